//! The approximate solution of an implicit update, and when it is good enough.

use super::pass::Wide;

/// Relative residual at which iterations end, times drag per mass where that is above 1. The error of the
/// temperature is below 0.1 % (see `the_temperature_is_right`).
pub const TOLERANCE: f64 = 2e-2;

/// The largest relative residual for drag alone, where no noise makes up for a residual.
pub const TOLERANCE_OF_DRAG: f64 = 1e-4;

/// Least relative residual, which rounding errors leave. With drag so strong that it should be less, the solution is inaccurate.
const FINEST: f64 = 1e-7;

/// Drag per mass beyond which the last residual is not added, as that would make it larger.
const STRONG: f64 = 2.0;

/// Relative residual of motion without drag with which the last residual need not be added.
const OF_SLOW_FLOW: f64 = 1e-2;

/// Most iterations of a solution.
const MOST: usize = 500;

#[derive(Debug, Clone, Default)]
pub struct Solution {
    /// The change of velocity of each sorted particle.
    pub change: Vec<Wide>,
    pub residual: Vec<Wide>,
    pub progress: Progress,
}

/// State of conjugate gradients; all ranks have the same.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    tolerance: f64,
    /// Squared norms of the first residual and of the present one.
    first: f64,
    now: f64,
    /// Drag per mass of the first residual, or 1 if that is more.
    drag: f64,
    /// Residual and direction of a mode without drag, in units of its first residual.
    without_drag: [f64; 2],
    /// Iterations so far.
    pub iterations: usize,
}

/// How iterations ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Accurate,
    /// Drag is so strong that rounding errors stop the convergence.
    Inaccurate,
}

/// One iteration: the solution moves by `alpha` times the direction, and the next direction has `beta` times this one.
pub struct Move {
    pub alpha: f64,
    pub beta: f64,
    /// Set in the last iteration.
    pub outcome: Option<End>,
}

impl Progress {
    pub fn new(tolerance: f64) -> Progress {
        Progress { tolerance, without_drag: [1.0; 2], ..Progress::default() }
    }

    /// Computes an iteration from the squared norm of the first residual, `p · Ap` and `Ap · M⁻¹Ap`.
    ///
    /// With `α = r·M⁻¹r / p·Ap` the next residual has the norm `α² Ap·M⁻¹Ap − r·M⁻¹r`, as residuals are
    /// orthogonal: so one sum over ranks is enough for each iteration.
    pub fn advance(&mut self, [first, curvature, square]: [f64; 3]) -> Move {
        if self.iterations == 0 {
            (self.first, self.now) = (first, first);
            self.drag = ((square / first).sqrt() - 1.0).max(1.0);
        }
        self.iterations += 1;
        let alpha = if curvature > 0.0 { self.now / curvature } else { 0.0 };
        let next = alpha * alpha * square - self.now;
        let beta = next / self.now;
        self.now = next;
        // The eigenvalue of M⁻¹A is 1 for a mode without drag.
        let [residual, direction] = &mut self.without_drag;
        *residual -= alpha * *direction;
        *direction = *residual + beta * *direction;
        Move { alpha, beta, outcome: self.outcome() }
    }

    fn outcome(&self) -> Option<End> {
        let wanted = self.tolerance / self.drag;
        let is_below = |relative: f64| self.now <= relative * relative * self.first;
        let slow_flow_is_right = self.adds_residual() || self.without_drag[0].abs() <= OF_SLOW_FLOW;
        if wanted >= FINEST && is_below(wanted) && slow_flow_is_right {
            return Some(End::Accurate);
        }
        let is_over = self.now.is_nan() || is_below(FINEST) || self.iterations >= MOST;
        is_over.then_some(End::Inaccurate)
    }

    /// Whether `M⁻¹` times the last residual is added to the solution.
    pub fn adds_residual(&self) -> bool {
        self.drag < STRONG
    }
}
