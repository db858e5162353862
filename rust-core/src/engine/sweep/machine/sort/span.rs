//! How far particles reach.

use crate::engine::error::EngineError;
use crate::engine::sweep::machine::Given;
use crate::engine::sweep::machine::vectors::Loop;
use std::ops::Range;

/// Particles that are looked at together.
const GROUP: usize = 4;
/// Their coordinates.
const LANES: usize = 3 * GROUP;

/// Beyond this a coordinate is none.
const ABSURD: f64 = 1e100;

/// The lowest and the highest coordinates of some particles.
pub struct SpanSome<'a> {
    pub given: &'a Given<'a>,
    pub particles: Range<usize>,
}

impl Loop for SpanSome<'_> {
    type Out = Result<[[f64; 3]; 2], EngineError>;

    #[inline(always)]
    fn run(self) -> Self::Out {
        let mut span = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let (groups, rest) = self.given.particles.x[self.particles.clone()].as_chunks::<GROUP>();
        for (g, group) in groups.iter().enumerate() {
            let mut x = [0.0; LANES];
            x.copy_from_slice(group.as_flattened());
            let mut absurd = [0; GROUP];
            for from in (0..LANES).step_by(GROUP) {
                for c in 0..GROUP {
                    // Also what is no number.
                    let sound = x[from + c].abs() <= ABSURD / 3.0;
                    absurd[c] |= u64::from(!sound);
                }
            }
            if absurd != [0; GROUP] {
                self.one_by_one(GROUP * g, group, &mut span)?;
                continue;
            }
            for c in 0..LANES {
                low[c] = if x[c] < low[c] { x[c] } else { low[c] };
                high[c] = if x[c] > high[c] { x[c] } else { high[c] };
            }
        }
        self.one_by_one(GROUP * groups.len(), rest, &mut span)?;
        for c in 0..LANES {
            span[0][c % 3] = span[0][c % 3].min(low[c]);
            span[1][c % 3] = span[1][c % 3].max(high[c]);
        }
        Ok(span)
    }
}

impl SpanSome<'_> {
    /// Particles that may be somewhere absurd: those that take no part may.
    #[inline(never)]
    fn one_by_one(&self, from: usize, x: &[[f64; 3]], span: &mut [[f64; 3]; 2]) -> Result<(), EngineError> {
        for (k, x) in (self.particles.start + from..).zip(x) {
            let sum = x[0].abs() + x[1].abs() + x[2].abs();
            if sum.is_nan() || sum > ABSURD {
                if self.given.species_of(k).is_some_and(|s| s < 0) {
                    continue;
                }
                return Err(EngineError::Position { tag: self.given.particles.tag[k] });
            }
            for c in 0..3 {
                span[0][c] = span[0][c].min(x[c]);
                span[1][c] = span[1][c].max(x[c]);
            }
        }
        Ok(())
    }
}
