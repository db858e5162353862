//! The pair styles inside LAMMPS: their results, and their errors.

use psidpd::lammps::{HostVersion, plugin};
use psidpd_tests::{lammps, root};
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

/// A valid script, of which each test changes one part.
fn script(plugin: &Path) -> String {
    let model = root().join("validation/models/warren2003-set6.toml");
    format!(
        "units lj\natom_style atomic\ncomm_modify vel yes\nregion b block 0 5 0 5 0 5\ncreate_box 1 b\n\
         create_atoms 1 random 600 4711 NULL overlap 0.3 maxtry 100\nmass 1 1\n\
         velocity all create 1.0 87 loop geom\nplugin load \"{}\"\npair_style dpd/psi 1.0 5\n\
         pair_coeff * * \"{}\" F\nfix 1 all nve\ntimestep 0.005\nthermo 10\nrun 10\n",
        plugin.display(),
        model.display()
    )
}

/// Runs a script and returns LAMMPS's output, or its error.
fn outcome(text: &str, ranks: usize) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    std::fs::write(&path, text).unwrap();
    match lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT) {
        Ok(run) => Ok(run.stdout),
        Err(error) => Err(error.to_string()),
    }
}

#[test]
fn a_script_runs_and_says_what_is_computed() {
    for ranks in [1, 2] {
        let said = outcome(&script(&lammps().1), ranks).unwrap();
        for part in [
            "Warren 2003, set 6",
            "density pass  n: quadratic kernel",
            "conventions",
            "no neighbor list is requested",
        ] {
            assert!(said.contains(part), "{part} is missing from\n{said}");
        }
        assert!(said.contains("Loop time"), "{said}");
        let saves = if ranks > 1 { "up to a tenth of a step" } else { "a few percent of a step" };
        assert!(
            said.contains(&format!("'newton off' saves sending back forces on ghosts, {saves}")),
            "{said}"
        );
        assert_eq!(said.contains("on one rank 'neighbor 0.0 bin'"), ranks == 1, "{said}");
    }
}

