//! Malicious or damaged files and arguments end soon with a message, and change no file.

mod memory;

use psidpd_tests::{program, psidpd, said};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const SOFT: &str = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = 25\n\
                    range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).unwrap();
}

/// The output of the program on one line, and its exit code.
fn words(output: &Output) -> (String, Option<i32>) {
    let text = said(output).replace(['│', '×'], " ");
    (text.split_whitespace().collect::<Vec<_>>().join(" "), output.status.code())
}

/// Results follow links and go into pipes; only files are replaced by files.
#[test]
fn json_is_written_through_what_is_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    std::fs::create_dir(here.join("inner")).unwrap();
    symlink("inner/real.json", here.join("link.json")).unwrap();
    for _ in 0..2 {
        let output = psidpd(here, &["check", "m.toml", "--json", "link.json"]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(here.join("link.json").is_symlink());
        let text = std::fs::read_to_string(here.join("inner/real.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap();
    }
    // With a pipe, or a file as standard output, earlier output is kept.
    let output = psidpd(here, &["check", "m.toml", "--json", "/dev/stdout"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let all = std::fs::File::create(here.join("all.txt")).unwrap();
    let status = Command::new(program())
        .args(["check", "m.toml", "--json", "/dev/stdout"])
        .current_dir(here)
        .stdout(all)
        .status()
        .unwrap();
    assert!(status.success());
    for text in [said(&output), std::fs::read_to_string(here.join("all.txt")).unwrap()] {
        assert!(text.starts_with("psidpd") || text.contains("kT"), "{text}");
        let json = &text[text.find("\n{").expect(&text)..];
        serde_json::from_str::<serde_json::Value>(json).unwrap();
    }
    psidpd(here, &["check", "m.toml", "--json", "/dev/null"]);
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
}

/// Opening a pipe without a writer would block.
#[test]
fn pipes_are_no_input() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    mknodat(CWD, here.join("pipe"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
    for arguments in [
        &["check", "pipe"][..],
        &["theory", "pipe"],
        &["run", "pipe", "--out", "out"],
        &["forces", "--model", "m.toml", "--data", "pipe", "--kT", "1"],
        &["snapshot", "pipe", "--out", "a.svg"],
        &["lammps", "convert", "pipe"],
    ] {
        let mut child = Command::new(program())
            .args(arguments)
            .current_dir(here)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if begun.elapsed() > Duration::from_secs(60) {
                child.kill().unwrap();
                panic!("{arguments:?} waits");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let (text, code) = words(&child.wait_with_output().unwrap());
        assert_eq!(code, Some(2), "{arguments:?}: {text}");
        assert!(text.contains("not a regular file"), "{arguments:?}: {text}");
    }
}

#[test]
fn more_than_a_machine_has_is_refused_with_a_number() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = |range: &str| {
        write(here, "m.toml", &SOFT.replace("range = 1\n[[thermo", &format!("range = {range}\n[[thermo")));
        let text =
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nbox = [4.0, 4.0, 4.0]\ndensity = 3.0\nsteps = 1\n";
        write(here, "s.toml", text);
    };
    scene("1");
    let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "o", "--threads", "20000"]));
    assert!(code == Some(2) && text.contains("from 1 to 1024"), "{text}");
    // Threads that would have to take turns on the processors are not made.
    let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "few", "--threads", "1000"]));
    let processors = std::thread::available_parallelism().unwrap().get();
    assert!(code == Some(0) && text.contains("1000 threads are more than the processors"), "{text}");
    assert!(text.contains(&format!(": using {processors}, with the same results")), "{text}");
    for (range, times) in [("20", "5.0 times"), ("1e6", "250000.0 times")] {
        scene(range);
        let begun = Instant::now();
        let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "o"]));
        assert!(code == Some(2) && text.contains(times) && text.contains("GB"), "{text}");
        let (text, code) = words(&psidpd(here, &["check", "s.toml"]));
        assert!(code == Some(1) && text.contains(times), "{text}");
        assert!(begun.elapsed() < Duration::from_secs(60));
    }
    scene("1");
    let box_of = |edge: &str| format!("0 {edge} xlo xhi\n0 {edge} ylo yhi\n0 {edge} zlo zhi\n");
    let data = format!("t\n\n1 atoms\n1 atom types\n{}\nAtoms # atomic\n\n1 1 0 0 0\n", box_of("0.001"));
    write(here, "d.data", &data);
    for arguments in [
        &["forces", "--model", "m.toml", "--data", "d.data", "--kT", "1"][..],
        &["snapshot", "d.data", "--density", "--range", "1", "--out", "a.svg"],
        &["snapshot", "d.data", "--colour", "density", "--range", "1", "--out", "a.svg"],
        &["snapshot", "d.data", "--colour", "psi", "--model", "m.toml", "--kT", "1", "--out", "a.svg"],
    ] {
        let (text, code) = words(&psidpd(here, arguments));
        assert!(code == Some(2) && text.contains("1000.0 times"), "{arguments:?}: {text}");
    }
}

