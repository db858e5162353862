//! LAMMPS among the points: the plugin, which takes the native steps, and LAMMPS's own style for the fluid, where it has one.

use super::origin::Origin;
use super::own_style::OwnStyle;
use super::quantity::{Class, Quantities};
use super::recommend::scene_of;
use super::sample::{Effort, FAR_OFF, Sampled, observe};
use super::setting::{Host as Who, Physics, Setting};
use crate::ExperimentError;
use crate::bench::log;
use psidpd_core::engine::Pool;
use psidpd_formats::dump;
use psidpd_lammps_host::Host;
use psidpd_lammps_host::export::lammps as deck;
use psidpd_observe::frame::View;
use psidpd_observe::{Observers, Series};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest time that one run may take.
const LIMIT: Duration = Duration::from_secs(3600);

/// LAMMPS with the plugin, in a folder for decks.
#[derive(Debug)]
pub struct Lammps {
    host: Host,
    /// `None` where the program has the styles in it.
    plugin: Option<PathBuf>,
    work: PathBuf,
    /// Its own style for the fluid.
    pub own: Option<OwnStyle>,
}

impl Lammps {
    /// The LAMMPS that is installed; builds the plugin for it if need be.
    ///
    /// # Errors
    /// There is none, or the plugin cannot be built.
    pub fn open(origin: &Origin, work: &Path, note: &dyn Fn(&str)) -> Result<Lammps, ExperimentError> {
        let host = Host::find()?;
        let plugin = psidpd_lammps_host::plugin::build(&host, note)?;
        psidpd_lammps_host::plugin::check(&host, &plugin)?;
        let (host, plugin) = match psidpd_lammps_host::plugin::launcher(&plugin) {
            Some(launcher) => (host.with_program(&launcher), None),
            None => (host, Some(plugin)),
        };
        Ok(Lammps { host, plugin, work: work.to_owned(), own: OwnStyle::of(origin)? })
    }

    /// Seconds for a step, by LAMMPS's own clock, with no output in the loop.
    ///
    /// # Errors
    /// LAMMPS stops.
    pub fn time(&self, origin: &Origin, setting: &Setting, steps: u64) -> Result<f64, ExperimentError> {
        let text = self.run(origin, setting, &[10, steps], "time", |script| script)?;
        let account = log::parse(&text)
            .map_err(|problem| ExperimentError::Printed { what: "a timed run of LAMMPS".into(), problem })?;
        Ok(account.seconds / account.steps as f64)
    }

