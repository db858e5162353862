//! Drag and noise apart from the forces, for the fix that integrates: updates velocities of a
//! rank's atoms by the midpoint rule.

use crate::error::StyleError;
use crate::style::{Style, at_rest, guard};
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Effort, Need, Rank, Stream, Update};
use psidpd_core::engine::{Around, Particles};

/// Parameters of the noise of one step.
#[derive(Debug, Clone, Copy)]
pub struct Noise {
    /// Seed of the pair style.
    pub seed: u64,
    pub step: u64,
    pub law: Law,
}

impl Style {
    /// Announces that the thermostat will act for `dt` where the next forces are computed: these then list its pairs, if
    /// they can.
    pub fn expect_thermostat(&mut self, dt: f64, virial: bool) -> Result<(), StyleError> {
        let dt = dt / self.scale().time;
        guard(|| {
            if let Some((thermostat, engine)) = self.thermostat_beside_engine() {
                thermostat.ask(engine, dt, virial);
            }
            Ok(())
        })
    }

    /// Finds the pairs of the thermostat and draws their noise; returns false if the model has no
    /// thermostat. `mass` has the masses of owned atoms, infinite for atoms that keep their velocities.
    /// With `virial` pair distances are stored.
    pub fn find_thermostat_pairs(
        &mut self,
        around: Around,
        particles: &Particles,
        mass: &[f64],
        dt: f64,
        virial: bool,
        noise: Noise,
    ) -> Result<bool, StyleError> {
        guard(|| {
            let scale = self.scale();
            if let Some((thermostat, engine)) = self.thermostat_beside_engine() {
                thermostat.take(engine);
            }
            let (Some(thermostat), pool, kinds, converted) = self.thermostat() else { return Ok(false) };
            let taken = converted.take(&scale, &at_rest(particles));
            let unit = scale.velocity().powi(2) / scale.energy;
            let scaled: Vec<f64>;
            let mass = match scale.is_one() {
                true => mass,
                false => {
                    scaled = mass.iter().map(|m| m * unit).collect();
                    &scaled
                }
            };
            let particles = Particles { owned: mass.len(), ..taken.particles() };
            let rank = Rank { around, particles, species_of_kind: kinds, mass };
            thermostat.find_pairs_of_rank(pool, &rank, dt / scale.time, virial)?;
            thermostat.draw(pool, noise.seed, noise.step, Stream(0), noise.law);
            Ok(true)
        })
    }

    /// Changes the velocities of all atoms of the last search for pairs, on one rank alone; returns the virial.
    pub fn act_alone(&mut self, v: &mut [f64]) -> Result<[f64; 6], StyleError> {
        guard(|| {
            let (Some(thermostat), pool, ..) = self.thermostat() else { return Ok([0.0; 6]) };
            let v = v.as_chunks_mut::<3>().0;
            let virial = thermostat.act(pool, Update::Midpoint, v);
            finite(v)?;
            Ok(virial)
        })
    }

    /// Begins the update on several ranks; `vectors` are the velocities of all atoms and ghosts, which become directions.
    pub fn begin_rounds(&mut self, vectors: &mut [f64]) -> Result<Need, StyleError> {
        guard(|| {
            let (Some(thermostat), pool, ..) = self.thermostat() else { return Ok(Need::Nothing([0.0; 6])) };
            Ok(thermostat.begin_midpoint(pool, vectors.as_chunks_mut::<3>().0)?)
        })
    }

    /// Continues with what the last round asked for; the last round changes the velocities `v` of the rank's atoms.
    pub fn next_round(
        &mut self,
        totals: [f64; 3],
        vectors: &mut [f64],
        v: &mut [f64],
    ) -> Result<Need, StyleError> {
        guard(|| {
            let (Some(thermostat), pool, ..) = self.thermostat() else { return Ok(Need::Nothing([0.0; 6])) };
            let (vectors, v) = (vectors.as_chunks_mut::<3>().0, v.as_chunks_mut::<3>().0);
            let need = thermostat.go_on(pool, totals, vectors, v)?;
            if let Need::Nothing(_) = need {
                finite(v)?;
            }
            Ok(need)
        })
    }

    /// Number of iterations of the last update.
    pub fn iterations(&mut self) -> usize {
        self.thermostat().0.map_or(0, |thermostat| thermostat.iterations())
    }

    /// Iterations of all updates since the style was set up.
    pub fn effort(&mut self) -> Effort {
        let mut effort = self.thermostat().0.map_or(Effort::default(), |thermostat| thermostat.effort());
        effort += self.effort_before();
        effort
    }
}

fn finite(v: &[[f64; 3]]) -> Result<(), StyleError> {
    let sum: f64 = v.iter().flatten().map(|v| v * v).sum();
    if sum.is_finite() {
        return Ok(());
    }
    Err(StyleError(
        "a velocity is not finite after the thermostat: the time step is too large, or the start overlaps"
            .to_owned(),
    ))
}
