use super::*;
use psidpd_experiments::crosscheck::{Options, check_table, validate};

/// Compare the codes; a few minutes on two cores.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Larger systems and longer runs: about an hour.
    #[arg(long)]
    full: bool,
    /// Folder for report.html, results.json and the runs.
    #[arg(long, value_name = "DIR", default_value = "target/validate")]
    out: PathBuf,
    /// Tests make only this comparison.
    #[arg(skip)]
    pub(super) only: Option<&'static str>,
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::default().writes(["results.json", "report.html"].map(|name| self.out.join(name)))
    }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let progress = Progress::new();
    let Arguments { full, ref out, only } = *arguments;
    let options = Options { full, out: out.clone(), existing: told.existing, only };
    let outcome = validate(&options, &progress)?;
    let results = &outcome.results;
    say::table(&check_table(results));
    say!(
        "\n{} passed, {} failed\nreport: {}",
        results.passed_count(),
        results.failed_count(),
        outcome.report.display()
    );
    conclude(told, results, results.passed)
}
