use super::run::{quoted, thread_count, threads_at_once, watch_signals};
use super::*;
use psidpd_experiments::sweep::{self, Axis, Options};
use std::sync::atomic::Ordering;

/// Run a scene at many values of its keys, several runs at a time.
///
/// Each run has a folder of its own below DIR. A sweep that was interrupted goes on when it is started again; runs that are
/// finished are taken as they are. sweep.csv has the results with errors, report.html plots of them.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The scene file.
    scene: PathBuf,
    /// A key and its values, evenly spaced or a list; of several keys every combination is run.
    #[arg(long, value_name = "KEY=LOW:HIGH:N", required = true)]
    over: Vec<Axis>,
    /// Folder for the runs, sweep.csv and report.html.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Runs side by side [default: processors / threads].
    #[arg(long, value_name = "N", value_parser = thread_count)]
    jobs: Option<NonZeroUsize>,
    /// Threads of each run.
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads_at_once)]
    threads: NonZeroUsize,
    #[command(flatten)]
    settings: Settings,
}

impl Arguments {
    pub fn files(&self) -> Files {
        {
            let edits = self.settings.edits.iter().chain(self.over.iter().flat_map(|axis| &axis.edits));
            let made = ["sweep.csv", "report.html"].map(|name| self.out.join(name));
            Files::reads([&self.scene]).edits(edits).makes(made)
        }
    }
}

pub fn run(a: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let options = Options {
        scene: a.scene.clone(),
        edits: a.settings.edits.clone(),
        axes: a.over.clone(),
        out: a.out.clone(),
        jobs: a.jobs,
        threads: a.threads,
        overwrite: told.existing == Existing::Replace,
    };
    let total: usize = a.over.iter().map(|axis| axis.edits.len()).product();
    let stop = watch_signals()?;
    let points = sweep::run(&options, &stop, &|point, ended| {
        let edits: Vec<String> = point.edits.iter().map(ToString::to_string).collect();
        let what = point.error.as_ref().map_or(String::new(), |e| format!(": {e}"));
        say!("{ended} of {total}: {}{what}", edits.join(", "));
    })?;
    say!("");
    say::table(&sweep::table(&a.over, &points));
    say!("written to {}", a.out.join("sweep.csv").display());
    say!("report: {}", a.out.join("report.html").display());
    write_json(told, &points)?;
    let signal = stop.load(Ordering::Relaxed);
    if signal != 0 {
        let finished = points.iter().filter(|p| p.finished).count();
        let command = a.to_go_on(told.json).map_or(String::new(), |line| format!("; to go on: {line}"));
        say!("stopped with {finished} of {total} runs finished{command}");
        return Ok(Verdict::Interrupted(u8::try_from(signal).unwrap_or(0)));
    }
    Ok(if points.iter().all(|p| p.finished) { Verdict::Good } else { Verdict::CheckFailed })
}

impl Arguments {
    /// The command line that resumes the sweep, if it can be shown.
    fn to_go_on(&self, json: Option<&Path>) -> Option<String> {
        let mut words = vec![format!("psidpd sweep {} --out {}", quoted(&self.scene)?, quoted(&self.out)?)];
        for axis in &self.over {
            words.push(format!("--over {}", quoted(&axis.text)?));
        }
        for edit in &self.settings.edits {
            words.push(format!("--set {}", quoted(edit.to_string())?));
        }
        words.extend(self.jobs.map(|n| format!("--jobs {n}")));
        words.extend((self.threads.get() > 1).then(|| format!("--threads {}", self.threads)));
        if let Some(file) = json {
            words.push(format!("--json {}", quoted(file)?));
        }
        Some(words.join(" "))
    }
}
