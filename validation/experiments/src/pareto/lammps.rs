//! LAMMPS among the points: the plugin, which takes the native steps, and LAMMPS's own style for the fluid, where it has one.

use super::origin::Origin;
use super::own_style::own_style;
use super::quantity::{Class, Quantities};
use super::recommend::scene_of;
use super::sample::{Effort, Made, Sampled, far_off, observe};
use super::setting::{Physics, Setting};
use crate::ExperimentError;
use crate::code::Host;
use crate::lammps::host::PluginHost;
use crate::lammps::style::PairStyle;
use crate::lammps::{frames, log};
use psidpd_formats::files::{Existing, remove_if_there, work_folder};
use psidpd_lammps_host::export::lammps::{self as deck, Script};
use psidpd_observe::{Observers, Series};
use std::path::{Path, PathBuf};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(3600);

#[derive(Debug)]
pub struct LammpsRuns {
    host: PluginHost,
    work: PathBuf,
    pub own: Option<PairStyle>,
}

impl LammpsRuns {
    /// The LAMMPS that is installed; builds the plugin for it if necessary.
    pub fn open(origin: &Origin, work: &Path, note: &dyn Fn(&str)) -> Result<LammpsRuns, ExperimentError> {
        let host = PluginHost::find(note)?;
        Ok(LammpsRuns { host, work: work.to_owned(), own: own_style(origin)? })
    }

    /// Seconds for a step, by LAMMPS's own clock, with no output in the loop.
    pub fn time(&self, origin: &Origin, setting: &Setting, steps: u64) -> Result<f64, ExperimentError> {
        let text = self.run(origin, setting, &[10, steps], "time", "")?;
        let account = log::timed("a timed run of LAMMPS", &text)?;
        Ok(account.seconds / account.steps as f64)
    }

    /// Makes a run of LAMMPS's own style: kinetic temperature and pressure by LAMMPS, g(r), diffusion and densities from
    /// its configurations. `step` is the time that a step takes.
    pub fn sample(
        &self,
        origin: &Origin,
        physics: &Physics,
        effort: Effort,
        step: f64,
        name: &str,
    ) -> Result<Sampled, ExperimentError> {
        let every = physics.interval();
        let samples = match effort {
            Effort::Seconds(s) => ((s / (step * every as f64)) as u64).clamp(20, 400),
            Effort::Samples(n) => n,
        };
        let setting = Setting { host: Host::Lammps, physics: *physics, threads: std::num::NonZeroUsize::MIN };
        let output = format!(
            "thermo_style custom step temp press\nthermo {every}\n\
             dump frames all custom {every} frames.lammpstrj id x y z ix iy iz\ndump_modify frames sort id\n"
        );
        let steps = [samples / 4 * every, samples * every];
        let text = match self.run(origin, &setting, &steps, name, &output) {
            Ok(text) => text,
            Err(ExperimentError::Lammps(error @ psidpd_lammps_host::LammpsError::Run { .. })) => {
                return Ok(Err(error.to_string().lines().next().unwrap_or_default().to_owned()));
            }
            Err(other) => return Err(other),
        };
        let mut sampled = Series::new(2);
        // The first is before the first step.
        for row in log::rows(&text, 3).iter().skip(1) {
            sampled.push(&row[1..3]);
        }
        let mean = sampled.mean(0);
        if let Some(why) = far_off(mean.value / origin.stage.kt) {
            return Ok(Err(why));
        }
        let observe = observe(origin, every, Host::Lammps, true)?;
        let mut observers = Observers::new(&observe, [origin.stage.name.as_str()]);
        let path = self.work.join(name).join("frames.lammpstrj");
        let scene = (origin.scene, origin.stage.name.as_str(), origin.stage.kt);
        frames::show(&path, scene, &origin.state, (every, origin.dt(physics)), &mut observers)?;
        let _ = remove_if_there(&path);
        let means = [(Class::Temperature, "T_kin", mean), (Class::Pressure, "p_total", sampled.mean(1))];
        let quantities = Quantities::of(means, &observers.finish(), origin.scene.model.dimensions());
        let time = sampled.samples() as f64 * physics.interval() as f64 * origin.dt(physics);
        Ok(Ok(Made { quantities, samples: sampled.samples(), time }))
    }

    /// Runs a deck of these stages, with commands before the last, and gives what LAMMPS prints.
    fn run(
        &self,
        origin: &Origin,
        setting: &Setting,
        steps: &[u64],
        name: &str,
        before_last_run: &str,
    ) -> Result<String, ExperimentError> {
        let folder = self.work.join(name);
        let scene = scene_of(origin, &setting.physics, steps);
        work_folder(&folder)?;
        deck::write_inputs(&scene, &origin.state, &folder, Existing::Keep)?;
        let own = self.own.as_ref().filter(|_| setting.host == Host::Lammps);
        let commands = own.map(|own| (own.atom_style(), own.commands(origin.stage.kt, scene.seed)));
        if let Some(("mdpd", _)) = commands {
            origin.state.to_data_by_tag("psidpd pareto").write_mdpd(&folder.join(deck::START))?;
        }
        let script = Script {
            plugin: self.host.plugin.is_some() && own.is_none(),
            style: commands.as_ref().map(|(atoms, commands)| (*atoms, commands.as_str())),
            before_last_run,
            final_data: false,
        };
        self.host.run(1, &folder, &deck::script_of(&scene, script)?, "none", LIMIT)
    }
}
