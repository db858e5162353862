//! A file that psidpd did not make is replaced with `--overwrite` alone, and an input never.

use psidpd_tests::{program, psidpd, said};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

const MODEL: &str = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = 25\n\
                     range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
/// Pictures of a narrow box are small and soon drawn.
const SCENE: &str = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nbox = [3.0, 3.0, 100.0]\ndensity = 0.12\nsteps = 10\n\
                     [output]\nthermo = 1\ndump = 5\nxyz = 5\ngsd = 5\nvtk = 5\nsnapshot = 5\n[observe]\nevery = 2\n\
                     temperature = true\nrdf = { range = 1.4, bins = 5 }\n";

fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

/// A folder with a scene `s.toml` and its model.
fn with_a_scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "m.toml", MODEL);
    write(folder.path(), "s.toml", SCENE);
    let many_body = psidpd_tests::root().join("validation/models/warren2003-set6.toml");
    std::fs::copy(many_body, folder.path().join("w.toml")).unwrap();
    folder
}

/// The exit code of a command line, and what the program says.
fn outcome(here: &Path, line: &str) -> (Option<i32>, String) {
    let output = psidpd(here, &line.split(' ').collect::<Vec<_>>());
    let text = said(&output).replace('│', " ");
    (output.status.code(), text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// All files below a folder with their content.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type().unwrap().is_dir() {
            let inner = content(&entry.path());
            all.extend(inner.into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            all.insert(name, std::fs::read(entry.path()).unwrap());
        }
    }
    all
}

/// Every name that a run makes, one at a time: with or without `--resume`, it stays.
#[test]
fn a_run_spares_what_it_did_not_make() {
    let folder = with_a_scene();
    let here = folder.path();
    assert_eq!(outcome(here, "run s.toml --out o --report").0, Some(0));
    let made = content(&here.join("o"));
    assert!(made.len() > 15, "{:?}", made.keys());
    let others = ["last-good.data", "observables/mine.csv", "snapshots/mine.txt"].map(str::to_owned);
    for (k, name) in made.keys().cloned().chain(others).enumerate() {
        let out = format!("u{k}");
        write(&here.join(&out), &name, "mine");
        write(&here.join(&out), "notes.txt", "mine");
        for more in ["", " --resume", " --report"] {
            let (code, text) = outcome(here, &format!("run s.toml --out {out}{more}"));
            assert!(code == Some(2) && text.contains("--overwrite"), "{name}{more}: {code:?} {text}");
            assert_eq!(content(&here.join(&out)).len(), 2, "{name}{more}");
            assert!(content(&here.join(&out)).values().all(|bytes| bytes == b"mine"), "{name}{more}");
        }
    }
    // What no run makes is no obstacle, and leave is leave.
    write(&here.join("free"), "notes.txt", "mine");
    assert_eq!(outcome(here, "run s.toml --out free").0, Some(0));
    let (code, text) = outcome(here, "run s.toml --out u3 --overwrite --report");
    assert_eq!(code, Some(0), "{text}");
    let new = content(&here.join("u3"));
    let same = |name: &&String| !["timing.json", "report.html"].contains(&name.as_str());
    assert!(made.keys().filter(same).all(|name| new[name] == made[name]));
    assert_eq!(new["notes.txt"], b"mine");
}

/// Without its checkpoint a finished run is no empty folder; killed before its first checkpoint, a run begins again.
#[test]
fn a_run_without_its_checkpoint_stays() {
    let folder = with_a_scene();
    let here = folder.path();
    assert_eq!(outcome(here, "run s.toml --out o").0, Some(0));
    std::fs::remove_file(here.join("o/checkpoint")).unwrap();
    let before = content(&here.join("o"));
    for more in ["", " --set kT=2", " --resume", " --resume --set kT=2"] {
        let (code, text) = outcome(here, &format!("run s.toml --out o{more}"));
        assert!(code == Some(2) && text.contains("--overwrite"), "{more}: {text}");
        assert_eq!(content(&here.join("o")), before, "{more}");
    }
    // As a kill between the first file and the first checkpoint leaves it.
    for name in ["summary.json", "final.data", "observables.json", "timing.json"] {
        std::fs::remove_file(here.join("o").join(name)).unwrap();
    }
    assert_eq!(outcome(here, "run s.toml --out o --resume --set kT=2").0, Some(2));
    assert_eq!(outcome(here, "run s.toml --out o").0, Some(2));
    let (code, text) = outcome(here, "run s.toml --out o --resume");
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(content(&here.join("o"))["final.data"], before["final.data"]);
}

