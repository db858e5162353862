//! Long runs on the command line: killed, interrupted, on a full disk, and resumed.

use psidpd::run::checkpoint::read_state;
use psidpd_tests::{program, psidpd, root, said};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rustix::process::{Pid, Signal, kill_process};
use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// A scene with a frozen floor, a body force, a ramp, observables, and every kind of output.
/// Of more than 1000 particles, so that frames are written beside the steps, on machines with two processors or more.
fn scene() -> String {
    let model = root().join("validation/models/warren2003-set6.toml");
    format!(
        "title = \"small\"\nmodel = \"{}\"\nkT = 1.0\nseed = 3\n[box]\nlengths = [4.0, 4.0, 12.0]\n\
         [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 0.6\ndensity = 6.05\nlattice = \"fcc\"\nfrozen = true\n\
         [[part]]\nshape = \"rest\"\ndensity = 6.05\nlattice = \"sc\"\n\
         [[body_force]]\nacceleration = [0.05, 0.0, 0.0]\n\
         [[stage]]\nname = \"warm\"\nsteps = 400\ndt = 0.01\nkT = [1.5, 1.0]\nlevels = 4\nintegrator = \"groot-warren\"\n\
         [[stage]]\nname = \"run\"\nsteps = 1100\ndt = 0.01\n\
         [output]\nthermo = 5\ndump = 25\nxyz = 50\nsnapshot = 300\ncheckpoint = 100\n\
         [observe]\nrdf = {{ stages = [\"warm\", \"run\"] }}\ntemperature = true\nvelocity_profile = true\n\
         msd = {{ length = 20 }}\n",
        model.display()
    )
}

/// A folder with the scene.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), scene()).unwrap();
    folder
}

fn run(folder: &Path, out: &str, more: &[&str]) -> Output {
    psidpd(folder, &[&["run", "s.toml", "--out", out], more].concat())
}

fn start(folder: &Path, scene: &str, out: &str, more: &[&str]) -> Child {
    Command::new(program())
        .args([&["run", scene, "--out", out], more].concat())
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

/// Waits until a file has `length` bytes, or the program has ended.
fn wait_for(child: &mut Child, file: &Path, length: u64) {
    let begin = Instant::now();
    while file.metadata().map_or(0, |m| m.len()) < length && child.try_wait().unwrap().is_none() {
        assert!(begin.elapsed() < Duration::from_secs(120), "{} does not grow", file.display());
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Every file of a run and of its subfolders, except the one with wall times.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            files.extend(contents(&path).into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else if name != "timing.json" {
            files.insert(name, std::fs::read(&path).unwrap());
        }
    }
    files
}

fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{name} differs");
    }
}

fn finished(output: &Output) -> String {
    let words = said(output);
    assert_eq!(output.status.code(), Some(0), "{words}");
    words
}

/// The run without interruption, made once.
fn whole() -> &'static Path {
    static WHOLE: OnceLock<PathBuf> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("whole-run");
        finished(&run(folder().path(), out.to_str().unwrap(), &["--overwrite"]));
        let files = contents(&out);
        for name in ["observables.json", "observables/rdf-warm.csv", "observables/velocity_profile.csv"] {
            assert!(files.contains_key(name), "{:?}", files.keys());
        }
        assert_eq!(files.keys().filter(|name| name.starts_with("snapshots/")).count(), 6);
        out
    })
}

/// Interrupts a run, and returns its folder and output.
fn interrupted(folder: &Path, out: &str, signal: Signal) -> (PathBuf, Output) {
    // The seed equals that of the scene.
    let mut child = start(folder, "s.toml", out, &["--threads", "2", "--set", "seed=3"]);
    let path = folder.join(out);
    wait_for(&mut child, &path.join("thermo.csv"), 10_000);
    send(&child, signal);
    (path, child.wait_with_output().unwrap())
}

