//! One scene at many values of its keys: runs side by side, one table, one page.

mod axis;
mod page;

pub use axis::Axis;
pub use page::{page, table};

use crate::checkpoint::Caller;
use crate::files::write_atomically;
use crate::report::{Headline, headline};
use crate::run::{Begin, Outcome, RunError, Runner};
use crate::scene::{Edit, Scene};
use psidpd_core::document::FileError;
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// What is swept, and how.
#[derive(Debug, Clone)]
pub struct Options {
    /// The scene file.
    pub scene: PathBuf,
    /// Values that all runs have.
    pub edits: Vec<Edit>,
    /// The keys and their values.
    pub axes: Vec<Axis>,
    /// Folder of the runs, `sweep.csv` and `report.html`.
    pub out: PathBuf,
    /// How many runs go on side by side.
    pub jobs: NonZeroUsize,
    /// Threads of each.
    pub threads: NonZeroUsize,
    /// Whether runs that are there are replaced; else they go on, and finished ones are taken as they are.
    pub overwrite: bool,
}

/// Why there is no sweep.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say it")]
pub enum SweepError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{points} runs are more than the {most} that a sweep may have: use fewer values")]
    TooMany { points: usize, most: usize },
    #[error("{} cannot be written: {source}", path.display())]
    Output { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Report(#[from] crate::report::ReportError),
}

/// One run of a sweep.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    /// Its keys with their values.
    #[serde(serialize_with = "shown")]
    pub edits: Vec<Edit>,
    /// Its folder.
    pub folder: PathBuf,
    /// What it measured; nothing if it failed or was stopped.
    pub headline: Headline,
    /// Why it has no results.
    pub error: Option<String>,
    /// Whether it came to its end.
    pub finished: bool,
}

fn shown<S: serde::Serializer>(edits: &[Edit], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(edits.iter().map(|e| (e.key(), e.value())))
}

/// The most runs of a sweep.
const MOST: usize = 10_000;

/// Runs all points, each in its own folder, until they are done or `stop` is set. `tell` hears of each that ended, with how
/// many have.
///
/// # Errors
/// A scene that cannot be read with the first values; a folder that cannot be written. A run that fails is a [`Point`]
/// with its error.
pub fn run(
    options: &Options,
    stop: &AtomicUsize,
    tell: &(dyn Fn(&Point, usize) + Sync),
) -> Result<Vec<Point>, SweepError> {
    let points = combinations(&options.axes)?;
    // What is wrong with the scene itself is said at once, and not once for each run.
    Scene::open_with(&options.scene, &[&options.edits[..], &points[0]].concat())?;
    std::fs::create_dir_all(&options.out)
        .map_err(|source| SweepError::Output { path: options.out.clone(), source })?;
    let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let done: Mutex<Vec<Option<Point>>> = Mutex::new(vec![None; points.len()]);
    let work = || {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(edits) = points.get(k).filter(|_| stop.load(Ordering::Relaxed) == 0) else { break };
            let point = run_point(options, edits, stop);
            if point.finished || point.error.is_some() {
                tell(&point, ended.fetch_add(1, Ordering::Relaxed) + 1);
            }
            done.lock().unwrap_or_else(PoisonError::into_inner)[k] = Some(point);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.get().min(points.len()) {
            scope.spawn(work);
        }
    });
    Ok(done.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten().collect())
}

/// Every value of every axis with every value of the others, the last axis fastest.
fn combinations(axes: &[Axis]) -> Result<Vec<Vec<Edit>>, SweepError> {
    let points = axes.iter().fold(1usize, |n, axis| n.saturating_mul(axis.edits.len()));
    if points > MOST {
        return Err(SweepError::TooMany { points, most: MOST });
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

/// The name of a point's folder.
fn name(edits: &[Edit]) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "=.,+-_".contains(c) { c } else { '_' };
    edits.iter().map(|e| e.to_string().chars().map(plain).collect::<String>()).collect::<Vec<_>>().join(",")
}

fn run_point(options: &Options, edits: &[Edit], stop: &AtomicUsize) -> Point {
    let folder = options.out.join(name(edits));
    let mut point = Point {
        edits: edits.to_vec(),
        folder: folder.clone(),
        headline: Headline::default(),
        error: None,
        finished: false,
    };
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
    let mut runner = Runner::begin(&scene, folder, begin)?;
    runner.set_threads(options.threads)?;
    Ok(matches!(runner.run(stop, &mut |_| ())?, Outcome::Finished { .. }))
}

/// Writes `sweep.csv` and `report.html`.
///
/// # Errors
/// A file cannot be written.
pub fn write(options: &Options, title: &str, points: &[Point]) -> Result<(), SweepError> {
    let to = |name: &str, text: String| {
        let path = options.out.join(name);
        write_atomically(&path, text.as_bytes())
            .map_err(|e| SweepError::Output { path, source: std::io::Error::other(e) })
    };
    to("sweep.csv", page::csv(&options.axes, points))?;
    to("report.html", page(title, &options.axes, points)?.render())
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let many: Axis = "kT=1:2:1000".parse().unwrap();
        assert!(combinations(&[many.clone(), many]).unwrap_err().to_string().contains("1000000 runs"));
    }
}
