use super::*;
use psidpd_experiments::hardcases::{self, Extent};

/// Run cases that are hard for a simulation, with each integrator and precision, and check that each ends as required.
///
/// The exit code is 1 if a case does not do what it must. docs/hardcases.md has the cases.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Only the integrators that are recommended, velocity Verlet in both precisions, the others in mixed.
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Also make runs of a million steps.
    #[arg(long)]
    full: bool,
    /// In LAMMPS with the plugin too, which must be installed.
    #[arg(long)]
    lammps: bool,
    /// Only the cases, or groups of cases, whose name contains these words.
    #[arg(long, value_name = "WORDS")]
    only: Option<String>,
}

pub fn run(a: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let extent = match (a.quick, a.full) {
        (true, _) => Extent::Quick,
        (_, true) => Extent::Full,
        _ => Extent::All,
    };
    let found = hardcases::run(extent, a.lammps, a.only.as_deref(), &Progress::new())?;
    say::table(&hardcases::table(&found));
    let wrong: Vec<_> = found.iter().filter(|v| v.wrong.is_some()).collect();
    for v in &wrong {
        let why = v.wrong.as_deref().unwrap_or_default();
        say!("{}, {}, {}, {}: must be {}: {why}", v.case, v.host.name(), v.integrator, v.precision, v.must);
    }
    say!("{} of {} cases as expected", found.len() - wrong.len(), found.len());
    conclude(told, &found, wrong.is_empty())
}
