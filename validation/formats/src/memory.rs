//! How much memory a run needs, and how much there is: what does not fit is refused before it is asked for, since the system ends
//! a program that asks for too much.

use rustix::process::{Resource, getrlimit};
use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Bytes of a particle at the peak: 4 GB for ten million (docs/running.md).
const PARTICLE: f64 = 400.0;

/// Bytes of a process without particles.
const PROGRAM: f64 = 2e7;

/// More memory than there is.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} about {} of memory, and this process can have {}: {limit}", shown(*need), shown(*there))]
pub struct MemoryError {
    what: String,
    need: f64,
    there: f64,
    limit: &'static str,
}

/// Bytes that a run of so many particles needs, roughly.
pub fn need(particles: usize) -> f64 {
    PROGRAM + PARTICLE * particles as f64
}

/// # Errors
/// A run of so many particles needs more than there is.
pub fn check(particles: usize) -> Result<(), MemoryError> {
    fits(need(particles), || format!("{particles} particles need"))
}

/// # Errors
/// What needs so many bytes, called `what` with its verb, needs more than there is.
pub fn fits(need: f64, what: impl FnOnce() -> String) -> Result<(), MemoryError> {
    let least = limits().into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    match least {
        Some((there, limit)) if need > there => Err(MemoryError { what: what(), need, there, limit }),
        _ => Ok(()),
    }
}

/// A number of bytes for people.
pub fn shown(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

/// What is still to be had, by each that limits it; those that do not say are left out.
fn limits() -> Vec<(f64, &'static str)> {
    let machine = read_to_string("/proc/meminfo").ok().and_then(|text| left_on_machine(&text));
    let of_shell = getrlimit(Resource::As).current.map(|most| most as f64 - in_use().unwrap_or(0.0));
    let mut all = Vec::new();
    all.extend(machine.map(|left| (left, "take fewer particles, or a machine with more memory")));
    all.extend(of_shell.map(|left| (left.max(0.0), "the limit of the shell (ulimit -v) allows no more")));
    let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
    let groups = groups.lines().flat_map(|line| left_in_groups(line, Path::new("/sys/fs/cgroup")));
    all.extend(
        groups.map(|left| (left, "the control group of the process, as a container has it, allows no more")),
    );
    all
}

/// Bytes of the address space in use.
fn in_use() -> Option<f64> {
    let pages: f64 = read_to_string("/proc/self/statm").ok()?.split_whitespace().next()?.parse().ok()?;
    Some(pages * rustix::param::page_size() as f64)
}

/// Memory that is free or can be made so, and room on the swap device, of a text as `/proc/meminfo` has it.
fn left_on_machine(text: &str) -> Option<f64> {
    let kilobytes = |name: &str| -> Option<f64> {
        text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
    };
    Some(1024.0 * (kilobytes("MemAvailable:")? + kilobytes("SwapFree:").unwrap_or(0.0)))
}

/// What a control group and those around it still allow; `line` is one of `/proc/self/cgroup`, `root` where groups are mounted.
fn left_in_groups(line: &str, root: &Path) -> Vec<f64> {
    let mut parts = line.splitn(3, ':').skip(1);
    let (Some(controllers), Some(group)) = (parts.next(), parts.next()) else { return Vec::new() };
    // Version 2 has no controllers in the line, version 1 a tree for each.
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
        // Pages of files are given up when memory is wanted.
        let stat = read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let files = stat.lines().find_map(|line| line.strip_prefix(names[2])?.trim().parse().ok());
        Some((most - now + files.unwrap_or(0.0)).clamp(0.0, most))
    };
    // Inside a container the path may be that outside of it: then the root is the group.
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
        assert_eq!(check(1000), Ok(()));
        // More than any address space has.
        let text = check(usize::MAX).unwrap_err().to_string();
        assert!(
            text.contains("18446744073709551615 particles need about") && text.contains("GB of memory"),
            "{text}"
        );
    }
}
