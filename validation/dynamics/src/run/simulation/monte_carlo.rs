//! Trial moves of single particles; the energy decides on their acceptance.

use super::super::integrator::parts::has_stopped_counting;
use super::{RunError, Simulation};
use crate::particles::maxwell;
use chacha20::ChaCha8Rng;
use psidpd_core::engine::{self, EngineError, LocalEnergy, Tally, Want};
use rand::{RngExt, SeedableRng};

/// The acceptance that tuning of the move length aims at.
const ACCEPTANCE: f64 = 0.4;

/// Sweeps between fresh sums of the densities, which limit the growth of rounding errors.
const RENEWED: u64 = 100;

#[derive(Debug, Clone, Default)]
pub(super) struct MonteCarlo {
    /// The energy at the present temperature.
    pub energy: Option<Box<LocalEnergy>>,
    /// The largest displacement along a direction, as tuned so far.
    found: Option<f64>,
    settling: bool,
    /// Numbers of trials and of accepted trials in the last step.
    trials: [u64; 2],
}

impl Simulation {
    /// Sets whether later steps tune the length of moves.
    pub fn set_settling(&mut self, settling: bool) {
        self.monte_carlo.settling = settling;
    }

    /// The tuned largest displacement along each direction, for checkpoints.
    pub fn max_move(&self) -> Option<f64> {
        self.monte_carlo.found
    }

    pub fn set_max_move(&mut self, found: Option<f64>) {
        self.monte_carlo.found = found;
    }

    /// Share of accepted trials in the last step; 0 before the first.
    pub fn acceptance(&self) -> f64 {
        let [trials, accepted] = self.monte_carlo.trials;
        accepted as f64 / trials.max(1) as f64
    }

    pub(in crate::run) fn random_of_step(&self) -> ChaCha8Rng {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&self.seed.to_le_bytes());
        seed[8..16].copy_from_slice(&self.number.to_le_bytes());
        seed[16..27].copy_from_slice(b"monte carlo");
        ChaCha8Rng::from_seed(seed)
    }

    /// Makes `sweeps` trials for each particle that is not frozen.
    pub(in crate::run) fn make_sweeps(
        &mut self,
        random: &mut ChaCha8Rng,
        sweeps: u64,
        max_move: Option<f64>,
    ) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let dimensions = self.dimensions();
        let heights = (0..dimensions).map(|k| self.particles.now().domain.height(k));
        let longest = 0.5 * heights.fold(f64::INFINITY, f64::min);
        let mut energy = match self.monte_carlo.energy.take() {
            Some(energy) => energy,
            None => Box::new(LocalEnergy::new(&self.model().at(self.kt())?)?),
        };
        let start = if energy.range > 0.0 { 0.1 * energy.range } else { longest };
        let most = max_move.or(self.monte_carlo.found).unwrap_or(start).min(longest);
        let (number, kt) = (self.number, self.kt());
        let failed = |source| RunError::Engine { step: number, source };
        let bounds = self.motion.bounds.clone();
        let Simulation { particles, external, monte_carlo, .. } = self;
        let (state, _) = particles.motion(true);
        let frozen = &external.frozen;
        let mut trials = [0; 2];
        for sweep in 0..sweeps {
            if sweep % RENEWED == 0 {
                let particles = engine::Particles {
                    owned: state.len(),
                    x: &state.x,
                    tag: &state.tag,
                    kind: &state.species,
                };
                energy.load(&state.domain, &particles).map_err(failed)?;
            }
            for k in (0..state.len()).filter(|k| frozen.get(*k) != Some(&true)) {
                let mut to = energy.positions()[k];
                to[..dimensions].iter_mut().for_each(|x| *x += most * (2.0 * random.random::<f64>() - 1.0));
                let threshold: f64 = random.random();
                trials[0] += 1;
                if bounds.has_walls() && bounds.has_escaped(&to) {
                    continue;
                }
                let change = energy.change(k, to, state.tag[k]).map_err(failed)?;
                if change <= 0.0 || threshold < (-change / kt).exp() {
                    energy.accept(&mut state.image[k]);
                    trials[1] += 1;
                    if has_stopped_counting(&state.image[k]) {
                        return Err(RunError::Uncounted { step: number, tag: state.tag[k] });
                    }
                }
            }
            if (sweep + 1) % RENEWED == 0 || sweep + 1 == sweeps {
                state.x.copy_from_slice(energy.positions());
            }
        }
        monte_carlo.energy = Some(energy);
        monte_carlo.trials = trials;
        if max_move.is_none() {
            let accepted = trials[1] as f64 / trials[0].max(1) as f64;
            let factor = if monte_carlo.settling { 1.0 + accepted - ACCEPTANCE } else { 1.0 };
            monte_carlo.found = Some((most * factor).min(longest));
        }
        Ok(())
    }

    /// Draws the velocities of the mobile particles from Maxwell's distribution, with the degrees of freedom
    /// that [`Simulation::degrees_of_freedom`] counts.
    pub(in crate::run) fn draw_velocities(&mut self, random: &mut ChaCha8Rng) {
        let (kt, dimensions) = (self.kt(), self.dimensions());
        let conserved = self.conserved();
        let Simulation { particles, external, .. } = self;
        let frozen = &external.frozen;
        let state = particles.now();
        let moves = |k: &usize| frozen.get(*k) != Some(&true);
        let mass = (0..state.len()).filter(moves).map(|k| state.mass[state.species[k] as usize]);
        let drawn = maxwell(mass, kt, dimensions, conserved, random);
        let moving = (0..state.len()).filter(moves).zip(drawn);
        let v = particles.velocities_mut();
        v.fill([0.0; 3]);
        moving.for_each(|(k, drawn)| v[k] = drawn);
    }

    /// Computes forces and totals at the present positions. If they are not finite the totals become
    /// infinite: trial moves then leave these positions.
    pub(super) fn forces_or_infinite(&mut self, want: Want) -> Result<(), RunError> {
        use EngineError::{ExcessFreeEnergy, Force};
        match self.conservative_forces(want) {
            Err(RunError::Engine { source: Force { .. } | ExcessFreeEnergy { .. }, .. }) => {
                self.forces.tally =
                    Tally { excess: f64::INFINITY, virial: [f64::INFINITY; 6], ..Tally::default() };
                Ok(())
            }
            other => other,
        }
    }

    /// Records the momentum of the particles at the end of a step, and the forces there.
    pub(in crate::run) fn record_rest(&mut self, want: Want) -> Result<(), RunError> {
        if !self.is_recording() {
            return Ok(());
        }
        self.record_momenta();
        self.forces_or_infinite(want)
    }
}
