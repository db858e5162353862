//! Shipped scenes in LAMMPS, as its users would measure them: by its own pair styles, computes and fixes, on one core.

use super::deck::{Place, pair_styles};
use crate::ExperimentError;
use crate::fluids::{DPD_PAIR, GAMMA, SET6};
use crate::lammps::deck::Deck;
use crate::lammps::host::PluginHost;
use crate::lammps::log::seconds_of_loops;
use crate::lammps::style::PairStyle;
use crate::start::SEED;
use psidpd_dynamics::scene::Scene;
use psidpd_lammps_host::{Host, plugin};
use psidpd_report::Progress;
use serde::Serialize;
use std::collections::HashSet;
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(3600);

/// What a scene takes in LAMMPS, in seconds of its loops.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct InLammps {
    /// With the computes that measure what the scene observes.
    pub measured: f64,
    pub bare: f64,
    /// `measured` over the processor time of the scene as shipped.
    pub over_shipped: f64,
}

/// Temperature, pressure, energy, g(r) and mean square displacements, at every tenth step as those of the scenes.
const BULK: &str = "\
fix means all ave/time 10 1 10 c_thermo_temp c_thermo_press c_thermo_pe ave running
compute rdf all rdf 100
fix rdf all ave/time 10 1 10 c_rdf[*] mode vector ave running
compute msd all msd
fix msd all ave/time 10 1 10 c_msd[4] ave running
";

/// The correlations that Green and Kubo's viscosity is the integral of.
const VISCOSITY: &str = "\
fix correlations all ave/correlate 10 50 500 c_thermo_press[4] c_thermo_press[5] c_thermo_press[6] type auto ave running
";

/// Profiles of density and stress, temperature and tension.
const SLAB: &str = "\
fix means all ave/time 10 1 10 c_thermo_temp c_thermo_press[1] c_thermo_press[2] c_thermo_press[3] ave running
compute bins all chunk/atom bin/1d z lower 0.1
compute stress all stress/atom NULL
fix density all ave/chunk 10 1 10 bins density/number ave running
fix stress all ave/chunk 10 1 10 bins c_stress[1] c_stress[2] c_stress[3] ave running
";

/// The pair style and the computes of a shipped scene whose fluid LAMMPS has; `None` for others.
fn of_scene(name: &str) -> Option<(PairStyle, Vec<&'static str>)> {
    let mdpd = PairStyle::Mdpd(SET6.pair(GAMMA));
    match name {
        "standard-dpd" => Some((DPD_PAIR, vec![BULK, VISCOSITY])),
        "warren-set6-bulk" => Some((mdpd, vec![BULK])),
        "warren-set6-slab" => Some((mdpd, vec![SLAB])),
        _ => None,
    }
}

/// A LAMMPS for scenes, and the pair styles that it has.
pub struct Lammps {
    place: Place,
    styles: HashSet<String>,
}

impl Lammps {
    /// The LAMMPS at a place, or one that is installed; scripts run in a folder inside `out`.
    pub fn find(lammps: Option<&Path>, out: &Path, progress: &Progress) -> Result<Lammps, ExperimentError> {
        let install = || plugin::install_to_build(&|line| progress.note(line));
        let host = lammps.map_or_else(install, Host::at)?;
        let work = out.join("lammps");
        let place = Place { lammps: PluginHost { host, plugin: None }, work };
        Ok(Lammps { styles: pair_styles(&place)?, place })
    }

    /// Seconds of a scene with and without computes; `None` where LAMMPS has no such fluid.
    pub fn time(&self, name: &str, scene: &Scene) -> Result<Option<[f64; 2]>, ExperimentError> {
        let Some((style, computes)) = of_scene(name) else { return Ok(None) };
        let is_mdpd = style.atom_style() == "mdpd";
        if !self.styles.contains(if is_mdpd { "mdpd" } else { "dpd" }) {
            return Ok(None);
        }
        let path = self.place.work.join(name).with_extension("data");
        let data = scene.initial_state().to_data(name);
        if is_mdpd {
            data.write_mdpd(&path)?
        } else {
            data.write(&path)?
        }
        let once = |computes: &[&str]| {
            let deck = Deck::new(&style, SEED, path.display().to_string());
            let script = script(&deck, scene, computes);
            seconds_of_loops(name, &self.place.lammps.run(1, &self.place.work, &script, "none", LIMIT)?)
        };
        Ok(Some([once(&computes)?, once(&[])?]))
    }
}

/// The stages of a scene, with computes in the last one alone, as observables sample it.
fn script(deck: &Deck, scene: &Scene, computes: &[&str]) -> String {
    let mut text = deck.text() + "fix 1 all nve\nthermo 50\n";
    for (number, stage) in scene.stages.iter().enumerate() {
        if number + 1 == scene.stages.len() {
            text.extend(computes.iter().copied());
        }
        // Writing to a String cannot fail.
        let _ = writeln!(text, "timestep {:?}\nrun {}", stage.dt, stage.steps);
    }
    text
}
