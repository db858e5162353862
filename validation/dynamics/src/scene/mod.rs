//! Scene files, which state the fluid, the box, the initial state and the number of steps.
//!
//! ```toml
//! model   = "../models/warren2003-set6.toml"   # relative to this file
//! kT      = 1.0
//! box     = 10.0                               # periodic; or [10.0, 10.0, 20.0]; or a table
//! density = 6.05
//! steps   = 1000
//! ```
//!
//! `docs/scene-file.md` describes every key; it is written from the table in [`keys`], and a file with other keys is refused.

mod arrangement;
mod body_force;
mod composition;
mod domain;
mod edits;
mod fill;
mod initial;
pub mod keys;
mod masses;
mod number;
mod output;
mod part;
mod round;
mod shape;
mod stage;
mod template;
mod velocities;
mod wall;

pub use arrangement::{Arrangement, Lattice};
pub use composition::Composition;
pub use edits::{Edit, edit_model};
pub use initial::Initial;
pub use output::{Output, every};
pub use part::Part;
pub use shape::Shape;
pub use stage::Stage;
pub(crate) use stage::place_of_integrator;
pub use template::{TEMPLATES, Template, TemplateError};
pub use velocities::Velocities;

use crate::device::Device;
use crate::particles::{BodyForce, State, Tags};
use psidpd_core::document::keys::{of_another_kind, read_known};
use psidpd_core::document::{Document, FileError, FileErrorKind, Section, Source, Value};
use psidpd_core::engine::{LocalEnergy, PeriodicBox, Plan, Precision};
use psidpd_core::model::Model;
use psidpd_observe::{self as observe, Observe, Place};
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Debug, Clone)]
pub struct Scene {
    pub title: String,
    pub model_path: PathBuf,
    pub model: Model,
    /// kT of the initial velocities, and the default of every stage.
    pub kt: f64,
    /// Seed of the initial state and of the noise.
    pub seed: u64,
    /// Precision of the pair forces, if the scene gives it.
    pub precision: Option<Precision>,
    /// The processor that computes a run.
    pub device: Device,
    pub domain: PeriodicBox,
    pub mass: Vec<f64>,
    pub initial: Initial,
    pub frozen: Tags,
    /// Body forces; they act in the stages that enable them.
    pub body_forces: Vec<BodyForce>,
    pub stages: Vec<Stage>,
    pub output: Output,
    pub observe: Observe,
    pub source: Arc<Source>,
    /// The folder from which paths in the file start.
    pub folder: PathBuf,
}

impl Scene {
    /// Reads a scene file and the model file it names.
    pub fn open(path: &Path) -> Result<Scene, FileError> {
        Scene::open_with(path, &[])
    }

    /// Reads a scene file and the model file it names, after edits of their keys.
    pub fn open_with(path: &Path, edits: &[Edit]) -> Result<Scene, FileError> {
        let base = path.parent().unwrap_or(Path::new(""));
        let document = Document::open(path)?;
        if edits.is_empty() {
            return Scene::read(&document, base, &[]);
        }
        let model = document.root().get("model").and_then(|v| Document::open(&base.join(v.as_str()?)).ok());
        let parameters = |name: &str| {
            let known = model.as_ref().and_then(|m| m.root().get("parameters")?.as_section()?.get(name));
            known.is_some()
        };
        let original = document.source.text();
        let (text, of_model) = edits::edit_scene(original, edits, &parameters)?;
        Document::parse_in(path, &text)
            .and_then(|edited| Scene::read(&edited, base, &of_model))
            .map_err(|error| edits::blamed(error, original, edits))
    }

