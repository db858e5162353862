use psidpd_passes::domain::PeriodicBox;

/// The particles that the thermostat acts on.
#[derive(Debug, Clone, Copy)]
pub struct Bodies<'a> {
    /// The box: at least twice as wide as the range along periodic directions.
    pub domain: &'a PeriodicBox,
    /// Positions, in the box along its periodic directions.
    pub x: &'a [[f64; 3]],
    /// Tags of the particles, each different.
    pub tag: &'a [i32],
    /// Species of each particle.
    pub species: &'a [i32],
    /// Mass of each species.
    pub mass: &'a [f64],
    /// Flags of particles with a fixed velocity; empty if there are none.
    pub frozen: &'a [bool],
}
