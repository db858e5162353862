use super::*;
use psidpd_report::write_run_report;

/// Make report.html of a run again.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The folder of the run.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads(
            &[
                "about.json",
                "thermo.csv",
                "observables.json",
                "summary.json",
                "timing.json",
                "final.data",
                "last-good.data",
                "dump.lammpstrj",
                "trajectory.xyz",
            ]
            .map(|name| self.folder.join(name)),
        )
    }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let page = write_run_report(&arguments.folder, told.existing)?;
    say!("{}", page.display());
    conclude(told, &json!({"report": shown(&page)}), true)
}
