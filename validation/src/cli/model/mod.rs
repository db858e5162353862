//! `psidpd model`: liquids by their data sheets, two of them by the tension between them, and walls by their contact angles.

mod liquid;
mod mixture;
mod wall;

use super::*;
use liquid::OfLiquid;
use mixture::OfMixture;
use psidpd_observe::Measured;
use psidpd_report::quantity::with_error;
use wall::OfWall;

/// Make a model of a liquid or of two, or a wall for it.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Make a model of a liquid from its data sheet.
    ///
    /// Numbers are in SI units. Density and the size of a particle are needed; what else is left out is free, and is reported.
    /// Compressibility, tension and viscosity are met by short runs, and measured again by longer ones. Exits with 1, and
    /// writes nothing, if a number is not met; says then which two numbers conflict, and what is nearest.
    Liquid(Box<OfLiquid>),
    /// Join the models of two liquids by the tension between them.
    ///
    /// Each keeps its own formulas; sought is the attraction between the species. Layers of both, one on the other, have the tension;
    /// longer runs from other seeds measure the result. Exits with 1, and writes nothing, if it is not within 3 percent.
    Mixture(OfMixture),
    /// Find the wall on which a liquid has a contact angle.
    ///
    /// The wall is matter behind a reflecting face, `[[wall]]` of a scene; found is the strength of its attraction. Three tensions and Young's law say the angle; a ridge of the liquid on the wall, which is
    /// written as a scene, is the check. Exits with 1, and writes nothing, if the two are not within 3 degrees of the angle.
    Wall(OfWall),
}

impl Verb {
    pub fn files(&self) -> Files {
        match self {
            Verb::Liquid(a) => a.files(),
            Verb::Mixture(a) => a.files(),
            Verb::Wall(a) => a.files(),
        }
    }
}

pub fn run(verb: &Verb, told: Told) -> Result<Verdict, Failure> {
    match verb {
        Verb::Liquid(a) => liquid::run(a, told),
        Verb::Mixture(a) => mixture::run(a, told),
        Verb::Wall(a) => wall::run(a, told),
    }
}

/// Where what is found goes, and from which seed it is sought.
#[derive(Debug, clap::Args)]
pub struct Search {
    /// Write the file even if not all is met.
    #[arg(long)]
    anyway: bool,
    /// Seed of the runs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where the file goes.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Search {
    /// Writes what was found, if it is good or asked for.
    fn write(&self, told: Told, text: Option<&str>, good: bool) -> Result<(), Failure> {
        match text {
            Some(text) if good || self.anyway => {
                write_bytes(&self.out, told.existing, text.as_bytes())?;
                say!("written to {}", self.out.display());
            }
            Some(_) => say!("nothing is written, as not all is met: --anyway writes the file"),
            None => say!("nothing is written: nothing was found"),
        }
        Ok(())
    }

    /// The end of the command that repeats the search.
    fn command(&self) -> String {
        format!(" --seed {} --out {}", self.seed, file_name(&self.out))
    }
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| *x > 0.0 && x.is_finite())
        .ok_or_else(|| "expected a number above 0".into())
}

fn shown(x: Measured) -> String {
    if x.value.is_finite() { with_error(x.value, Some(x.error)) } else { "-".into() }
}
