//! Whole scenes: what users run, as shipped against the same scene without observables and output.

use super::outcome::Machine;
use super::scenes_in_lammps::{InLammps, Lammps};
use crate::ExperimentError;
use crate::files::absolute_folder;
use crate::machine::processor_seconds;
use psidpd_dynamics::run::{Begin, Runner};
use psidpd_dynamics::scene::{Output, Scene, TEMPLATES};
use psidpd_formats::files::{Existing, PathError, write_bytes};
use psidpd_observe::Observe;
use psidpd_report::{Progress, Table};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Shipped scenes, each the first with its observables and kind of fluid, with their models.
macro_rules! shipped {
    ($($scene:literal with $model:literal),+ $(,)?) => {
        &[$(Shipped {
            name: $scene,
            scene: include_str!(concat!("../../../scenes/", $scene, ".toml")),
            model_name: concat!($model, ".toml"),
            model: include_str!(concat!("../../../models/", $model, ".toml")),
        }),+]
    };
}

struct Shipped {
    name: &'static str,
    scene: &'static str,
    model_name: &'static str,
    model: &'static str,
}

const SHIPPED: &[Shipped] = shipped![
    "standard-dpd" with "standard-dpd",
    "standard-dpd-channel" with "standard-dpd",
    "warren-set6-bulk" with "warren2003-set6",
    "warren-set6-slab" with "warren2003-set6",
    "spline-drop" with "spline-attractive",
    "spline-eos" with "spline-eos",
    "binary-2d" with "binary-2d",
    "immiscible-liquids" with "drop-collision",
    "huggins" with "huggins",
    "van-der-waals-2d-slab" with "van-der-waals-2d-slab",
];

#[derive(Debug, Clone)]
pub struct Options<'a> {
    pub threads: &'a [NonZeroUsize],
    pub rounds: usize,
    /// The most steps of a stage.
    pub steps: Option<u64>,
    /// The LAMMPS to compare with; one that is installed if there is none.
    pub lammps: Option<&'a Path>,
    pub out: &'a Path,
}

/// Seconds of the fastest of some runs: of all processors together, and by the clock on the wall.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Seconds {
    pub processor: f64,
    pub wall: f64,
}

#[derive(Debug, Clone, Serialize)]
pub struct WholeScene {
    pub scene: String,
    /// Whether `psidpd new` writes it.
    pub is_template: bool,
    pub particles: usize,
    pub steps: u64,
    pub threads: usize,
    pub as_shipped: Seconds,
    /// The scene without `[observe]` and `[output]`.
    pub bare: Seconds,
    /// Processor time as shipped over that of the bare scene.
    pub ratio: f64,
    /// The same scene in LAMMPS, if that has its fluid.
    pub in_lammps: Option<InLammps>,
}

#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    pub machine: Machine,
    pub scenes: Vec<WholeScene>,
}

