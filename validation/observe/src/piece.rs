//! A piece of a configuration of many particles, so that a temperature of its forces costs the same for any number of them.
//!
//! A particle of the piece has a weight w, 1 in the middle and 0 from the surface of the piece on, so that
//! kT = ⟨Σ w F·F⟩/⟨Σ (w ∇²U − ∇w·F)⟩ holds wherever the piece lies, as does the kinetic temperature of its pairs. The particles around, within twice the range of the forces, are those on
//! which forces within depend.

use psidpd_core::engine::PeriodicBox;

/// Ranges of the forces between the middle of a piece and its end, particles around included, at least.
const LEAST: f64 = 4.5;

/// All particles in their box, from which a piece is taken.
#[derive(Clone, Copy)]
pub struct Whole<'a> {
    pub domain: &'a PeriodicBox,
    pub dimensions: usize,
    pub x: &'a [[f64; 3]],
    pub species: &'a [i32],
    /// True for particles that never move; empty if all particles move.
    pub frozen: &'a [bool],
}

/// The particles of a piece and those around it.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Which particles of all these are.
    pub of: Vec<usize>,
    pub x: Vec<[f64; 3]>,
    pub species: Vec<i32>,
    /// Whether a particle counts for nothing: one around the piece, or one that never moves.
    pub still: Vec<bool>,
    space: Space,
}

impl Piece {
    /// A piece around a particle, `middle`, with about `few` particles, those around included, or more where a piece of so few would be
    /// smaller than forces reach. `None` if the configuration has no more than that.
    pub fn of(whole: Whole, range: f64, few: usize, middle: usize) -> Option<Piece> {
        let (count, center) = (whole.x.len(), *whole.x.get(middle)?);
        if count <= few {
            return None;
        }
        let space = |half: f64| Space::new(whole, center, half, range);
        let everywhere = space(f64::INFINITY);
        let away: Vec<f64> = whole.x.iter().map(|x| everywhere.away(*x)).collect();
        let mut sorted = away.clone();
        let end = sorted.select_nth_unstable_by(few, f64::total_cmp).1.max(LEAST * range);
        let space = space(end - 2.0 * range);
        let near = (0..count).filter(|k| away[*k] <= end);
        let mut piece =
            Piece { of: Vec::new(), x: Vec::new(), species: Vec::new(), still: Vec::new(), space };
        for k in near {
            let x = whole.x[k];
            let is_frozen = whole.frozen.get(k).is_some_and(|frozen| *frozen);
            piece.of.push(k);
            piece.x.push(x);
            piece.species.push(whole.species[k]);
            piece.still.push(is_frozen || piece.space.weight(x).0 == 0.0);
        }
        Some(piece)
    }

    /// The weight at a point, and its gradient.
    pub fn weight(&self, x: [f64; 3]) -> (f64, [f64; 3]) {
        self.space.weight(x)
    }
}

/// The space of a piece, with faces as those of the box.
#[derive(Debug, Clone)]
struct Space {
    domain: PeriodicBox,
    dimensions: usize,
    /// The middle, as fractions of the box.
    center: [f64; 3],
    /// The distance from the middle at which weights end, along each normal of the box; infinite if that is across the box.
    half: [f64; 3],
    /// The length over which weights fall.
    range: f64,
}

impl Space {
    fn new(whole: Whole, center: [f64; 3], half: f64, range: f64) -> Space {
        let (domain, dimensions) = (whole.domain.clone(), whole.dimensions);
        let ends = |k: usize| {
            let across = domain.periodic()[k] && half + 2.0 * range >= 0.5 * domain.height(k);
            if k >= dimensions || across { f64::INFINITY } else { half }
        };
        Space { center: domain.fraction(center), half: [0, 1, 2].map(ends), domain, dimensions, range }
    }

    /// How far a point is from the middle along each normal of the box, with its sign.
    fn along(&self, x: [f64; 3]) -> [f64; 3] {
        let s = self.domain.fraction(x);
        std::array::from_fn(|k| {
            let s = s[k] - self.center[k];
            self.domain.height(k) * if self.domain.periodic()[k] { s - s.round() } else { s }
        })
    }

    /// The largest of these distances.
    fn away(&self, x: [f64; 3]) -> f64 {
        self.along(x)[..self.dimensions].iter().fold(0.0, |most, along| most.max(along.abs()))
    }

    fn weight(&self, x: [f64; 3]) -> (f64, [f64; 3]) {
        let (along, inverse) = (self.along(x), self.domain.inverse());
        let (mut weight, mut gradient) = (1.0, [0.0; 3]);
        for k in 0..self.dimensions {
            let left = (self.half[k] - along[k].abs()) / self.range;
            let part = left.clamp(0.0, 1.0);
            let slope = if part == left { -along[k].signum() / self.range } else { 0.0 };
            gradient = std::array::from_fn(|c| {
                part * gradient[c] + weight * slope * self.domain.height(k) * inverse[k][c]
            });
            weight *= part;
        }
        (weight, gradient)
    }
}
