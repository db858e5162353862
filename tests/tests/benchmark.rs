//! The benchmark's command line with tiny cases: the figures mean nothing here, but all of them must be present.

use psidpd_tests::{psidpd, root, said};
use serde_json::Value;
use std::collections::BTreeSet;

/// Paths to all values, with `[]` for entries of lists and `<name>` for keys that are names themselves.
fn paths(value: &Value, at: &str, into: &mut BTreeSet<String>) {
    let named = ["parts", "equal_bits"].iter().any(|map| at.ends_with(map));
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let key = if named { "<name>" } else { key.as_str() };
                let path = if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") };
                into.insert(path.clone());
                paths(value, &path, into);
            }
        }
        Value::Array(list) => list.iter().for_each(|entry| paths(entry, &format!("{at}[]"), into)),
        _ => {}
    }
}

/// The fields in the tables of `docs/bench.md`.
fn documented() -> BTreeSet<String> {
    let text = std::fs::read_to_string(root().join("docs/bench.md")).unwrap();
    let (_, fields) = text.split_once("## bench.json").expect("a chapter about bench.json");
    fields
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(field, _)| field.to_owned())
        .collect()
}

#[test]
fn a_small_benchmark_has_every_documented_field() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench --all --sizes 500,700 --few-above 600 --rounds 2 --steps 20 --memory 20000 --threads 1,2 --out b --json c.json";
    let output = psidpd(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("What to take in LAMMPS on"), "{}", said(&output));
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let outcome: Value = serde_json::from_str(&read("b/bench.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&read("c.json")).unwrap(), outcome);

    // The page describes the fields of spreads once.
    let mut found = BTreeSet::new();
    paths(&outcome, "", &mut found);
    found.retain(|path| ![".min", ".median", ".max"].iter().any(|end| path.ends_with(end)));
    let documented = documented();
    let missing: Vec<_> = documented.difference(&found).collect();
    let unknown: Vec<_> = found.difference(&documented).collect();
    assert!(missing.is_empty() && unknown.is_empty(), "missing: {missing:?}; not documented: {unknown:?}");

    let runs = outcome["runs"].as_array().unwrap();
    for (fluid, code) in [
        ("mdpd", "lammps mdpd"),
        ("mdpd", "lammps eam/alloy"),
        ("mdpd", "plugin dpd/psi"),
        ("mdpd", "plugin dpd/psi precision mixed threads 2"),
        ("mdpd", "plugin dpd/psi precision mixed, 2 ranks"),
        ("mdpd", "native double portable 2"),
        ("dpd", "lammps dpd"),
        ("dpd", "native mixed portable 1"),
        ("formula", "plugin dpd/psi"),
    ] {
        let found = runs.iter().find(|r| r["size"] == 500 && r["fluid"] == fluid && r["code"] == code);
        let run = found.unwrap_or_else(|| panic!("no run of {code} with {fluid}"));
        assert_eq!(run["seconds"].as_array().unwrap().len(), 2);
        assert!(run["mega_particle_steps_per_second"]["median"].as_f64().unwrap() > 0.0);
        assert!(!run["parts"].as_object().unwrap().is_empty());
    }
    // Mixtures of sizes are timed natively, at the smallest size, and none whose ranges its box does not hold.
    let mixtures: Vec<_> = runs.iter().filter(|r| r["fluid"] == "two-sizes").collect();
    let natively = |r: &&Value| r["size"] == 500 && r["code"].as_str().unwrap().starts_with("native ");
    assert!(mixtures.len() >= 4 && mixtures.iter().all(natively), "{mixtures:?}");
    assert!(runs.iter().all(|r| r["fluid"] != "colloid"));
    // The large box has few codes, but each on both numbers of ranks.
    let large: Vec<&str> =
        runs.iter().filter(|r| r["size"] == 700).filter_map(|r| r["code"].as_str()).collect();
    assert!(large.contains(&"lammps mdpd") && large.contains(&"plugin dpd/psi precision mixed, 2 ranks"));
    assert!(large.len() < runs.len() / 3 && !large.contains(&"lammps eam/alloy"), "{large:?}");
    assert!(read("b/report.html").contains("In boxes of more than 600 particles"));
    assert!(outcome["equal_bits"].as_object().unwrap().values().all(|equal| *equal == true));
    // A particle needs at least its position, velocity and force.
    assert!(outcome["memory"][0]["bytes_per_particle"].as_f64().unwrap() > 72.0);
    assert!(read("b/report.html").contains("<svg"));
}

/// Every template and ten shipped scenes, a few steps of each, with times of both.
#[test]
fn whole_scenes_are_timed() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench --scenes --steps 2 --threads 1 --out b --json c.json";
    let output = psidpd(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = std::fs::read_to_string(folder.path().join("c.json")).unwrap();
    let outcome: Value = serde_json::from_str(&text).unwrap();
    let scenes = outcome["scenes"].as_array().unwrap();
    let templates = scenes.iter().filter(|s| s["is_template"] == true).count();
    assert!(templates == 7 && scenes.len() == 17, "{text}");
    for scene in scenes {
        let [shipped, bare] = ["as_shipped", "bare"].map(|of| scene[of]["processor"].as_f64().unwrap());
        assert!(shipped > 0.0 && bare > 0.0 && scene["particles"].as_u64().unwrap() > 400, "{scene}");
        assert!((scene["ratio"].as_f64().unwrap() - shipped / bare).abs() < 1e-9, "{scene}");
    }
    assert!(said(&output).contains("new --template droplet"), "{}", said(&output));
    let there: Vec<_> = scenes.iter().filter(|s| !s["in_lammps"].is_null()).collect();
    let names: Vec<_> = there.iter().map(|s| s["scene"].as_str().unwrap()).collect();
    assert_eq!(names, ["standard-dpd", "warren-set6-bulk", "warren-set6-slab"]);
    for scene in there {
        let [measured, bare] = ["measured", "bare"].map(|of| scene["in_lammps"][of].as_f64().unwrap());
        assert!(measured > 0.0 && bare > 0.0, "{scene}");
    }
}

#[test]
fn what_cannot_be_timed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, word) in [
        ("bench --sizes 0", "--sizes"),
        ("bench --seconds=-1", "positive"),
        ("bench --sizes 20 --steps 20 --rounds 1", "too few"),
        ("bench --steps 20 --rounds 1 --psi nonsense --sizes 500", "nonsense"),
    ] {
        let output = psidpd(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert!(said.contains(word), "{arguments}: {said}");
    }
}
