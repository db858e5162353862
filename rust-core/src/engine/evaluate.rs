//! The calls of the engine to each of its paths.

use super::error::EngineError;
use super::request::Request;
use super::surroundings::Surroundings;
use crate::model::Fluid;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::Tally;
use std::fmt::Debug;

/// A way to compute forces. A host with ghosts calls [`Evaluate::first`], copies slopes from owners to ghosts, and calls
/// [`Evaluate::second`].
pub trait Evaluate {
    /// Computes all forces on particles in a box without ghosts, writes them to `force` or adds them to it.
    fn whole(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<Tally, EngineError>;

    /// The first half of an evaluation, which needs no slopes of ghosts; may add some forces to `force`.
    fn first(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<(), EngineError>;

    /// The second half of an evaluation, with the slopes of ghosts: adds the other forces.
    fn second(&mut self, request: &Request, force: &mut [[f64; 3]]) -> Result<Tally, EngineError>;

    /// Slopes of owned particles in the last evaluation, followed by those of ghosts, which the host writes.
    fn slopes_mut(&mut self) -> &mut Vec<f64>;

    /// Gets the slopes of owned particles after [`Evaluate::whole`], with room for `all`.
    fn fetch_slopes(&mut self, all: usize);
}

/// A path of another crate, for a GPU: [`Engine::use_device`](super::Engine::use_device).
///
/// It computes forces and totals, adds forces to those of the host, and no values of single particles.
pub trait DevicePath: Evaluate + Debug + Send + Sync {
    /// The device, for the log.
    fn name(&self) -> String;

    /// Whether it can compute in this box: see [`Surroundings`].
    fn fits(&self, domain: &PeriodicBox) -> bool;

    /// Takes the same model at another temperature.
    ///
    /// # Errors
    /// The device cannot compute it.
    fn set_fluid(&mut self, fluid: &Fluid) -> Result<(), EngineError>;

    /// The species of each type, as in [`Engine::map_kinds`](super::Engine::map_kinds).
    fn map_kinds(&mut self, kinds: &[i32]);

    /// Numbers of evaluations of ψ with a density below its bounds, and above.
    fn out_of_bounds(&self) -> [u64; 2];
}
