use super::say::whoever_listens as say;
use super::*;
use psidpd_core::engine::{Pool, Precision, at_once};
use psidpd_dynamics::device::Device;
use psidpd_dynamics::run::{Advice, Begin, FILES, Length, Outcome, Runner, Start, Summary, Timing};
use psidpd_experiments::check::uncalibrated;
use psidpd_report::{Headline, headline, write_run_report};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::low_level::{emulate_default_handler, register};
use std::ffi::OsStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Run a scene natively.
///
/// Ctrl-C or SIGTERM ends a run after the present step, with a checkpoint; a second one kills it.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The scene file.
    scene: PathBuf,
    /// Folder for thermo.csv, dump.lammpstrj, final.data, summary.json, timing.json and checkpoints.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Continue from the last checkpoint in the folder, or from the first step if there is none. The files become those of an
    /// uninterrupted run, byte for byte.
    #[arg(long, conflicts_with = "overwrite")]
    resume: bool,
    /// Prolong the run in the folder, finished or not: its last stage gets N steps, or N more. The files become those of a run that
    /// was this long from the start.
    #[arg(long, value_name = "N|+N", requires = "resume")]
    steps: Option<Length>,
    /// Threads that share the work; what a run writes does not depend on their number.
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads_at_once)]
    threads: NonZeroUsize,
    /// Precision of the pair forces [default: that of the scene, or else mixed].
    #[arg(long, value_parser = precision, value_name = "mixed|double")]
    precision: Option<Precision>,
    /// The processor that computes the steps, one of those that `psidpd devices` lists [default: that of the scene, or
    /// else the CPU].
    #[arg(long, value_name = "cpu|gpu|gpu:N")]
    device: Option<Device>,
    /// Make report.html at the end, also of a run that stopped.
    #[arg(long)]
    report: bool,
    #[command(flatten)]
    settings: Settings,
}

impl Arguments {
    /// The command line that resumes the run with all its options, if it can be shown.
    fn to_resume(&self, steps: Option<u64>, json: Option<&Path>) -> Option<String> {
        let mut words =
            vec![format!("psidpd run {} --out {} --resume", quoted(&self.scene)?, quoted(&self.out)?)];
        words.extend(steps.map(|steps| format!("--steps {steps}")));
        if self.threads.get() > 1 {
            words.push(format!("--threads {}", self.threads));
        }
        words.extend(self.precision.map(|precision| format!("--precision {precision}")));
        words.extend(self.device.map(|device| format!("--device {device}")));
        for edit in &self.settings.edits {
            words.push(format!("--set {}", quoted(edit.to_string())?));
        }
        words.extend(self.report.then(|| "--report".to_owned()));
        if let Some(file) = json {
            words.push(format!("--json {}", quoted(file)?));
        }
        Some(words.join(" "))
    }
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.scene]).edits(&self.settings.edits).makes(FILES.map(|name| self.out.join(name)))
    }
}

/// Parses a number of threads, of which there are at most as many as processors, with a warning.
pub fn threads_at_once(text: &str) -> Result<NonZeroUsize, String> {
    let asked = thread_count(text)?;
    let used = at_once(asked);
    if used < asked {
        warn(&format!(
            "{asked} threads are more than the processors this process may use: using {used}, with the same results"
        ));
    }
    Ok(used)
}

/// Parses a number of threads or of runs side by side.
pub fn thread_count(text: &str) -> Result<NonZeroUsize, String> {
    let count = text.parse().map_err(|e| format!("{e}"))?;
    Pool::count(count).map_err(|e| e.to_string())
}

/// Parses a whole number that must not be smaller than `least`.
pub fn at_least(least: u64) -> impl Fn(&str) -> Result<u64, String> + Clone {
    move |text| match text.parse::<u64>() {
        Ok(number) if number >= least => Ok(number),
        _ => Err(format!("must be a whole number from {least}")),
    }
}

/// The reader of a whole number from `least` to `most`.
pub fn between(least: u32, most: u32) -> impl Fn(&str) -> Result<u32, String> + Clone {
    move |text| match text.parse::<u32>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("must be a whole number from {least} to {most}")),
    }
}

