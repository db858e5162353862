//! The machine and the program on it.

use crate::ExperimentError;
use psidpd_formats::files::read_inside;
use std::path::Path;
use std::sync::LazyLock;

pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The version with the checksum of the file that has this code: what is under development keeps its version.
pub static BUILD: LazyLock<String> = LazyLock::new(|| {
    let file = || {
        let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
        let here = machine as *const () as usize;
        let is_here = |line: &&str| {
            let ends = line.split([' ', '-']).map(|end| usize::from_str_radix(end, 16));
            matches!(ends.take(2).collect::<Vec<_>>()[..], [Ok(from), Ok(to)] if (from..to).contains(&here))
        };
        read_inside(Path::new(maps.lines().find(is_here)?.splitn(6, ' ').last()?.trim_start())).ok()
    };
    // Without it a run is known to this process alone.
    let sum = file().map_or_else(std::process::id, |bytes| crc32fast::hash(&bytes));
    format!("{VERSION} {sum:08x}")
});

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

#[cfg(test)]
mod tests {
    use super::*;

    /// The file of a test is its executable.
    #[test]
    fn a_build_is_known_by_its_file() {
        let file = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(*BUILD, format!("{VERSION} {:08x}", crc32fast::hash(&file)));
    }
}
