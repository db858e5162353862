//! What a run tells its caller: where it is, and how it ended.

use super::advice::Advice;
use super::summary::Summary;
use super::timing::Timing;
use super::watch::Deviation;
use crate::checkpoint::Thermo;

/// Where a run is, after every step.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Name of the stage.
    pub stage: &'a str,
    /// Steps made, over all stages.
    pub step: u64,
    /// Steps to make, over all stages.
    pub steps: u64,
    /// The totals, on steps that have them.
    pub thermo: Option<&'a Thermo>,
    /// What is wrong with the temperatures of the stage, at its last step.
    pub deviations: &'a [Deviation],
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// All steps are made.
    Finished {
        /// What it came to.
        summary: Box<Summary>,
        /// What it took.
        timing: Timing,
        /// A better step for its last stage, if it made steps.
        advice: Option<Advice>,
    },
    /// It was asked to stop, and left a checkpoint.
    Interrupted {
        /// What it was told.
        stop: usize,
        /// Steps made.
        step: u64,
        /// Steps to make.
        steps: u64,
    },
}
