use crate::arrays::{numbers, shown};
use crate::errors::{exception, wrong};
use crate::phases;
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use psidpd_core::model;
use psidpd_core::theory::MeanField;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A fluid as a model file describes it: species, densities, excess free energies, pair potentials, thermostats.
///
/// `Model.from_file` and `Model.from_text` read one. The temperature is not part of the model; its users give kT.
/// All numbers are in the reduced units of the model: lengths in r_c, masses in m, energies in the unit of kT.
#[pyclass(frozen, module = "psidpd")]
pub struct Model {
    pub model: model::Model,
}

#[pymethods]
impl Model {
    /// Reads a model file.
    ///
    /// Raises InputError for anything wrong in it, with the line and the key.
    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Model> {
        model::Model::open(&path).map(|model| Model { model }).map_err(exception)
    }

    /// Reads a model from a text, as a model file has it. Paths of tables in it are relative to the current folder.
    ///
    /// Raises InputError for anything wrong in it, with the line and the key.
    #[staticmethod]
    #[pyo3(signature = (text, name = "model"))]
    fn from_text(text: &str, name: &str) -> PyResult<Model> {
        model::Model::parse(name, text).map(|model| Model { model }).map_err(exception)
    }

    /// The title in the file.
    #[getter]
    fn title(&self) -> &str {
        &self.model.title
    }

    /// The source of the model, or None.
    #[getter]
    fn reference(&self) -> Option<&str> {
        self.model.reference.as_deref()
    }

    /// The number of dimensions, 2 or 3.
    #[getter]
    fn dimensions(&self) -> usize {
        self.model.dimensions()
    }

    /// Names of the species.
    #[getter]
    fn species(&self) -> Vec<String> {
        self.model.species().to_vec()
    }

    /// The constants of the file, by name.
    #[getter]
    fn parameters(&self) -> std::collections::BTreeMap<String, f64> {
        self.model.parameters().clone()
    }

    /// The text of the file.
    #[getter]
    fn text(&self) -> &str {
        self.model.source().text()
    }

    /// The pressure in mean field, in energy/length^d.
    ///
    /// `rho` is the number density: of one species a number or an array of any shape, and pressures come back in the same
    /// shape; of S species an array whose last axis has S entries, and pressures come back without that axis. Mean
    /// field leaves out correlations: a simulation differs where particles attract each other strongly.
    ///
    /// Raises InputError where the model has no pressure in mean field, and for densities below 0 or that are not finite.
    fn pressure<'py>(
        &self,
        rho: &Bound<'py, PyAny>,
        #[allow(non_snake_case)] kT: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = rho.py();
        let theory = self.theory(kT)?;
        let rho = numbers(rho, "rho")?;
        let species = self.model.species().len();
        let mut shape = rho.shape().to_vec();
        if species > 1 && shape.pop() != Some(species) {
            return Err(wrong(format!(
                "rho has the shape {}, but its last axis must have {species} entries, one for each of {}",
                shown(rho.shape()),
                self.model.species().join(", ")
            )));
        }
        let densities = rho.as_slice()?.to_vec();
        // What lends the array ends in an abort if the array has moved meanwhile.
        drop(rho);
        if let Some(rho) = densities.iter().find(|rho| !(**rho >= 0.0 && rho.is_finite())) {
            return Err(wrong(format!(
                "a density must be a finite number that is not negative, found {rho}"
            )));
        }
        let pressures: Vec<f64> =
            py.detach(|| densities.chunks_exact(species).map(|d| theory.pressure(d)).collect());
        let found = PyArray1::from_vec(py, pressures).reshape(shape)?;
        // A scalar argument gives a scalar result, as in numpy's own functions.
        found.get_item(())
    }

    /// Mean-field phases at kT, a number or several: a pandas DataFrame with one row for each kT.
    ///
    /// Of one species: densities `vapour` and `liquid` that coexist, their `pressure`, the densities `spinodal_low` and
    /// `spinodal_high` between which the fluid is unstable, and the `tension` and `width` of the planar interface. Of two
    /// species, at the total number density `density`: shares of the first species instead, `composition_low` and
    /// `composition_high`. Missing values are NaN, and `note` says why.
    ///
    /// Raises InputError for more than two species, and where the model has no mean field.
    #[pyo3(signature = (kT, density = None))]
    fn phase_diagram<'py>(
        &self,
        #[allow(non_snake_case)] kT: &Bound<'py, PyAny>,
        density: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = kT.py();
        let temperatures = numbers(kT, "kT")?.as_slice()?.to_vec();
        let rows =
            py.detach(|| temperatures.iter().map(|kt| phases::row(&self.model, *kt, density)).collect());
        let rows: Vec<phases::Row> = Result::from_iter::<Vec<Result<_, _>>>(rows)?;
        phases::frame(py, &rows)
    }

    fn __repr__(&self) -> String {
        format!("<psidpd.Model \"{}\", species {}>", self.model.title, self.model.species().join(", "))
    }

    /// A model is pickled as its text.
    fn __reduce__<'py>(slf: &Bound<'py, Model>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let source = slf.get().model.source();
        let make = slf.get_type().getattr("from_text")?;
        Ok((make, (source.text().to_owned(), source.name().to_owned())))
    }
}

impl Model {
    fn theory(&self, kt: f64) -> PyResult<MeanField> {
        let fluid = self.model.at(kt).map_err(exception)?;
        MeanField::new(&fluid).map_err(exception)
    }
}