/// Every verb that writes: what it would replace stays without `--overwrite`, and nothing else is made.
#[test]
fn every_verb_spares_what_it_did_not_make() {
    let folder = with_a_scene();
    let here = folder.path();
    assert_eq!(outcome(here, "run s.toml --out o").0, Some(0));
    std::fs::create_dir(here.join("full")).unwrap();
    write(here, "in.old", "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\ninclude more\n");
    write(here, "more", "pair_coeff 1 1 mdpd/rhosum 0.75\npair_coeff 1 1 mdpd -40 25 18 1.0 0.75\n");
    let quick = [
        ("check m.toml --json F", "results.json"),
        ("forces --model m.toml --data o/final.data --kT 1 --json F", "results.json"),
        ("run s.toml --out a --json F", "results.json"),
        ("theory w.toml --report F", "page.html"),
        ("export eam w.toml --spacing 0.01 --out F", "t.eam"),
        ("export eam w.toml --spacing 0.01", "w.eam.alloy"),
        ("export lammps s.toml --out F/..", "in.lammps"),
        ("export lammps s.toml --out F/..", "start.data"),
        ("export lammps s.toml --out F/..", "model.toml"),
        ("snapshot o/final.data --out F", "a.svg"),
        ("snapshot o/final.data --out F", "a.png"),
        ("snapshot o/dump.lammpstrj --out F", "a.gif"),
        ("report o", "o/report.html"),
        ("new F", "scene.toml"),
        ("new x", "standard-dpd.toml"),
        ("man --out F/..", "psidpd.1"),
        ("man --out F/..", "psidpd-run.1"),
        ("sweep s.toml --over kT=1:1.1:2 --out F/..", "sweep.csv"),
        ("sweep s.toml --over kT=1:1.1:2 --out F/..", "report.html"),
        ("lammps convert in.old --out F", "in.new"),
        ("lammps convert in.old --out in.new", "more.psi"),
    ];
    // With leave these take minutes, or need LAMMPS or a feature.
    let slow = [
        ("calibrate w.toml --out F", "c.toml"),
        ("model liquid water --density 997 --rc 1e-9 --temperature 298 --out F", "water.toml"),
        ("model mixture w.toml w.toml --species a b --tension 5 --out F", "both.toml"),
        ("model wall w.toml --contact-angle 60 --out F", "wall.toml"),
        ("pareto s.toml --out F/..", "pareto.json"),
        ("pareto s.toml --out F/..", "pareto.html"),
        ("bench --out F/..", "bench.json"),
        ("bench --out F/..", "report.html"),
        ("validate --out F/..", "results.json"),
        ("validate --out F/..", "report.html"),
    ];
    let mut seen = Vec::new();
    for (k, (line, file)) in quick.into_iter().chain(slow).enumerate() {
        seen.push(line.split(' ').next().unwrap().to_owned());
        // A name that the line states is that of a file in a folder of its own.
        let path = if line.contains('F') { format!("d{k}/{file}") } else { file.to_owned() };
        let line = line.replace("F/..", &format!("d{k}")).replace('F', &path);
        write(here, &path, "mine");
        let before = content(here);
        let (code, text) = outcome(here, &line);
        assert!(code == Some(2) && text.contains("--overwrite"), "{line}: {code:?} {text}");
        let after = content(here);
        assert!(before.iter().all(|(name, bytes)| after[name] == *bytes), "{line}");
        let harmless = |name: &&String| before.contains_key(*name) || name.starts_with("a/");
        assert!(
            after.keys().all(|name| harmless(&name)),
            "{line}: {:?}",
            after.keys().filter(|n| !harmless(n))
        );
        if slow.iter().all(|(_, name)| *name != file) || line.starts_with("sweep") {
            let line = if line.starts_with("run") { line + " --resume" } else { line + " --overwrite" };
            let _ = std::fs::remove_dir_all(here.join("a"));
            let line = line.replace(" --resume", " --overwrite");
            let (code, text) = outcome(here, &line);
            let by_hand = line.starts_with("lammps convert");
            assert!(code == Some(0) || by_hand && code == Some(1), "{line}: {code:?} {text}");
            assert_ne!(std::fs::read(here.join(&path)).unwrap(), b"mine", "{line}");
        }
        let _ = std::fs::remove_file(here.join(&path));
    }
    for line in ["reproduce berendsen-water --out reproduced", "hardcases"] {
        seen.push(line.split(' ').next().unwrap().to_owned());
    }
    // A folder for runs of a paper is not shared with others' files.
    write(here, "reproduced/quick/berendsen-water/notes.txt", "mine");
    let (code, text) = outcome(here, "reproduce berendsen-water --out reproduced");
    assert!(code == Some(2) && text.contains("notes.txt") | text.contains("did not make"), "{text}");
    assert_eq!(content(&here.join("reproduced")).len(), 1);
    // These write nothing but --json, or work in folders that end with them.
    seen.extend(["devices", "completions"].map(str::to_owned));
    let help = said(&psidpd(here, &["--help"]));
    let list = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    for verb in list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   ")) {
        let verb = verb.split_whitespace().next().unwrap();
        assert!(verb == "help" || seen.iter().any(|seen| seen == verb), "{verb} is not tried");
    }
}

