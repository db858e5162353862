//! Links, pipes and devices in the folder of a run, names that are no text, and files that may not grow.

use psidpd_tests::{program, psidpd, said};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const MODEL: &str = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = 25\n\
                     range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
/// Pictures of a narrow box are small and soon drawn.
const SCENE: &str = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nbox = [3.0, 3.0, 100.0]\ndensity = 0.12\nsteps = 10\n\
                     [output]\nthermo = 1\ndump = 5\nxyz = 5\ngsd = 5\nvtk = 5\nsnapshot = 5\n[observe]\nevery = 2\n\
                     temperature = true\nrdf = { range = 1.4, bins = 5 }\n";

fn with_a_scene(here: &Path) {
    std::fs::write(here.join("m.toml"), MODEL).unwrap();
    std::fs::write(here.join("s.toml"), SCENE).unwrap();
    let many_body = psidpd_tests::root().join("validation/models/warren2003-set6.toml");
    std::fs::copy(many_body, here.join("w.toml")).unwrap();
}

fn copy(from: &Path, to: &Path) {
    assert!(Command::new("cp").arg("-a").args([from, to]).status().unwrap().success());
}

/// A command line with a limit of the shell.
fn under(here: &Path, line: &str, limit: &str) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit {limit}; exec \"$0\" \"$@\"")]).arg(program()).args(line.split(' '));
    command.current_dir(here).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn limited(here: &Path, line: &str, limit: &str) -> Output {
    under(here, line, limit).output().unwrap()
}

/// The output of the program, which must end within seconds and must not fill the memory.
fn soon(here: &Path, line: &str) -> (Option<i32>, String) {
    let mut child = under(here, line, "-v 4000000").spawn().unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("{line} waits");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), said(&output))
}

/// Puts a link to a file outside, a link to an endless device, or a pipe in the place of a file.
fn replace_by(kind: &str, path: &Path) {
    let _ = std::fs::remove_file(path);
    match kind {
        "link" => symlink("../mine", path).unwrap(),
        "zero" => symlink("/dev/zero", path).unwrap(),
        _ => mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap(),
    }
}