#[test]
fn a_run_killed_ten_times_ends_in_the_same_bytes() {
    let folder = folder();
    let here = folder.path();
    let whole = whole();
    // Checkpoints are so frequent that many kills fall into the writing of one.
    std::fs::write(here.join("s.toml"), scene().replace("checkpoint = 100", "checkpoint = 10")).unwrap();
    let length = whole.join("thermo.csv").metadata().unwrap().len() as f64;
    let mut random = StdRng::seed_from_u64(20);
    let mut moments: Vec<f64> = (0..10).map(|_| random.random_range(0.0..0.8)).collect();
    moments.sort_by(f64::total_cmp);
    let out = here.join("killed");
    let mut killed = 0;
    for (k, moment) in moments.into_iter().enumerate() {
        let threads = if k % 2 == 0 { "1" } else { "2" };
        let mut child = start(here, "s.toml", "killed", &["--resume", "--threads", threads]);
        wait_for(&mut child, &out.join("thermo.csv"), (moment * length) as u64);
        // The kill falls between rows, within a checkpoint, or before the first step.
        std::thread::sleep(Duration::from_micros(random.random_range(0..8000)));
        child.kill().unwrap();
        let output = child.wait_with_output().unwrap();
        killed += u32::from(output.status.signal() == Some(9));
    }
    // On a busy machine some kills may come after the end of the run.
    assert!(killed >= 8, "{killed} of 10 killed");
    let words = finished(&run(here, "killed", &["--resume"]));
    assert!(words.contains("going on after step "), "{words}");
    assert_same(whole, &out);
    let words = finished(&run(here, "killed", &["--resume"]));
    assert!(words.contains("is finished: nothing is left to do"), "{words}");
    assert_same(whole, &out);
}

#[test]
fn signals_stop_a_run_that_says_how_to_go_on() {
    let folder = folder();
    let here = folder.path();
    let whole = whole();
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let name = format!("by {code}");
        let (out, output) = interrupted(here, &name, signal);
        let words = said(&output);
        assert_eq!(output.status.code(), Some(code), "{words}");
        let last = words.lines().last().unwrap();
        let (what, how) = last.split_once("; to go on: ").unwrap_or_else(|| panic!("{words}"));
        assert!(what.starts_with("stopped after step ") && what.ends_with(" of 1500"), "{what}");
        assert!(how.contains("--resume --threads 2 --set seed=3"), "{how}");
        // Without --resume the run is left unchanged.
        let again = run(here, &name, &[]);
        let words = said(&again);
        assert_eq!(again.status.code(), Some(2), "{words}");
        assert!(words.contains("not finished") && words.contains("--overwrite"), "{words}");
        let shell = how.replacen("psidpd", &format!("'{}'", program().display()), 1);
        let output = Command::new("sh").args(["-c", &shell]).current_dir(here).output().unwrap();
        let words = finished(&output);
        let step = what.split(' ').nth(3).unwrap();
        assert!(words.contains(&format!("going on after step {step} of 1500")), "{words}");
        assert_same(whole, &out);
    }
    let out = interrupted(here, "over", Signal::INT).0;
    finished(&run(here, "over", &["--overwrite"]));
    assert_same(whole, &out);
}

/// The signals are sent while the program is stopped, so that both arrive before any step ends.
#[test]
fn a_second_signal_kills() {
    let folder = folder();
    let mut child = start(folder.path(), "s.toml", "out", &[]);
    wait_for(&mut child, &folder.path().join("out/thermo.csv"), 10_000);
    for signal in [Signal::STOP, Signal::INT, Signal::TERM, Signal::CONT] {
        send(&child, signal);
    }
    let output = child.wait_with_output().unwrap();
    assert!(matches!(output.status.signal(), Some(2 | 15)), "{:?}\n{}", output.status, said(&output));
    finished(&run(folder.path(), "out", &["--resume"]));
}

#[test]
fn a_truncated_checkpoint_falls_back_to_the_one_before() {
    let folder = folder();
    let here = folder.path();
    let whole = whole();
    let out = interrupted(here, "cut", Signal::INT).0;
    let newest = std::fs::File::options().write(true).open(out.join("checkpoint")).unwrap();
    newest.set_len(1000).unwrap();
    let words = finished(&run(here, "cut", &["--resume"]));
    assert!(words.contains("checkpoint is truncated: 1000 bytes of "), "{words}");
    assert!(words.contains("going on from the previous checkpoint"), "{words}");
    assert_same(whole, &out);
    // With both checkpoints damaged no file changes.
    let out = interrupted(here, "both", Signal::INT).0;
    for name in ["checkpoint", "checkpoint.old"] {
        std::fs::File::options().write(true).open(out.join(name)).unwrap().set_len(1000).unwrap();
    }
    let before = contents(&out);
    let output = run(here, "both", &["--resume"]);
    let words = said(&output);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("truncated") && words.contains("--overwrite"), "{words}");
    assert!(contents(&out) == before);
}

