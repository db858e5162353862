use crate::bulk::{self, Bulk, Observed, Sampling};
use crate::run::{Begin, RunError};
use crate::scene::Scene;
use psidpd_core::document::FileError;
use psidpd_core::model::Model;
use psidpd_core::theory::{MeanField, TheoryError};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// How large the runs of a case are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// Half an hour for all cases.
    Quick,
    /// Those of the papers. Runs that were interrupted go on.
    Full,
}

/// Why a case cannot be carried out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say it")]
pub enum PaperError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Theory(#[from] TheoryError),
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error("the model has no parameter {0}")]
    Parameter(String),
}

/// Where and how a case runs.
#[derive(Debug, Clone)]
pub struct Context {
    /// How large.
    pub size: Size,
    /// The folder of the case.
    pub folder: PathBuf,
    /// Threads of each run.
    pub threads: NonZeroUsize,
}

/// A homogeneous fluid of one species that a case measures.
pub struct Fluid<'a> {
    /// The model file.
    pub model: &'a str,
    /// kT.
    pub kt: f64,
    /// Time step.
    pub dt: f64,
    /// Edge of the box, at full size.
    pub edge: f64,
    /// Observables beside temperature and pressure.
    pub observe: &'a str,
}

impl Context {
    /// A number by size.
    pub fn pick<T>(&self, quick: T, full: T) -> T {
        match self.size {
            Size::Quick => quick,
            Size::Full => full,
        }
    }

    fn begin(&self) -> Begin {
        self.pick(Begin::Overwrite, Begin::Resume)
    }

    fn write(&self, name: &str, model: &str) -> Result<PathBuf, PaperError> {
        let path = self.folder.join(format!("{name}.model.toml"));
        std::fs::create_dir_all(&self.folder)
            .and_then(|()| std::fs::write(&path, model))
            .map_err(|source| PaperError::Io { path: path.clone(), source })?;
        Ok(path)
    }

    /// Measures a homogeneous fluid at partial densities.
    pub fn bulk(&self, name: &str, fluid: &Fluid, densities: &[f64]) -> Result<Observed, PaperError> {
        let path = self.write(name, fluid.model)?;
        let model = Model::open(&path)?;
        let total: f64 = densities.iter().sum();
        let all = total * fluid.edge.powi(model.dimensions() as i32);
        let sampling = Sampling {
            particles: self.pick(all.min(1500.0), all) as usize,
            dt: fluid.dt,
            equilibrate: self.pick(400, 5000),
            steps: self.pick(1600, 50_000),
            every: 20,
            seed: 1,
            threads: self.threads,
        };
        let bulk = Bulk { model: &model, kt: fluid.kt, densities, observe: fluid.observe, sampling };
        Ok(bulk::run(&bulk.scene(&path)?, &self.folder.join(name), self.begin(), self.threads)?)
    }

    /// Runs a scene, the text of which does not name its model.
    pub fn scene(&self, name: &str, model: &str, scene: &str) -> Result<Observed, PaperError> {
        let path = self.write(name, model)?;
        let text = format!("model = \"{name}.model.toml\"\n{scene}");
        let scene =
            Scene::parse(&format!("{name}.scene.toml"), &text, path.parent().unwrap_or(Path::new("")))?;
        Ok(bulk::run(&scene, &self.folder.join(name), self.begin(), self.threads)?)
    }
}

/// Mean field of a model file.
pub fn mean_field(model: &str, kt: f64) -> Result<MeanField, PaperError> {
    Ok(MeanField::new(&Model::parse("model.toml", model)?.at(kt)?)?)
}

/// A model file with other parameters.
pub fn with_parameters(model: &str, parameters: &[(&str, f64)]) -> Result<String, PaperError> {
    let missing = |name: &str| PaperError::Parameter(name.to_owned());
    let mut document: toml_edit::DocumentMut = model.parse().map_err(|_| missing("parameters"))?;
    for (name, value) in parameters {
        let entry = document.get_mut("parameters").and_then(|table| table.get_mut(name));
        *entry.ok_or_else(|| missing(name))? = toml_edit::value(*value);
    }
    Ok(document.to_string())
}
