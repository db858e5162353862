//! Instructions per step and particle, counted by callgrind: unlike times, counts do not depend on other load
//! of the machine, so a regression of a few percent shows.
//!
//! Counts are compared with `baselines/instructions.json`. After an intended change,
//!
//! ```text
//! PSIDPD_UPDATE_BASELINE=1 cargo test --release -p psidpd-tests --test instruction_counts
//! ```
//!
//! writes the file anew. Valgrind does not support AVX-512; its kernels have the same source as those of AVX2.

use psidpd_tests::{engine, root, said};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Allowed relative deviation from the baseline, for other versions of the compiler and the C library.
const TOLERANCE: f64 = 0.05;
/// Numbers of evaluations in the two runs whose difference counts; the first evaluations allocate memory.
const EVALUATIONS: [u32; 2] = [2, 5];

fn baseline() -> PathBuf {
    root().join("tests/baselines/instructions.json")
}

/// The number of particles, and the instructions of a whole run.
fn count(program: &Path, case: &[&str], evaluations: u32) -> (f64, f64) {
    let mut run = Command::new("valgrind");
    run.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program);
    // The arguments are fluid, precision and instruction set; after the number, the sides with ghosts, `thermostat`,
    // `listed` or `ranked`.
    run.args(&case[..3]).arg(evaluations.to_string()).args(&case[3..]);
    let output = run.output().unwrap_or_else(|e| {
        panic!("valgrind does not start ({e}): install it (Debian: apt-get install valgrind)")
    });
    assert!(output.status.success(), "{case:?}: {}", said(&output));
    let said = said(&output);
    let collected = said.lines().find_map(|line| line.split_once("Collected :")).map(|(_, n)| n.trim());
    let instructions = collected.and_then(|n| n.parse().ok());
    let particles = said.split_whitespace().next().and_then(|n| n.parse().ok());
    match (particles, instructions) {
        (Some(p), Some(i)) => (p, i),
        _ => panic!("callgrind says no count: {said}"),
    }
}

fn per_particle_step(program: &Path, case: &[&str]) -> f64 {
    let [few, many] = EVALUATIONS.map(|evaluations| count(program, case, evaluations));
    (many.1 - few.1) / (many.0 * f64::from(EVALUATIONS[1] - EVALUATIONS[0]))
}

fn compiler() -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("--version").current_dir(root()).output().expect("rustc runs");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
fn instructions_per_particle_and_step_stay_what_they_were() {
    let program = engine().instructions;
    let mut counts = BTreeMap::new();
    for fluid in ["mdpd", "dpd", "formula", "colloid", "two-sizes"] {
        // Ranks have the sweep of all ranges.
        let mixture = ["colloid", "two-sizes"].contains(&fluid);
        for precision in ["mixed", "double"] {
            for instructions in ["portable", "avx2"] {
                // The additional cost of ghosts hardly depends on the instruction set. The thermostat apart from the
                // forces is counted on its own, and together with the forces at the same positions, without drag and noise: also
                // on a rank with ghosts.
                let more = match instructions {
                    _ if mixture => &[None][..],
                    "avx2" => &[None, Some("6"), Some("thermostat"), Some("listed"), Some("ranked")][..],
                    _ => &[None],
                };
                for more in more {
                    let mut case = vec![fluid, precision, instructions];
                    case.extend(more);
                    let count = per_particle_step(&program, &case);
                    println!("{:<24} {count:8.1}", case.join(" "));
                    counts.insert(case.join(" "), (10.0 * count).round() / 10.0);
                }
            }
        }
    }
    let rewrite = "PSIDPD_UPDATE_BASELINE=1 cargo test --release -p psidpd-tests --test instruction_counts";
    if std::env::var_os("PSIDPD_UPDATE_BASELINE").is_some_and(|v| !v.is_empty()) {
        let value = json!({ "compiler": compiler(), "instructions_per_particle_step": counts });
        std::fs::write(baseline(), format!("{value:#}\n")).expect("the baseline is written");
        return;
    }
    let text = std::fs::read_to_string(baseline())
        .unwrap_or_else(|e| panic!("{}: {e}; write it by\n{rewrite}", baseline().display()));
    let expected: Value = serde_json::from_str(&text).expect("the baseline is JSON");
    let expected_counts = expected["instructions_per_particle_step"].as_object().expect("counts by name");
    assert!(
        expected_counts.keys().eq(counts.keys()),
        "the baseline has other cases; write it anew by\n{rewrite}"
    );
    let faults: Vec<String> = counts
        .iter()
        .filter_map(|(case, count)| {
            let before = expected_counts[case].as_f64().unwrap_or(f64::NAN);
            let change = count / before - 1.0;
            // This comparison makes NaN a failure; the reverse comparison would not.
            let good = change.abs() <= TOLERANCE;
            (!good).then(|| format!("{case}: {count} instead of {before} ({:+.1} %)", 100.0 * change))
        })
        .collect();
    assert!(
        faults.is_empty(),
        "instructions per particle and step:\n{}\nbaseline by {}, here {}. If the change is meant (fewer are welcome):\n{rewrite}",
        faults.join("\n"),
        expected["compiler"].as_str().unwrap_or("an unknown compiler"),
        compiler(),
    );
}

/// Most threads of the test below, and the work of the busiest one over its share: what the caller's thread does alone, the
/// motion of the particles included, and units of work that do not divide evenly.
const THREADS: usize = 16;
const MOST_WORK: f64 = 1.25;

/// Instructions of each thread in a whole run in the box of edge 20 cut-offs.
fn of_threads(program: &Path, folder: &Path, evaluations: u32, threads: usize) -> Vec<f64> {
    let out = folder.join(format!("{evaluations}-{threads}"));
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--separate-threads=yes"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(program)
        .args(["mdpd", "mixed", "avx2", &evaluations.to_string(), "0", "48400", &threads.to_string()])
        .output()
        .expect("valgrind starts");
    assert!(output.status.success(), "{}", said(&output));
    let count = |number: usize| {
        let text =
            std::fs::read_to_string(format!("{}-{number:02}", out.display())).expect("a thread's counts");
        let totals = text.lines().find_map(|line| line.strip_prefix("totals:")).expect("their sum");
        totals.trim().parse().expect("a number")
    };
    (1..=threads).map(count).collect()
}

/// Valgrind runs one thread at a time, on any machine: the counts are what each would do on a core of its own.
#[test]
fn threads_have_equal_parts_of_the_work() {
    let (program, folder) = (engine().instructions, tempfile::tempdir().expect("a folder"));
    let work = |threads: usize| -> Vec<f64> {
        let [few, many] = [1, 2].map(|evaluations| of_threads(&program, folder.path(), evaluations, threads));
        few.iter().zip(many).map(|(few, many)| many - few).collect()
    };
    let alone = work(1)[0];
    let together = work(THREADS);
    let (all, most) = (together.iter().sum::<f64>(), together.iter().copied().fold(0.0, f64::max));
    let share = alone / THREADS as f64;
    println!(
        "{:.3} of the work of one thread; the busiest has {:.3} of its share",
        all / alone,
        most / share
    );
    assert!(all < 1.05 * alone, "{all} instructions instead of {alone}");
    assert!(most < MOST_WORK * share, "the busiest of {THREADS} has {most} instead of {share}");
}