/// 64 species, each with a product of 64 factors.
#[test]
fn many_species_are_looked_at_in_a_moment() {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = (0..64).map(|k| format!("S{k}")).collect();
    let list = |before: &str, after: &str, by: &str| {
        names.iter().map(|n| format!("{before}{n}{after}")).collect::<Vec<_>>().join(by)
    };
    for psi in [list("(1 + n_", ")", "*"), "0.5*n^2".to_owned()] {
        let text = format!(
            "title = \"many\"\nspecies = [{}]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\n{}\n",
            list("\"", "\"", ", "),
            list("", &format!(" = \"{psi}\""), "\n")
        );
        write(folder.path(), "m.toml", &text);
        // Seconds of the processor, not of a clock.
        let mut limited = Command::new("sh");
        limited.args(["-c", "ulimit -t 60 && exec \"$0\" check m.toml"]).arg(program());
        let output = limited.current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    }
}

/// Mixtures at temperatures and densities where no phase has the pressure: each took half a minute or more.
#[test]
fn theory_of_extreme_mixtures_ends_in_a_moment() {
    let folder = tempfile::tempdir().unwrap();
    for (name, state) in [
        ("huggins", "--kT 0.001"),
        ("huggins-demixing", "--density 1e-9"),
        ("binary-2d", "--density 1e-9"),
        ("binary-2d", "--density 1e6"),
    ] {
        let model = psidpd_tests::root().join(format!("validation/models/{name}.toml"));
        let mut limited = Command::new("sh");
        limited.args(["-c", &format!("ulimit -t 10 && exec \"$0\" theory \"$1\" {state}")]);
        let output = limited.arg(program()).arg(model).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{name} {state}: {}", said(&output));
    }
}

/// Control characters in a file are shown, and do not reach the terminal.
#[test]
fn messages_are_plain_and_short() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let title = SOFT.replace("\"t\"", "\"a\\u001b[31mb\"");
    let raw = SOFT.replace("range = 1\n[[", "range = \u{1b}[31m\n[[");
    let key = SOFT.replace("range = 1\n[[", "range = 1\n\"\\u001b[31mx\" = 2\n[[");
    let long = SOFT.replace("\"t\"", &format!("\"t\"\n\"{}\" = 1", "x".repeat(2_000_000)));
    for (text, message) in [
        (&title, "control character"),
        (&raw, "not valid TOML"),
        (&key, "unknown key"),
        (&long, "unknown key"),
    ] {
        write(here, "m.toml", text);
        for verb in ["check", "theory"] {
            let output = psidpd(here, &[verb, "m.toml"]);
            assert_eq!(output.status.code(), Some(2), "{}", said(&output));
            let bare = said(&output);
            assert!(bare.len() < 10_000, "{} bytes", bare.len());
            let (text, _) = words(&output);
            assert!(text.contains(message), "{text}");
            assert!(!bare.contains("\u{1b}[31m"), "{bare:?}");
        }
    }
}

