//! Lines shared out among the bins of a profile.
//!
//! A line from p to q, in numbers of bins, gives each bin its weight times the part of the line in that bin. Over the position its
//! density is a rectangle: it steps up by s = weight/(q − p) at p and down at q. A step at p adds s (1 − t) to the bin of p, with t the
//! fraction of p in its bin, and s to all bins after it. So a line costs two additions, however many bins it crosses, and the bins are
//! running sums at the end. A line that crosses no more than one edge is given to its two bins at once: its s may be large.

use super::across::Across;
use crate::flux::BLOCK;
use psidpd_core::engine::vectors::{Loop, integer, run_best};

/// The weights of a line: two numbers.
pub const WEIGHTS: usize = 2;

/// The numbers in a strip: what the bin gets, then what each bin from there on gets.
const WIDTH: usize = 2 * WEIGHTS;

/// How lines are added to strips, of which there are more than bins: in a periodic box lines begin in the middle one of three copies of
/// the bins, and may go on in the others; in another box they may begin or end outside.
#[derive(Debug, Clone, Copy)]
pub struct Strips {
    bins: usize,
    periodic: bool,
}

/// A block of lines: their ends in numbers of bins, and their weights.
#[derive(Debug)]
pub struct Ends {
    pub from: [f64; BLOCK],
    pub to: [f64; BLOCK],
    pub weights: [[f64; BLOCK]; WEIGHTS],
    steps: Steps,
}

impl Default for Ends {
    fn default() -> Ends {
        let none = [0.0; BLOCK];
        Ends { from: none, to: none, weights: [none; WEIGHTS], steps: Steps::default() }
    }
}

impl Strips {
    pub fn of(across: &Across) -> Strips {
        Strips { bins: across.bins, periodic: across.is_periodic() }
    }

    fn count(&self) -> usize {
        if self.periodic { 3 * self.bins + 1 } else { self.bins + 2 }
    }

    /// The number of sums over lines.
    pub fn width(&self) -> usize {
        WIDTH * self.count()
    }

    /// Adds `count` lines to `sums`.
    pub fn add(&self, lines: &mut Ends, count: usize, sums: &mut [f64]) {
        if run_best(Place { strips: *self, lines }) && self.periodic {
            for k in 0..count {
                if (lines.to[k] - lines.from[k]).abs() > self.bins as f64 {
                    self.take_turns(lines, k, sums);
                }
            }
            run_best(Place { strips: *self, lines });
        }
        run_best(Add { lines, count, sums });
    }

    /// Adds the whole turns of a line that is longer than a period, and leaves the rest of it.
    fn take_turns(&self, lines: &mut Ends, k: usize, sums: &mut [f64]) {
        let (bins, length) = (self.bins as f64, lines.to[k] - lines.from[k]);
        let turns = (length.abs() / bins).floor();
        for (c, weights) in lines.weights.iter_mut().enumerate() {
            let in_each = weights[k] * turns / length.abs();
            for (strip, sign) in [(0, 1.0), (self.bins, -1.0)] {
                sums[WIDTH * strip + c] += sign * in_each;
                sums[WIDTH * strip + WEIGHTS + c] += sign * in_each;
            }
            weights[k] -= in_each * bins;
        }
        lines.to[k] -= turns * bins * length.signum();
    }

    /// The weights in each bin, [`WEIGHTS`] numbers for each.
    pub fn bins(&self, sums: &[f64]) -> Vec<f64> {
        let mut bins = vec![0.0; WEIGHTS * self.bins];
        let mut running = [0.0; WEIGHTS];
        for (k, strip) in sums.chunks_exact(WIDTH).enumerate() {
            let bin =
                if self.periodic { Some(k % self.bins) } else { k.checked_sub(1).filter(|k| *k < self.bins) };
            for c in 0..WEIGHTS {
                if let Some(bin) = bin {
                    bins[WEIGHTS * bin + c] += running[c] + strip[c];
                }
                running[c] += strip[WEIGHTS + c];
            }
        }
        bins
    }
}

/// The strip of each end of a block of lines, and which parts of the weights it gets.
#[derive(Debug)]
struct Steps {
    at: [[u32; BLOCK]; 2],
    here: [[f64; BLOCK]; 2],
    /// What each strip behind the first end gets, and those behind the other end lose.
    after: [f64; BLOCK],
}

impl Default for Steps {
    fn default() -> Steps {
        Steps { at: [[0; BLOCK]; 2], here: [[0.0; BLOCK]; 2], after: [0.0; BLOCK] }
    }
}

/// Finds the strips of a block of lines.
struct Place<'a> {
    strips: Strips,
    lines: &'a mut Ends,
}

