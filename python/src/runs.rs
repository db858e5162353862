use crate::engine::{settings, thread_count};
use crate::errors::{RunStoppedError, exception, wrong};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use psidpd::experiments::sweep::{self as sweeps, Axis, Options};
use psidpd::formats::Configuration;
use psidpd::formats::files::Existing;
use psidpd::observe;
use psidpd::report::{headline, write_run_report};
use psidpd::run::{Begin, Outcome, Runner};
use psidpd::scene::Scene;
use pyo3::exceptions::{PyKeyboardInterrupt, PyUserWarning};
use pyo3::prelude::*;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The number of the signal SIGINT.
const INTERRUPT: usize = 2;

/// The time between checks for Ctrl-C. Python reports the signal only when asked.
pub const LOOK: Duration = Duration::from_millis(50);

/// The scene of a file, or of a text whose paths start from a folder; with another precision or device, if they are given.
pub fn read_scene(
    path: Option<PathBuf>,
    text: Option<&str>,
    base: &Path,
    precision: Option<&str>,
    device: Option<&str>,
) -> PyResult<Scene> {
    let mut scene = match (path, text) {
        (Some(path), _) => Scene::open(&path),
        (None, text) => Scene::parse("scene", text.unwrap_or_default(), base),
    }
    .map_err(exception)?;
    if let Some(name) = precision {
        scene.precision = Some(settings(name, 1)?.precision);
    }
    if let Some(name) = device {
        scene.device = name.parse().map_err(wrong)?;
    }
    Ok(scene)
}

/// Runs a scene into the folder `out`: what `psidpd.run` does. The scene is the file `path`, or `text`, whose paths start
/// from the folder `base`. `begin` is "new", "resume" or "overwrite".
///
/// Ctrl-C ends it after the present step, with a checkpoint, and raises KeyboardInterrupt.
#[pyfunction]
#[pyo3(signature = (path, text, base, out, threads, precision, device, begin, report))]
#[allow(clippy::too_many_arguments, reason = "the Python function has defaults and keywords for them")]
pub fn run_scene(
    py: Python,
    path: Option<PathBuf>,
    text: Option<&str>,
    base: PathBuf,
    out: PathBuf,
    threads: usize,
    precision: Option<&str>,
    device: Option<&str>,
    begin: &str,
    report: bool,
) -> PyResult<()> {
    let scene = read_scene(path, text, &base, precision, device)?;
    let threads = thread_count(threads)?;
    let begin = match begin {
        "new" => Begin::New,
        "resume" => Begin::Resume,
        "overwrite" => Begin::Overwrite,
        other => {
            return Err(wrong(format!("begin is \"new\", \"resume\" or \"overwrite\", not \"{other}\"")));
        }
    };
    let mut raised = None;
    let mut warnings = Vec::new();
    let outcome = py.detach(|| {
        let mut runner = Runner::begin(&scene, &out, begin)?;
        runner.set_threads(threads)?;
        let stop = AtomicUsize::new(0);
        let mut looked = Instant::now();
        let outcome = runner.run(&stop, &mut |progress| {
            warnings.extend(progress.deviations.iter().map(ToString::to_string));
            if looked.elapsed() < LOOK {
                return;
            }
            looked = Instant::now();
            if let Err(signal) = Python::attach(|py| py.check_signals()) {
                raised = Some(signal);
                stop.store(INTERRUPT, Ordering::Relaxed);
            }
        });
        if report && outcome.as_ref().err().is_none_or(psidpd::run::RunError::is_stop) {
            // If both fail, the error of the run is more informative than the error of the page.
            let page = write_run_report(&out, Existing::Keep);
            if outcome.is_ok() {
                page?;
            }
        }
        Ok::<_, psidpd::cli::Failure>(outcome?)
    });
    for warning in &warnings {
        let text = CString::new(warning.replace('\0', " "))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 2)?;
    }
    match (outcome.map_err(exception)?, raised) {
        (Outcome::Finished { .. }, None) => Ok(()),
        (Outcome::Interrupted { step, steps, .. }, Some(signal))
            if signal.is_instance_of::<PyKeyboardInterrupt>(py) =>
        {
            Err(PyKeyboardInterrupt::new_err(format!(
                "stopped after step {step} of {steps}; to go on: psidpd.run(…, out={:?}, resume=True)",
                out.display().to_string()
            )))
        }
        (_, Some(signal)) => Err(signal),
        (Outcome::Interrupted { .. }, None) => Err(PyKeyboardInterrupt::new_err("stopped")),
    }
}

