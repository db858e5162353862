//! The machine, for pages.

use crate::ExperimentError;
use std::path::Path;

pub fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let model = std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            Some(line.split(':').nth(1)?.trim().to_owned())
        })
        .unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    format!("{model}, {cores} core(s)")
}

/// Processor time of all threads of this process so far, in seconds.
pub fn processor_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The most memory that this process ever had.
pub fn peak_kilobytes() -> Result<u64, ExperimentError> {
    let status = Path::new("/proc/self/status");
    let text = std::fs::read_to_string(status).map_err(ExperimentError::at(status))?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|rest| rest.split_whitespace().next()?.parse().ok())
        .ok_or_else(|| ExperimentError::Memory(format!("no VmHWM in {}", status.display())))
}
