//! The two engines of a style, and which of them an evaluation is done by.

use crate::style::StyleError;
use psidpd_core::engine::{
    Around, Engine, Newton, PairsOfHost, Particles, PeriodicBox, Plan, Pool, Settings, Step, Sweep, Tally,
    Want,
};
use psidpd_core::model::Fluid;
use std::sync::Arc;

/// The sweep is fast. The plain engine does what the sweep leaves to it: pairs that LAMMPS lists, energies
/// and virials of single atoms, densities that no force needs.
#[derive(Debug)]
pub struct Engines {
    engine: Engine,
    sweep: Sweep,
    all_densities: bool,
    /// Whether the last evaluation was the sweep's.
    swept: bool,
    /// ψ and densities of the last sweep, for whoever asks.
    excess: Vec<f64>,
    densities: Vec<f64>,
}

impl Engines {
    /// Engines for a fluid; `kinds` has the species of each type.
    ///
    /// # Errors
    /// A model whose derivatives grow too large, species out of range.
    pub fn new(
        fluid: &Fluid,
        kinds: &[i32],
        settings: Settings,
        pool: Arc<Pool>,
    ) -> Result<Engines, StyleError> {
        let plan = Plan::new(fluid).map_err(|e| StyleError::new(e.to_string()))?;
        let mut engine = Engine::of_plan(plan.clone());
        let mut sweep = Sweep::of_plan(plan, settings, pool);
        engine.map_kinds(kinds)?;
        sweep.map_kinds(kinds)?;
        Ok(Engines {
            engine,
            sweep,
            all_densities: false,
            swept: false,
            excess: Vec::new(),
            densities: Vec::new(),
        })
    }

    /// The plain engine, for its plan.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The fast engine, for its settings.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// As [`Engine::sum_all_densities`].
    pub fn sum_all_densities(&mut self, all: bool) {
        self.all_densities = all;
        self.engine.sum_all_densities(all);
    }

    /// Whether the sweep has what is wanted.
    fn sweeps(&self, want: Want) -> bool {
        !(self.all_densities || want.of_particles())
    }

    /// Whether no images are needed along the periodic directions of `domain`.
    pub fn fits(&self, domain: &PeriodicBox, want: Want) -> bool {
        self.sweeps(want) && self.sweep.fits(domain)
    }

    /// A whole evaluation, if a rank has all of a box that [fits](Engines::fits): adds the forces to `force`.
    ///
    /// # Errors
    /// As [`Sweep::evaluate`].
    pub fn evaluate(
        &mut self,
        domain: &PeriodicBox,
        particles: &Particles,
        v: &[[f64; 3]],
        step: Option<Step>,
        want: Want,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, StyleError> {
        self.swept = true;
        Ok(self.sweep.evaluate(domain, particles, v, step, want, force, true)?)
    }

    /// Slopes of owned particles after [`Engines::evaluate`], and room for `all`.
    pub fn fetch_slopes(&mut self, all: usize) {
        self.sweep.fetch_slopes(all);
    }

    /// The first half of an evaluation: all that needs no slopes of ghosts.
    ///
    /// # Errors
    /// As [`Sweep::first`] and [`Engine::densities`].
    pub fn first(
        &mut self,
        around: Around,
        particles: &Particles,
        v: &[[f64; 3]],
        step: Option<Step>,
        want: Want,
        newton: Newton,
    ) -> Result<(), StyleError> {
        self.swept = self.sweeps(want);
        if self.swept {
            self.sweep.first(around, particles, v, step, want)?;
        } else {
            self.engine.densities(particles, newton)?;
        }
        Ok(())
    }

    /// The same with pairs listed by LAMMPS.
    ///
    /// # Errors
    /// As [`Engine::densities_of_pairs`].
    pub fn first_of_pairs(
        &mut self,
        particles: &Particles,
        listed: &PairsOfHost,
        newton: Newton,
    ) -> Result<(), StyleError> {
        self.swept = false;
        Ok(self.engine.densities_of_pairs(particles, listed, newton)?)
    }

    /// `∂ψ/∂n` of owned particles, then room for ghosts.
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        if self.swept { self.sweep.slopes_mut() } else { self.engine.slopes_mut() }
    }

    /// The second half: adds the forces to `force`.
    ///
    /// # Errors
    /// As [`Sweep::second`] and [`Engine::forces`].
    pub fn second(
        &mut self,
        particles: &Particles,
        v: &[[f64; 3]],
        step: Option<Step>,
        want: Want,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, StyleError> {
        if self.swept {
            Ok(self.sweep.second(particles, force, true)?)
        } else {
            Ok(self.engine.forces(particles, v, step, want, force)?)
        }
    }

    /// Evaluations of ψ out of the bounds of a density.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        let (a, b) = (self.engine.out_of_bounds(), self.sweep.out_of_bounds());
        [a[0] + b[0], a[1] + b[1]]
    }

    /// As [`Engine::single`], with the slopes of the last evaluation.
    pub fn single(&self, kinds: [i32; 2], r: f64, particles: [usize; 2]) -> (f64, f64) {
        let slopes = if self.swept { self.sweep.slopes() } else { self.engine.slopes() };
        self.engine.single_at(kinds, r, slopes, particles)
    }

    /// Densities of owned particles in the last evaluation, as [`Engine::local_densities`].
    pub fn local_densities(&mut self) -> &[f64] {
        if !self.swept {
            return self.engine.local_densities();
        }
        self.sweep.local_densities(&mut self.excess, &mut self.densities);
        &self.densities
    }

    /// ψ of owned particles in the last evaluation.
    pub fn excess(&mut self) -> &[f64] {
        if !self.swept {
            return self.engine.excess();
        }
        self.sweep.local_densities(&mut self.excess, &mut self.densities);
        &self.excess
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        let held = self.excess.capacity() + self.densities.capacity();
        self.engine.memory() + self.sweep.memory() + held * size_of::<f64>()
    }
}
