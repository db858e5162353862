//! Forces of configurations.

use crate::arrays::{integers, numbers, shown};
use crate::errors::{RunStoppedError, exception, wrong};
use crate::model::Model;
use nalgebra::Matrix3;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use psidpd_core::engine::{self, Evaluated, PeriodicBox, Pool, Precision, Settings, at_once, check_reach};
use psidpd_core::model::Fluid;
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError, TryLockError};

/// The conservative forces of a model at one temperature: Engine(model, kT).evaluate(x, box, types).
///
/// `precision` is "double", or "mixed" as runs have it by default; `threads` share the work. One evaluation at a time:
/// other threads of Python wait for it.
#[pyclass(frozen, module = "psidpd")]
pub struct Engine {
    engine: Mutex<engine::Engine>,
    /// The fluid and the settings serve to make the engine anew in a forked process; `process` owns its threads.
    fluid: Fluid,
    settings: Settings,
    process: AtomicU32,
    species: Vec<String>,
    dimensions: usize,
    /// The longest range of any force.
    #[pyo3(get)]
    cutoff: f64,
    description: String,
}

/// The result of an evaluation.
#[pyclass(frozen, get_all, module = "psidpd")]
pub struct Evaluation {
    /// The potential energy U = Σ ψ + Σ φ.
    energy: f64,
    /// Σ r_ij ⊗ F_ij, shape (6,): xx, yy, zz, xy, xz, yz.
    virial: Py<PyArray1<f64>>,
    /// Weighted local densities, without corrections, shape (N, densities × species): for each density of the model
    /// one column for each species.
    densities: Py<PyArray2<f64>>,
    /// Forces, in the shape of the positions.
    forces: Py<PyArray2<f64>>,
}

#[pymethods]
impl Engine {
    #[new]
    #[pyo3(signature = (model, kT, *, precision = "double", threads = 1))]
    #[allow(non_snake_case)]
    fn new(model: &Model, kT: f64, precision: &str, threads: usize) -> PyResult<Engine> {
        let fluid = model.model.at(kT).map_err(exception)?;
        let settings = settings(precision, threads)?;
        let engine = engine::Engine::new(&fluid, settings).map_err(exception)?;
        Ok(Engine {
            species: model.model.species().to_vec(),
            dimensions: fluid.dimensions,
            cutoff: engine.plan().cutoff(),
            description: format!("{}\n{settings:?}", engine.plan()),
            engine: Mutex::new(engine),
            fluid,
            settings,
            process: AtomicU32::new(std::process::id()),
        })
    }

    /// Energy, virial, densities and conservative forces of particles in a box.
    ///
    /// x : array (N, 3), in two dimensions also (N, 2): positions, wrapped or not.
    /// box : a length, three lengths (two in two dimensions), or a matrix whose rows are the edge vectors.
    /// types : array (N,) of indices of species, from 0, or of their names; left out, all are of the first species.
    /// periodic : the periodic directions, all if left out.
    ///
    /// Raises InputError for arrays that do not fit, and where the energy is not finite.
    #[pyo3(signature = (x, r#box, types = None, *, periodic = None))]
    fn evaluate(
        &self,
        py: Python,
        x: &Bound<PyAny>,
        r#box: &Bound<PyAny>,
        types: Option<&Bound<PyAny>>,
        periodic: Option<Vec<bool>>,
    ) -> PyResult<Evaluation> {
        let positions = numbers(x, "x")?;
        let (count, width) = match *positions.shape() {
            [count, 3] => (count, 3),
            [count, 2] if self.dimensions == 2 => (count, 2),
            _ => {
                let shape = shown(positions.shape());
                return Err(wrong(format!("x must have the shape (N, {}), has {shape}", self.dimensions)));
            }
        };
        // Without Python's lock another thread may write to the array, or resize it.
        let points: Vec<[f64; 3]> = match width {
            3 => positions.as_slice()?.as_chunks().0.to_vec(),
            _ => positions.as_slice()?.as_chunks().0.iter().map(|[x, y]| [*x, *y, 0.0]).collect(),
        };
        // What lends the array ends in an abort if the array has moved meanwhile.
        drop(positions);
        let kinds = self.kinds(types, count)?;
        let periodic = directions(periodic, self.dimensions)?;
        let domain = self.domain(r#box, periodic)?;
        check_reach(&domain, self.dimensions, self.cutoff, count).map_err(exception)?;
        self.follow_fork()?;
        let found = py.detach(|| {
            let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
            engine.evaluate(&points, &domain, &kinds)
        });
        self.evaluation(py, found.map_err(exception)?, count, width)
    }

    fn __repr__(&self) -> String {
        format!("<psidpd.Engine\n{}>", self.description)
    }
}

impl Engine {
    /// Makes the engine anew in a forked process, which has no threads of the engine. Python's lock is held, so only one
    /// thread at a time runs this.
    fn follow_fork(&self) -> PyResult<()> {
        let here = std::process::id();
        if self.process.load(Ordering::Relaxed) == here {
            return Ok(());
        }
        // If a thread was evaluating during the fork, the lock stays closed in the new process.
        let mut engine = match self.engine.try_lock() {
            Ok(engine) => engine,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {
                return Err(RunStoppedError::new_err(
                    "this process was forked while another thread evaluated forces with this Engine: make an Engine of its \
                     own here, or start processes with multiprocessing.get_context(\"spawn\")",
                ));
            }
        };
        *engine = engine::Engine::new(&self.fluid, self.settings).map_err(exception)?;
        self.process.store(here, Ordering::Relaxed);
        Ok(())
    }