/// Whatever a folder holds in the places of a run's files: nothing waits, nothing outside is read or written.
#[test]
fn nothing_in_the_folder_of_a_run_leads_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    with_a_scene(here);
    assert_eq!(soon(here, "run s.toml --out o").0, Some(0));
    // The run of a longer scene that a full disk stopped on its way.
    let more = SCENE.replace("steps = 10", "steps = 40").replace("dump = 5", "dump = 1\ncheckpoint = 5");
    std::fs::write(here.join("long.toml"), more).unwrap();
    assert_eq!(limited(here, "run long.toml --out p", "-f 600").status.code(), Some(1));
    assert!(here.join("p/checkpoint").exists() && !here.join("p/summary.json").exists());
    let names = [
        "about.json",
        "thermo.csv",
        "summary.json",
        "timing.json",
        "observables.json",
        "final.data",
        "last-good.data",
        "dump.lammpstrj",
        "trajectory.xyz",
        "trajectory.gsd",
        "report.html",
        "checkpoint",
        "checkpoint.old",
        "checkpoint.new",
        "snapshots/particles-0000000005.png",
        "vtk/density-0000000005.vti",
        "observables/rdf.csv",
    ];
    // What a command line makes of the folder `from` with something else in these places.
    let meet = |kind: &str, names: &[&str], from: &str, line: &str| {
        let folder = here.join(kind);
        let here = folder.as_path();
        std::fs::create_dir_all(here).unwrap();
        std::fs::write(here.join("mine"), "mine: a secret").unwrap();
        let _ = std::fs::remove_dir_all(here.join("q"));
        copy(&here.join("..").join(from), &here.join("q"));
        for name in names {
            let path = here.join("q").join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            replace_by(kind, &path);
        }
        let (code, text) = soon(here, line);
        let what = format!("{kind} {names:?} {line}: {code:?} {text}");
        assert!(code.is_some() && !text.contains("secret") && !text.contains("panicked"), "{what}");
        assert_eq!(std::fs::read_to_string(here.join("mine")).unwrap(), "mine: a secret", "{what}");
        let page = std::fs::read_to_string(here.join("q/report.html")).unwrap_or_default();
        assert!(!page.contains("secret"), "{what}");
        assert!(code == Some(0) || line.contains("--resume"), "{what}");
    };
    let all = |kind: &str| {
        for name in names {
            meet(kind, &[name], "o", "report q");
            meet(kind, &[name], "o", "run ../s.toml --out q --resume --report");
            meet(kind, &[name], "p", "run ../long.toml --out q --resume");
        }
        // All files are replaced, so all places are tried at once.
        meet(kind, &names, "o", "run ../s.toml --out q --overwrite");
    };
    std::thread::scope(|scope| {
        for kind in ["link", "zero", "pipe"] {
            scope.spawn(move || all(kind));
        }
    });
    // Folders in it are no links either.
    for name in ["snapshots", "vtk", "observables"] {
        let _ = std::fs::remove_dir_all(here.join("q"));
        copy(&here.join("p"), &here.join("q"));
        std::fs::create_dir_all(here.join("elsewhere")).unwrap();
        let _ = std::fs::remove_dir_all(here.join("q").join(name));
        symlink("../elsewhere", here.join("q").join(name)).unwrap();
        std::fs::write(here.join("elsewhere/particles-0000000000.png"), "mine").unwrap();
        for line in ["run s.toml --out q --overwrite", "run long.toml --out q --resume", "report q"] {
            soon(here, line);
            assert_eq!(std::fs::read_dir(here.join("elsewhere")).unwrap().count(), 1, "{name} {line}");
        }
    }
    // As the start of another run, too.
    for (kind, code) in [("pipe", 2), ("zero", 2), ("link", 2)] {
        let _ = std::fs::remove_dir_all(here.join("q"));
        copy(&here.join("o"), &here.join("q"));
        replace_by(kind, &here.join("q/checkpoint"));
        let start = SCENE.replace("density = 0.12\n", "").replace("box = [3.0, 3.0, 100.0]\n", "");
        std::fs::write(here.join("start.toml"), start + "[initial]\nkind = \"checkpoint\"\nfile = \"q\"\n")
            .unwrap();
        let (found, text) = soon(here, "check start.toml");
        assert_eq!(found, Some(code), "{kind}: {text}");
    }
}

fn run(here: &Path, arguments: &[&OsStr]) -> Output {
    Command::new(program()).args(arguments).current_dir(here).output().unwrap()
}

