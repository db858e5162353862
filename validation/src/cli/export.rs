use super::*;
use psidpd_lammps_host::export::eam::{self, Grid};
use psidpd_lammps_host::export::lammps as deck;

/// A fluid in the formats of other codes.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Tables for LAMMPS's pair_style eam/alloy: the same conservative fluid in any LAMMPS.
    Eam(EamArguments),
    /// An input deck for LAMMPS with the pair style dpd/psi: the scene's own trajectory.
    Lammps(LammpsArguments),
}

#[derive(Debug, clap::Args)]
pub struct LammpsArguments {
    /// The scene file.
    scene: PathBuf,
    /// Folder for in.lammps, start.data, model.toml and the tables of the model.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    settings: Settings,
}

#[derive(Debug, clap::Args)]
pub struct EamArguments {
    /// The model file.
    model: PathBuf,
    /// The table to write; default: the model's name with .eam.alloy.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// kT.
    #[arg(long = "kT", value_name = "T", default_value_t = 1.0, allow_negative_numbers = true, value_parser = temperature)]
    kt: f64,
    /// Spacing in r.
    #[arg(long, value_name = "DR", default_value_t = Grid::default().spacing)]
    spacing: f64,
    /// Largest local density in the table.
    #[arg(long, value_name = "RHO", default_value_t = Grid::default().largest_density)]
    largest_density: f64,
    /// How many densities.
    #[arg(long, value_name = "N", default_value_t = Grid::default().densities)]
    densities: usize,
    #[command(flatten)]
    settings: Settings,
}

impl EamArguments {
    /// The file for the table.
    fn table(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| {
            let mut name = self.model.file_stem().unwrap_or_default().to_owned();
            name.push(".eam.alloy");
            PathBuf::from(name)
        })
    }
}

impl Verb {
    pub fn files(&self) -> Files {
        match self {
            Verb::Eam(a) => Files::reads([&a.model]).edits(&a.settings.edits).writes([a.table()]),
            Verb::Lammps(a) => Files::reads([&a.scene])
                .edits(&a.settings.edits)
                .makes(deck::FILES.map(|name| a.out.join(name))),
        }
    }
}

pub fn run(verb: &Verb, told: Told) -> Result<Verdict, Failure> {
    match verb {
        Verb::Eam(a) => run_eam(a, told),
        Verb::Lammps(a) => run_lammps(a, told),
    }
}

fn run_lammps(a: &LammpsArguments, told: Told) -> Result<Verdict, Failure> {
    let scene = a.settings.scene(&a.scene)?;
    let files = deck::write(&scene, &a.out, told.existing)?;
    say!("written to {}; run it there:", a.out.display());
    say!("lmp -in {} -var plugin PATH/psidpdplugin.so", deck::SCRIPT);
    conclude(
        told,
        &json!({"folder": shown(&a.out), "files": files.iter().map(shown).collect::<Vec<_>>()}),
        true,
    )
}

fn run_eam(a: &EamArguments, told: Told) -> Result<Verdict, Failure> {
    let (model, kt) = a.settings.model(&a.model)?;
    let fluid = model.at(kt.unwrap_or(a.kt))?;
    let out = a.table();
    let grid = Grid { spacing: a.spacing, largest_density: a.largest_density, densities: a.densities };
    eam::write(&fluid, &vec![1.0; fluid.species.len()], grid, &out, told.existing)?;
    say!("{}", out.display());
    say!("pair_style eam/alloy\npair_coeff * * {} {}", out.display(), fluid.species.join(" "));
    conclude(told, &json!({"table": shown(&out), "species": fluid.species}), true)
}
