use super::*;
use psidpd_core::engine::Want;
use psidpd_dynamics::run::{Simulation, State};
use psidpd_formats::data::DataFile;

/// Conservative energy, virial, densities and forces of one configuration, by atom id.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The model file.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// A LAMMPS data file, atom_style atomic; type k is the model's k-th species.
    #[arg(long, value_name = "FILE")]
    data: PathBuf,
    /// kT.
    #[arg(long = "kT", value_name = "T", allow_negative_numbers = true, value_parser = temperature)]
    kt: f64,
    #[command(flatten)]
    settings: Settings,
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.model, &self.data])
    }
}

/// The content of the file of `--json`.
#[derive(Debug, Serialize)]
struct Forces {
    energy: f64,
    /// The components are in the order xx, yy, zz, xy, xz, yz.
    virial: [f64; 6],
    /// For each atom, in the order of the ids, each density of each species, density-major.
    density: Vec<Vec<f64>>,
    forces: Vec<[f64; 3]>,
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let (model, kt) = arguments.settings.model(&arguments.model)?;
    let mut data = DataFile::read(&arguments.data)?;
    data.sort_by_id();
    let state = State::from_data(&data, &model).map_err(|error| {
        let line = error.atom.and_then(|id| DataFile::line_of(&arguments.data, id));
        CliError::NoState { path: arguments.data.clone(), line, error }
    })?;
    let mut simulation = Simulation::new(&model, kt.unwrap_or(arguments.kt), state, 1)?;
    // Other codes are compared with the plain sum over pairs.
    simulation.use_pair_sums_only(true);
    simulation.compute(Want { densities: true, ..Want::TOTALS }, None)?;
    let densities = simulation.engine().results().densities;
    let width = densities.len() / simulation.len().max(1);
    let forces = Forces {
        energy: simulation.potential_energy(),
        virial: simulation.tally().virial,
        density: match width {
            0 => vec![Vec::new(); simulation.len()],
            _ => densities.chunks_exact(width).map(<[f64]>::to_vec).collect(),
        },
        forces: simulation.forces().to_vec(),
    };
    let size = forces.forces.iter().flatten().map(|c| c * c).sum::<f64>() / forces.forces.len() as f64;
    let mut table = Table::new(["quantity", "value"]);
    table.push(["particles".to_owned(), forces.forces.len().to_string()]);
    table.push(["energy".to_owned(), format!("{:.12e}", forces.energy)]);
    for (name, w) in ["xx", "yy", "zz", "xy", "xz", "yz"].iter().zip(forces.virial) {
        table.push([format!("virial {name}"), format!("{w:.12e}")]);
    }
    table.push(["root mean square force".to_owned(), format!("{:.12e}", size.sqrt())]);
    say::table(&table);
    conclude(told, &forces, true)
}