/// A path need not be text: each verb works, and results in JSON show what can be shown.
#[test]
fn paths_that_are_no_text_work() {
    let folder = tempfile::tempdir().unwrap();
    let here = &folder.path().join(OsStr::from_bytes(b"m\xfcller"));
    std::fs::create_dir(here).unwrap();
    with_a_scene(here);
    std::fs::write(here.join("t.csv"), "r, u\n0, 1\n0.5, 0.3\n1, 0\n").unwrap();
    std::fs::write(here.join("in.old"), "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\n")
        .unwrap();
    let place = |name: &str| here.join(OsStr::from_bytes(&[name.as_bytes(), b"\xff"].concat()));
    let with = |name: &str, end: &str| {
        let mut path = place(name).into_os_string();
        path.push(end);
        path
    };
    let scene = here.join("s.toml").into_os_string();
    let out = place("o").into_os_string();
    for (k, line) in [
        vec!["check".into(), scene.clone(), "--set".into(), "kT=0.9".into()],
        vec!["run".into(), scene.clone(), "--out".into(), out.clone(), "--report".into()],
        vec!["run".into(), scene.clone(), "--out".into(), out.clone(), "--resume".into()],
        vec!["report".into(), out.clone()],
        vec!["snapshot".into(), place("o").join("final.data").into(), "--out".into(), with("a", ".svg")],
        vec!["snapshot".into(), place("o").join("dump.lammpstrj").into(), "--out".into(), with("a", ".gif")],
        vec!["export".into(), "lammps".into(), scene.clone(), "--out".into(), place("deck").into()],
        vec![
            "export".into(),
            "eam".into(),
            here.join("w.toml").into(),
            "--spacing".into(),
            "0.01".into(),
            "--out".into(),
            with("t", ".eam"),
        ],
        vec!["man".into(), "--out".into(), place("man").into()],
        vec!["new".into(), with("x", ".toml")],
        vec!["new".into(), place("y").into(), "--template".into(), "slab".into()],
        vec!["theory".into(), here.join("w.toml").into(), "--report".into(), with("p", ".html")],
        vec![
            "sweep".into(),
            scene.clone(),
            "--over".into(),
            "kT=1:1.1:2".into(),
            "--out".into(),
            place("sweep").into(),
        ],
        vec![
            "lammps".into(),
            "convert".into(),
            here.join("in.old").into(),
            "--out".into(),
            place("in").into(),
        ],
    ]
    .into_iter()
    .enumerate()
    {
        let json = with(&format!("json{k}"), "");
        for more in [&[][..], &["--overwrite".as_ref(), "--json".as_ref(), json.as_os_str()]] {
            let arguments: Vec<&OsStr> =
                line.iter().map(|word| word.as_os_str()).chain(more.iter().copied()).collect();
            // A run is resumed or begun anew.
            let resumes = arguments.contains(&"--resume".as_ref());
            let arguments: Vec<&OsStr> =
                arguments.into_iter().filter(|word| !(resumes && *word == "--overwrite")).collect();
            let output = run(folder.path(), &arguments);
            let by_hand = arguments.contains(&"convert".as_ref()) && output.status.code() == Some(1);
            assert!(
                output.status.success() || by_hand,
                "{arguments:?}: {:?} {}",
                output.status,
                said(&output)
            );
        }
        let text = std::fs::read(&json).unwrap();
        serde_json::from_slice::<serde_json::Value>(&text).unwrap();
    }
    assert!(Path::new(&with("x", ".toml")).is_file() && Path::new(&with("y", ".toml")).is_file());
    // Nothing was written elsewhere.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A file that may not grow fails as on a full disk: with a message, and what was there stays whole.
#[test]
fn a_file_beyond_the_limit_leaves_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    with_a_scene(here);
    std::fs::write(
        here.join("gsd.toml"),
        SCENE.replace("steps = 10", "steps = 100000000").replace("gsd = 5", "gsd = 1"),
    )
    .unwrap();
    for line in [
        "run s.toml --out o",
        "export eam w.toml --spacing 0.01 --out t.eam",
        "export lammps s.toml --out deck",
        "theory w.toml --report page.html",
        "snapshot o/final.data --out a.svg",
        "sweep s.toml --over kT=1:1.1:2 --out sweep",
        "calibrate w.toml --density 6:7 --points 2 --particles 200 --steps 100 --equilibrate 10 --tolerance 9 --out c.toml",
        "man --out man",
        "new x",
        "report o",
    ] {
        let output = psidpd(here, &line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(0), "{line}: {}", said(&output));
    }
    let old = |name: &str| std::fs::read(here.join(name)).unwrap();
    for (line, files, blocks) in [
        ("run gsd.toml --out g", &[][..], 1000),
        ("run s.toml --out g2 --json run.json", &[], 1),
        ("report o", &["o/report.html"], 1),
        ("theory w.toml --report page.html", &["page.html"], 1),
        ("snapshot o/final.data --out a.svg --overwrite", &["a.svg"], 1),
        ("export eam w.toml --spacing 0.01 --out t.eam --overwrite", &["t.eam"], 1),
        ("export lammps s.toml --out deck --overwrite", &["deck/start.data"], 1),
        ("man --out man --overwrite", &["man/psidpd-run.1"], 1),
        ("new x --overwrite", &["x.toml", "standard-dpd.toml"], 0),
        ("check w.toml --json out.json", &[], 0),
    ] {
        let before: Vec<Vec<u8>> = files.iter().map(|name| old(name)).collect();
        let output = limited(here, line, &format!("-f {blocks}"));
        let text = said(&output);
        let code = output.status.code();
        let nothing_to_write = line.starts_with("man") && code == Some(0);
        assert!(
            nothing_to_write || matches!(code, Some(1 | 2)) && text.contains("too large"),
            "{line}: {code:?} {text}"
        );
        for (name, before) in files.iter().zip(before) {
            assert!(old(name) == before, "{line}: {name} has changed");
        }
    }
    let left = |folder: &Path| {
        let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
        names.filter(|name| name.as_bytes().starts_with(b".psidpd-")).count()
    };
    assert_eq!(["", "o", "deck", "man"].map(|name| left(&here.join(name))), [0; 4]);
}