#[test]
fn foreign_checkpoints_are_refused_with_what_differs() {
    let folder = folder();
    let here = folder.path();
    let out = interrupted(here, "out", Signal::INT).0;
    let before = contents(&out);
    let model = root().join("validation/models/warren2003-set6.toml");
    let other = std::fs::read_to_string(&model).unwrap();
    assert!(other.contains("gamma"));
    std::fs::write(here.join("other.toml"), other.replace("gamma = 18.0", "gamma = 17.0")).unwrap();
    let elsewhere = scene().replace(&model.display().to_string(), "other.toml");
    for (scene, differs) in [
        (scene().replace("kT = 1.0", "kT = 1.1"), "kT is 1.1, was 1"),
        (
            scene().replace("steps = 1100", "steps = 1000"),
            "has 1100 steps in its last stage, more than the 1000",
        ),
        (elsewhere, "the model's thermostat[1].gamma is 17, was 18"),
    ] {
        std::fs::write(here.join("s.toml"), scene).unwrap();
        let output = run(here, "out", &["--resume"]);
        let words = said(&output);
        assert_eq!(output.status.code(), Some(2), "{words}");
        // The message may be wrapped into lines.
        let flat = words.split_whitespace().filter(|w| *w != "│").collect::<Vec<_>>().join(" ");
        assert!(flat.contains(differs), "{differs} is not in\n{words}");
        assert!(contents(&out) == before);
    }
}

/// Limits the size of files to `blocks` of 512 bytes by the shell, which acts like a full disk.
fn limited(folder: &Path, scene: &str, out: &str, blocks: u32) -> Output {
    let command = format!("ulimit -f {blocks}; exec \"$@\"");
    Command::new("sh")
        .args(["-c", &command, "sh"])
        .arg(program())
        .args(["run", scene, "--out", out, "--resume"])
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn a_full_disk_leaves_the_last_good_state() {
    let folder = folder();
    let here = folder.path();
    let whole = whole();
    let out = here.join("full");
    // The limit has room for checkpoints, but not for the dump.
    let output = limited(here, "s.toml", "full", 2000);
    let words = said(&output);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("dump.lammpstrj cannot be written"), "{words}");
    assert!(words.contains("--resume"), "{words}");
    assert_eq!(read_state(&out).unwrap().len(), read_state(whole).unwrap().len());
    let words = finished(&run(here, "full", &["--resume"]));
    assert!(words.contains("going on after step "), "{words}");
    assert_same(whole, &out);
    // The limit has no room for a single checkpoint, which is found before the first step.
    let slim = scene().replace("dump = 25\nxyz = 50\nsnapshot = 300\n", "");
    assert!(slim != scene());
    std::fs::write(here.join("slim.toml"), slim).unwrap();
    let output = limited(here, "slim.toml", "none", 10);
    let words = said(&output);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("checkpoint cannot be written"), "{words}");
    assert!(words.contains("after step 0") && words.contains("no checkpoint yet"), "{words}");
    assert!(!here.join("none/checkpoint.new").exists());
    // A later checkpoint exceeds the limit; the earlier one stays valid.
    let out = interrupted(here, "later", Signal::INT).0;
    let before = std::fs::read(out.join("checkpoint")).unwrap();
    let output = limited(here, "s.toml", "later", 10);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(std::fs::read(out.join("checkpoint")).unwrap() == before);
    finished(&run(here, "later", &["--resume"]));
    assert_same(whole, &out);
}

/// Whether a run holds a file of its folder open that has no name yet: a checkpoint that it writes.
fn has_unnamed_file(child: &Child, out: &Path) -> bool {
    let files = std::fs::read_dir(format!("/proc/{}/fd", child.id())).into_iter().flatten().flatten();
    let mut targets = files.filter_map(|file| std::fs::read_link(file.path()).ok());
    targets.any(|path| path.starts_with(out) && path.to_string_lossy().ends_with("(deleted)"))
}