    /// The files that the scene names: its model, tables and states, and the tables that its model names.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let document = |source: &Source| Document::parse(source.name(), source.text()).ok();
        let mut all = vec![self.model_path.clone()];
        let beside_model = self.model_path.parent().unwrap_or(Path::new(""));
        for (source, folder) in [(&*self.source, &*self.folder), (self.model.source(), beside_model)] {
            let names = document(source).map(|document| document.root().strings()).unwrap_or_default();
            all.extend(names.iter().map(|name| folder.join(name)).filter(|path| path.is_file()));
        }
        all
    }

    /// Parses a scene from a text; messages use `name` as the name of the file, and the path of the model
    /// file starts from `base`.
    pub fn parse(name: &str, text: &str, base: &Path) -> Result<Scene, FileError> {
        Scene::read(&Document::parse(name, text)?, base, &[])
    }

    fn read(document: &Document, base: &Path, of_model: &[Edit]) -> Result<Scene, FileError> {
        read_known(&document.root(), keys::TABLES, &["observe"], || Scene::of(document, base, of_model))
            .map_err(|error| no_scene(&document.root()).unwrap_or(error))
    }

    fn of(document: &Document, base: &Path, of_model: &[Edit]) -> Result<Scene, FileError> {
        let root = document.root();
        let title = root.read("title", Value::string)?;
        let (model_path, model) = read_model(&root.require("model")?, base, of_model)?;
        let kt = root.require("kT")?.positive()?;
        let seed = root.read("seed", Value::count)?.unwrap_or(1);
        let precision = root.read("precision", |value| value.one_of("precision", &Precision::ALL))?;
        let device = root.read("device", read_device)?.unwrap_or(Device::Cpu);
        let (initial, domain) = initial::read(&root, &model, base)?;
        let mass = masses::read(&root, model.species(), &initial)?;
        let model = wall::read(&root, model, (&initial, &domain), (kt, &mass))?;
        let stages = stage::read(&root, kt)?;
        let body_forces = body_force::read(&root, &model, &initial)?;
        let drive = body_forces.iter().find_map(BodyForce::drive);
        let names: Vec<&str> = stages.iter().map(|s| s.name.as_str()).collect();
        let timeless = stages.iter().filter(|s| !s.integrator.has_time()).map(|s| s.name.as_str()).collect();
        let (fluid, slab) = (&model.at(kt)?, initial.slab(&domain, model.dimensions()));
        let place = Place { fluid, domain: &domain, stages: &names, timeless, slab, drive };
        let observe = observe::read(&root, &place)?;
        let scene = Scene {
            title: title.map_or_else(|| model.title.clone(), |t| t.value),
            model_path,
            kt,
            seed,
            precision,
            device,
            mass,
            frozen: initial.frozen(),
            body_forces,
            output: output::read(&root)?,
            observe,
            source: root.place.source.clone(),
            folder: base.to_owned(),
            stages,
            model,
            domain,
            initial,
        };
        scene.check_noise(&root)?;
        scene.check_trials(&root)?;
        scene.check_room(document)?;
        scene.check_walls(&root)?;
        Ok(scene)
    }

    /// Number of steps of all stages.
    pub fn steps(&self) -> u64 {
        self.stages.iter().map(|stage| stage.steps).sum()
    }

    /// The particles before the first step; a function of the file alone.
    pub fn initial_state(&self) -> State {
        fill::fill(self).0
    }

    /// Precision of the pair forces; mixed by default.
    pub fn precision(&self) -> Precision {
        self.precision.unwrap_or_default()
    }

    fn moving_parts(&self) -> Vec<&Part> {
        self.initial.parts().iter().filter(|part| !part.frozen && part.count > 0).collect()
    }

    /// Number densities of the species in every part that is not frozen; none for a start from a file.
    pub fn densities_of_parts(&self) -> Vec<Vec<f64>> {
        let of = |part: &Part| {
            let volume = part.shape.volume(self.model.dimensions());
            part.composition.share(part.count).into_iter().map(|n| n as f64 / volume).collect()
        };
        self.moving_parts().into_iter().map(of).collect()
    }

    /// The mixtures that a scene of several species may come to: each of several parts, and the last all parts mixed. Without several
    /// parts or species the list is empty.
    pub fn mixtures(&self) -> Vec<Vec<f64>> {
        let (species, mut all) = (self.model.species().len(), self.densities_of_parts());
        if species < 2 || all.len() < 2 {
            return Vec::new();
        }
        let (mut counts, mut volume) = (vec![0.0; species], 0.0);
        for part in self.moving_parts() {
            let share = part.composition.share(part.count);
            counts.iter_mut().zip(&share).for_each(|(sum, n)| *sum += *n as f64);
            volume += part.shape.volume(self.model.dimensions());
        }
        all.push(counts.into_iter().map(|n| n / volume).collect());
        all
    }

    /// Number densities of the species in the fluid: in the largest part that is not frozen, or in the whole
    /// box for a start from a file.
    pub fn densities(&self) -> Vec<f64> {
        let dimensions = self.model.dimensions();
        let largest = self.initial.parts().iter().filter(|p| !p.frozen).max_by_key(|p| p.count);
        let (counts, volume) = match (&self.initial, largest) {
            (Initial::Parts(_), Some(part)) => {
                (part.composition.share(part.count), part.shape.volume(dimensions))
            }
            _ => {
                let mut counts = vec![0; self.model.species().len()];
                self.initial_state().species.iter().for_each(|s| counts[*s as usize] += 1);
                (counts, self.domain.volume(dimensions))
            }
        };
        counts.into_iter().map(|n| n as f64 / volume).collect()
    }

    /// The number density of a scene that one fluid fills from face to face; `None` for other scenes.
    pub fn uniform_density(&self) -> Option<f64> {
        let [part] = self.initial.parts() else { return None };
        let volume = self.domain.volume(self.model.dimensions());
        let fills = (part.shape.volume(self.model.dimensions()) / volume - 1.0).abs() < 1e-9;
        (fills && self.domain.periodic()[..self.model.dimensions()].iter().all(|p| *p))
            .then(|| part.count as f64 / volume)
    }

    /// Refuses particles that start in the matter of a round wall.
    fn check_walls(&self, root: &Section) -> Result<(), FileError> {
        let fluid = self.model.at(self.kt)?;
        let bounds = crate::run::Surfaces::of(&fluid.walls, &self.domain);
        if bounds.is_empty() {
            return Ok(());
        }
        let state = self.initial_state();
        let Some(k) = state.x.iter().position(|x| bounds.is_in_matter(x)) else { return Ok(()) };
        let message = format!("particle {} starts in the matter of a round wall", state.tag[k]);
        Err(root.require("wall")?.error(message).with_help(
            "parts that stay away from it: shape = \"cylinder\" or \"sphere\" of its radius for a fluid inside, shape = \"rest\" for one outside",
        ))
    }

    /// Refuses parts without room for their particles at the minimum distance.
    fn check_room(&self, document: &Document) -> Result<(), FileError> {
        let apart =
            |p: &Part| matches!(p.arrangement, Arrangement::Random { min_distance } if min_distance > 0.0);
        if !self.initial.parts().iter().any(apart) {
            return Ok(());
        }
        let Some(crowded) = fill::fill(self).1 else { return Ok(()) };
        let root = document.root();
        let section = match root.get("initial") {
            Some(initial) => initial.section()?,
            None => root.require("part")?.array()?[crowded.part].section()?,
        };
        let message = format!(
            "only {} of {} particles found a place at this distance from all others",
            crowded.placed,
            self.initial.parts()[crowded.part].count
        );
        let error = section.require("min_distance")?.error(message);
        Err(error.with_help("use a smaller distance, or a lattice"))
    }

    /// Checks that the model is valid at every temperature, and that the box is so wide that no two images
    /// share the noise of a pair.
    fn check_noise(&self, root: &Section) -> Result<(), FileError> {
        self.model.at(self.kt)?;
        for stage in &self.stages {
            let fluid = self.model.at(stage.kt)?;
            let plan = Plan::new(&fluid).map_err(|e| root.error(format!("the model: {e}")))?;
            let has_noise = stage.thermostat && stage.integrator.has_time();
            let Some(range) = plan.noise_range().filter(|_| has_noise) else { continue };
            domain::check_width(root, &self.domain, self.model.dimensions(), range)?;
        }
        Ok(())
    }

    /// Checks that the energy includes all forces, which trial moves need.
    fn check_trials(&self, root: &Section) -> Result<(), FileError> {
        for stage in self.stages.iter().filter(|stage| !stage.integrator.has_time()) {
            let refuse = |message: String| {
                place_of_integrator(root, &stage.name)
                    .map_or_else(|| root.error(message.as_str()), |v| v.error(message.as_str()))
            };
            if let Err(reason) = LocalEnergy::new(&self.model.at(stage.kt)?) {
                return Err(refuse(format!("monte-carlo needs an energy: {reason}")));
            }
            if stage.body_forces && !self.body_forces.is_empty() {
                let message =
                    "monte-carlo needs an energy, and body forces have none in a periodic box".to_owned();
                return Err(refuse(message).with_help("stages with body_forces = false have none"));
            }
        }
        Ok(())
    }
}