/// Each row has the text to replace, its replacement, and a part of the error. Each error is one line.
#[test]
fn mistakes_stop_with_one_clear_line() {
    let base = script(&lammps().1);
    let style = "pair_style dpd/psi 1.0 5";
    let coeff = base.lines().find(|l| l.starts_with("pair_coeff")).unwrap().to_owned();
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.toml");
    std::fs::write(&bad, "title = \"t\"\nspecies = [\"F\"]\nspeceis = 1\n").unwrap();
    let flat = folder.path().join("flat.toml");
    std::fs::write(&flat, "title = \"t\"\ndimensions = 2\nspecies = [\"F\"]\n").unwrap();
    let singular = folder.path().join("singular.toml");
    std::fs::write(
        &singular,
        "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
         [excess_free_energy]\nF = \"-ln(1 - n)\"\n",
    )
    .unwrap();
    let mdpd = |style: &str, coeff: &str| format!("{style}\n{coeff}");
    let warren = "pair_coeff 1 1 -40 25 18 1.0 0.75";
    let cases: Vec<(&str, String, &str)> = vec![
        (style, "pair_style dpd/psi 0.0 5".into(), "the temperature must be positive, found 0.0"),
        (style, "pair_style dpd/psi -1 5".into(), "the temperature must be positive"),
        (style, "pair_style dpd/psi 1.0 0".into(), "the seed must be a positive whole number"),
        (
            style,
            "pair_style dpd/psi 1.0".into(),
            "expected 'pair_style dpd/psi T seed' and optional keywords, found 1 arguments",
        ),
        (style, "pair_style dpd/psi 1.0 5 6".into(), "keyword '6' needs a value"),
        (
            style,
            "pair_style dpd/psi 1.0 5 law lucy".into(),
            "unknown keyword 'law': expected 'precision', 'threads' or 'device'",
        ),
        (style, "pair_style dpd/psi 1.0 5 precision single".into(), "unknown precision 'single'"),
        (style, "pair_style dpd/psi 1.0 5 threads 0".into(), "threads must be from 1 to 1024, found 0"),
        (&coeff, "pair_coeff * * nowhere.toml F".into(), "nowhere.toml: cannot be read"),
        (&coeff, format!("pair_coeff * * {} F", bad.display()), "bad.toml:3: speceis: unknown key"),
        (&coeff, format!("pair_coeff * * {} F", flat.display()), "dimensions = 2, the simulation has 3"),
        (&coeff, coeff.replace(" F", " G"), "no species \"G\"; the model has F"),
        (&coeff, format!("{coeff} F"), "a species (or NULL) for each of 1 atom types, found 5 arguments"),
        (&coeff, coeff.replace("* *", "1 1"), "must start with * *"),
        // LAMMPS itself checks that coefficients are given.
        (&coeff, String::new(), "ERROR"),
        (&coeff, format!("pair_coeff * * {} F", singular.display()), "is not finite at local densities"),
        ("comm_modify vel yes", String::new(), "add 'comm_modify vel yes'"),
        ("units lj", "units real".into(), "use 'units lj'"),
        ("0 5 0 5 0 5", "0 5 0 5 0 1.9".into(), "less than twice the range of the thermostat"),
        (
            &coeff,
            mdpd("pair_style mdpd/psi 1.0 1.0 5", "pair_coeff 1 1 -40 25 18 1.0"),
            "expected 'pair_coeff I J A B gamma rc rd [",
        ),
        (
            &coeff,
            mdpd("pair_style mdpd/psi 1.0 1.0 5", "pair_coeff 1 1 -40 25 18 1.2 0.75"),
            "must not exceed the cut-off",
        ),
        (
            &coeff,
            mdpd("pair_style mdpd/psi 1.0 1.0 5", "pair_coeff 1 1 -40 25 -3 1.0 0.75"),
            "gamma must not be negative, found -3",
        ),
        ("timestep 0.005", "timestep 0".into(), "the thermostat needs a timestep greater than 0"),
        (
            "run 10",
            "compute t all pe/tally all\nrun 1".into(),
            "computes of the TALLY package get no pairs from it",
        ),
        (&coeff, mdpd("pair_style mdpd/psi 1.0 1.0", warren), "expected 'pair_style mdpd/psi T cutoff seed'"),
        (&coeff, mdpd("pair_style mdpd/psi 1.0 1.0 5 law hard", warren), "unknown law 'hard'"),
        (&coeff, mdpd("pair_style mdpd/psi 1.0 1.0 5 low lucy", warren), "unknown keyword 'low'"),
    ];
    for (from, to, message) in cases {
        assert!(base.contains(from), "{from}");
        let text = base.replacen(from, &to, 1);
        let error = outcome(&text, 1).expect_err(&format!("{to} should be refused"));
        assert!(error.contains(message), "{to}\nexpected: {message}\nfound: {error}");
    }
}

/// LAMMPS's error names the source line of the failed check, which differs between checks.
#[test]
fn errors_name_the_place_of_the_check() {
    let base = script(&lammps().1);
    let place = |style: &str| {
        let error = outcome(&base.replace("pair_style dpd/psi 1.0 5", style), 1).unwrap_err();
        let line = error.lines().find(|l| l.starts_with("ERROR: Pair style")).unwrap().to_owned();
        line.rsplit_once('(').unwrap().1.to_owned()
    };
    let places =
        ["-1 5", "1.0 0", "1.0", "1.0 5 6"].map(|words| place(&format!("pair_style dpd/psi {words}")));
    for (k, place) in places.iter().enumerate() {
        assert!(place.contains(".cpp:"), "{place}");
        assert!(!places[..k].contains(place), "{places:?}");
    }
}

