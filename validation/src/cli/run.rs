use super::{Failure, Verdict, write_json};
use crate::report::{Progress, write_run_report};
use crate::run::run_scene;
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// Run a scene natively.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The scene file.
    scene: PathBuf,
    /// Folder for thermo.csv, dump.lammpstrj, final.data and summary.json.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Make report.html at the end, also of a run that stopped.
    #[arg(long)]
    report: bool,
}

pub fn run(arguments: &Arguments, json: Option<&Path>) -> Result<Verdict, Failure> {
    let scene = Scene::open(&arguments.scene).map_err(Failure::new)?;
    let progress = Progress::new();
    let total = scene.stages.iter().map(|s| s.steps).sum();
    let bar = progress.bar(&scene.title, total);
    let outcome = run_scene(&scene, &arguments.out, &mut |p| bar.set(p.step));
    if arguments.report && outcome.as_ref().err().is_none_or(|e| e.is_stop()) {
        write_run_report(&arguments.out).map_err(Failure::new)?;
    }
    let summary = outcome.map_err(Failure::new)?;
    bar.finish();
    println!("{summary}");
    println!("written to {}", arguments.out.display());
    write_json(json, &summary)?;
    Ok(Verdict::Good)
}
