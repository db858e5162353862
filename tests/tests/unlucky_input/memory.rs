//! Runs that would take more memory than there is, and what runs take.

use super::{SCENE, SOFT, with_a_run, words, write};
use psidpd_tests::program;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// 87 million particles take 42 GB; the shell allows 4.
#[test]
fn more_memory_than_there_is_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    write(here, "s.toml", &SCENE.replace("4.0, 4.0, 4.0", "307, 307, 307"));
    for (line, code, need) in [
        ("run s.toml --out o", 2, "41.7 GB"),
        ("export lammps s.toml --out o", 2, "41.7 GB"),
        ("check s.toml", 1, "41.7 GB"),
    ] {
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &format!("ulimit -v 4000000; exec \"$0\" {line}")])
            .arg(program())
            .current_dir(here);
        let (text, found) = words(&shell.output().unwrap());
        assert_eq!(found, Some(code), "{line}: {text}");
        assert!(
            text.contains(&format!("86803329 particles need about {need}")) && text.contains("ulimit -v"),
            "{line}: {text}"
        );
    }
}

/// The most memory that a run ever had, from its start to its last file.
fn peak(here: &Path, scene: &str) -> f64 {
    let mut run = Command::new(program());
    run.args(["run", scene, "--out", "o", "--overwrite"]).current_dir(here);
    let mut child = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let kilobytes = text.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next());
        peak = kilobytes.map_or(peak, |k| 1024.0 * k.parse::<f64>().unwrap());
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    peak
}

/// A run of Warren's liquid takes about the memory that `check` says, for which more than there is is refused: with many
/// particles, with steps enough for the temperature to be watched, with a thermostat apart from the forces, with few particles,
/// with steps enough for that of their configurations, with an observable of forces, and with one of liquids.
#[test]
fn a_run_takes_the_memory_that_check_says() {
    let folder = with_a_run();
    let here = folder.path();
    let apart = "integrator = \"two-stage\"\n";
    let observed = "[observe]\nevery = 4\ntemperature = true\n";
    let of_liquids = "[observe]\nevery = 4\nviscosity = true\n";
    for (edge, steps, rest) in [
        (48, 2, ""),
        (44, 12, ""),
        (44, 2, apart),
        (20, 2, ""),
        (20, 1000, ""),
        (26, 12, observed),
        (44, 12, of_liquids),
    ] {
        let text = format!(
            "title = \"t\"\nmodel = \"w.toml\"\nkT = 1.0\nbox = {edge}.0\ndensity = 6.05\ndt = 0.002\nsteps = {steps}\n{rest}"
        );
        write(here, "large.toml", &text);
        let found = psidpd_tests::json(here, &["check", "large.toml"], 0);
        let [said, had] = [found["cost"]["bytes"].as_f64().unwrap(), peak(here, "large.toml")];
        assert!((0.75..1.15).contains(&(had / said)), "{steps} steps {rest}: {had:e} of {said:e} bytes");
    }
}
