//! Scene files: which fluid, in which box, from which start, for how many steps.
//!
//! ```toml
//! title = "Warren set 6, bulk"
//! model = "../models/warren2003-set6.toml"   # relative to this file
//! kT    = 1.0
//! seed  = 1                                  # of the initial state and of the noise
//!
//! [box]
//! lengths = [10.0, 10.0, 10.0]               # periodic; two of them for two-dimensional models
//!
//! [masses]                                   # optional; 1 if not given
//! F = 1.0
//!
//! [initial]
//! kind    = "random"                         # random | lattice | slab | data
//! density = 6.05                             # of the filled part; or count = 6050
//! # composition = { A = 0.5, B = 0.5 }       # number fractions; equal shares if not given
//! # axis = "z"                               # slab: its normal; the last direction if not given
//! # thickness = 10.0                         # slab: centred
//! # file = "start.data"                      # data: a LAMMPS data file, which has the box: no [box]
//! # velocities = "thermal"                   # thermal | zero | keep (data only)
//!
//! [[stage]]
//! name  = "produce"
//! steps = 1000
//! dt    = 0.01
//! # integrator = "velocity-verlet"           # or "groot-warren", with lambda = 0.65
//! # kT = 2.0                                 # another temperature in this stage
//! # thermostat = false                       # no dissipative and random forces
//!
//! [output]
//! thermo = 100                               # steps between rows of totals; 0: none
//! dump   = 0                                 # steps between frames; 0: none
//!
//! [observe]                                  # optional: what is measured; docs/observables.md
//! rdf = true
//! ```

mod composition;
mod domain;
mod fill;
mod initial;
mod masses;
mod output;
mod stage;
mod velocities;

pub use composition::Composition;
pub use initial::{Filling, Initial, Placement};
pub use output::Output;
pub use stage::Stage;
pub use velocities::Velocities;

use crate::observe::{self, Observe};
use crate::run::State;
use psidpd_core::document::{Document, FileError, FileErrorKind, Section, Value};
use psidpd_core::engine::{PeriodicBox, Plan};
use psidpd_core::model::Model;
use std::path::{Path, PathBuf};

/// A scene file with its model, read and checked.
#[derive(Debug, Clone)]
pub struct Scene {
    /// What the file calls itself.
    pub title: String,
    /// Where the model file is.
    pub model_path: PathBuf,
    /// The model.
    pub model: Model,
    /// kT, of the initial velocities and of every stage that does not say otherwise.
    pub kt: f64,
    /// Seed of the initial state and of the noise.
    pub seed: u64,
    /// The box.
    pub domain: PeriodicBox,
    /// Mass of each species.
    pub mass: Vec<f64>,
    /// The initial state.
    pub initial: Initial,
    /// What is done with it, in this order.
    pub stages: Vec<Stage>,
    /// What is written.
    pub output: Output,
    /// What is measured on the way.
    pub observe: Observe,
}

impl Scene {
    /// Reads a scene file and the model file it names.
    ///
    /// # Errors
    /// Anything wrong in either file, with its line and key.
    pub fn open(path: &Path) -> Result<Scene, FileError> {
        let base = path.parent().unwrap_or(Path::new(""));
        Scene::read(&Document::open(path)?, base)
    }

    /// Reads a scene from a text; `name` stands for the file in messages, and the model file is looked
    /// for in `base`.
    ///
    /// # Errors
    /// As [`Scene::open`].
    pub fn parse(name: &str, text: &str, base: &Path) -> Result<Scene, FileError> {
        Scene::read(&Document::parse(name, text)?, base)
    }

    fn read(document: &Document, base: &Path) -> Result<Scene, FileError> {
        let root = document.root();
        let title = root.require("title")?.string()?.value;
        let (model_path, model) = read_model(&root.require("model")?, base)?;
        let kt = positive(&root.require("kT")?)?;
        let seed = root.require("seed")?.count()?.value;
        let (initial, domain) = initial::read(&root, &model, base)?;
        let mass = masses::read(&root, model.species(), &initial)?;
        let stages = stage::read(&root, kt)?;
        let output = output::read(&root)?;
        let observe = observe::read(&root, &model, kt, &domain, &stages, observe::slab_axis(&initial), None)?;
        let scene =
            Scene { title, model_path, model, kt, seed, domain, mass, initial, stages, output, observe };
        scene.check_noise(&root)?;
        root.finish()?;
        Ok(scene)
    }

    /// The particles before the first step; the same for the same file.
    pub fn initial_state(&self) -> State {
        fill::fill(self)
    }

    /// The model must hold at every temperature, and the box must keep images apart that would share
    /// their noise.
    fn check_noise(&self, root: &Section) -> Result<(), FileError> {
        self.model.at(self.kt)?;
        for stage in &self.stages {
            let fluid = self.model.at(stage.kt)?;
            let plan =
                Plan::new(&fluid).map_err(|e| root.error(FileErrorKind::Value(format!("the model: {e}"))))?;
            let Some(range) = plan.noise_range().filter(|_| stage.thermostat) else { continue };
            domain::check_width(root, &self.domain, self.model.dimensions(), range)?;
        }
        Ok(())
    }
}

fn read_model(value: &Value, base: &Path) -> Result<(PathBuf, Model), FileError> {
    let name = value.string()?.value;
    let path = base.join(&name);
    match Model::open(&path) {
        Ok(model) => Ok((path, model)),
        Err(error) => match error.kind() {
            FileErrorKind::Unreadable(why) => {
                let kind =
                    FileErrorKind::Value(format!("the model file {} cannot be read: {why}", path.display()));
                Err(value.error(kind).with_help("the path is relative to the scene file"))
            }
            _ => Err(error),
        },
    }
}

/// A number above zero.
fn positive(value: &Value) -> Result<f64, FileError> {
    let number = value.number()?.value;
    if number > 0.0 {
        Ok(number)
    } else {
        Err(value.error(FileErrorKind::Value(format!("must be positive, is {number}"))))
    }
}

#[cfg(test)]
mod tests;
