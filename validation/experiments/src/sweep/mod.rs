//! One scene at many values of its keys: runs side by side, one table, one page.

mod axis;
mod page;

pub use axis::Axis;
pub use page::{page, table};

use crate::ExperimentError;
use crate::jobs;
use psidpd_dynamics::checkpoint::Caller;
use psidpd_dynamics::run::{Begin, Folder, Outcome, RunError, Runner};
use psidpd_dynamics::scene::{Edit, Scene};
use psidpd_formats::files::{Existing, PathError, may_replace, read_if_there, replace_inside};
use psidpd_report::{Headline, headline};
use serde::Serialize;
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

#[derive(Debug, Clone)]
pub struct Options {
    pub scene: PathBuf,
    /// Values that all runs have.
    pub edits: Vec<Edit>,
    pub axes: Vec<Axis>,
    /// Folder of the runs, `sweep.csv` and `report.html`.
    pub out: PathBuf,
    /// How many runs go on side by side; processors over threads if left out.
    pub jobs: Option<NonZeroUsize>,
    pub threads: NonZeroUsize,
    /// Whether runs that are there are replaced; else they go on, and finished ones are taken as they are.
    pub overwrite: bool,
}

#[derive(Debug, Clone, Default, Serialize)]
pub struct Point {
    #[serde(serialize_with = "shown")]
    pub edits: Vec<Edit>,
    #[serde(serialize_with = "psidpd_formats::files::shown")]
    pub folder: PathBuf,
    /// What it measured; nothing if it failed or was stopped.
    pub headline: Headline,
    pub error: Option<String>,
    pub finished: bool,
}

fn shown<S: serde::Serializer>(edits: &[Edit], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(edits.iter().map(|e| (e.key(), e.value())))
}

const TABLE: &str = "sweep.csv";
const PAGE: &str = "report.html";

const MOST: usize = 10_000;

/// Runs all points, each in its own folder, until they are done or `stop` is set, and writes `sweep.csv` and `report.html`. `tell`
/// hears of each that ended, with how many have. Of two sweeps at once in a folder the second is refused.
///
/// # Errors
/// A scene that cannot be read with the first values; a folder that cannot be written. A run that fails is a [`Point`]
/// with its error.
pub fn run(
    options: &Options,
    stop: &AtomicUsize,
    tell: &(dyn Fn(&Point, usize) + Sync),
) -> Result<Vec<Point>, ExperimentError> {
    let points = combinations(&options.axes)?;
    // What is wrong with the scene itself is said at once, and not once for each run.
    Scene::open_with(&options.scene, &[&options.edits[..], &points[0]].concat())?;
    let _locked = Folder::open(&options.out)?;
    refuse_other_grid(options, &points)?;
    refuse_results(options)?;
    let ended = AtomicUsize::new(0);
    let goes_on = |_: &_| stop.load(Ordering::Relaxed) == 0;
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let at_once = options.jobs.map_or((cores / options.threads).max(1), NonZeroUsize::get);
    let points =
        jobs::on(at_once.min(points.len()), points.iter().enumerate().take_while(goes_on), |edits| {
            let point = run_point(options, edits, stop);
            if point.finished || point.error.is_some() {
                tell(&point, ended.fetch_add(1, Ordering::Relaxed) + 1);
            }
            point
        });
    write(options, &points)?;
    Ok(points)
}

/// A table or a page that no sweep made is not replaced.
fn refuse_results(options: &Options) -> Result<(), ExperimentError> {
    let existing = Existing::from(options.overwrite);
    for name in [TABLE, PAGE] {
        let path = options.out.join(name);
        // A link is no file of anybody's, and is replaced itself. Every row of the table is known to be of this sweep.
        let is_file = path.symlink_metadata().is_ok_and(|about| about.is_file());
        if is_file && !(name == TABLE && is_table(&path)) {
            may_replace(&path, existing)?;
        }
    }
    Ok(())
}

/// Whether a file is a table of a sweep, by the names of its last columns.
fn is_table(path: &Path) -> bool {
    let text = read_if_there(path).ok().flatten().unwrap_or_default();
    text.lines().next().is_some_and(|header| header.ends_with("finished,notes,folder"))
}

/// Every value of every axis with every value of the others, the last axis fastest.
fn combinations(axes: &[Axis]) -> Result<Vec<Vec<Edit>>, ExperimentError> {
    let points = axes.iter().fold(1usize, |n, axis| n.saturating_mul(axis.edits.len()));
    if points > MOST {
        return Err(ExperimentError::TooManyRuns { points, most: MOST });
    }
    let mut all = vec![Vec::new()];
    for axis in axes {
        all = all
            .iter()
            .flat_map(|point: &Vec<Edit>| {
                axis.edits.iter().map(move |edit| [&point[..], std::slice::from_ref(edit)].concat())
            })
            .collect();
    }
    Ok(all)
}

/// A table of other runs is not replaced: every row must be a point of this sweep. Rows end with their folders.
fn refuse_other_grid(options: &Options, points: &[Vec<Edit>]) -> Result<(), ExperimentError> {
    let path = options.out.join(TABLE);
    let Ok(Some(text)) = read_if_there(&path) else { return Ok(()) };
    let ends: Vec<String> = points.iter().map(|p| format!(",{}", page::quoted(&name(p)))).collect();
    let stranger = text.lines().skip(1).find(|row| !ends.iter().any(|end| row.ends_with(end)));
    match stranger.filter(|_| !options.overwrite) {
        Some(row) => Err(ExperimentError::OtherGrid { path, row: row.to_owned() }),
        None => Ok(()),
    }
}

