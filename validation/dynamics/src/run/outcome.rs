//! Reports to the caller of a run: its progress, its outcome and its summary.

use super::{Advice, Deviation, Means, Thermo, Timing};
use serde::Serialize;

#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    pub stage: &'a str,
    pub step: u64,
    pub steps: u64,
    /// The totals, if the step computed them.
    pub thermo: Option<&'a Thermo>,
    /// Wrong temperatures of the stage; filled at its last step only.
    pub deviations: &'a [Deviation],
}

#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    Finished {
        summary: Box<Summary>,
        timing: Timing,
        /// A better step for the last stage; `None` if this call made no steps or has no advice.
        advice: Option<Advice>,
    },
    /// The run stopped on request and left a checkpoint.
    Interrupted {
        /// The value of the stop request.
        stop: usize,
        step: u64,
        steps: u64,
    },
}

/// Summary of the results of a run, also written to `summary.json`. It does not depend on interruptions:
/// times are in [`Timing`](super::Timing).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    pub title: String,
    pub particles: usize,
    pub steps: u64,
    /// Number of evaluations of ψ at a density below and above its bounds.
    pub out_of_bounds: [u64; 2],
    pub last: Thermo,
    /// Plain means over the thermo rows of the last stage, without error bars; `None` without rows.
    pub means: Option<Means>,
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {} particles, {} steps", self.title, self.particles, self.steps)?;
        let [below, above] = self.out_of_bounds;
        if below + above > 0 {
            let share = (below + above) as f64 / (self.particles as f64 * self.steps as f64);
            write!(
                f,
                "\nout of bounds: psi was evaluated {below} times below and {above} times above the bounds of a density \
                 ({:.2} % of particle-steps); it went on with a linear slope there",
                100.0 * share
            )?;
        }
        Ok(())
    }
}