/// The content of the file of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    timing: &'a Timing,
    headline: &'a Headline,
    advice: Option<&'a Advice>,
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let Arguments { scene: path, out, resume, steps, threads, precision, device, report, settings } =
        arguments;
    let mut scene = settings.scene(path)?;
    let length = steps.map(|length| length.steps(&scene, out));
    if let Some(steps) = length {
        let edits = [&settings.edits[..], &[Length::edit(steps, &scene)]].concat();
        scene = Settings { edits }.scene(path)?;
    }
    scene.precision = precision.or(scene.precision);
    scene.device = device.unwrap_or(scene.device);
    if let Some(warning) = uncalibrated(&scene.model.at(scene.kt)?) {
        warn(&warning.message);
    }
    let begin = match (resume, told.existing) {
        (true, _) => Begin::Resume,
        (_, Existing::Replace) => Begin::Overwrite,
        _ => Begin::New,
    };
    let mut runner = Runner::begin(&scene, out, begin)?;
    runner.set_threads(*threads)?;
    // Before this line a signal ends the program at once, because nothing can be lost yet.
    let stop = watch_signals()?;
    let total = scene.steps();
    let made = tell_start(runner.start(), begin, out, total);
    say(&format!("forces by {}", runner.evaluation()));
    let bar = Progress::new().steps(&scene.title, total, made, runner.particles());
    let outcome = runner.run(&stop, &mut |p| {
        bar.set(p.step);
        p.deviations.iter().for_each(|deviation| warn(&deviation.to_string()));
    });
    drop(bar);
    // A failure to write the page does not change the outcome of the run.
    if *report
        && outcome.as_ref().err().is_none_or(|e| e.is_stop())
        && let Err(error) = write_run_report(out, Existing::Keep)
    {
        warn(&format!("the run has no page: {error}; to make it: psidpd report"));
    }
    match outcome? {
        Outcome::Finished { summary, timing, advice } => {
            say(&summary.to_string());
            if let Some(session) = timing.sessions.last().filter(|_| made < total) {
                say(&format!(
                    "{} steps in {:.1} s: {:.3e} particle-steps per second",
                    session.to_step - session.from_step,
                    session.wall_seconds,
                    session.particle_steps_per_second
                ));
            }
            if let Some(session) =
                timing.sessions.last().filter(|s| s.one_thread_seconds > 0.1 * s.wall_seconds)
            {
                say(&format!(
                    "note: for {:.1} s of {:.1} one thread did the work of all, as other programs used the processors: with fewer threads the run is as fast",
                    session.one_thread_seconds, session.wall_seconds
                ));
            }
            if let Some(iterations) = timing.sessions.last().and_then(|session| session.thermostat) {
                let most = iterations.most.map_or(String::new(), |most| format!(", {most} at most"));
                say(&format!("the thermostat took {:.1} iterations on average{most}", iterations.mean));
                if iterations.inaccurate > 0 {
                    warn(&format!(
                        "{} updates of the thermostat are inaccurate: drag is too strong for this dt; use a smaller \
                         gamma or dt",
                        iterations.inaccurate
                    ));
                }
            }
            let found = headline(out);
            say("");
            say::table_to_whoever_listens(&found.table());
            found.notes.iter().for_each(|note| say(&format!("note: {note}")));
            advice.iter().for_each(|advice| say(&format!("note: {advice}")));
            say(&format!("written to {}", out.display()));
            let results =
                Report { summary: &summary, timing: &timing, headline: &found, advice: advice.as_ref() };
            write_json(told, &results).map_err(|cause| CliError::Unwritten { folder: out.clone(), cause })?;
            Ok(Verdict::Good)
        }
        Outcome::Interrupted { stop, step, steps } => {
            let command = arguments
                .to_resume(length, told.json)
                .map_or(String::new(), |line| format!("; to go on: {line}"));
            say(&format!("stopped after step {step} of {steps}{command}"));
            Ok(Verdict::Interrupted(u8::try_from(stop).unwrap_or(0)))
        }
    }
}

fn precision(name: &str) -> Result<Precision, String> {
    let found = Precision::ALL.iter().find(|(known, _)| *known == name);
    found.map(|(_, precision)| *precision).ok_or_else(|| "expected mixed or double".into())
}

/// Reports where a resumed run begins, and returns the number of steps already made.
fn tell_start(start: &Start, begin: Begin, out: &Path, total: u64) -> u64 {
    match start {
        Start::New if begin == Begin::Resume => {
            say(&format!("there is no checkpoint in {}: beginning with the first step", out.display()));
            0
        }
        Start::New => 0,
        Start::Finished => {
            say(&format!("the run in {} is finished: nothing is left to do", out.display()));
            total
        }
        Start::Resumed { step, prolonged, program, instructions, fallback } => {
            if let Some(why) = fallback {
                warn(&format!("{why}; going on from the previous checkpoint"));
            }
            if let Some(program) = program {
                warn(&format!(
                    "the checkpoint is of psidpd {program}: what follows may differ in rounding from what that \
                     version would have computed"
                ));
            }
            if let Some(instructions) = instructions {
                warn(&format!(
                    "the checkpoint was computed with {instructions}, which this run does not use: what follows may differ in rounding, and \
                     its files in their bytes"
                ));
            }
            let before = prolonged.map_or(String::new(), |before| format!(", where the run had {before}"));
            say(&format!("going on after step {step} of {total}{before}"));
            *step
        }
    }
}

/// Returns a number that the first SIGINT or SIGTERM sets to its signal number. The second signal kills the program.
pub fn watch_signals() -> std::io::Result<Arc<AtomicUsize>> {
    let stop = Arc::new(AtomicUsize::new(0));
    for signal in [SIGINT, SIGTERM] {
        let stop = stop.clone();
        let action = move || {
            // Two signals may arrive in two threads at once, of which one is the second all the same.
            if stop.compare_exchange(0, signal as usize, Ordering::Relaxed, Ordering::Relaxed).is_err() {
                let _ = emulate_default_handler(signal);
            }
        };
        // SAFETY: the action writes an atomic number and calls a function that is made for signal handlers; it never allocates or panics.
        unsafe { register(signal, action)? };
    }
    Ok(stop)
}

fn warn(line: &str) {
    let _ = writeln!(std::io::stderr(), "warning: {}", printable(line));
}

/// A word quoted for a shell; `None` if it is not valid text or has control characters.
pub fn quoted(word: impl AsRef<OsStr>) -> Option<String> {
    let text = word.as_ref().to_str().filter(|text| printable(text) == *text && !text.contains('\n'))?;
    let plain = |c: char| c.is_alphanumeric() || "/._-+,=@%:".contains(c);
    Some(if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    })
}