/// A model may come from anywhere: it can name tables in its own folder only, unless the user allows more,
/// and errors do not show the contents of other files.
#[test]
fn tables_stay_in_the_folder_of_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("inner");
    std::fs::create_dir(&here).unwrap();
    write(folder.path(), "outside.csv", "n, psi\n0, 0\n1, secret\n");
    symlink("../outside.csv", here.join("link.csv")).unwrap();
    write(&here, "inside.csv", "n, psi\n0, 0\n1, secret\n");
    let outside = folder.path().join("outside.csv");
    for (table, anywhere, message) in [
        ("../outside.csv", false, "outside the folder"),
        (outside.to_str().unwrap(), false, "outside the folder"),
        ("link.csv", false, "outside the folder"),
        ("../outside.csv", true, "field 2 is not a finite number"),
        ("inside.csv", false, "field 2 is not a finite number"),
    ] {
        let text = format!(
            "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\n\
             F = {{ table = \"{table}\" }}\n"
        );
        write(&here, "m.toml", &text);
        let mut check = Command::new(program());
        check.args(["check", "m.toml"]).current_dir(&here).env_remove("PSIDPD_TABLES_ANYWHERE");
        if anywhere {
            check.env("PSIDPD_TABLES_ANYWHERE", "1");
        }
        let (text, code) = words(&check.output().unwrap());
        assert!(code == Some(2) && text.contains(message) && !text.contains("secret"), "{table}: {text}");
    }
}

const SCENE: &str =
    "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nbox = [4.0, 4.0, 4.0]\ndensity = 3.0\nsteps = 20\n";

