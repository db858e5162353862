//! Reports to the caller of a run: its progress, and its outcome.

use super::{Advice, Deviation, Summary, Thermo, Timing};

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