/// Settings without effect, and replaced settings, give one warning and no error.
#[test]
fn what_does_nothing_is_said() {
    let base = script(&lammps().1);
    let coeff = base.lines().find(|l| l.starts_with("pair_coeff")).unwrap().to_owned();
    let warned = |text: &str, message: &str| {
        let said = outcome(text, 2).unwrap();
        assert_eq!(said.matches("WARNING: Pair style dpd/psi").count(), 1, "{said}");
        assert!(said.contains(message), "{message}\n{said}");
    };
    let twice = base.replace(&coeff, &format!("{coeff}\n{coeff}"));
    warned(&twice, "this pair_coeff replaces the model");
    warned(&format!("suffix omp\n{base}"), "the suffix has no effect");
    warned(&base.replace("psi 1.0 5", "psi 1.0 5 threads 600"), "threads 600 is more than the");
    // A second pair_style starts without the settings of the first.
    let style = "pair_style dpd/psi 1.0 5";
    let said = outcome(&format!("{base}{style}\n{coeff}\nrun 1\n"), 1).unwrap();
    assert!(!said.contains("WARNING: Pair style"), "{said}");
    // The log lists the settings.
    assert!(said.contains("advice        'precision mixed'"), "{said}");
    let mixed = outcome(&base.replace(style, &format!("{style} precision mixed")), 1).unwrap();
    assert!(mixed.contains("mixed precision") && !mixed.contains("'precision mixed'"), "{mixed}");
    // Each piece of advice is given once, and to those that it concerns.
    let heeded =
        format!("newton off\n{base}").replace("fix 1 all nve", "fix 1 all dpd/splitting aboba").replace(
            style,
            &format!("neighbor 0.0 bin\nneigh_modify delay 0 every 20 check no\n{style} precision mixed"),
        );
    let heeded = outcome(&heeded, 1).unwrap();
    for advice in ["'newton off'", "'neighbor 0.0 bin'", "'fix dpd/splitting'"] {
        assert_eq!(mixed.matches(advice).count(), 1, "{advice}: {mixed}");
        assert_eq!(heeded.matches(advice).count(), 0, "{advice}: {heeded}");
    }
}

/// In two dimensions atoms with different z are refused, whichever rank has them.
#[test]
fn atoms_out_of_the_plane_are_refused() {
    let flat = |more: &str| {
        format!(
            "units lj\ndimension 2\ncomm_modify vel yes\nregion b block 0 5 0 5 -0.5 0.5\ncreate_box 1 b\n\
             create_atoms 1 random 50 1 b\nmass 1 1\n{more}\nplugin load \"{}\"\npair_style mdpd/psi 1 1 5\n\
             pair_coeff 1 1 -40 25 4.5 1 0.75\nfix 1 all nve\nrun 1\n",
            lammps().1.display()
        )
    };
    for ranks in [1, 2] {
        outcome(&flat(""), ranks).unwrap();
        let error = psidpd_tests::last_words(ranks, || outcome(&flat("set atom 7 z 0.2"), ranks));
        assert!(error.contains("in two dimensions all atoms must have the same z"), "{error}");
    }
}

/// An error on one rank stops all ranks, without a hang.
#[test]
fn trouble_on_one_rank_stops_two() {
    let lost = script(&lammps().1).replace("run 10", "set atom 1 vx 1e300\nrun 10");
    let error = psidpd_tests::last_words(2, || outcome(&lost, 2));
    assert!(error.contains("ERROR"), "{error}");
}

/// LAMMPS prints the number of lost atoms; the style prints their ids, once, and not again in the next run.
#[test]
fn lost_atoms_are_named() {
    let text = script(&lammps().1).replace("comm_modify", "boundary f p p\ncomm_modify").replace(
        "run 10",
        "neigh_modify every 1 delay 0\nfix walls all wall/reflect xlo EDGE xhi EDGE\nthermo_modify lost ignore\n\
         set atom 17 vx 1e4\nset atom 23 vx -1e4\nrun 10\nrun 10",
    );
    for ranks in [1, 2] {
        let said = outcome(&text, ranks).unwrap();
        assert_eq!(
            said.matches("at step 1 2 of 600 atoms are lost, with the IDs 17, 23:").count(),
            1,
            "{said}"
        );
    }
}