/// A folder with a model, a many-body model, a scene and a finished run of it in `o`.
fn with_a_run() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    std::fs::copy(psidpd_tests::root().join("validation/models/warren2003-set6.toml"), here.join("w.toml"))
        .unwrap();
    write(here, "s.toml", SCENE);
    let output = psidpd(here, &["run", "s.toml", "--out", "o"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    folder
}

fn split(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

/// The verbs that `psidpd --help` lists.
fn verbs() -> Vec<String> {
    let help = said(&psidpd(Path::new("."), &["--help"]));
    let list = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    let lines = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    lines
        .filter_map(|line| line.split_whitespace().next())
        .filter(|verb| *verb != "help")
        .map(str::to_owned)
        .collect()
}

/// Failing to write to standard output is an error. The source of slow verbs shows that they print in the same way.
#[test]
fn a_full_standard_output_is_an_error_of_every_verb() {
    let folder = with_a_run();
    let lines = [
        "check m.toml",
        "theory w.toml",
        "reproduce --list",
        "new x",
        "run s.toml --out again",
        "run s.toml --out o --resume",
        "sweep s.toml --over kT=1:1.1:2 --out sweep",
        "report o",
        "snapshot o/final.data",
        "forces --model m.toml --data o/final.data --kT 1",
        "export eam w.toml --spacing 0.01",
        "export lammps s.toml --out deck",
        "completions bash",
        "man --out man",
        "calibrate w.toml --density 6:7 --points 2 --particles 200 --steps 100 --equilibrate 10 --tolerance 9 --out c.toml",
        "--help",
        "run --help",
        "--version",
    ];
    write(folder.path(), "in.old", "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\n");
    for line in lines.into_iter().chain(["lammps convert in.old"]) {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut program = Command::new(program());
        let program =
            program.args(split(line)).current_dir(folder.path()).stdout(full).stderr(Stdio::piped());
        let (text, code) = words(&program.output().unwrap());
        assert_eq!(code, Some(1), "{line}: {text}");
        assert!(
            text.contains("standard output cannot be written") && !text.contains("panicked"),
            "{line}: {text}"
        );
    }
    // The other verbs take minutes, or need LAMMPS or a feature.
    let long = ["validate", "bench", "pareto", "hardcases", "model", "devices"];
    for verb in verbs() {
        let tried = lines.iter().any(|line| line.split(' ').next() == Some(&verb)) || verb == "lammps";
        assert!(tried != long.contains(&verb.as_str()), "{verb}");
        let folder = psidpd_tests::root().join("validation/src/cli");
        let sources = match verb.as_str() {
            "completions" | "man" => vec![folder.join("shell.rs")],
            verb if folder.join(verb).is_dir() => {
                folder.join(verb).read_dir().unwrap().map(|entry| entry.unwrap().path()).collect()
            }
            verb => vec![folder.join(format!("{verb}.rs"))],
        };
        for source in sources {
            let text = std::fs::read_to_string(&source).unwrap().replace("eprintln!(", "");
            assert!(!text.contains("println!(") && !text.contains("print!("), "{}", source.display());
        }
    }
}

/// Lines that nobody can read stop no verb.
#[test]
fn a_full_standard_error_stops_nothing() {
    let folder = with_a_run();
    write(folder.path(), "in.old", "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\n");
    for (line, expected) in [
        ("lammps convert in.old --out in.new", 0),
        ("run s.toml --out o --threads 1000 --resume", 0),
        ("check m.toml", 0),
        ("check nowhere.toml", 2),
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut program = Command::new(program());
        let output = program.args(split(line)).current_dir(folder.path()).stderr(full).output().unwrap();
        assert_eq!(output.status.code(), Some(expected), "{line}: {}", said(&output));
    }
}

/// Every error about a file names it: a damaged, empty or missing file, or a folder.
#[test]
fn errors_of_every_verb_name_the_file() {
    let folder = with_a_run();
    let here = folder.path();
    let reads = [
        "check F",
        "theory F",
        "calibrate F --out c.toml --density 5:6",
        "run F --out out",
        "sweep F --over kT=1:2:2 --out out",
        "report F",
        "snapshot F",
        "forces --model F --data o/final.data --kT 1",
        "forces --model m.toml --data F --kT 1",
        "export eam F",
        "export lammps F --out out",
        "pareto F",
        "lammps plugin --lammps F",
        "bench --lammps F --out out",
        "model liquid w --data F --rc 1e-9 --temperature 300 --out x.toml",
        "model mixture m.toml F --tension 5 --out x.toml",
        "model wall F --contact-angle 60 --out x.toml",
    ];
    for (name, text) in
        [("broken", Some("x = [[[\n\"")), ("empty", Some("")), ("missing", None), ("folder", None)]
    {
        if name == "folder" {
            std::fs::create_dir(here.join(name)).unwrap();
        }
        if let Some(text) = text {
            write(here, name, text);
        }
        for line in reads {
            let line = line.replace('F', name);
            let (text, code) = words(&psidpd(here, &split(&line)));
            assert!(code == Some(2) && text.contains(name), "{line}: {code:?}: {text}");
        }
    }
    for line in [
        "lammps convert missing",
        "lammps convert folder",
        "check m.toml --json folder",
        "theory w.toml --report folder",
        "snapshot o/final.data --out folder/no/a.svg",
        "export eam w.toml --spacing 0.01 --out folder",
        "export lammps s.toml --out broken",
        "run s.toml --out broken",
        "man --out broken",
        "new broken/x",
    ] {
        let (text, code) = words(&psidpd(here, &split(line)));
        let name = if line.contains("folder") {
            "folder"
        } else if line.contains("missing") {
            "missing"
        } else {
            "broken"
        };
        assert!(code == Some(2) && text.contains(name), "{line}: {code:?}: {text}");
    }
    // Invalid settings give an error without a sentence about files, and invalid data names its line.
    write(here, "narrow.toml", &SCENE.replace("4.0, 4.0, 4.0", "1.5, 4.0, 4.0"));
    let data = "t\n\n1 atoms\n3 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms # atomic\n\n7 3 0 0 0\n";
    write(here, "types.data", data);
    for (line, names) in [
        ("run narrow.toml --out out", &["narrow.toml"][..]),
        ("forces --model m.toml --data types.data --kT 1", &["types.data, line 12", "type 3"]),
        ("export eam w.toml --spacing 1e-9", &["w.toml", "2.000e9 numbers"]),
        ("export eam w.toml --densities 1000000000000", &["w.toml", "1.000e12 numbers"]),
        ("calibrate w.toml --density 5:6 --out c.toml --threads 100000", &["from 1 to 1024"]),
        ("model liquid w --density 0.997 --rc 1e-9 --out x.toml", &["density = 0.997", "SI units"]),
        ("model liquid w --density 997 --molecules 3 --out x.toml", &["molar_mass"]),
        ("model mixture w.toml w.toml --tension 5 --out x.toml", &["both liquids are called w", "--species"]),
        ("model mixture w.toml w.toml --species a --tension 5 --out x.toml", &["2 values"]),
        ("model mixture w.toml w.toml --species a-b c --tension 5 --out x.toml", &["a-b", "letters, digits"]),
        ("model mixture w.toml m.toml --tension -5 --out x.toml", &["above 0"]),
        ("model wall m.toml --contact-angle 190 --out x.toml", &["160 degrees"]),
        ("model wall m.toml --contact-angle 60 --density -1 --out x.toml", &["above 0"]),
        ("reproduce --threads 100000", &["from 1 to 1024"]),
        ("bench --threads 100000", &["from 1 to 1024"]),
        ("pareto s.toml --threads 0", &["from 1 to 1024"]),
        ("sweep s.toml --over kT=1:2:2 --out out --threads 100000", &["from 1 to 1024"]),
    ] {
        let (text, code) = words(&psidpd(here, &split(line)));
        assert!(code == Some(2) && names.iter().all(|name| text.contains(name)), "{line}: {code:?}: {text}");
    }
}

/// A drag whose forces overflow stops every integrator, with the step and the reason.
#[test]
fn a_drag_beyond_numbers_stops_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", &SOFT.replace("gamma = 4.5", "gamma = 1e150"));
    for integrator in
        ["velocity-verlet", "aboba", "baoab", "two-stage", "force-gradient", "shardlow-s1", "dpd-vv"]
    {
        write(here, "s.toml", &format!("{SCENE}integrator = \"{integrator}\"\n[output]\nthermo = 5\n"));
        let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", integrator]));
        assert_eq!(code, Some(1), "{integrator}: {text}");
        assert!(text.contains("stopped: step") && text.contains("is not finite"), "{integrator}: {text}");
        let thermo = std::fs::read_to_string(here.join(integrator).join("thermo.csv")).unwrap();
        assert!(!thermo.contains("NaN") && !thermo.contains("inf"), "{integrator}: {thermo}");
    }
}

/// A new run deletes the files of the old run, and no others.
#[test]
fn a_new_run_deletes_nothing_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    let observed = format!("{SCENE}[observe]\nevery = 2\ntemperature = true\n");
    write(here, "s.toml", &observed);
    assert_eq!(psidpd(here, &["run", "s.toml", "--out", "o"]).status.code(), Some(0));
    write(here, "o/observables/mine.csv", "mine");
    write(here, "o/mine.data", "mine");
    assert!(here.join("o/observables/temperature.csv").is_file());
    write(here, "s.toml", SCENE);
    let output = psidpd(here, &["run", "s.toml", "--out", "o", "--overwrite"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for name in ["o/observables/mine.csv", "o/mine.data"] {
        assert_eq!(std::fs::read_to_string(here.join(name)).unwrap(), "mine", "{name}");
    }
    assert!(!here.join("o/observables/temperature.csv").exists());
    // The input of a run is kept, under whatever name.
    for (kind, file) in [("data", "o/final.data"), ("checkpoint", "o/checkpoint"), ("checkpoint", "o")] {
        let initial = format!("[initial]\nkind = \"{kind}\"\nfile = \"{file}\"\n");
        write(
            here,
            "next.toml",
            &format!("title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nsteps = 5\n{initial}"),
        );
        let before = std::fs::read(here.join("o/checkpoint")).unwrap();
        let (text, code) = words(&psidpd(here, &["run", "next.toml", "--out", "o", "--overwrite"]));
        assert!(code == Some(2) && text.contains(file), "{file}: {text}");
        assert_eq!(std::fs::read(here.join("o/checkpoint")).unwrap(), before, "{file}");
        assert!(here.join("o/final.data").is_file());
    }
}

/// A run that has finished has not failed to start, even if a later file cannot be written.
#[test]
fn a_finished_run_stays_finished() {
    let folder = with_a_run();
    let here = folder.path();
    let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "p", "--json", "/dev/full"]));
    assert!(
        code == Some(1) && text.contains("the run in p is finished, but cannot write /dev/full"),
        "{text}"
    );
    // Neither the report nor the old checkpoint can be changed, as on a read-only disk.
    std::fs::create_dir(here.join("o/report.html")).unwrap();
    std::fs::create_dir(here.join("o/checkpoint.old")).unwrap();
    let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "o", "--resume", "--report"]));
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("is finished: nothing is left to do") && text.contains("warning: the run has no page"),
        "{text}"
    );
}

