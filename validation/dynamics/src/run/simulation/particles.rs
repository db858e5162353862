//! The state of the particles at the present step, and the forces on them.

use super::super::integrator::parts::has_stopped_counting;
use super::super::reorder::Reordering;
use super::{RunError, Simulation};
use crate::particles::State;
use psidpd_core::engine::Pool;
use std::sync::OnceLock;

#[derive(Debug, Clone)]
pub(super) struct Particles {
    state: State,
    force: Vec<[f64; 3]>,
    /// Counts changes of the positions and of their order.
    moves: u64,
    /// `Σ m v v` of the present velocities, cached at the first request.
    flux: OnceLock<[f64; 6]>,
    /// Whether some steps end with a sort.
    reordering: bool,
}

impl Particles {
    /// Creates particles with zero forces. Positions outside the box are wrapped.
    pub fn new(mut state: State, species: usize, dimensions: usize) -> Result<Particles, RunError> {
        if let Some(fault) = state.fault(species, dimensions) {
            return Err(RunError::State(fault));
        }
        for ((x, image), tag) in state.x.iter_mut().zip(&mut state.image).zip(&state.tag) {
            state.domain.wrap(x, image);
            if has_stopped_counting(image) {
                return Err(RunError::State(format!("particle {tag} is more than 2^31 boxes away")));
            }
        }
        let force = vec![[0.0; 3]; state.len()];
        Ok(Particles { state, force, moves: 0, flux: OnceLock::new(), reordering: false })
    }

    /// Calls `replace` with the particles to replace them, without wrapping; the box stays.
    pub fn replace_with(&mut self, replace: impl FnOnce(&mut State), forces: &[[f64; 3]]) {
        replace(&mut self.state);
        self.force.clear();
        self.force.extend_from_slice(forces);
        // A failed start has left no forces.
        self.force.resize(self.state.len(), [0.0; 3]);
        self.moves += 1;
        self.flux.take();
    }

    pub fn now(&self) -> &State {
        &self.state
    }

    pub fn mass_of(&self, k: usize) -> f64 {
        self.state.mass[self.state.species[k] as usize]
    }

    pub fn forces(&self) -> &[[f64; 3]] {
        &self.force
    }

    pub fn forces_mut(&mut self) -> (&State, &mut [[f64; 3]]) {
        (&self.state, &mut self.force)
    }

    /// Takes the velocities away, for work that reads all else; [`Particles::put_velocities`] follows.
    pub fn take_velocities(&mut self) -> Vec<[f64; 3]> {
        self.flux.take();
        std::mem::take(&mut self.state.v)
    }

    pub fn put_velocities(&mut self, v: Vec<[f64; 3]>) {
        self.state.v = v;
    }

    pub fn velocities_mut(&mut self) -> &mut [[f64; 3]] {
        self.flux.take();
        &mut self.state.v
    }

    /// Mutable particles and their forces, for a drift or kick; `moves` says whether positions change.
    pub fn motion(&mut self, moves: bool) -> (&mut State, &[[f64; 3]]) {
        self.moves += u64::from(moves);
        self.flux.take();
        (&mut self.state, &self.force)
    }

    pub fn replace_forces(&mut self, forces: &[[f64; 3]]) {
        self.force.copy_from_slice(forces);
    }

    pub fn moves(&self) -> u64 {
        self.moves
    }

    /// Sorts all particle arrays into `order`, if reordering is on; `scratch` loses what it has.
    pub fn reorder(&mut self, pool: &Pool, order: &[u32], scratch: &mut Vec<[f64; 3]>) -> bool {
        let State { x, v, species, tag, image, .. } = &mut self.state;
        if !self.reordering || order.len() != x.len() {
            return false;
        }
        let mut reordering = Reordering { scratch };
        self.moves += 1;
        reordering.vectors(pool, order, x);
        reordering.vectors(pool, order, v);
        reordering.vectors(pool, order, &mut self.force);
        let ordered = reordering.numbers(pool, order, |k| image[k]);
        for (image, ordered) in image.iter_mut().zip(ordered) {
            *image = ordered;
        }
        let ordered = reordering.numbers(pool, order, |k| [tag[k], species[k], 0]);
        for (k, [of_tag, of_species, _]) in ordered.enumerate() {
            (tag[k], species[k]) = (of_tag, of_species);
        }
        true
    }

    /// Sets `Σ m v v` of the present step, if another processor has computed it.
    #[cfg(feature = "gpu")]
    pub fn set_momentum_flux(&mut self, flux: [f64; 6]) {
        self.flux = OnceLock::from(flux);
    }

    /// `Σ m v v`, in the order xx, yy, zz, xy, xz, yz.
    pub fn momentum_flux(&self) -> [f64; 6] {
        *self.flux.get_or_init(|| {
            let mut sum = [0.0; 6];
            for (v, s) in self.state.v.iter().zip(&self.state.species) {
                let m = self.state.mass[*s as usize];
                for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                    sum[k] += m * v[a] * v[b];
                }
            }
            sum
        })
    }
}

impl Simulation {
    /// Sets whether some steps end with a sort that puts neighbours in space close in memory, which is faster
    /// in large systems. Afterwards only its tag identifies a particle. The default is off.
    ///
    /// The steps that sort depend on their number only. Trajectories differ by the rounding of sums.
    pub fn set_reordering(&mut self, on: bool) {
        self.particles.reordering = on;
    }

    pub fn len(&self) -> usize {
        self.particles.state.len()
    }

    /// Always false: a simulation has at least one particle.
    pub fn is_empty(&self) -> bool {
        self.particles.state.is_empty()
    }

    pub fn forces(&self) -> &[[f64; 3]] {
        &self.particles.force
    }

    /// The particles; positions are wrapped into the box.
    pub fn state(&self) -> &State {
        debug_assert!(self.motion.deferred.is_none());
        &self.particles.state
    }
}