/// Kills a run three hundred times. It writes a checkpoint every step, so that many kills fall into the
/// writing of one. `CONTRIBUTING.md` says when to run it.
#[test]
#[ignore = "a stress test of half a minute: cargo test --release -p psidpd-tests --test resume -- --ignored"]
fn a_run_killed_hundreds_of_times_ends_in_the_same_bytes() {
    const KILLS: u32 = 300;
    let folder = folder();
    let here = folder.path();
    let whole = whole();
    std::fs::write(here.join("s.toml"), scene().replace("checkpoint = 100", "checkpoint = 1")).unwrap();
    let out = here.join("killed");
    let step_of = |out: &Path| {
        let text = std::fs::read_to_string(out.join("timing.json")).unwrap_or_default();
        text.rsplit("\"to_step\": ")
            .next()
            .and_then(|t| t.split(',').next()?.parse::<u64>().ok())
            .unwrap_or(0)
    };
    let mut random = StdRng::seed_from_u64(21);
    let (mut killed, mut within, mut runs, mut furthest) = (0, 0, 0, 0);
    while killed < KILLS {
        // The run ended before its three hundred kills and starts again.
        if out.join("summary.json").exists() {
            assert_same(whole, &out);
            std::fs::remove_dir_all(&out).unwrap();
            (runs, furthest) = (runs + 1, 0);
        }
        let threads = if killed % 2 == 0 { "1" } else { "2" };
        let mut child = start(here, "s.toml", "killed", &["--resume", "--threads", threads]);
        // The time counts from the continuation of the run, because no file changes before.
        let begin = Instant::now();
        while step_of(&out) <= furthest && begin.elapsed() < Duration::from_secs(60) {
            if child.try_wait().unwrap().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_micros(random.random_range(0..30_000)));
        send(&child, Signal::STOP);
        let writing = has_unnamed_file(&child, &out);
        child.kill().unwrap();
        let output = child.wait_with_output().unwrap();
        if output.status.signal() == Some(9) {
            killed += 1;
            within += u32::from(writing);
        } else {
            finished(&output);
        }
        let step = step_of(&out);
        assert!(step >= furthest, "step {step} after {furthest}");
        furthest = step;
    }
    println!(
        "{killed} kills, {within} of them while a checkpoint was written, over {runs} runs and part of another"
    );
    assert!(within >= KILLS / 20, "{within}");
    finished(&run(here, "killed", &["--resume"]));
    assert_same(whole, &out);
}

/// A file system in memory with a size in kilobytes; only root can mount one.
struct Disk(PathBuf);

impl Disk {
    fn mount(path: PathBuf, options: &str) -> Disk {
        std::fs::create_dir_all(&path).unwrap();
        let output =
            Command::new("mount").args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&path).output().unwrap();
        assert!(output.status.success(), "this test must be run as root: {}", said(&output));
        Disk(path)
    }

    fn grow(&self, options: &str) {
        let options = format!("remount,{options}");
        let output = Command::new("mount").args(["-o", &options]).arg(&self.0).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// Disks fill up at different moments of a run: in tables, dumps, pictures, checkpoints, at the end. Each
/// time the run stops with the name of a file, and continues when there is room.
#[test]
#[ignore = "needs root, to mount disks: cargo test --release -p psidpd-tests --test resume -- --ignored"]
fn disks_of_any_size_leave_a_run_that_can_go_on() {
    let folder = folder();
    let here = folder.path();
    let whole = whole();
    let all: u64 = contents(whole).values().map(|bytes| bytes.len() as u64).sum();
    let mut random = StdRng::seed_from_u64(22);
    let (mut stopped, mut named) = (0, BTreeMap::new());
    for k in 0..20 {
        let kilobytes = random.random_range(16..all / 1024 + 200);
        let disk = Disk::mount(here.join(format!("disk {k}")), &format!("size={kilobytes}k"));
        let out = disk.0.join("out");
        let output = run(here, out.to_str().unwrap(), &["--resume"]);
        let words = said(&output);
        if output.status.code() != Some(0) {
            stopped += 1;
            assert_eq!(output.status.code(), Some(1), "{kilobytes} kB: {words}");
            let cause = words.split(": No space left").next().filter(|cause| cause.len() < words.len());
            let file = cause.unwrap_or_else(|| panic!("{words}")).trim_end_matches(" cannot be written");
            let name = file.rsplit('/').next().unwrap();
            *named.entry(name.to_owned()).or_insert(0) += 1;
            disk.grow(&format!("size={}k", 4 * all / 1024 + 1000));
            finished(&run(here, out.to_str().unwrap(), &["--resume"]));
        }
        assert_same(whole, &out);
    }
    println!("{stopped} of 20 disks became full, in {named:?}");
    assert!(stopped >= 8 && named.len() >= 2, "{stopped} {named:?}");
}