/// Names with escape sequences do not affect a terminal, and commands that cannot be shown are omitted.
#[test]
fn names_of_files_are_shown_without_escapes() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = with_a_run();
    let here = folder.path();
    let bad = "a\u{1b}[31mb";
    for arguments in [
        &["new", bad][..],
        &["run", "s.toml", "--out", bad],
        &["report", bad],
        &["man", "--out", bad],
        &["export", "eam", "w.toml", "--spacing", "0.01", "--out", bad],
        &["check", "no\u{1b}[31m.toml"],
        &["forces", "--model", "m.toml", "--data", "no\u{1b}[31m", "--kT", "1"],
    ] {
        let output = psidpd(here, arguments);
        assert!(
            !said(&output).contains("\u{1b}[31m") && said(&output).contains("?[31m"),
            "{arguments:?}: {}",
            said(&output)
        );
    }
    write(here, "long.toml", &SCENE.replace("steps = 20", "steps = 100000000"));
    for (out, tells) in [(OsStr::from_bytes(b"plain"), true), (OsStr::from_bytes(b"\xff"), false)] {
        let mut run = Command::new(program());
        run.args(["run", "long.toml", "--out"]).arg(out).current_dir(here).stdout(Stdio::piped());
        let child = run.spawn().unwrap();
        let begun = Instant::now();
        while !here.join(out).join("checkpoint").exists() {
            assert!(begun.elapsed() < Duration::from_secs(30));
            std::thread::sleep(Duration::from_millis(20));
        }
        rustix::process::kill_process(rustix::process::Pid::from_child(&child), rustix::process::Signal::INT)
            .unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        assert!(said(&output).contains("stopped after step"), "{}", said(&output));
        assert_eq!(
            said(&output).contains("to go on: psidpd run long.toml --out plain --resume"),
            tells,
            "{}",
            said(&output)
        );
    }
}

