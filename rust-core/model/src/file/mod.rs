//! Reads the text of a model file into a checked [`Model`].

mod bind;
mod density;
mod excess;
mod interaction;
mod literature;
mod names;
mod parameters;
mod units;
mod wall;

use super::fluid::Fluid;
use super::wall::Wall;
use crate::document::keys::{of_another_kind, read_known};
use crate::document::{Document, FileError, Section, Source, Value};
use density::DensityEntry;
use excess::ExcessEntry;
use interaction::{PairTable, ThermostatEntry};
pub use literature::Published;
pub use names::KNOWN_FUNCTIONS;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
pub use units::Units;

/// A model file, read and checked. The host supplies the temperature: see [`Model::at`].
#[derive(Debug, Clone)]
pub struct Model {
    source: Arc<Source>,
    /// The title in the file.
    pub title: String,
    /// The publication that the model comes from.
    pub reference: Option<String>,
    dimensions: usize,
    /// The units of the model's numbers, if the file states them.
    pub units: Option<Units>,
    literature: Vec<Published>,
    species: Vec<String>,
    parameters: BTreeMap<String, f64>,
    densities: Vec<DensityEntry>,
    excess: Vec<ExcessEntry>,
    pairs: Vec<PairTable>,
    thermostats: Vec<ThermostatEntry>,
    walls: Vec<Wall>,
}

/// A temperature for checking formulas at load time; a formula is unlikely to be singular exactly here.
const CHECK_KT: f64 = 0.918_273_645;

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// Fails for any error in the file, with its line and key.
    pub fn open(path: &Path) -> Result<Model, FileError> {
        Model::read(&Document::open(path)?)
    }

    /// Reads a model from a text; `name` stands for the file in messages, and tables are searched in its folder.
    ///
    /// # Errors
    /// Fails as [`Model::open`].
    pub fn parse(name: &str, text: &str) -> Result<Model, FileError> {
        Model::read(&Document::parse(name, text)?)
    }

    /// Reads a model from a text as the content of the file at `path`, whose name may be no valid text.
    ///
    /// # Errors
    /// Fails as [`Model::open`].
    pub fn parse_in(path: &Path, text: &str) -> Result<Model, FileError> {
        Model::read(&Document::parse_in(path, text)?)
    }

    fn read(document: &Document) -> Result<Model, FileError> {
        read_known(&document.root(), crate::keys::TABLES, &[], || Model::of(document))
            .map_err(|error| no_model(&document.root()).unwrap_or(error))
    }

    fn of(document: &Document) -> Result<Model, FileError> {
        let root = document.root();
        let title = root.require("title")?.string()?.value;
        let reference = root.read("reference", Value::string)?.map(|text| text.value);
        let dimensions = read_dimensions(&root)?;
        let units = units::read(&root)?;
        let literature = literature::read(&root)?;
        let species = names::read_species(&root)?;
        let parameters = parameters::read(&root)?;
        let densities = density::read(&root, &species.value, &parameters)?;
        let excess = excess::read(&root, &species, &densities, &document.directory)?;
        let pairs = interaction::read_pairs(&root, &species.value, &document.directory)?;
        let thermostats = interaction::read_thermostats(&root, &species.value)?;
        let model = Model {
            source: Arc::clone(&document.source),
            title,
            reference,
            dimensions,
            units,
            literature,
            species: species.value,
            parameters,
            densities,
            excess,
            pairs,
            thermostats,
            walls: Vec::new(),
        };
        // Every name and number is checked at load time, before the host supplies its temperature.
        let fluid = model.at(CHECK_KT)?;
        interaction::check_coverage(&model.source, &fluid)?;
        Ok(model)
    }

    /// The same model between walls, which belong to a scene and not to the file.
    pub fn with_walls(self, walls: Vec<Wall>) -> Model {
        Model { walls, ..self }
    }

    /// The walls.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// The number of dimensions, 2 or 3.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// The published values of the fluid at a temperature.
    pub fn published(&self, kt: f64) -> Option<&Published> {
        self.literature.iter().find(|p| (p.kt - kt).abs() <= 1e-9 * kt)
    }

    /// The names of the species.
    pub fn species(&self) -> &[String] {
        &self.species
    }

    /// The constants of the file.
    pub fn parameters(&self) -> &BTreeMap<String, f64> {
        &self.parameters
    }

    /// The file's name and text.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The fluid at temperature `kt`, in energy units of the file.
    ///
    /// # Errors
    /// Fails if `kt` is not a positive number, or if a formula or number is not finite at this temperature.
    pub fn at(&self, kt: f64) -> Result<Fluid, FileError> {
        bind::bind(self, kt)
    }
}

fn read_dimensions(root: &Section) -> Result<usize, FileError> {
    let Some(value) = root.get("dimensions") else { return Ok(3) };
    match value.count()? {
        d @ (2 | 3) => Ok(d as usize),
        _ => Err(value.error("must be 2 or 3")),
    }
}

#[cfg(test)]
mod tests;

/// The error for a scene where a model is expected: the file has keys of a scene, and none that define a model.
fn no_model(root: &Section) -> Option<FileError> {
    let of_model = ["species", "excess_free_energy", "density", "pair"];
    let of_scene = ["model", "box", "stage", "steps", "initial", "part"];
    let key = of_scene.into_iter().find(|key| root.get(key).is_some())?;
    if of_model.into_iter().any(|key| root.get(key).is_some()) {
        return None;
    }
    let help =
        "a scene goes to `psidpd run`, `check` or `sweep`; its model is the file that its key `model` names";
    Some(of_another_kind(root, key, "this is a scene, and a model is expected").with_help(help))
}