/// Times the scenes one after the other, each in turns with and without observables and output.
pub fn run(options: &Options, machine: Machine, progress: &Progress) -> Result<Outcome, ExperimentError> {
    let out = absolute_folder(options.out)?;
    let lammps = progress.spinner("LAMMPS", || Lammps::find(options.lammps, &out, progress))?;
    let paths = write_scenes(&out.join("scenes"))?;
    let bar = progress.bar("scenes", (paths.len() * options.threads.len() * options.rounds) as u64);
    let mut scenes = Vec::new();
    for (path, is_template) in paths {
        let mut scene = Scene::open(&path)?;
        for stage in &mut scene.stages {
            stage.steps = options.steps.map_or(stage.steps, |most| stage.steps.min(most));
        }
        let bare = Scene { observe: Observe::default(), output: Output::default(), ..scene.clone() };
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for &threads in options.threads {
            let mut fastest: [Option<Seconds>; 2] = [None; 2];
            let (mut particles, mut there) = (0, None::<[f64; 2]>);
            for _ in 0..options.rounds {
                // LAMMPS has one rank.
                if let Some(found) =
                    (threads.get() == 1).then(|| lammps.time(&name, &scene)).transpose()?.flatten()
                {
                    there = Some(there.map_or(found, |before| [0, 1].map(|k| found[k].min(before[k]))));
                }
                for (scene, fastest) in [&bare, &scene].into_iter().zip(&mut fastest) {
                    let (seconds, count) = time(scene, &out.join("run"), threads)?;
                    particles = count;
                    *fastest = Some(fastest.map_or(seconds, |before: Seconds| Seconds {
                        processor: before.processor.min(seconds.processor),
                        wall: before.wall.min(seconds.wall),
                    }));
                }
                bar.advance(1);
            }
            let [Some(bare), Some(as_shipped)] = fastest else { continue };
            scenes.push(WholeScene {
                scene: name.clone(),
                is_template,
                particles,
                steps: scene.steps(),
                threads: threads.get(),
                as_shipped,
                bare,
                ratio: as_shipped.processor / bare.processor,
                in_lammps: there.map(|[measured, bare]| InLammps {
                    measured,
                    bare,
                    over_shipped: measured / as_shipped.processor,
                }),
            });
        }
    }
    Ok(Outcome { machine, scenes })
}

/// Writes the templates and the shipped scenes, and returns their paths, and which are templates.
fn write_scenes(folder: &Path) -> Result<Vec<(PathBuf, bool)>, ExperimentError> {
    let mut paths = Vec::new();
    let write = |path: &Path, text: &str| -> Result<(), PathError> {
        std::fs::create_dir_all(path.parent().unwrap_or(path)).map_err(PathError::at("write", path))?;
        write_bytes(path, Existing::Replace, text.as_bytes())
    };
    for template in TEMPLATES {
        let path = folder.join("templates").join(template.name).with_extension("toml");
        write(&path, template.scene)?;
        write(&path.with_file_name(template.model_name), template.model)?;
        paths.push((path, true));
    }
    for shipped in SHIPPED {
        let path = folder.join("scenes").join(shipped.name).with_extension("toml");
        write(&path, shipped.scene)?;
        write(&folder.join("models").join(shipped.model_name), shipped.model)?;
        paths.push((path, false));
    }
    Ok(paths)
}

/// Runs a scene, and returns how long it took and how many particles it has.
fn time(scene: &Scene, out: &Path, threads: NonZeroUsize) -> Result<(Seconds, usize), ExperimentError> {
    let (processor, wall) = (processor_seconds(), Instant::now());
    let mut runner = Runner::begin(scene, out, Begin::Overwrite)?;
    runner.set_threads(threads)?;
    runner.run_to_end(&mut |_| {})?;
    let seconds = Seconds { processor: processor_seconds() - processor, wall: wall.elapsed().as_secs_f64() };
    Ok((seconds, runner.particles()))
}

impl Outcome {
    pub fn table(&self) -> Table {
        let header = [
            "scene",
            "particles",
            "steps",
            "threads",
            "as shipped, s",
            "without, s",
            "ratio",
            "wall",
            "LAMMPS, s",
            "without, s",
            "over shipped",
        ];
        let mut table = Table::new(header);
        for s in &self.scenes {
            let there = |of: fn(&InLammps) -> f64| {
                s.in_lammps.as_ref().map_or_else(|| "–".into(), |here| format!("{:.2}", of(here)))
            };
            let name = if s.is_template { format!("new --template {}", s.scene) } else { s.scene.clone() };
            table.push([
                name,
                s.particles.to_string(),
                s.steps.to_string(),
                s.threads.to_string(),
                format!("{:.2}", s.as_shipped.processor),
                format!("{:.2}", s.bare.processor),
                format!("{:.2}", s.ratio),
                format!("{:.2}", s.as_shipped.wall / s.bare.wall),
                there(|of| of.measured),
                there(|of| of.bare),
                there(|of| of.over_shipped),
            ]);
        }
        table
    }
}