/// Outside a checkout no plugin can be built, and nothing is downloaded for it.
#[test]
fn a_bench_without_sources_installs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // By another process: a file that this one has open to write, and a child of another test too, cannot be started.
    assert!(Command::new("cp").args([program(), &here.join("psidpd")]).status().unwrap().success());
    for verb in ["bench", "validate", "lammps plugin"] {
        let mut command = Command::new(here.join("psidpd"));
        command.args(split(verb)).current_dir(here).env("PSIDPD_LAMMPS_DIR", here.join("lammps"));
        command.env_remove("PSIDPD_LAMMPS_VENV").env("PSIDPD_PYTHON", "/nowhere/python3");
        let (text, code) = words(&command.output().unwrap());
        assert!(code == Some(2) && text.contains("run from a checkout"), "{verb}: {text}");
        assert!(!here.join("lammps").exists(), "{verb}");
    }
}

/// Derived files go to the folder of the new script, and replace others on request only.
#[test]
fn a_converted_script_replaces_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::create_dir_all(here.join("work")).unwrap();
    std::fs::create_dir_all(here.join("d")).unwrap();
    let data = "t\n\n1 atoms\n1 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms # mdpd\n\n1 1 0 0 0 0\n";
    write(here, "d/mdpd.data", data);
    write(here, "d/mdpd.data.atomic", "mine");
    let script = "units lj\natom_style mdpd\nread_data ../d/mdpd.data\npair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\n";
    write(here, "work/in.old", script);
    let convert = |more: &[&str]| {
        words(&psidpd(here, &[&["lammps", "convert", "work/in.old", "--out", "new/in.new"], more].concat()))
    };
    std::fs::create_dir_all(here.join("new")).unwrap();
    let (text, code) = convert(&[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(std::fs::read_to_string(here.join("new/in.new")).unwrap().contains("mdpd.data.atomic\n"));
    assert!(!std::fs::read_to_string(here.join("new/in.new")).unwrap().contains("../d"));
    assert!(std::fs::read_to_string(here.join("new/mdpd.data.atomic")).unwrap().contains("1 1 0 0 0\n"));
    for name in ["new/in.new", "new/mdpd.data.atomic"] {
        write(here, name, "mine");
        let (text, code) = convert(&[]);
        assert!(code == Some(2) && text.contains("--overwrite"), "{text}");
        assert_eq!(std::fs::read_to_string(here.join(name)).unwrap(), "mine");
        let (text, code) = convert(&["--overwrite"]);
        assert_eq!(code, Some(0), "{text}");
        std::fs::remove_file(here.join("new/in.new")).unwrap();
    }
    assert_eq!(std::fs::read_to_string(here.join("d/mdpd.data.atomic")).unwrap(), "mine");
    // An atom line with too few columns gives an error with file and line.
    write(here, "d/mdpd.data", &data.replace("1 1 0 0 0 0", "1 1 0 0"));
    let (text, code) = convert(&["--overwrite"]);
    assert!(code == Some(2) && text.contains("mdpd.data: line 12"), "{text}");
}

/// A stand-in for Python: pip logs its start and its end with its process id, and takes a second; a child
/// process of it takes another second.
const SLOW_PIP: &str = r#"#!/bin/sh
[ "$1" = -c ] && exit 0
if [ "$2" = venv ]; then mkdir -p "$3/bin"; cp "$0" "$3/bin/python"; exit 0; fi
echo "begin $$" >> "$PSIDPD_LAMMPS_DIR/log"
exec 3<&0
sh -c 'sleep 2; echo "child $0" >> "$PSIDPD_LAMMPS_DIR/log"' $$ <&3 &
sleep 1
echo "end $$" >> "$PSIDPD_LAMMPS_DIR/log"
wait
exit 1
"#;

#[test]
fn pip_ends_with_an_installation_that_is_killed_before_the_next_begins() {
    let folder = tempfile::tempdir().unwrap();
    let python = folder.path().join("python");
    std::fs::write(&python, SLOW_PIP).unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    let install = || {
        let mut command = Command::new(program());
        command.args(["lammps", "install"]).env("PSIDPD_PYTHON", &python);
        command.env("PSIDPD_LAMMPS_DIR", folder.path()).stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let log = || std::fs::read_to_string(folder.path().join("log")).unwrap_or_default();
    let mut first = install();
    while !log().contains("begin") {
        std::thread::sleep(Duration::from_millis(5));
    }
    first.kill().unwrap();
    first.wait().unwrap();
    install().wait().unwrap();
    // The first pip ends at once; its child ends before the second pip begins.
    let log = log();
    let words: Vec<&str> = log.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(words, ["begin", "child", "begin", "end", "child"], "{log}");
}
