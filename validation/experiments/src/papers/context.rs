use crate::ExperimentError;
use crate::machine::{BUILD, VERSION};
use crate::papers::case::{Reproduction, curve};
use crate::run::bulk::{Bulk, Sampling};
use crate::run::{self, Observed};
use psidpd_core::model::Model;
use psidpd_core::theory::MeanField;
use psidpd_dynamics::run::Begin;
use psidpd_dynamics::scene::{Edit, Scene, edit_model};
use psidpd_formats::files::{Existing, work_folder, write_bytes};
use psidpd_observe::Measured;
use psidpd_report::run::SeriesTable;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// Half an hour for all cases.
    Quick,
    /// Boxes and times of the papers.
    Full,
}

#[derive(Debug, Clone)]
pub struct Context {
    pub size: Size,
    pub folder: PathBuf,
    pub threads: NonZeroUsize,
    /// What becomes of runs of full size that are there and were made from something else: those of quick size are replaced.
    pub existing: Existing,
}

/// A homogeneous fluid of one species that a case measures.
pub struct Fluid<'a> {
    pub model: &'a str,
    pub kt: f64,
    pub dt: f64,
    /// Edge of the box, at full size.
    pub edge: f64,
    /// Other values of keys of its scene, each as KEY=VALUE, with what is observed beside temperature and pressure.
    pub changes: &'a [&'a str],
}

impl Fluid<'_> {
    /// A fluid at kT = 1, with the step and the box of most papers.
    pub fn of(model: &str) -> Fluid<'_> {
        Fluid { model, kt: 1.0, dt: 0.01, edge: 10.0, changes: &[] }
    }
}

impl Context {
    pub fn pick<T>(&self, quick: T, full: T) -> T {
        match self.size {
            Size::Quick => quick,
            Size::Full => full,
        }
    }

    /// Runs a scene, or reads a run of it that is there. At full size that of another build of this version counts.
    fn run(&self, name: &str, scene: &Scene) -> Result<Observed, ExperimentError> {
        let program = self.pick(&**BUILD, VERSION);
        let instead = match (self.size, self.existing) {
            (Size::Full, Existing::Keep) => Begin::New,
            _ => Begin::Overwrite,
        };
        Ok(run::once(scene, (&self.folder.join(name), instead), program, self.threads)?)
    }

    fn write(&self, name: &str, model: &str) -> Result<PathBuf, ExperimentError> {
        let path = self.folder.join(format!("{name}.model.toml"));
        work_folder(&self.folder)?;
        write_bytes(&path, Existing::Keep, model.as_bytes())?;
        Ok(path)
    }

    /// Measures a homogeneous fluid at partial densities.
    pub fn bulk(&self, name: &str, fluid: &Fluid, densities: &[f64]) -> Result<Observed, ExperimentError> {
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
        let bulk = Bulk { model: &model, kt: fluid.kt, densities, edits: &edits(fluid.changes)?, sampling };
        self.run(name, &bulk.scene(&path)?)
    }

    /// Pressures of a fluid of one species at several densities, which end the names of the runs.
    pub fn pressures(
        &self,
        name: &str,
        fluid: &Fluid,
        densities: &[f64],
    ) -> Result<Vec<(f64, Measured)>, ExperimentError> {
        let at = |rho: &f64| Ok((*rho, self.bulk(&format!("{name}{rho}"), fluid, &[*rho])?.pressure()));
        densities.iter().map(at).collect()
    }

    /// Runs a scene with a model and other values of its keys, each as KEY=VALUE.
    pub fn scene(
        &self,
        name: &str,
        model: &str,
        scene: &str,
        changes: &[&str],
    ) -> Result<Observed, ExperimentError> {
        let path = self.write(name, model)?;
        self.run(name, &run::scene(scene, (&Model::open(&path)?, &path), &edits(changes)?)?)
    }

    /// Runs a scene of `scenes/full`, as it is at full size and with `changes` at quick size.
    pub fn shipped(
        &self,
        name: &str,
        model: &str,
        scene: &str,
        changes: &[&str],
    ) -> Result<Observed, ExperimentError> {
        self.scene(name, model, scene, self.pick(changes, &[]))
    }

