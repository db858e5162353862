//! The pairs of one plane of cells, with what drag and noise need of them.

use super::cells::{Cells, Segment};
use crate::engine::plan::ThermostatPlan;
use psidpd_passes::noise::{Law, PairNoise};

/// A pair: `g`, and the second particle.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(16))]
pub struct Pair {
    /// `ê √(½ Δt D)`, from the second particle to the first.
    pub g: [f32; 3],
    /// Counted from the first particle of the plane of the first particle on, through the next plane.
    pub j: u32,
}

/// Pairs whose first particle is in one plane; the second is in the same plane or in the next.
#[derive(Debug, Clone, Default)]
pub struct Plane {
    /// The sorted particles of this plane, and of the next one.
    pub own: std::ops::Range<usize>,
    pub next: std::ops::Range<usize>,
    /// Where the pairs of each particle begin; one past the last.
    pub start: Vec<u32>,
    pub pairs: Vec<Pair>,
    /// Noise of each pair.
    pub xi: Vec<f32>,
    /// `r/|g|` of each pair; empty where no virial is wanted.
    pub stretch: Vec<f32>,
    found: Found,
    /// Tags of both particles of each pair.
    pub tags: [Vec<u32>; 2],
}

/// `√(½ Δt γ)`, one over the range and the exponent of `w_R`, by pairs of species.
pub struct Scale {
    species: usize,
    amplitude: Vec<f64>,
    inverse_range: Vec<f64>,
    exponent: Vec<f64>,
    cutoff_squared: f64,
}

impl Scale {
    pub fn new(plan: &ThermostatPlan, dt: f64) -> Scale {
        Scale {
            species: plan.gamma.len().isqrt(),
            amplitude: plan.gamma.iter().map(|gamma| (0.5 * dt * gamma).sqrt()).collect(),
            inverse_range: plan.range.iter().map(|r| if *r > 0.0 { 1.0 / r } else { f64::MAX }).collect(),
            exponent: plan.exponent.clone(),
            cutoff_squared: plan.longest * plan.longest,
        }
    }
}

/// Pairs of the cell in hand.
#[derive(Debug, Clone, Default)]
struct Found {
    /// Squares of the distances of all candidates of a particle.
    squared: Vec<f64>,
    j: Vec<u32>,
    d: [Vec<f64>; 3],
    /// What `d` is multiplied by to give `g`.
    factor: Vec<f64>,
    /// Pair of species.
    species: Vec<u16>,
    count: usize,
    /// How many there were after each particle.
    ends: Vec<usize>,
}

/// Pairs that are looked at together, in the first-level cache.
const BLOCK: usize = 256;

impl Plane {
    /// Finds the pairs of plane `number`.
    pub fn fill(&mut self, cells: &Cells, number: usize, scale: &Scale, virial: bool) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.fill_avx2(cells, number, scale, virial) };
        }
        self.fill_portably(cells, number, scale, virial);
    }

    /// The same operations in wider vectors; nothing is contracted, so the bits are the same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn fill_avx2(&mut self, cells: &Cells, number: usize, scale: &Scale, virial: bool) {
        self.fill_portably(cells, number, scale, virial);
    }

    #[inline(always)]
    fn fill_portably(&mut self, cells: &Cells, number: usize, scale: &Scale, virial: bool) {
        self.own = cells.of_plane(number);
        self.next = cells.next(number).map_or(0..0, |next| cells.of_plane(next));
        self.start.clear();
        self.start.push(0);
        self.pairs.clear();
        self.stretch.clear();
        let [columns, bins] = cells.columns();
        let mut segments = Vec::with_capacity(16);
        self.found.ends.clear();
        self.found.count = 0;
        for column in 0..columns {
            for bin in 0..bins {
                for i in cells.look_from(number, column, bin, &mut segments) {
                    self.found.look(cells, i, &segments, scale);
                }
                if self.found.count > BLOCK {
                    self.take(scale, virial);
                }
            }
        }
        self.take(scale, virial);
    }

    /// Takes the pairs that were found over.
    #[inline(always)]
    fn take(&mut self, scale: &Scale, virial: bool) {
        let Plane { start, pairs, stretch, found, .. } = self;
        found.weigh(scale);
        let mut k = 0;
        for end in &found.ends {
            while k < *end {
                let factor = found.factor[k];
                if factor > 0.0 {
                    let g = [0, 1, 2].map(|c| (found.d[c][k] * factor) as f32);
                    pairs.push(Pair { g, j: found.j[k] });
                    if virial {
                        stretch.push((1.0 / factor) as f32);
                    }
                }
                k += 1;
            }
            start.push(pairs.len() as u32);
        }
        found.ends.clear();
        found.count = 0;
    }

    /// Draws the noise of the pairs.
    pub fn draw(&mut self, tags: &[u32], noise: PairNoise, law: Law) {
        let Plane { own, next, start, pairs, xi, tags: [a, b], .. } = self;
        a.clear();
        b.clear();
        let (of_own, of_next) = (&tags[own.clone()], &tags[next.clone()]);
        for (tag, ends) in of_own.iter().zip(start.windows(2)) {
            let pairs = &pairs[ends[0] as usize..ends[1] as usize];
            a.resize(a.len() + pairs.len(), *tag);
            b.extend(pairs.iter().map(|pair| match (pair.j as usize).checked_sub(of_own.len()) {
                None => of_own[pair.j as usize],
                Some(k) => of_next[k],
            }));
        }
        xi.resize(pairs.len(), 0.0);
        noise.fill(law, a, b, xi);
    }
}

