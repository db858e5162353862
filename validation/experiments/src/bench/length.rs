//! How many steps a timed run makes.

use super::contender::Contender;
use crate::code::Code;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Length {
    /// Steps before the clock starts.
    pub warm_up: u64,
    /// Steps that are timed.
    pub steps: u64,
}

/// Fewest steps that are timed: LAMMPS builds its lists every two to ten steps, and a run must contain its
/// share of builds.
pub const FEWEST: u64 = 20;
/// Steps between reorderings of the native runner: its runs are whole multiples of this.
pub const CYCLE: u64 = psidpd_dynamics::run::REORDERING;
/// Most steps, however fast they are.
const MOST: u64 = 1_000_000;

impl Length {
    /// The length of a run of `steps` that are timed, after a tenth as many.
    pub fn of(steps: u64) -> Length {
        Length { warm_up: (steps / 10).max(5), steps }
    }

    /// The length that fits into `seconds` for a contender that takes `step` seconds for one, but no shorter than
    /// [`FEWEST`], or one [`CYCLE`], whatever time these take.
    pub fn within(seconds: f64, contender: &Contender, step: f64) -> Length {
        // The cast takes NaN to zero and what is too large to the greatest number.
        let fit = (seconds / step) as u64;
        let cycle = if contender.code == Code::Native { CYCLE } else { 1 };
        Length::of((fit.min(MOST) / cycle * cycle).max(FEWEST.next_multiple_of(cycle)))
    }

    pub fn all(self) -> u64 {
        self.warm_up + self.steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_bounds_steps_and_the_fewest_bound_that() {
        let lammps = Contender::alone(Code::Mdpd);
        let native = Contender::alone(Code::Native);
        let plain = Contender::alone(Code::PairSums);
        let steps = |contender, step| Length::within(0.3, contender, step).steps;
        assert_eq!(steps(&lammps, 0.002), 150);
        assert_eq!([0.1, 10.0].map(|s| steps(&lammps, s)), [20, 20]);
        // 75 steps would fit, two whole cycles do.
        assert_eq!([0.004, 0.1, 10.0].map(|s| steps(&native, s)), [64, 32, 32]);
        assert_eq!(steps(&plain, 0.1), 20);
        assert_eq!([0.0, -1.0, f64::NAN].map(|s| steps(&lammps, s)), [MOST, 20, 20]);
        assert_eq!(Length::within(0.3, &lammps, 0.1).all(), 25);
        assert_eq!(Length::of(640).warm_up, 64);
    }
}