    /// This context in a folder that several cases share: their runs are made once.
    pub fn shared(&self, case: &str) -> Context {
        let folder = self.folder.parent().map_or_else(|| self.folder.clone(), |all| all.join(case));
        Context { folder, ..self.clone() }
    }

    /// Plots temperature and pressure of a run in two dimensions against time, from its `thermo.csv`.
    pub fn plot_thermo(
        &self,
        run: &str,
        title: &str,
        outcome: &mut Reproduction,
    ) -> Result<(), ExperimentError> {
        let path = self.folder.join(run).join("thermo.csv");
        let missing = || ExperimentError::at(&path)("it is missing");
        let table = SeriesTable::read(&path)?.ok_or_else(missing)?;
        let column = |name| table.get(name).map_or_else(|| vec![f64::NAN; table.rows()], <[f64]>::to_vec);
        for (file, axis, name, of) in [
            ("temperature", "kT", "kinetic", column("temperature")),
            ("pressure", "pressure", "mean of xx and yy", column("pressure")),
        ] {
            let points = column("time").into_iter().zip(of).collect();
            outcome.plot(file, title, ["time", axis], vec![curve(name, points)]);
        }
        Ok(())
    }
}

fn edits(changes: &[&str]) -> Result<Vec<Edit>, ExperimentError> {
    changes.iter().map(|change| change.parse().map_err(ExperimentError::Conditions)).collect()
}

/// A scene or model with other values of its keys, as `--set` has them.
pub fn edited(text: &str, changes: &[&str]) -> Result<String, ExperimentError> {
    Ok(edit_model(text, &edits(changes)?)?)
}

pub fn mean_field(model: &str, kt: f64) -> Result<MeanField, ExperimentError> {
    Ok(MeanField::new(&Model::parse("model.toml", model)?.at(kt)?)?)
}

pub fn with_parameters(model: &str, parameters: &[(&str, f64)]) -> Result<String, ExperimentError> {
    let edit = |(name, value): &(&str, f64)| Edit::new(&format!("parameters.{name}"), format!("{value:?}"));
    Ok(edit_model(model, &parameters.iter().map(edit).collect::<Vec<Edit>>())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hours of another scene are not replaced without leave; a minute of one is.
    #[test]
    fn runs_of_full_size_are_replaced_with_leave_alone() {
        let of = |size, existing, seed: u64| {
            let folder = tempfile::tempdir().unwrap();
            let context =
                Context { size, folder: folder.path().into(), threads: NonZeroUsize::MIN, existing };
            let run = |seed: u64| {
                let changes =
                    ["box=4.0", "initial.density=3.0", "equilibrate=1", "steps=40", &format!("seed={seed}")];
                context.scene("run", crate::shipped::STANDARD, run::HOMOGENEOUS, &changes)
            };
            run(1).unwrap();
            run(seed).is_ok()
        };
        assert!(of(Size::Full, Existing::Keep, 1) && !of(Size::Full, Existing::Keep, 2));
        assert!(of(Size::Full, Existing::Replace, 2) && of(Size::Quick, Existing::Keep, 2));
    }

    #[test]
    fn a_scene_is_changed_where_the_path_leads_and_nowhere_else() {
        let scene = "model = \"m.toml\"\nsteps = 1\n[[stage]]\nsteps = 2\n[[stage]]\nsteps = 3\n[output]\nthermo = 4\n";
        let text = edited(scene, &["steps=10", "stage.2.steps=30", "output.thermo=0"]).unwrap();
        let expected = "model = \"m.toml\"\nsteps = 10\n[[stage]]\nsteps = 2\n[[stage]]\nsteps = 30\n[output]\nthermo = 0\n";
        assert_eq!(text, expected);
        assert!(edited(scene, &["stage.3.steps=1"]).is_err());
        assert_eq!(edited(scene, &[]).unwrap(), scene);
        // The model of a case replaces that of its scene, and is added where there is none.
        let model = "model = \"n.toml\"\n";
        for (scene, expected) in [(scene, scene.replace("m.toml", "n.toml")), ("", model.to_owned())] {
            assert_eq!(edited(scene, &["model=\"n.toml\""]).unwrap(), expected);
        }
        let of = |name| with_parameters("[parameters]\nA = 1.0\n", &[(name, 2.5)]);
        assert_eq!(of("A").unwrap(), "[parameters]\nA = 2.5\n");
        assert!(of("B").is_err());
    }
}
