//! The lowest and highest coordinates of the particles.

use crate::engine::error::EngineError;
use crate::engine::sweep::workspace::input::Input;
use crate::engine::vectors::{self, Loop};
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_threads::{Pool, part};
use std::ops::Range;

/// Number of particles that a step of the loop reads.
const PARTICLES: usize = 4;
/// Number of their coordinates.
const COORDINATES: usize = 3 * PARTICLES;

/// A coordinate beyond this is an error.
const ABSURD: f64 = 1e100;

/// The lowest and the highest coordinates of the owned particles; the origin if there are none.
pub fn extremes(pool: &Pool, set: InstructionSet, input: &Input) -> Result<[[f64; 3]; 2], EngineError> {
    let threads = pool.threads();
    let particles = |t| part(input.particles.owned, t, threads);
    let mut parts: Vec<_> = (0..threads).map(|t| (particles(t), Ok(NOWHERE))).collect();
    pool.each(&mut parts, |(particles, found)| {
        *found = vectors::run(set, FindExtremes { input, particles: particles.clone() });
    });
    let [mut low, mut high] = NOWHERE;
    for (_, found) in parts {
        let [lowest, highest] = found?;
        for c in 0..3 {
            low[c] = low[c].min(lowest[c]);
            high[c] = high[c].max(highest[c]);
        }
    }
    Ok(if low[0] > high[0] { [[0.0; 3]; 2] } else { [low, high] })
}

/// The extremes of no particles.
const NOWHERE: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

/// The lowest and the highest coordinates of some particles.
struct FindExtremes<'a> {
    input: &'a Input<'a>,
    particles: Range<usize>,
}

impl Loop for FindExtremes<'_> {
    type Out = Result<[[f64; 3]; 2], EngineError>;

    #[inline(always)]
    fn run(self) -> Self::Out {
        let x = &self.input.particles.x[self.particles.clone()];
        let (mut low, mut high) = ([f64::INFINITY; COORDINATES], [f64::NEG_INFINITY; COORDINATES]);
        let mut poison = [0.0; COORDINATES];
        let (groups, rest) = x.as_chunks::<PARTICLES>();
        for group in groups {
            let mut x = [0.0; COORDINATES];
            x.copy_from_slice(group.as_flattened());
            for c in 0..COORDINATES {
                low[c] = if x[c] < low[c] { x[c] } else { low[c] };
                high[c] = if x[c] > high[c] { x[c] } else { high[c] };
                // The product is NaN for coordinates that are not finite.
                poison[c] += 0.0 * x[c];
            }
        }
        let sound = |c: usize| poison[c] == 0.0 && low[c] >= -ABSURD / 3.0 && high[c] <= ABSURD / 3.0;
        let mut extremes = NOWHERE;
        if !groups.is_empty() && !(0..COORDINATES).all(sound) {
            self.one_by_one(0, x, &mut extremes)?;
            return Ok(extremes);
        }
        self.one_by_one(PARTICLES * groups.len(), rest, &mut extremes)?;
        for c in 0..COORDINATES {
            extremes[0][c % 3] = extremes[0][c % 3].min(low[c]);
            extremes[1][c % 3] = extremes[1][c % 3].max(high[c]);
        }
        Ok(extremes)
    }
}

impl FindExtremes<'_> {
    /// Checks particles that may have absurd coordinates: those that are left out may.
    #[inline(never)]
    fn one_by_one(
        &self,
        from: usize,
        x: &[[f64; 3]],
        extremes: &mut [[f64; 3]; 2],
    ) -> Result<(), EngineError> {
        for (k, x) in (self.particles.start + from..).zip(x) {
            let sum = x[0].abs() + x[1].abs() + x[2].abs();
            if sum.is_nan() || sum > ABSURD {
                if self.input.species_of(k).is_some_and(|s| s < 0) {
                    continue;
                }
                return Err(EngineError::Position { tag: self.input.particles.tag[k] });
            }
            for c in 0..3 {
                extremes[0][c] = extremes[0][c].min(x[c]);
                extremes[1][c] = extremes[1][c].max(x[c]);
            }
        }
        Ok(())
    }
}