impl Found {
    /// Finds the pairs of particle `i` with what is in `segments`.
    #[inline(always)]
    fn look(&mut self, cells: &Cells, i: usize, segments: &[Segment], scale: &Scale) {
        let [x, y, z] = &cells.x;
        let candidates: usize = segments.iter().map(|s| s.end - s.first).sum();
        let room = self.count + candidates;
        if self.j.len() < room {
            self.j.resize(room, 0);
            self.d.iter_mut().for_each(|d| d.resize(room, 0.0));
            self.species.resize(room, 0);
        }
        for (number, segment) in segments.iter().enumerate() {
            let first = if number == 0 { i + 1 } else { segment.first };
            let Some(length) = segment.end.checked_sub(first).filter(|length| *length > 0) else { continue };
            let at = [x[i] - segment.shift[0], y[i] - segment.shift[1], z[i] - segment.shift[2]];
            if self.squared.len() < length {
                self.squared.resize(length, 0.0);
            }
            let squared = &mut self.squared[..length];
            let (x, y, z) = (&x[first..][..length], &y[first..][..length], &z[first..][..length]);
            for (((squared, x), y), z) in squared.iter_mut().zip(x).zip(y).zip(z) {
                let d = [at[0] - x, at[1] - y, at[2] - z];
                *squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            }
            let from = self.count;
            let mut count = from;
            for (k, squared) in squared.iter().enumerate() {
                self.j[count] = k as u32;
                count += usize::from(*squared < scale.cutoff_squared);
            }
            self.count = count;
            let own = usize::from(cells.species[i]) * scale.species;
            for n in from..count {
                let k = self.j[n] as usize;
                for (c, x) in [x, y, z].into_iter().enumerate() {
                    self.d[c][n] = at[c] - x[k];
                }
                self.species[n] = (own + usize::from(cells.species[first + k])) as u16;
                self.j[n] = ((first + k) as isize + segment.offset) as u32;
            }
        }
        self.ends.push(self.count);
    }

    /// Computes the factors of all pairs at hand.
    #[inline(always)]
    fn weigh(&mut self, scale: &Scale) {
        let count = self.count;
        self.factor.resize(count.max(self.factor.len()), 0.0);
        let factor = &mut self.factor[..count];
        let [x, y, z] = &self.d;
        let (x, y, z) = (&x[..count], &y[..count], &z[..count]);
        if let ([amplitude], [inverse_range], [exponent]) =
            (&scale.amplitude[..], &scale.inverse_range[..], &scale.exponent[..])
        {
            for (((factor, x), y), z) in factor.iter_mut().zip(x).zip(y).zip(z) {
                let r = (x * x + y * y + z * z).sqrt();
                let t = (1.0 - r * inverse_range).max(0.0);
                // Two particles on one point have no direction.
                *factor = if r > 0.0 { amplitude / r * t } else { 0.0 };
            }
            if *exponent != 1.0 {
                for (((factor, x), y), z) in factor.iter_mut().zip(x).zip(y).zip(z) {
                    let r = (x * x + y * y + z * z).sqrt();
                    *factor *= power((1.0 - r * inverse_range).max(0.0), *exponent);
                }
            }
            return;
        }
        for (k, factor) in factor.iter_mut().enumerate() {
            let s = usize::from(self.species[k]);
            let r = (x[k] * x[k] + y[k] * y[k] + z[k] * z[k]).sqrt();
            let t = (1.0 - r * scale.inverse_range[s]).max(0.0);
            *factor = if r > 0.0 { scale.amplitude[s] / r * t * power(t, scale.exponent[s]) } else { 0.0 };
        }
    }
}

/// `t^(exponent − 1)` within the range, 0 beyond.
fn power(t: f64, exponent: f64) -> f64 {
    match exponent {
        _ if t <= 0.0 => 0.0,
        1.0 => 1.0,
        2.0 => t,
        _ => t.powf(exponent - 1.0),
    }
}