/// A process that is killed while it writes leaves nothing; what an earlier version left goes with the next file.
#[test]
fn killed_processes_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    with_a_scene(here);
    std::fs::write(here.join(".psidpd-Ab12cd"), "half").unwrap();
    std::fs::write(here.join(".psidpd-settings"), "mine").unwrap();
    for k in 0..30 {
        let mut command = Command::new(program());
        command.args(["export", "eam", "w.toml", "--spacing", "0.0005", "--out", "t.eam", "--overwrite"]);
        let mut child = command.current_dir(here).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(3 * k));
        let _ = child.kill();
        child.wait().unwrap();
    }
    assert_eq!(psidpd(here, &["check", "m.toml", "--json", "out.json"]).status.code(), Some(0));
    let names: Vec<_> = std::fs::read_dir(here).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    let left: Vec<_> = names.iter().filter(|name| name.as_bytes().starts_with(b".psidpd-")).collect();
    assert_eq!(left, [".psidpd-settings"]);
}

/// Comments and strings may hold any number of brackets, and lists any number of points.
#[test]
fn only_what_nests_is_too_deep() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    with_a_scene(here);
    let brackets = "[".repeat(100);
    let model = format!(
        "# {brackets}\n{}# {}\n",
        MODEL.replace("\"t\"", &format!("\"{brackets}\"")),
        ".".repeat(400)
    );
    std::fs::write(here.join("m.toml"), model).unwrap();
    let output = psidpd(here, &["run", "s.toml", "--out", "o"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for deep in [format!("x = {brackets}"), format!("{} = 1", vec!["a"; 400].join("."))] {
        std::fs::write(here.join("m.toml"), MODEL.to_owned() + &deep).unwrap();
        let output = psidpd(here, &["check", "m.toml"]);
        assert!(
            output.status.code() == Some(2) && said(&output).contains("nest deeper"),
            "{}",
            said(&output)
        );
    }
    // Parts of keys nest as brackets do.
    let key = ["a"; 60].join(".");
    let text = format!("{}{key} = 1{}", format!("{key} = {{").repeat(60), "}".repeat(60));
    std::fs::write(here.join("m.toml"), text).unwrap();
    assert_eq!(psidpd(here, &["check", "m.toml"]).status.code(), Some(2));
}

/// A script from elsewhere tells a terminal nothing.
#[test]
fn a_converted_script_is_printed_without_escapes() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let script = "# \u{1b}[31mred\u{7}\u{9b}\u{202e} \r\n\tpair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\n\
                  print \"\u{1b}]0;title\u{7}\"\n";
    std::fs::write(here.join("in.old"), script).unwrap();
    let output = psidpd(here, &["lammps", "convert", "in.old"]);
    let text = said(&output);
    assert!(text.contains("# ?[31mred?") && text.contains("mdpd/psi"), "{text}");
    assert!(!text.chars().any(|c| c.is_control() && !"\n\r\t".contains(c)), "{text:?}");
    let output = psidpd(here, &["lammps", "convert", "in.old", "--out", "in.new"]);
    assert!(!said(&output).contains('\u{1b}'), "{}", said(&output));
    assert!(std::fs::read_to_string(here.join("in.new")).unwrap().starts_with("# \u{1b}[31mred"));
}
