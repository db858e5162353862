use super::*;
use psidpd_dynamics::run::FILES;
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
        let others =
            ["summary.json", "timing.json"].into_iter().chain(FILES).map(|name| self.folder.join(name));
        Files::reads(&["about.json", "thermo.csv", "observables.json"].map(|name| self.folder.join(name)))
            .also_reads(others)
    }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let page = write_run_report(&arguments.folder, told.existing)?;
    say!("{}", page.display());
    conclude(told, &json!({"report": shown(&page)}), true)
}