fn read_device(value: &Value) -> Result<Device, FileError> {
    let name = value.string()?.value;
    name.parse().map_err(|message| value.error(message))
}

fn read_model(value: &Value, base: &Path, edits: &[Edit]) -> Result<(PathBuf, Model), FileError> {
    let name = value.string()?.value;
    let path = base.join(&name);
    let model = Model::open(&path).and_then(|model| match edits {
        [] => Ok(model),
        _ => Model::parse_in(&path, &edit_model(model.source().text(), edits)?),
    });
    match model {
        Ok(model) => Ok((path, model)),
        Err(error) => match &*error.kind {
            FileErrorKind::Unreadable(why) => {
                let message = format!("the model file {} cannot be read: {why}", path.display());
                Err(value.error(message).with_help("the path is relative to the scene file"))
            }
            _ => Err(error),
        },
    }
}

/// The error of a model file given as a scene: it names no model and has keys of a model.
fn no_scene(root: &Section) -> Option<FileError> {
    let of_model = ["species", "excess_free_energy", "density", "pair"];
    let key = of_model.into_iter().find(|key| root.get(key).is_some())?;
    let help = "a model goes to `psidpd check` or `theory`; a scene names it, model = \"FILE\", and `psidpd new` writes one";
    let what = "this is a model, and a scene is expected";
    root.get("model").is_none().then(|| of_another_kind(root, key, what).with_help(help))
}

#[cfg(test)]
mod tests;
