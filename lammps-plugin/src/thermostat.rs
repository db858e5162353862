//! Drag and noise apart from the forces, for the fix that integrates: updates velocities of a
//! rank's atoms by the midpoint rule.

use crate::bridge::{Atoms, Effort, Extent, Heat, Round, Wants};
use crate::error::StyleError;
use crate::style::{Style, guard};
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{self, Need, Rank, Stream, Update};
use psidpd_core::engine::{Around, Particles};

impl Style {
    /// Announces that the thermostat will act for a time where the next forces are computed: these then list its pairs, if
    /// they can.
    pub fn expect_thermostat(&mut self, time: f64) -> Result<(), StyleError> {
        guard(|| {
            if let Some(thermostat) = &mut self.thermostat {
                thermostat.ask(&mut self.engine, time / self.scale.time);
            }
            Ok(())
        })
    }

    /// Finds the pairs of the thermostat and draws their noise; returns false if the model has no
    /// thermostat. `mass` has the masses of owned atoms, infinite for atoms that keep their velocities.
    /// With `virial` its action computes a virial.
    pub fn thermostat_pairs(
        &mut self,
        extent: &Extent,
        images: &[bool],
        atoms: &Atoms,
        mass: &[f64],
        heat: &Heat,
    ) -> Result<bool, StyleError> {
        guard(|| {
            let Style { thermostat, engine, scale, converted, .. } = self;
            let Some(thermostat) = thermostat else { return Ok(false) };
            thermostat.ask_for_forces_on_fixed(heat.fixed);
            let around = Around { domain: &scale.domain(extent)?, images };
            let (request, _) = converted.take(scale, atoms, None);
            let unit = scale.velocity().powi(2) / scale.energy;
            let mass: &[f64] = &mass.iter().map(|m| m * unit).collect::<Vec<_>>();
            let particles = Particles { owned: mass.len(), ..request.particles };
            let kinds = engine.plan().species_of_type().to_vec();
            let rank = Rank { around, particles, species_of_kind: &kinds, mass };
            thermostat.find_pairs_of_rank_with(engine, &rank, heat.time / scale.time, heat.virial)?;
            let law = if heat.uniform { Law::Uniform } else { Law::Gaussian };
            thermostat.draw(heat.seed, heat.step, Stream(0), law);
            Ok(true)
        })
    }

    /// Changes the velocities of all atoms of the last search for pairs, on one rank alone; returns the virial.
    pub fn act_alone(&mut self, v: &mut [f64]) -> Result<[f64; 6], StyleError> {
        guard(|| {
            let Some(thermostat) = &mut self.thermostat else { return Ok([0.0; 6]) };
            let v = v.as_chunks_mut::<3>().0;
            let virial = thermostat.act(self.engine.pool(), Update::Midpoint, v);
            finite(v)?;
            Ok(virial)
        })
    }

    /// Begins the update on several ranks; `vectors` are the velocities of all atoms and ghosts, which become directions.
    pub fn thermostat_begin(&mut self, vectors: &mut [f64]) -> Result<Round, StyleError> {
        guard(|| {
            let Some(thermostat) = &mut self.thermostat else { return Ok(round(Need::Nothing([0.0; 6]))) };
            Ok(round(thermostat.begin_midpoint(self.engine.pool(), vectors.as_chunks_mut::<3>().0)?))
        })
    }

    /// Continues with what the last round asked for; the last round changes the velocities `v` of the rank's atoms.
    pub fn thermostat_go_on(
        &mut self,
        totals: [f64; 3],
        vectors: &mut [f64],
        v: &mut [f64],
    ) -> Result<Round, StyleError> {
        guard(|| {
            let Some(thermostat) = &mut self.thermostat else { return Ok(round(Need::Nothing([0.0; 6]))) };
            let (vectors, v) = (vectors.as_chunks_mut::<3>().0, v.as_chunks_mut::<3>().0);
            let need = thermostat.go_on(self.engine.pool(), totals, vectors, v)?;
            if let Need::Nothing(_) = need {
                finite(v)?;
            }
            Ok(round(need))
        })
    }

    /// The mean force of drag and noise in the last update on each owned atom of infinite mass, in units of the model; zero for
    /// others. Empty if nobody asked for it.
    pub fn forces_on_fixed(&self) -> &[f64] {
        self.thermostat.as_ref().map_or(&[], |thermostat| thermostat.forces_on_fixed().as_flattened())
    }

    pub fn iterations(&self) -> usize {
        self.thermostat.as_ref().map_or(0, |thermostat| thermostat.iterations())
    }

    pub(crate) fn effort_so_far(&self) -> thermostat::Effort {
        let mut effort =
            self.thermostat.as_ref().map_or(Default::default(), |thermostat| thermostat.effort());
        effort += self.effort_before;
        effort
    }

    pub fn effort(&self) -> Effort {
        let thermostat::Effort { updates, iterations, most, listed, inaccurate } = self.effort_so_far();
        Effort { updates, iterations, most, listed, inaccurate }
    }
}

fn round(need: Need) -> Round {
    let (wants, parts, virial) = match need {
        Need::Nothing(virial) => (Wants::Nothing, [0.0; 3], virial),
        Need::Totals(parts) => (Wants::Totals, parts, [0.0; 6]),
        Need::Ghosts => (Wants::Ghosts, [0.0; 3], [0.0; 6]),
    };
    Round { wants, parts, virial }
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
