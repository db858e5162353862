//! A run that Python steps.

use crate::engine::thread_count;
use crate::errors::{RunStoppedError, exception, wrong};
use crate::lent::Lent;
use crate::runs::{LOOK, read_scene};
use numpy::{PyArray1, PyArray2};
use psidpd::run::{Live, Simulation};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

type Part = fn(&Simulation) -> &[[f64; 3]];

/// What the arrays have, in their order.
const PARTS: [Part; 3] = [|run| &run.state().x, |run| &run.state().v, Simulation::forces];

/// The compiled part of psidpd.Simulation.
#[pyclass(frozen, module = "psidpd")]
pub struct Steps {
    live: Mutex<Live>,
    /// Arrays that were asked for; their numbers are renewed after steps.
    arrays: [OnceLock<Py<PyArray2<f64>>>; 3],
    process: u32,
}

impl Steps {
    /// Does something with the run, without Python's lock.
    fn with<R: Send>(&self, py: Python, act: impl FnOnce(&mut Live) -> R + Send) -> PyResult<R> {
        if self.process != std::process::id() {
            return Err(RunStoppedError::new_err(
                "this Simulation belongs to another process: make one here",
            ));
        }
        Ok(py.detach(|| act(&mut self.live.lock().unwrap_or_else(PoisonError::into_inner))))
    }

    /// An array of numpy that is the same at every call.
    fn shown(&self, py: Python, part: usize) -> PyResult<Py<PyArray2<f64>>> {
        let vectors = self.with(py, |live| by_tag(live, PARTS[part]))?;
        let lent = Lent::array(py, &vectors)?.unbind();
        Ok(self.arrays[part].get_or_init(|| lent).clone_ref(py))
    }
}

/// Values of all particles, in the order of tags.
fn by_tag<T: Copy + Default>(live: &Live, of: fn(&Simulation) -> &[T]) -> Vec<T> {
    let simulation = live.simulation();
    let mut sorted = vec![T::default(); simulation.len()];
    for (value, tag) in of(simulation).iter().zip(&simulation.state().tag) {
        sorted[*tag as usize - 1] = *value;
    }
    sorted
}

#[pymethods]
impl Steps {
    #[new]
    fn new(
        py: Python,
        path: Option<PathBuf>,
        text: Option<&str>,
        base: PathBuf,
        threads: usize,
        precision: Option<&str>,
        device: Option<&str>,
    ) -> PyResult<Steps> {
        let scene = read_scene(path, text, &base, precision, device)?;
        let threads = thread_count(threads)?;
        let live = py.detach(|| Live::new(scene, threads)).map_err(exception)?;
        let tags = &live.simulation().state().tag;
        if tags.iter().any(|tag| !(1..=tags.len() as i32).contains(tag)) {
            return Err(wrong("the tags of the particles must be 1 to their number"));
        }
        Ok(Steps { live: Mutex::new(live), arrays: Default::default(), process: std::process::id() })
    }

    /// Makes steps, up to the end of the scene if their number is left out. Ctrl-C ends them after the present one.
    #[pyo3(signature = (steps))]
    fn run(&self, py: Python, steps: Option<u64>) -> PyResult<()> {
        let mut raised = None;
        let outcome = self.with(py, |live| {
            let mut looked = Instant::now();
            live.run(steps.unwrap_or(live.left()), || {
                if looked.elapsed() >= LOOK {
                    looked = Instant::now();
                    raised = Python::attach(|py| py.check_signals()).err();
                }
                raised.is_some()
            })
        })?;
        for (array, of) in self.arrays.iter().zip(PARTS) {
            if let Some(array) = array.get() {
                Lent::renew(array.bind(py), &self.with(py, |live| by_tag(live, of))?)?;
            }
        }
        outcome.map_err(exception)?;
        raised.map_or(Ok(()), Err)
    }

    /// The steps of the scene that are left.
    #[getter]
    fn left(&self, py: Python) -> PyResult<u64> {
        self.with(py, |live| live.left())
    }

    #[getter]
    fn positions(&self, py: Python) -> PyResult<Py<PyArray2<f64>>> {
        self.shown(py, 0)
    }

    #[getter]
    fn velocities(&self, py: Python) -> PyResult<Py<PyArray2<f64>>> {
        self.shown(py, 1)
    }

    #[getter]
    fn forces(&self, py: Python) -> PyResult<Py<PyArray2<f64>>> {
        self.shown(py, 2)
    }

    /// The index of each particle's species, in the order of tags.
    #[getter]
    fn types<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        Ok(PyArray1::from_vec(py, self.with(py, |live| by_tag(live, |run| &run.state().species[..]))?))
    }

    /// The edge vectors of the box, as rows.
    #[getter]
    fn r#box(&self, py: Python) -> PyResult<[[f64; 3]; 3]> {
        self.with(py, |live| [0, 1, 2].map(|k| live.simulation().state().domain.edge(k)))
    }

    #[getter]
    fn species(&self, py: Python) -> PyResult<Vec<String>> {
        self.with(py, |live| live.scene().model.species().to_vec())
    }

    /// Step number, time, name of the stage, kT of the thermostat, temperature, potential energy, kinetic energy, and the
    /// pressure tensor in the order xx, yy, zz, xy, xz, yz.
    #[getter]
    #[allow(clippy::type_complexity, reason = "Python gives the numbers their names")]
    fn now(&self, py: Python) -> PyResult<(u64, f64, String, f64, f64, f64, f64, [f64; 6])> {
        self.with(py, |live| {
            let (s, stage) = (live.simulation(), live.stage());
            let energies = (s.temperature(), s.potential_energy(), s.kinetic_energy());
            let (number, time, name) = (s.step_number(), live.time(), stage.name.clone());
            (number, time, name, stage.kt, energies.0, energies.1, energies.2, s.pressure_tensor())
        })
    }
}