/// The name of a point's folder. Where a character cannot be in it, the name ends with a number made of the whole text, so that
/// other values have other folders.
fn name(edits: &[Edit]) -> String {
    let text = edits.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
    let is_plain = |c: char| c.is_alphanumeric() || "=.,+-_".contains(c);
    let plain: String = text.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
    if text == plain { plain } else { format!("{plain}-{:08x}", mixed(text.as_bytes())) }
}

/// Fowler, Noll and Vo's hash 1a of 32 bits: the same on every machine and in every version.
fn mixed(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

fn run_point(options: &Options, edits: &[Edit], stop: &AtomicUsize) -> Point {
    let folder = options.out.join(name(edits));
    let mut point = Point { edits: edits.to_vec(), folder: folder.clone(), ..Point::default() };
    let all = [&options.edits[..], edits].concat();
    match attempt(options, &all, &folder, stop) {
        Ok(finished) => point.finished = finished,
        Err(error) => {
            let help = error.help(Caller::Options).map_or(String::new(), |help| format!(" ({help})"));
            point.error = Some(format!("{error}{help}"));
        }
    }
    if point.finished {
        point.headline = headline(&folder);
    }
    point
}

fn attempt(options: &Options, edits: &[Edit], folder: &Path, stop: &AtomicUsize) -> Result<bool, RunError> {
    let scene = Scene::open_with(&options.scene, edits)?;
    let begin = if options.overwrite { Begin::Overwrite } else { Begin::Resume };
    if folder.is_symlink() {
        let cause = io::Error::new(io::ErrorKind::NotADirectory, "not a folder");
        return Err(PathError::at("write", folder)(cause).into());
    }
    let mut runner = Runner::begin(&scene, folder, begin)?;
    runner.set_threads(options.threads)?;
    Ok(matches!(runner.run(stop, &mut |_| ())?, Outcome::Finished { .. }))
}

/// Writes `sweep.csv` and `report.html`.
fn write(options: &Options, points: &[Point]) -> Result<(), ExperimentError> {
    let title = options.scene.file_stem().map_or("sweep".into(), |name| name.to_string_lossy());
    let to = |name: &str, text: String| replace_inside(&options.out.join(name), text.as_bytes(), true);
    to(TABLE, page::csv(&options.axes, points))?;
    Ok(to(PAGE, page(&title, &options.axes, points)?.render())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of other values stays, unless they are among the new ones or `overwrite` says so.
    #[test]
    fn a_table_of_other_values_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let axes = |texts: &[&str]| texts.iter().map(|a| a.parse().unwrap()).collect::<Vec<Axis>>();
        let mut options = Options {
            scene: PathBuf::new(),
            edits: Vec::new(),
            axes: axes(&["kT=0.5,1", "density=5,6"]),
            out: folder.path().to_owned(),
            jobs: None,
            threads: NonZeroUsize::MIN,
            overwrite: false,
        };
        let point = |edits: &Vec<Edit>| Point {
            edits: edits.clone(),
            folder: options.out.join(name(edits)),
            finished: true,
            ..Point::default()
        };
        let points: Vec<Point> = combinations(&options.axes).unwrap().iter().map(point).collect();
        write(&options, &points).unwrap();
        let try_over = |options: &mut Options, texts: &[&str]| {
            options.axes = axes(texts);
            refuse_other_grid(options, &combinations(&options.axes).unwrap()).map_err(|e| e.to_string())
        };
        assert_eq!(try_over(&mut options, &["kT=0.5,1", "density=5,6"]), Ok(()));
        assert_eq!(try_over(&mut options, &["kT=0.5,1,2", "density=5,6"]), Ok(()));
        let other = try_over(&mut options, &["kT=0.5,2", "density=5,6"]).unwrap_err();
        assert!(other.contains("kT=1,density=5") && other.contains("--overwrite"), "{other}");
        assert!(try_over(&mut options, &["density=5,6"]).is_err());
        options.overwrite = true;
        assert_eq!(try_over(&mut options, &["kT=2,3"]), Ok(()));
    }

    #[test]
    fn points_are_all_combinations_with_folders_of_their_own() {
        let axes: Vec<Axis> = ["kT=0.5:1.5:3", "integrator=aboba,baoab"].map(|a| a.parse().unwrap()).to_vec();
        let points = combinations(&axes).unwrap();
        let names: Vec<String> = points.iter().map(|p| name(p)).collect();
        assert_eq!(
            names[..3],
            ["kT=0.5,integrator=aboba", "kT=0.5,integrator=baoab", "kT=1,integrator=aboba"]
        );
        assert_eq!(names.len(), 6);
        // What cannot be in the name of a folder still keeps values apart.
        let files: Vec<String> = ["model=a_b", "model=a/b", "model=a\"b", "model=a b"]
            .map(|text| name(&[text.parse().unwrap()]))
            .to_vec();
        assert_eq!(files[0], "model=a_b");
        assert!((0..4).all(|k| (0..k).all(|l| files[k] != files[l])), "{files:?}");
        assert!(
            files.iter().all(|f| f.starts_with("model=a_b") && !f.contains(['/', '"', ' '])),
            "{files:?}"
        );
        let many: Axis = "kT=1:2:1000".parse().unwrap();
        assert!(combinations(&[many.clone(), many]).unwrap_err().to_string().contains("1000000 runs"));
    }
}