    /// Makes a run of LAMMPS's own style: kinetic temperature and pressure by LAMMPS, g(r), diffusion and densities from
    /// its configurations. `step` is the time that a step takes.
    ///
    /// # Errors
    /// LAMMPS prints what is not understood.
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
        let setting = Setting { host: Who::Lammps, physics: *physics, threads: std::num::NonZeroUsize::MIN };
        let add = |script: String| {
            let output = format!(
                "thermo_style custom step temp press\nthermo {every}\n\
                 dump frames all custom {every} frames.lammpstrj id x y z ix iy iz\ndump_modify frames sort id\nrun "
            );
            // Behind the steps that settle.
            match script.rsplit_once("run ") {
                Some((before, after)) => format!("{before}{output}{after}"),
                None => script,
            }
        };
        let steps = [samples / 4 * every, samples * every];
        let text = match self.run(origin, &setting, &steps, name, add) {
            Ok(text) => text,
            Err(ExperimentError::Lammps(error @ psidpd_lammps_host::LammpsError::Run { .. })) => {
                return Ok(Sampled::Unstable(
                    error.to_string().lines().next().unwrap_or_default().to_owned(),
                ));
            }
            Err(other) => return Err(other),
        };
        let mut sampled = Series::new(2);
        for row in rows(&text) {
            sampled.push(&row[1..3]);
        }
        let mean = sampled.mean(0);
        let calm = mean.value < FAR_OFF * origin.stage.kt;
        // What is no number is not calm.
        if !calm {
            return Ok(Sampled::Unstable(format!(
                "the temperature is {:.1} kT",
                mean.value / origin.stage.kt
            )));
        }
        let observe = observe(origin, every, Who::Lammps, true)?;
        let mut observers = Observers::new(&observe, [origin.stage.name.as_str()]);
        let path = self.work.join(name).join("frames.lammpstrj");
        for (k, frame) in dump::read(&path)?.iter().enumerate() {
            self.show(origin, frame, k, (every, every as f64 * origin.dt(physics)), &mut observers)?;
        }
        let _ = std::fs::remove_file(&path);
        let means = [(Class::Temperature, "T_kin", mean), (Class::Pressure, "p_total", sampled.mean(1))];
        let quantities = Quantities::of(means, &observers.finish(), origin.scene.model.dimensions());
        let time = sampled.samples() as f64 * physics.interval() as f64 * origin.dt(physics);
        Ok(Sampled::Made { quantities: Box::new(quantities), samples: sampled.samples(), time })
    }

    /// Shows a frame of LAMMPS to observers, which look at positions alone; frames are `every` steps and a time `interval` apart.
    fn show(
        &self,
        origin: &Origin,
        frame: &dump::Frame,
        k: usize,
        (every, interval): (u64, f64),
        observers: &mut Observers,
    ) -> Result<(), ExperimentError> {
        let missing = || ExperimentError::Printed {
            what: "a dump of LAMMPS".into(),
            problem: "no columns of positions",
        };
        let x = frame.vectors(["x", "y", "z"]).ok_or_else(missing)?;
        let images = frame.vectors(["ix", "iy", "iz"]).ok_or_else(missing)?;
        let images: Vec<[i32; 3]> = images.iter().map(|i| i.map(|c| c as i32)).collect();
        let ids = frame.get("id").ok_or_else(missing)?;
        let tags: Vec<i32> = ids.iter().map(|id| *id as i32).collect();
        let (v, species) = (vec![[0.0; 3]; x.len()], vec![0; x.len()]);
        let pool = Pool::new(NonZeroUsize::MIN);
        let view = View {
            pool: &pool,
            step: (k as u64 + 1) * every,
            time: k as f64 * interval,
            kt: origin.stage.kt,
            model: &origin.scene.model,
            dimensions: origin.scene.model.dimensions(),
            domain: &origin.state.domain,
            masses: &origin.state.mass,
            x: &x,
            v: &v,
            images: &images,
            species: &species,
            tags: &tags,
            frozen: &[],
            temperature: 0.0,
            kinetic_energy: 0.0,
            pressure: [0.0; 6],
            conservative_pressure: [0.0; 6],
            flux: None,
        };
        observers.sample(view, &origin.stage.name);
        Ok(())
    }

    /// Runs a deck of these stages, and gives what LAMMPS prints.
    fn run(
        &self,
        origin: &Origin,
        setting: &Setting,
        steps: &[u64],
        name: &str,
        change: impl Fn(String) -> String,
    ) -> Result<String, ExperimentError> {
        let folder = self.work.join(name);
        let scene = scene_of(origin, &setting.physics, steps);
        deck::write(&scene, &folder)?;
        deck::write_start(&scene, &origin.state, &folder.join(deck::START))?;
        let path = folder.join(deck::SCRIPT);
        let mut script = std::fs::read_to_string(&path).map_err(ExperimentError::io(&path))?;
        if self.plugin.is_none() || setting.host == Who::Lammps {
            script = without(&script, "plugin  ");
        }
        if let (Who::Lammps, Some(own)) = (setting.host, &self.own) {
            script = own.put_into(&script, origin);
            if own.needs_its_own_data() {
                let data = folder.join(deck::START);
                origin.state.to_data_by_tag("psidpd pareto").write_mdpd(&data)?;
            }
        }
        script = change(without(&script, "write_data"));
        std::fs::write(&path, script).map_err(ExperimentError::io(&path))?;
        let plugin = self.plugin.as_ref().map(|p| p.display().to_string()).unwrap_or_default();
        let arguments = ["-log", "none", "-var", "plugin", plugin.as_str()];
        Ok(self.host.run_script(1, &folder, &path, &arguments, LIMIT)?.stdout)
    }
}

/// A script without the lines that begin so.
fn without(script: &str, begin: &str) -> String {
    script.lines().filter(|line| !line.starts_with(begin)).fold(String::new(), |all, line| all + line + "\n")
}

/// The rows of numbers of the last table that LAMMPS printed, but its first, which is before the first step.
fn rows(text: &str) -> Vec<Vec<f64>> {
    let lines: Vec<&str> = text.lines().collect();
    let header = lines.iter().rposition(|line| line.split_whitespace().next() == Some("Step"));
    let table = header.map_or(&[][..], |k| &lines[k + 1..]);
    let read = |line: &&str| line.split_whitespace().map(|w| w.parse().ok()).collect::<Option<Vec<f64>>>();
    table.iter().map_while(read).filter(|row| row.len() == 3).skip(1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_table_is_read() {
        let text = "Step Temp Press\n 0 9 9\nLoop time\n   Step  Temp  Press \n 10 1.5 2\n 20 1 3.5\n 30 2 4\nLoop time of\n";
        assert_eq!(rows(text), [[20.0, 1.0, 3.5], [30.0, 2.0, 4.0]]);
        assert!(rows("nothing").is_empty());
    }
}
