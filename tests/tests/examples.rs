//! Every script in `lammps-plugin/examples` runs on one rank and on two.

use psidpd_tests::{examples, lammps, root};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Tables of thermo output with columns and rows, one for each run.
fn tables(output: &str) -> Vec<(Vec<String>, Vec<Vec<f64>>)> {
    let mut tables = Vec::new();
    let mut lines = output.lines();
    while let Some(line) = lines.next() {
        let columns: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        if columns.first().is_none_or(|c| c != "Step") {
            continue;
        }
        let rows = lines
            .by_ref()
            .take_while(|l| !l.starts_with("Loop time"))
            .filter_map(|l| l.split_whitespace().map(|w| w.parse().ok()).collect::<Option<Vec<f64>>>())
            .filter(|row| row.len() == columns.len())
            .collect();
        tables.push((columns, rows));
    }
    tables
}

/// The potential energies of the first and of the last row, after a check of all rows.
fn energies(script: &Path, output: &str) -> [f64; 2] {
    let tables = tables(output);
    assert!(!tables.is_empty(), "{}: no thermo output\n{output}", script.display());
    let mut energies = Vec::new();
    for (columns, rows) in &tables {
        assert!(rows.len() >= 2, "{}: {rows:?}", script.display());
        for row in rows {
            assert!(row.iter().all(|x| x.is_finite()), "{}: {columns:?} {row:?}", script.display());
        }
        let energy = columns.iter().position(|c| c == "PotEng" || c == "E_pair").unwrap();
        energies.extend(rows.iter().map(|row| row[energy]));
    }
    [energies[0], energies[energies.len() - 1]]
}

#[test]
fn examples_run_on_one_rank_and_on_two() {
    let (host, plugin) = lammps();
    let scripts = examples();
    assert_eq!(scripts.len(), 10);
    let arguments = ["-log", "none", "-var", "plugin", "./psidpdplugin.so", "-var", "models", "models"];
    let arguments = [&arguments[..], &["-var", "steps", "50"]].concat();
    for script in scripts {
        let [one, two] = [1, 2].map(|ranks| {
            // Output files of scripts stay out of the checkout.
            let folder = tempfile::tempdir().unwrap();
            // LAMMPS does not expand variables within quotes, so values with a space would be split.
            symlink(plugin, folder.path().join("psidpdplugin.so")).unwrap();
            symlink(root().join("validation/models"), folder.path().join("models")).unwrap();
            let run = host.run_script(ranks, folder.path(), &script, &arguments, Duration::from_secs(120));
            let run = run.unwrap_or_else(|e| panic!("{}, {ranks} ranks: {e}", script.display()));
            energies(&script, &run.stdout)
        });
        // LAMMPS numbers new atoms by ranks, and the noise depends on these numbers: only the initial state agrees.
        for (k, largest) in [(0, 1e-6), (1, 0.05)] {
            let apart = (one[k] - two[k]).abs();
            assert!(apart < largest * (1.0 + one[k].abs()), "{}: {one:?} {two:?}", script.display());
        }
    }
}

/// Beside each script are a page and logs of both runs; the logs name no folder of their author.
#[test]
fn examples_have_pages_and_logs() {
    for script in examples() {
        let folder = script.parent().unwrap();
        assert!(folder.join("README.md").is_file(), "{}", folder.display());
        let mut logs: Vec<PathBuf> = std::fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().path())
            .filter(|p| p.file_name().unwrap().to_str().unwrap().starts_with("log."))
            .collect();
        logs.sort();
        assert_eq!(logs.len(), 2, "{}", folder.display());
        for (log, ranks) in logs.iter().zip(["1", "2"]) {
            assert_eq!(log.extension().unwrap(), ranks);
            let text = std::fs::read_to_string(log).unwrap();
            assert!(text.contains(&format!("on {ranks} procs")), "{}", log.display());
            assert!(text.contains("Total wall time"), "{} is not whole", log.display());
            for path in ["/tmp", "/home", "/root", "/work", "/usr"] {
                assert!(!text.contains(path), "{} has {path}", log.display());
            }
            // The log shows that the script has not changed since the run.
            for line in std::fs::read_to_string(&script).unwrap().lines() {
                assert!(text.contains(line.trim_end()), "{} lacks: {line}", log.display());
            }
        }
    }
}

/// LAMMPS accepts the example commands of the manual pages.
#[test]
fn examples_of_the_manual_pages_are_accepted() {
    let (host, plugin) = lammps();
    let models = root().join("validation/models");
    let mut count = 0;
    for page in ["pair_dpd_psi", "pair_mdpd_psi", "pair_dpd_spline", "fix_dpd_splitting", "fix_dpd_wall"] {
        let text = std::fs::read_to_string(root().join(format!("lammps-plugin/doc/{page}.md"))).unwrap();
        let (_, examples) = text.split_once("## Examples\n\n```text\n").unwrap();
        let (examples, _) = examples.split_once("```").unwrap();
        // The first paragraph loads the plugin and has the pair style of a fix; the others have one style each.
        let (first, styles) = examples.split_once("\n\n").unwrap();
        let pair: Vec<&str> = first.lines().filter(|l| l.starts_with("pair_")).collect();
        let pair = pair.join("\n");
        let boundary = first.lines().find(|l| l.starts_with("boundary ")).unwrap_or_default();
        let load = first.lines().find(|l| l.starts_with("plugin ")).unwrap();
        for style in styles.split("\n\n") {
            let types = if style.contains(" A B") || style.contains("1 2") { 2 } else { 1 };
            let flat = style.contains("-2d");
            let (dimension, edge) = if flat { (2, "-0.5 0.5") } else { (3, "0 5") };
            let script = format!(
                "units lj\ndimension {dimension}\n{boundary}\ncomm_modify vel yes\nregion b block 0 5 0 5 {edge}\n\
                 create_box {types} b\ncreate_atoms 1 random 50 1 b\ncreate_atoms {types} random 50 2 b\n\
                 mass * 1\n{load}\n{pair}\n{style}\nrun 0\n",
            );
            let folder = tempfile::tempdir().unwrap();
            symlink(plugin, folder.path().join("psidpdplugin.so")).unwrap();
            let path = folder.path().join("in.page");
            std::fs::write(&path, &script).unwrap();
            for model in std::fs::read_dir(&models).unwrap().map(|e| e.unwrap().path()) {
                std::fs::copy(&model, folder.path().join(model.file_name().unwrap())).unwrap();
            }
            let run = host.run_script(1, folder.path(), &path, &[], Duration::from_secs(60));
            assert!(run.is_ok(), "{page}: {}\n{script}", run.unwrap_err());
            count += 1;
        }
    }
    assert_eq!(count, 18);
}
