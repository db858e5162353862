use super::*;
use psidpd_dynamics::run::FILES;
use psidpd_report::{Against, FALSE_ALARM, write_run_report};

/// Make report.html of a run again, or compare two runs.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The folder of the run.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Compare with another run, number by number, in place of a page. The verb fails if the runs differ by more than chance
    #[arg(long, value_name = "DIR")]
    against: Option<PathBuf>,
}

impl Arguments {
    pub fn files(&self) -> Files {
        let folders = [Some(&self.folder), self.against.as_ref()];
        let files = |names: &[&str]| -> Vec<PathBuf> {
            folders.iter().flatten().flat_map(|folder| names.iter().map(|name| folder.join(name))).collect()
        };
        Files::reads(&files(&["about.json", "thermo.csv", "observables.json"]))
            .also_reads(files(&["summary.json", "timing.json"]).into_iter().chain(files(&FILES)))
    }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    if let Some(other) = &arguments.against {
        return compare([&arguments.folder, other], told);
    }
    let page = write_run_report(&arguments.folder, told.existing)?;
    say!("{}", page.display());
    conclude(told, &json!({"report": shown(&page)}), true)
}

fn compare(folders: [&PathBuf; 2], told: Told) -> Result<Verdict, Failure> {
    let found = Against::read(folders.map(PathBuf::as_path))?;
    say!("{}", found.table().to_text().trim_end());
    found.left_out.iter().for_each(|what| say!("not compared: {what}"));
    let (numbers, limit, differing) = (found.numbers, found.limit, found.differing().count());
    let all = found.rows.len();
    match (numbers, differing) {
        (0, _) => say!("nothing is compared: no number with an error is in both runs"),
        (_, 0) => say!("no difference: {numbers} numbers of {all} quantities are within {limit:.1} errors"),
        _ => say!(
            "{differing} of {all} quantities differ by more than {limit:.1} errors, which runs of one fluid do in less than {} % of cases",
            100.0 * FALSE_ALARM
        ),
    }
    conclude(told, &found, numbers > 0 && differing == 0)
}
