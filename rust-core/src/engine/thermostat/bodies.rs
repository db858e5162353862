use psidpd_passes::domain::PeriodicBox;

/// The particles that the thermostat acts on.
#[derive(Debug, Clone, Copy)]
pub struct Bodies<'a> {
    /// The box: at least twice as wide as the range along periodic directions.
    pub domain: &'a PeriodicBox,
    /// Positions, in the box along its periodic directions.
    pub x: &'a [[f64; 3]],
    /// Tags, each once.
    pub tag: &'a [i32],
    /// Species.
    pub species: &'a [i32],
    /// Mass of each species.
    pub mass: &'a [f64],
    /// Which particles have a velocity that nothing changes; empty if none has.
    pub frozen: &'a [bool],
}