    fn kinds(&self, types: Option<&Bound<PyAny>>, count: usize) -> PyResult<Vec<i32>> {
        let Some(types) = types else { return Ok(vec![0; count]) };
        if types.is_instance_of::<PyString>() {
            return Err(wrong(format!(
                "types must have an index or a name of a species for each particle, as a list; found the single text {}",
                types.repr()?
            )));
        }
        let kinds = match types.extract::<Vec<String>>() {
            Ok(names) => names.iter().map(|name| self.index(name)).collect::<PyResult<Vec<i32>>>()?,
            Err(_) => {
                let types = integers(types, "types")?;
                if types.shape() != [count] {
                    let shape = shown(types.shape());
                    return Err(wrong(format!(
                        "types must have the shape ({count},), as many as positions; has {shape}"
                    )));
                }
                types.as_slice()?.to_vec()
            }
        };
        if kinds.len() != count {
            return Err(wrong(format!("there are {count} positions and {} types", kinds.len())));
        }
        let last = self.species.len() - 1;
        match kinds.iter().find(|kind| usize::try_from(**kind).map_or(true, |k| k > last)) {
            Some(kind) => Err(wrong(format!(
                "types: {kind} is not the number of a species; the numbers go from 0 to {last}: {}",
                self.species.join(", ")
            ))),
            None => Ok(kinds),
        }
    }

    fn index(&self, name: &str) -> PyResult<i32> {
        let found = self.species.iter().position(|s| s == name);
        let known = || {
            wrong(format!("types: \"{name}\" is not a species of this model: {}", self.species.join(", ")))
        };
        Ok(found.ok_or_else(known)? as i32)
    }

    fn domain(&self, object: &Bound<PyAny>, periodic: [bool; 3]) -> PyResult<PeriodicBox> {
        let array = numbers(object, "box")?;
        let given = array.as_slice()?;
        let lengths = match (array.shape(), given) {
            ([], [one]) | ([1], [one]) => [*one; 3],
            ([3], [x, y, z]) => [*x, *y, *z],
            ([2], [x, y]) if self.dimensions == 2 => [*x, *y, 1.0],
            ([3, 3], all) => {
                let edges = Matrix3::from_column_slice(all);
                return PeriodicBox::new([0.0; 3], edges, periodic).map_err(|e| wrong(format!("box: {e}")));
            }
            (shape, _) => {
                let shape = shown(shape);
                return Err(wrong(format!(
                    "box must be a length, three lengths or a 3 × 3 matrix, has the shape {shape}"
                )));
            }
        };
        PeriodicBox::orthogonal([0.0; 3], lengths, periodic).map_err(|e| wrong(format!("box: {e}")))
    }

    fn evaluation(&self, py: Python, found: Evaluated, count: usize, width: usize) -> PyResult<Evaluation> {
        let Evaluated { energy, virial, densities, forces } = found;
        let columns = densities.len().checked_div(count).unwrap_or(0);
        let flat: Vec<f64> = match width {
            3 => forces.into_flattened(),
            _ => forces.iter().flat_map(|f| [f[0], f[1]]).collect(),
        };
        Ok(Evaluation {
            energy,
            virial: PyArray1::from_slice(py, &virial).unbind(),
            densities: PyArray1::from_vec(py, densities).reshape([count, columns])?.unbind(),
            forces: PyArray1::from_vec(py, flat).reshape([count, width])?.unbind(),
        })
    }
}

pub fn settings(precision: &str, threads: usize) -> PyResult<Settings> {
    let known = Precision::ALL.iter().find(|(name, _)| *name == precision);
    let (_, precision) =
        known.ok_or_else(|| wrong(format!("precision is \"mixed\" or \"double\", not \"{precision}\"")))?;
    Ok(Settings { precision: *precision, threads: thread_count(threads)?, ..Settings::default() })
}

pub fn thread_count(threads: usize) -> PyResult<NonZeroUsize> {
    Pool::count(threads).map(at_once).map_err(|e| wrong(e.to_string()))
}

fn directions(given: Option<Vec<bool>>, dimensions: usize) -> PyResult<[bool; 3]> {
    let all = [true, true, dimensions == 3];
    match given.as_deref() {
        None => Ok(all),
        Some([x, y]) if dimensions == 2 => Ok([*x, *y, false]),
        Some([x, y, z]) => Ok([*x, *y, *z && dimensions == 3]),
        Some(other) => Err(wrong(format!("periodic must have {dimensions} entries, has {}", other.len()))),
    }
}
