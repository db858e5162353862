use super::*;
use psidpd_dynamics::device::{self, Found};
use psidpd_dynamics::run::RunError;

/// List the GPUs that can compute a run, for `psidpd run --device` and the key `device` of a scene.
///
/// The program must be built for them. If it is not, or if there are none, the exit code is 2.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// The content of the file of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    devices: &'a [Found],
}

pub fn run(_: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let devices = device::gpus().map_err(RunError::from)?;
    let mut table = Table::new(["device", "name", "kind", "interface", "driver"]);
    for Found { device, name, kind, interface, driver } in &devices {
        table.push([device, name, kind, interface, driver]);
    }
    say::table(&table);
    conclude(told, &Report { devices: &devices }, true)
}
