//! Where the particles of an evaluation are, and which of them interact.

use psidpd_passes::domain::PeriodicBox;

/// What a host knows about the pairs of its particles.
#[derive(Debug, Clone, Copy)]
pub enum Surroundings<'a> {
    /// All particles are in hand, in a box of their own: periodic images are the engine's business.
    Box(&'a PeriodicBox),
    /// The particles are those of a rank, and ghosts stand for whatever interacts with them from beyond it.
    Ghosts(Around<'a>, Newton),
    /// The host lists the pairs that interact, ghosts among them.
    Listed(PairsOfHost<'a>, Newton),
}

impl Surroundings<'_> {
    /// A rank whose ghosts stand for everything beyond its own particles, periodic images among it.
    pub fn ghosts(newton: Newton) -> Surroundings<'static> {
        Surroundings::Ghosts(Around { domain: &PeriodicBox::OPEN, images: &[] }, newton)
    }
}

/// What a rank of a host finds around its particles.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// The box. Along its periodic directions the rank has all of it; along the others there are ghosts for what is
    /// beyond the rank, or nothing is.
    pub domain: &'a PeriodicBox,
    /// For each ghost whether it is the image, along a periodic direction of `domain`, of a particle that is there too:
    /// those take no part. Empty if none is.
    pub images: &'a [bool],
}

/// Whether the host adds forces on ghosts back to their owners.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Newton {
    /// It does: each pair is computed once over all ranks, its force put on both particles.
    #[default]
    On,
    /// It does not: a pair of an owned particle and a ghost is computed on both sides, its force put
    /// on the owned particle alone.
    Off,
}

/// A pair that does not act at its full strength, as two particles with a bond between them may not.
///
/// `factor` scales the conservative interaction: `U = Σ ψ(n_i) + Σ s φ` with `n_i = Σ s w`. Drag and noise act at full
/// strength, so that the thermostat keeps its temperature; only pairs with a factor of 0 do not interact at all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecialPair {
    /// The host's number of the first particle, an owned one.
    pub i: u32,
    /// That of the second. Where it is a ghost, the rank of the second has the same pair from its side.
    pub j: u32,
    /// The strength.
    pub factor: f64,
}

/// The pairs of one step, as the host lists them: at least all within the cut-off of the model, those
/// of two owned particles once, those of an owned particle `i` and a ghost `j` on either side.
///
/// Pairs that are not listed do not interact. `factor` scales a pair's conservative interaction:
/// `U = Σ ψ(n_i) + Σ s φ` with `n_i = Σ s w`. Drag and noise act at full strength, so that the
/// thermostat keeps its temperature whatever the factors.
#[derive(Debug, Clone, Copy)]
pub struct PairsOfHost<'a> {
    /// The first particle of each pair, owned.
    pub i: &'a [i32],
    /// The second.
    pub j: &'a [i32],
    /// Strengths; empty if all are one.
    pub factor: &'a [f64],
}
