//! The surroundings of an evaluation's particles, which decide which pairs interact.

use psidpd_passes::domain::PeriodicBox;

/// A host's knowledge of the pairs of its particles.
#[derive(Debug, Clone, Copy)]
pub enum Surroundings<'a> {
    /// There are no ghosts: the engine applies the periods of the box.
    Box(&'a PeriodicBox),
    /// The particles are those of a rank, and ghosts stand for all particles beyond it that interact with them.
    Ghosts(Around<'a>, Newton),
    /// The host lists the pairs that interact, including pairs with ghosts.
    Listed(PairsOfHost<'a>, Newton),
}

impl<'a> Surroundings<'a> {
    /// A rank whose ghosts stand for everything beyond its own particles, including periodic images.
    pub fn ghosts(newton: Newton) -> Surroundings<'static> {
        Surroundings::Ghosts(Around { domain: &PeriodicBox::OPEN, images: &[] }, newton)
    }

    /// The box and its ghosts; `None` if the host lists the pairs.
    pub fn around(self) -> Option<Around<'a>> {
        match self {
            Surroundings::Box(domain) => Some(Around { domain, images: &[] }),
            Surroundings::Ghosts(around, _) => Some(around),
            Surroundings::Listed(..) => None,
        }
    }
}

/// The box around a rank's particles, and its ghosts.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// The box. Along its periodic directions the rank owns all of it; along the others ghosts stand
    /// for particles beyond the rank, or there are none.
    pub domain: &'a PeriodicBox,
    /// For each ghost, whether it is the image, along a periodic direction of `domain`, of another
    /// particle of this rank: such ghosts are left out. Empty if there are none.
    pub images: &'a [bool],
}

/// Whether the host adds forces on ghosts back to their owners.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Newton {
    /// The host adds them: each pair is computed once over all ranks, and its force is added to both particles.
    #[default]
    On,
    /// The host does not: a pair of an owned particle and a ghost is computed on both sides, and its
    /// force is added to the owned particle alone.
    Off,
}

/// A pair with reduced strength, for instance two bonded particles.
///
/// `factor` scales the conservative interaction: the density and the pair energy have it. Drag and noise act at full
/// strength; only pairs with a factor of 0 do not interact at all.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecialPair {
    /// Array index, from 0, of the first particle, an owned one.
    pub i: u32,
    /// Array index of the second particle. If it is a ghost, the rank of its owner has the same pair too.
    pub j: u32,
    /// Factor of the conservative interaction.
    pub factor: f64,
}

/// The pairs of one step, as the host lists them: at least all within the cut-off of the model; those
/// of two owned particles once, those of an owned particle `i` and a ghost `j` on either side.
///
/// Pairs that are not listed do not interact. `factor` scales a pair's conservative interaction:
/// `U = Σ ψ(n_i) + Σ s φ` with `n_i = Σ s w`. Drag and noise act at full strength, so that the
/// thermostat keeps its temperature whatever the factors.
#[derive(Debug, Clone, Copy)]
pub struct PairsOfHost<'a> {
    /// The first particle of each pair, owned.
    pub i: &'a [i32],
    /// The second particle of each pair.
    pub j: &'a [i32],
    /// Factor of each pair; empty if all are 1.
    pub factor: &'a [f64],
}
