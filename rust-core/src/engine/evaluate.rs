//! The calls of the engine to either of its two paths.

use super::error::EngineError;
use super::request::{Request, Results};
use super::surroundings::Surroundings;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::Tally;

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

    /// Slopes of owned particles in the last evaluation, followed by those of ghosts.
    fn slopes(&self) -> &[f64];

    /// The slopes, for the host to write those of ghosts.
    fn slopes_mut(&mut self) -> &mut Vec<f64>;

    /// Gets the slopes of owned particles after [`Evaluate::whole`], with room for `all`.
    fn fetch_slopes(&mut self, all: usize);

    /// Values of single particles in the last evaluation.
    fn results(&self) -> Results<'_>;

    /// ψ of owned particles in the last evaluation, without the terms that act as pair potentials.
    fn excess(&mut self) -> &[f64];
}
