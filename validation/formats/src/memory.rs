//! The memory that a run needs, and the memory that is available. A run that does not fit is refused before it asks for
//! memory, because the system kills a program that asks for too much.

use rustix::process::{Resource, getrlimit};
use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Bytes per particle of a short run at its peak (docs/bench.md).
pub const PARTICLE: f64 = 480.0;

/// Bytes of a process without particles.
const PROGRAM: f64 = 2e7;

/// The error of a need for more memory than is available.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} about {} of memory, and this process can have {}: {limit}", shown(*need), shown(*there))]
pub struct MemoryError {
    what: String,
    need: f64,
    there: f64,
    limit: &'static str,
}

/// The approximate number of bytes that a run needs with this number of particles, and so many bytes for each.
pub fn need(particles: usize, each: f64) -> f64 {
    PROGRAM + each * particles as f64
}

/// Checks that a run with this number of particles, and so many bytes for each, fits into the memory.
pub fn check(particles: usize, each: f64) -> Result<(), MemoryError> {
    fits(need(particles, each), || format!("{particles} particles need"))
}

/// Checks that `need` bytes fit into the memory. `what` makes the subject and verb of the error message.
pub fn fits(need: f64, what: impl FnOnce() -> String) -> Result<(), MemoryError> {
    let least = limits().into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    match least {
        Some((there, limit)) if need > there => Err(MemoryError { what: what(), need, there, limit }),
        _ => Ok(()),
    }
}

/// A number of bytes with a unit, for messages.
pub fn shown(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

/// The available memory under each limit that the system tells.
fn limits() -> Vec<(f64, &'static str)> {
    let machine = read_to_string("/proc/meminfo").ok().and_then(|text| left_on_machine(&text));
    let of_shell = getrlimit(Resource::As).current.map(|most| most as f64 - in_use().unwrap_or(0.0));
    let mut all = Vec::new();
    all.extend(machine.map(|left| (left, "take fewer particles or bins, or a machine with more memory")));
    all.extend(of_shell.map(|left| (left.max(0.0), "the limit of the shell (ulimit -v) allows no more")));
    let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
    let groups = groups.lines().flat_map(|line| left_in_groups(line, Path::new("/sys/fs/cgroup")));
    all.extend(
        groups.map(|left| (left, "the control group of the process (as in a container) allows no more")),
    );
    all
}

/// Bytes of the address space in use.
fn in_use() -> Option<f64> {
    let pages: f64 = read_to_string("/proc/self/statm").ok()?.split_whitespace().next()?.parse().ok()?;
    Some(pages * rustix::param::page_size() as f64)
}

/// Free or reclaimable memory plus free swap space, from a text in the format of `/proc/meminfo`.
fn left_on_machine(text: &str) -> Option<f64> {
    let kilobytes = |name: &str| -> Option<f64> {
        text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
    };
    Some(1024.0 * (kilobytes("MemAvailable:")? + kilobytes("SwapFree:").unwrap_or(0.0)))
}

/// The memory that a control group and its ancestors still allow. `line` is one of `/proc/self/cgroup`; groups are mounted
/// at `root`.
fn left_in_groups(line: &str, root: &Path) -> Vec<f64> {
    let mut parts = line.splitn(3, ':').skip(1);
    let (Some(controllers), Some(group)) = (parts.next(), parts.next()) else { return Vec::new() };
    // The line of version 2 has no controllers; version 1 has one tree for each controller.
    let (root, names) = match controllers {
        "" => (root.to_owned(), ["memory.max", "memory.current", "file "]),
        c if c.split(',').any(|c| c == "memory") => {
            (root.join("memory"), ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_cache "])
        }
        _ => return Vec::new(),
    };
    let number = |path: PathBuf| -> Option<f64> { read_to_string(path).ok()?.trim().parse().ok() };
    let left = |folder: PathBuf| -> Option<f64> {
        let (most, now) = (number(folder.join(names[0]))?, number(folder.join(names[1]))?);
        // The system reclaims pages of files when a process needs memory.
        let stat = read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let files = stat.lines().find_map(|line| line.strip_prefix(names[2])?.trim().parse().ok());
        Some((most - now + files.unwrap_or(0.0)).clamp(0.0, most))
    };
    // Inside a container the path may be the path outside of it. Then the root is the group.
    Path::new(group.trim_start_matches('/')).ancestors().filter_map(|group| left(root.join(group))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read() {
        let text = "MemTotal:  9 kB\nMemAvailable:    3 kB\nSwapFree:  2 kB\n";
        assert_eq!(left_on_machine(text), Some(5.0 * 1024.0));
        assert_eq!(left_on_machine(""), None);
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        write("a/memory.max", "1000\n");
        write("a/memory.current", "700\n");
        write("a/memory.stat", "anon 600\nfile 100\n");
        write("a/b/memory.max", "max\n");
        write("a/b/memory.current", "700\n");
        write("memory/c/memory.limit_in_bytes", "50\n");
        write("memory/c/memory.usage_in_bytes", "80\n");
        assert_eq!(left_in_groups("0::/a/b", folder.path()), [400.0]);
        assert_eq!(left_in_groups("5:cpu,memory:/c", folder.path()), [0.0]);
        for line in ["", "0", "3:cpu:/a", "0::/elsewhere"] {
            assert!(left_in_groups(line, folder.path()).is_empty(), "{line}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_both_numbers() {
        assert_eq!(check(1000, PARTICLE), Ok(()));
        // No address space is this large.
        let text = check(usize::MAX, PARTICLE).unwrap_err().to_string();
        assert!(
            text.contains("18446744073709551615 particles need about") && text.contains("GB of memory"),
            "{text}"
        );
    }
}
