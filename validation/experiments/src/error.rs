use psidpd_core::document::FileError;
use psidpd_core::engine::EngineError;
use psidpd_core::model::PresetError;
use psidpd_core::model::expression::TooLarge;
use psidpd_core::theory::TheoryError;
use psidpd_dynamics::run::RunError;
use psidpd_formats::files::PathError;
use psidpd_lammps_host::LammpsError;
use psidpd_observe::ObserveError;
use psidpd_report::ReportError;
use std::path::{Path, PathBuf};

/// Why an experiment could not be carried out. A check that fails is no error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    #[error(transparent)]
    Lammps(#[from] LammpsError),
    #[error(transparent)]
    Format(#[from] psidpd_formats::FormatError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Write(#[from] PathError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Preset(#[from] PresetError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error(transparent)]
    Formula(#[from] TooLarge),
    #[error("{what}: {source}")]
    Statistics { what: String, source: ObserveError },
    #[error(transparent)]
    Observe(#[from] ObserveError),
    #[error(transparent)]
    Theory(#[from] TheoryError),
    #[error("{path}: {problem}")]
    Output { path: PathBuf, problem: String },
    #[error("{what}: {problem} in what LAMMPS printed")]
    Printed { what: String, problem: &'static str },
    #[error("{0} particles are too few: the box must be at least three ranges wide; take 170 or more")]
    TooSmall(usize),
    #[error("measuring memory: {0}")]
    Memory(String),
    #[error(
        "no stage of the scene has a thermostat and a fixed temperature, so there is nothing to compare with"
    )]
    NoStage,
    #[error("no hard case and no group of them has \"{0}\" in its name; the groups: {1}")]
    NoCase(String, String),
    #[error("{what}: {source}")]
    Stopped { what: String, source: Box<RunError> },
    #[error("the reference, {what}, is unstable: {why}; lower the dt of the scene")]
    Reference { what: String, why: String },
    #[error(
        "--tolerance {0}: nothing of this name was measured; a scene measures densities by interface_width or drop, the \
         tension by surface_tension or drop, and viscosities by viscosity or poiseuille, in its [observe]"
    )]
    Unmeasured(String),
    #[error("the model file cannot be edited: {0}")]
    Edit(#[from] toml_edit::TomlError),
    #[error("the model has no [density.{0}]")]
    NoSuchDensity(String),
    #[error("the model has several densities ({0}): name the one to calibrate with --name")]
    WhichDensity(String),
    #[error("{0}")]
    Conditions(String),
    #[error("the required pressure at density {0} is not a finite number: choose another range of densities")]
    NoTarget(f64),
    #[error(
        "{}: no correction could be measured at densities {low} to {high} ({failed}): use a smaller --dt, or a narrower --density range",
        model.display()
    )]
    NoCorrection { model: PathBuf, low: f64, high: f64, failed: String },
    #[error("{points} runs are more than the {most} that a sweep may have: use fewer values")]
    TooManyRuns { points: usize, most: usize },
    #[error(
        "{} has the run {row}, which is not part of this sweep and would be lost from the table: choose another folder, sweep over \
         values with the old ones among them, or replace the table with --overwrite", path.display()
    )]
    OtherGrid { path: PathBuf, row: String },
    #[error(transparent)]
    Liquid(#[from] crate::model::liquid::LiquidError),
    #[error("{given} densities for {species} species")]
    Densities { given: usize, species: usize },
}

/// Why a fluid could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum Trouble {
    #[error("it freezes: {0}")]
    Frozen(String),
    #[error("it does not run: {0}")]
    Stopped(String),
    #[error(transparent)]
    Failed(#[from] ExperimentError),
}

/// A run that stops says something of the fluid; another error does not.
impl From<RunError> for Trouble {
    fn from(error: RunError) -> Trouble {
        if error.is_stop() { Trouble::Stopped(error.to_string()) } else { Trouble::Failed(error.into()) }
    }
}

/// What was measured, or what the fluid does instead.
pub fn value_or_why<T>(measured: Result<T, Trouble>) -> Result<Result<T, String>, ExperimentError> {
    match measured {
        Ok(value) => Ok(Ok(value)),
        Err(Trouble::Failed(error)) => Err(error),
        Err(trouble) => Ok(Err(trouble.to_string())),
    }
}

impl ExperimentError {
    /// For `map_err` of what is done with the file or folder `path`.
    pub fn at<E: ToString>(path: &Path) -> impl FnOnce(E) -> ExperimentError {
        move |problem| ExperimentError::Output { path: path.to_owned(), problem: problem.to_string() }
    }
}