impl Loop for Place<'_> {
    type Out = bool;

    /// Returns whether a line may be longer than a period.
    #[inline(always)]
    fn run(self) -> bool {
        let Place { strips, lines: Ends { from, to, steps, .. } } = self;
        let Steps { at: [at_from, at_to], here: [here_from, here_to], after } = steps;
        let (bins, periodic, top) = (strips.bins as f64, strips.periodic, (strips.count() - 1) as f64);
        let mut is_long = false;
        for k in 0..BLOCK {
            // Outside a box that is not periodic is a strip at either end.
            let shift = if periodic { bins - (from[k] / bins).floor() * bins } else { 1.0 };
            let (start, end) = (from[k] + shift, to[k] + shift);
            let (first, last, slope) = (start.floor(), end.floor(), 1.0 / (end - start));
            let (up, down) = (first + 1.0 - start, last + 1.0 - end);
            let is_short = (last - first).abs() < 1.5;
            let rises = start <= end;
            let of_lower = (if rises { up } else { down } * slope.abs()).min(1.0);
            let of_upper = 1.0 - of_lower;
            let [short_from, short_to] = if rises { [of_lower, of_upper] } else { [of_upper, of_lower] };
            here_from[k] = if is_short { short_from } else { up * slope };
            here_to[k] = if is_short { short_to } else { -down * slope };
            after[k] = if is_short { 0.0 } else { slope };
            at_from[k] = integer(first.max(0.0).min(top) as f32);
            at_to[k] = integer(last.max(0.0).min(top) as f32);
            is_long |= (to[k] - from[k]).abs() > bins;
        }
        is_long
    }
}

/// Adds a block of lines to the sums of their strips.
struct Add<'a> {
    lines: &'a Ends,
    count: usize,
    sums: &'a mut [f64],
}

impl Loop for Add<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Add { lines: Ends { weights: [normal, rest], steps, .. }, count, sums } = self;
        let Steps { at: [at_from, at_to], here: [here_from, here_to], after } = steps;
        let (strips, _) = sums.as_chunks_mut::<WIDTH>();
        // Lines follow each other that begin at one particle, so that what begins in one strip is added up first.
        let (mut strip, mut here) = (at_from[0] as usize, [0.0; WIDTH]);
        for k in 0..count {
            let weights = [normal[k], rest[k], normal[k], rest[k]];
            let (from, to, behind) = (here_from[k], here_to[k], after[k]);
            if at_from[k] as usize != strip {
                add(&mut strips[strip], [1.0; WIDTH], here);
                (strip, here) = (at_from[k] as usize, [0.0; WIDTH]);
            }
            add(&mut here, [from, from, behind, behind], weights);
            add(&mut strips[at_to[k] as usize], [to, to, -behind, -behind], weights);
        }
        add(&mut strips[strip], [1.0; WIDTH], here);
    }
}

/// Adds weights times factors.
#[inline(always)]
fn add(sums: &mut [f64; WIDTH], factors: [f64; WIDTH], weights: [f64; WIDTH]) {
    (0..WIDTH).for_each(|c| sums[c] += factors[c] * weights[c]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    /// Each bin gets the part of each line that is in it, by the definition: in boxes with and without a period, for lines along
    /// the bins, within a bin, beyond the ends of the box, and longer than the box.
    #[test]
    fn bins_get_their_parts() {
        let mut random = StdRng::seed_from_u64(8);
        for (bins, periodic) in [(7, true), (7, false), (1, true), (1, false), (40, true)] {
            let strips = Strips { bins, periodic };
            let n = bins as f64;
            let mut lines = Ends::default();
            for k in 0..BLOCK {
                let from = n * (3.0 * random.random::<f64>() - 1.0);
                let length =
                    [0.0, 1e-13, 0.3, 0.9 * n, 2.7 * n][k % 5] * (2.0 * random.random::<f64>() - 1.0);
                (lines.from[k], lines.to[k]) = (from, from + length);
                lines.weights = std::array::from_fn(|c| {
                    let mut weights = lines.weights[c];
                    weights[k] = random.random::<f64>() - 0.3;
                    weights
                });
            }
            // Exactly on an edge.
            (lines.from[0], lines.to[0]) = (1.0, 1.0);
            let mut expected = vec![0.0; WEIGHTS * bins];
            for k in 0..BLOCK - 3 {
                let (low, high) = (lines.from[k].min(lines.to[k]), lines.from[k].max(lines.to[k]));
                for bin in -200i64..200 {
                    let edge = bin as f64;
                    let part = match high - low < 1e-12 {
                        true => f64::from(u8::from((0.0..1.0).contains(&(0.5 * (low + high) - edge)))),
                        false => ((edge + 1.0).min(high) - edge.max(low)).max(0.0) / (high - low),
                    };
                    let to = if periodic { bin.rem_euclid(bins as i64) } else { bin };
                    if (0..bins as i64).contains(&to) {
                        let at = WEIGHTS * to as usize;
                        (0..WEIGHTS).for_each(|c| expected[at + c] += part * lines.weights[c][k]);
                    }
                }
            }
            let mut sums = vec![0.0; strips.width()];
            strips.add(&mut lines, BLOCK - 3, &mut sums);
            for (found, expected) in strips.bins(&sums).iter().zip(&expected) {
                assert!(
                    (found - expected).abs() < 1e-12 * BLOCK as f64,
                    "{bins} {periodic}: {found} {expected}"
                );
            }
        }
    }
}