/// What psidpd has made it replaces: results again, the page of a run, the table of a sweep.
#[test]
fn own_results_are_made_again() {
    let folder = with_a_scene();
    let here = folder.path();
    for _ in 0..2 {
        for line in [
            "run s.toml --out o --resume --report --json run.json",
            "report o --json report.json",
            "check m.toml --json out.json",
            "theory w.toml --report page.html --json out.json",
            "sweep s.toml --over kT=1:1.1:2 --out sweep --json points.json",
            "man --out man",
        ] {
            let (code, text) = outcome(here, line);
            assert_eq!(code, Some(0), "{line}: {text}");
        }
    }
}

/// Inputs stay, also with `--overwrite`, wherever they are named.
#[test]
fn inputs_are_never_replaced() {
    let folder = with_a_scene();
    let here = folder.path();
    write(here, "in.old", "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\ninclude more\n");
    write(here, "more", "pair_coeff 1 1 mdpd -40 25 18 1.0 0.75\n");
    assert_eq!(outcome(here, "run s.toml --out o").0, Some(0));
    for (link, file) in [("o/model.toml", "m.toml"), ("deck/model.toml", "m.toml"), ("in.new", "more")] {
        std::fs::create_dir_all(here.join(link).parent().unwrap()).unwrap();
        std::fs::hard_link(here.join(file), here.join(link)).unwrap();
    }
    // A model that has the name of a file of runs too.
    std::fs::copy(here.join("m.toml"), here.join("o/own.toml")).unwrap();
    std::fs::remove_file(here.join("o/trajectory.xyz")).unwrap();
    std::fs::hard_link(here.join("o/own.toml"), here.join("o/trajectory.xyz")).unwrap();
    let before = content(here);
    for line in [
        "check m.toml --json m.toml",
        "run s.toml --out b --json m.toml",
        "run s.toml --out b --json s.toml",
        "run s.toml --out o --set model=o/own.toml",
        "run s.toml --out o --set initial.kind=file --set initial.file=o/final.data",
        "sweep s.toml --over model=m.toml,w.toml --out c --json w.toml",
        "export lammps s.toml --out deck",
        "export eam w.toml --out w.toml",
        "theory w.toml --report w.toml",
        "calibrate w.toml --out w.toml",
        "report o --json o/final.data",
        "snapshot o/final.data --json o/final.data",
        "lammps convert in.old --out in.old",
        "lammps convert in.old --out in.new",
    ] {
        let (code, text) = outcome(here, &format!("{line} --overwrite"));
        assert!(code == Some(2) && text.contains("choose another"), "{line}: {code:?} {text}");
        let after = content(here);
        assert!(before.iter().all(|(name, bytes)| after.get(name) == Some(bytes)), "{line}");
    }
}

/// Of two sweeps at once the second leaves at once, and the table is that of the first.
#[test]
fn of_two_sweeps_one_writes() {
    let folder = with_a_scene();
    let here = folder.path();
    let files = SCENE.lines().filter(|line| line.ends_with(" = 5") && !line.starts_with("thermo"));
    let long = files.fold(SCENE.replace("steps = 10", "steps = 3000"), |scene, line| scene.replace(line, ""));
    write(here, "s.toml", &long);
    let line = "sweep s.toml --over kT=1:1.1:2 --out sweep --jobs 1";
    let mut first = Command::new(program()).args(line.split(' ')).current_dir(here).spawn().unwrap();
    while !here.join("sweep").join("kT=1").join("thermo.csv").exists() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let (code, text) = outcome(here, line);
    assert!(first.try_wait().unwrap().is_none(), "the first sweep was too short");
    assert!(code == Some(2) && text.contains("another run is writing"), "{text}");
    assert!(first.wait().unwrap().success());
    let table = std::fs::read_to_string(here.join("sweep/sweep.csv")).unwrap();
    assert_eq!(table.matches(",true,").count(), 2, "{table}");
}
