//! The commands and files of the README work as printed.

use psidpd_tests::{blocks, lammps, psidpd, readme_block, root, said};
use std::time::Duration;

#[test]
fn the_lammps_script_runs_in_the_checkout() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("in.readme");
    let (host, plugin) = lammps();
    let text = readme_block("lammps", "pair_style   dpd/psi");
    // The plugin is at the README's path, unless the environment moved it.
    std::fs::write(
        &script,
        text.replace("target/lammps/psidpdplugin.so", &format!("\"{}\"", plugin.display())),
    )
    .unwrap();
    let run = host.run_script(1, &root(), &script, &["-log", "none"], Duration::from_secs(300)).unwrap();
    assert!(run.stdout.contains("Loop time"), "{}", run.stdout);
}

/// Each block of the page on LAMMPS behind its whole script replaces the lines of the README's script that give the
/// same commands.
#[test]
fn the_lines_of_the_page_on_lammps_run() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("in.page");
    let (host, plugin) = lammps();
    let whole = readme_block("lammps", "pair_style   dpd/psi");
    let (before, after) = whole.split_at(whole.find("plugin ").unwrap());
    let command = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
    let blocks: Vec<_> =
        blocks("docs/lammps.md").into_iter().filter(|b| b.language == "lammps").skip(1).collect();
    assert_eq!(blocks.len(), 3);
    for block in blocks {
        let given: Vec<String> = block.text.lines().map(command).collect();
        let kept = |part: &str| {
            let lines = part.lines().filter(|line| !given.contains(&command(line)));
            lines.map(|line| format!("{line}\n")).collect::<String>()
        };
        // `newton` stands before the box, and the plugin before its styles.
        let (newton, others): (Vec<&str>, Vec<&str>) =
            block.text.lines().partition(|line| command(line) == "newton");
        let load = after.lines().next().filter(|_| !given.contains(&"plugin".to_owned())).unwrap_or_default();
        let rest = kept(&after[after.find('\n').unwrap()..]);
        let text = format!("{}\n{}{load}\n{}\n{rest}", newton.join("\n"), kept(before), others.join("\n"))
            .replace("target/lammps/psidpdplugin.so", &format!("\"{}\"", plugin.display()));
        std::fs::write(&script, &text).unwrap();
        let ranks = if block.text.contains("0.0 bin") { 1 } else { 2 };
        let run =
            host.run_script(ranks, &root(), &script, &["-log", "none"], Duration::from_secs(300)).unwrap();
        assert!(run.stdout.contains("Loop time"), "{text}\n{}", run.stdout);
    }
}

/// With the model of the tutorial, as the page says.
#[test]
fn the_script_of_the_page_on_lammps_runs() {
    let folder = tempfile::tempdir().unwrap();
    let (host, plugin) = lammps();
    let model = blocks("docs/tutorial.md").into_iter().find(|b| b.text.starts_with("# fluid.toml")).unwrap();
    std::fs::write(folder.path().join("fluid.toml"), model.text).unwrap();
    let page = blocks("docs/lammps.md").into_iter().find(|b| b.language == "lammps").unwrap();
    let script = folder.path().join("in.page");
    let there = format!("\"{}\"", plugin.display());
    std::fs::write(&script, page.text.replace("target/lammps/psidpdplugin.so", &there)).unwrap();
    let limit = Duration::from_secs(300);
    let run = host.run_script(1, folder.path(), &script, &["-log", "none"], limit).unwrap();
    assert!(run.stdout.contains("Loop time"), "{}", run.stdout);
}

#[test]
fn the_native_scene_runs() {
    let folder = tempfile::tempdir().unwrap();
    let models = root().join("validation/models").display().to_string();
    let scene = readme_block("toml", "# scene.toml").replace("validation/models", &models);
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let output = psidpd(folder.path(), &["run", "scene.toml", "--out", "slab", "--json", "run.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = std::fs::read_to_string(folder.path().join("run.json")).unwrap();
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let values = found["headline"]["values"].as_array().unwrap();
    let [t, error] = ["value", "error"]
        .map(|key| values.iter().find(|v| v["name"] == "temperature").and_then(|v| v[key].as_f64()).unwrap());
    // Before the slab of a lattice has melted it is some percent too hot.
    assert!((t - 1.0).abs() < 4.0 * error && error < 0.01, "{found}");
    assert!(!said(&output).contains("do not trust"), "{}", said(&output));
    for file in ["thermo.csv", "dump.lammpstrj", "final.data", "summary.json"] {
        assert!(folder.path().join("slab").join(file).is_file(), "{file} is missing");
    }
    // The slab is at its temperature from the first row of its last stage.
    let summary = std::fs::read_to_string(folder.path().join("slab/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let temperature = summary["means"]["temperature"].as_f64().unwrap();
    assert!((temperature - 1.0).abs() < 0.015, "{temperature}");
}