/// Mean of a stationary series of correlated samples, and its standard error: (mean, error).
///
/// The error is NaN for fewer than 8 samples. See `docs/observables.md` for the method.
#[pyfunction]
pub fn estimate(series: &Bound<PyAny>) -> PyResult<(f64, f64)> {
    let series = crate::arrays::numbers(series, "series")?;
    let values = series.as_slice()?;
    match observe::estimate(values) {
        Ok(found) => Ok((found.mean, found.error)),
        Err(observe::ObserveError::TooFew { found, .. }) if found > 0 => {
            Ok((values.iter().sum::<f64>() / found as f64, f64::NAN))
        }
        Err(error) => Err(exception(error)),
    }
}

/// Runs a scene with every combination of values of its keys, which are given as in a file: what `psidpd.sweep` does.
#[pyfunction]
#[pyo3(signature = (scene, over, out, jobs, threads, overwrite))]
pub fn sweep(
    py: Python,
    scene: PathBuf,
    over: Vec<(String, Vec<String>)>,
    out: PathBuf,
    jobs: Option<usize>,
    threads: usize,
    overwrite: bool,
) -> PyResult<()> {
    let axis = |(key, values): (String, Vec<String>)| {
        if values.is_empty() {
            return Err(wrong(format!("{key}: no values")));
        }
        let edits =
            values.iter().map(|value| format!("{key}={value}").parse()).collect::<Result<_, String>>();
        let text = format!("{key}={}", values.join(","));
        Ok(Axis { key, edits: edits.map_err(wrong)?, text })
    };
    let axes = over.into_iter().map(axis).collect::<PyResult<Vec<Axis>>>()?;
    let threads = thread_count(threads)?;
    let jobs = jobs.map(thread_count).transpose()?;
    let options = Options { scene, edits: Vec::new(), axes, out, jobs, threads, overwrite };
    let stop = AtomicUsize::new(0);
    let (ended, raised) = py.detach(|| {
        std::thread::scope(|scope| {
            let runs = scope.spawn(|| sweeps::run(&options, &stop, &|_, _| ()));
            let mut raised = None;
            while !runs.is_finished() {
                std::thread::sleep(LOOK);
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals()).err();
                    stop.store(if raised.is_some() { INTERRUPT } else { 0 }, Ordering::Relaxed);
                }
            }
            (runs.join(), raised)
        })
    });
    ended.map_err(|_| RunStoppedError::new_err("the sweep failed"))?.map_err(exception)?;
    raised.map_or(Ok(()), Err)
}

/// The positions of a data file, in the order of the particles' tags: shape (N, 3).
#[pyfunction]
pub fn read_positions(py: Python, path: PathBuf) -> PyResult<Bound<PyArray2<f64>>> {
    let read = py.detach(|| Configuration::open(&path, None)).map_err(exception)?;
    let mut order: Vec<usize> = (0..read.x.len()).collect();
    order.sort_by_key(|k| read.tag.get(*k).copied());
    let flat: Vec<f64> = order.iter().flat_map(|k| read.x[*k]).collect();
    PyArray1::from_vec(py, flat).reshape([order.len(), 3])
}

/// A result of a run: name, value, error, unit, source, mean-field prediction, and published value with its error.
type Found = (String, f64, Option<f64>, String, String, Option<f64>, Option<[f64; 2]>);

/// The results of the run in a folder that are looked for first, and notes on them.
#[pyfunction]
#[pyo3(name = "headline")]
pub fn headline_of(py: Python, folder: PathBuf) -> (Vec<Found>, Vec<String>) {
    let all = py.detach(|| headline(&folder));
    let values = all.values.into_iter();
    let values =
        values.map(|v| (v.name, v.value, v.error, v.unit, v.source, v.mean_field, v.published)).collect();
    (values, all.notes)
}