/// If B differs between pairs of types there is no potential: the error says so.
#[test]
fn b_by_type_pair_is_refused_with_the_reason() {
    let text = script(&lammps().1)
        .replace("create_box 1 b", "create_box 2 b")
        .replace("mass 1 1", "mass * 1")
        .lines()
        .filter(|l| !l.starts_with("pair_coeff"))
        .collect::<Vec<_>>()
        .join("\n")
        .replace(
            "pair_style dpd/psi 1.0 5",
            "pair_style mdpd/psi 1.0 1.0 5\npair_coeff 1 1 -40 25 18 1 0.75\npair_coeff 1 2 -30 20 18 1 0.75\n\
             pair_coeff 2 2 -40 25 18 1 0.75",
        );
    let error = outcome(&format!("{text}\n"), 1).unwrap_err();
    assert!(error.contains("B differs between pairs of types (25 and 20)"), "{error}");
    assert!(error.contains("the nearest model is"), "{error}");
    let missing = text.replace("pair_coeff 1 2 -30 20 18 1 0.75\n", "");
    let error = outcome(&format!("{missing}\n"), 1).unwrap_err();
    assert!(error.contains("no coefficients for types 1 and 2: this style does not mix them"), "{error}");
    let same = text.replace("-30 20", "-30 25");
    assert!(outcome(&format!("{same}\n"), 1).is_ok());
}

/// The potential energy and pressure that LAMMPS prints equal those of the native engine, which `validate`
/// checks for single styles; here the styles are in a hybrid, run twice, and are loaded again.
#[test]
fn styles_survive_clear_and_reload() {
    let text = script(&lammps().1);
    let load = text.lines().find(|l| l.starts_with("plugin load")).unwrap().to_owned();
    let again = format!("{text}clear\n{load}\n{}", text.replace(&format!("{load}\n"), ""));
    let said = outcome(&again, 1).unwrap();
    assert_eq!(said.matches("Loop time").count(), 2, "{said}");
}

/// A plugin built for another LAMMPS stops the script with an error before any of its code runs.
#[test]
fn a_plugin_for_another_lammps_is_refused() {
    let (host, ours) = lammps();
    let mut other = host.version().unwrap();
    other.number = 20_240_829;
    let base = root().join("target/lammps/other-version");
    let stranger = plugin::build_for(host, &other, &base, &|_| {}).unwrap();
    let error = outcome(&script(&stranger), 1).unwrap_err();
    assert!(error.contains("was built for LAMMPS 20240829 (29 Aug 2024), this is LAMMPS"), "{error}");
    assert!(error.contains("psidpd lammps plugin"), "{error}");
    let refused = plugin::check(host, &stranger).unwrap_err().to_string();
    assert!(refused.contains("20240829"), "{refused}");
    let _: HostVersion = other;
    plugin::check(host, ours).unwrap();
}

/// The third and fourth values of `compute pair` count evaluations of ψ below and above its bounds.
#[test]
fn evaluations_beyond_bounds_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = root().join("validation/models/warren2003-set6.toml");
    let bounded = std::fs::read_to_string(&shipped)
        .unwrap()
        .replace("range  = \"rd\"", "range  = \"rd\"\nbounds = [1.0, 3.5]");
    let path = folder.path().join("bounded.toml");
    std::fs::write(&path, bounded).unwrap();
    let counts = |model: &Path| -> [f64; 2] {
        let text = script(&lammps().1)
            .replace(&shipped.display().to_string(), &model.display().to_string())
            .replace(
                "thermo 10\n",
                "thermo 10\ncompute b all pair dpd/psi\nthermo_style custom step pe c_b[3] c_b[4]\n",
            );
        let said = outcome(&text, 2).unwrap();
        let row = said.lines().skip_while(|l| !l.trim_start().starts_with("Step")).nth(2).unwrap();
        let numbers: Vec<f64> = row.split_whitespace().map(|w| w.parse().unwrap()).collect();
        [numbers[2], numbers[3]]
    };
    let [below, above] = counts(&path);
    assert!(below > 0.0 && above > 0.0, "{below} {above}");
    assert_eq!(counts(&shipped), [0.0, 0.0]);
}
