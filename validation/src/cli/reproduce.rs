use super::run::threads_at_once;
use super::*;
use psidpd_experiments::papers::{Case, Compared, Context, Reproduction, Size, Source, cases};
use psidpd_formats::files::work_folder;
use serde_json::Value;

/// Figures and tables of the papers: measured, and compared with what is published.
///
/// Exits with 1 if a value deviates by more than three combined errors.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Which cases, by id, or by the first part of it; all if left out.
    ids: Vec<String>,
    /// Only list the cases.
    #[arg(long)]
    list: bool,
    /// Small and short runs, half an hour for all cases; what is done if --full is left out.
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Boxes of the papers and long runs; interrupted runs continue.
    #[arg(long)]
    full: bool,
    /// Folder for runs, plots and results.
    #[arg(long, value_name = "DIR", default_value = "target/reproduce")]
    out: PathBuf,
    /// Threads of each run.
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads_at_once)]
    threads: NonZeroUsize,
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let chosen = choose(&arguments.ids)?;
    if arguments.list {
        let mut table = Table::new(["id", "what"]);
        chosen.iter().for_each(|case| table.push([&case.id, case.what]));
        say::table(&table);
        let entry = |case: &Case| json!({ "id": case.id, "paper": case.paper, "what": case.what });
        return conclude(told, &json!({ "cases": chosen.iter().map(entry).collect::<Vec<_>>() }), true);
    }
    let size = if arguments.full { Size::Full } else { Size::Quick };
    let mut results = Vec::new();
    let mut good = true;
    for case in &chosen {
        say!("{}: {}", case.id, case.what);
        let folder = arguments.out.join(if arguments.full { "full" } else { "quick" }).join(&case.id);
        let context =
            Context { size, folder: folder.clone(), threads: arguments.threads, existing: told.existing };
        let begun = std::time::Instant::now();
        let result = match case.run(&context) {
            Ok(outcome) => {
                show(&outcome);
                good &= outcome.passes();
                write_plots(&outcome, &folder)?;
                result(case, &outcome)
            }
            Err(ExperimentError::Run(why)) if why.is_stop() => {
                say!("  stopped: {why}");
                good = false;
                json!({ "id": case.id, "values": [], "pass": false, "stopped": why.to_string() })
            }
            Err(why) => return Err(Failure::from(why)),
        };
        say!("  {:.0} s\n", begun.elapsed().as_secs_f64());
        results.push(result);
    }
    match &results[..] {
        [one] => conclude(told, one, good),
        all => conclude(told, &json!({ "cases": all, "pass": good }), good),
    }
}

/// The cases of these ids, and of papers that are named by the first part of their ids.
fn choose(ids: &[String]) -> Result<Vec<Case>, Failure> {
    let all = cases();
    if ids.is_empty() {
        return Ok(all);
    }
    let mut chosen: Vec<Case> = Vec::new();
    for id in ids {
        let is_whole = all.iter().any(|case| case.id == *id);
        let prefix = format!("{id}-");
        let is_meant = |case: &&Case| if is_whole { case.id == *id } else { case.id.starts_with(&prefix) };
        if !all.iter().any(|case| is_meant(&case)) {
            return Err(CliError::UnknownCase(id.clone()).into());
        }
        for case in all.iter().filter(is_meant) {
            if chosen.iter().all(|c| c.id != case.id) {
                chosen.push(case.clone());
            }
        }
    }
    Ok(chosen)
}

fn result(case: &Case, outcome: &Reproduction) -> Value {
    let values: Vec<Value> = outcome.values.iter().map(Compared::to_json).collect();
    json!({ "id": case.id, "values": values, "pass": outcome.passes() })
}

fn show(outcome: &Reproduction) {
    use psidpd_experiments::papers::Rule;
    let mut table = Table::new(["value", "measured", "published", "deviation", ""]);
    for v in &outcome.values {
        let sign = match v.rule {
            Rule::Equal => "",
            Rule::AtLeast => "≥ ",
            Rule::AtMost => "≤ ",
        };
        let source = match v.source {
            Source::Printed => "",
            Source::Read => " (read)",
            Source::Own => " (own)",
        };
        table.push([
            v.name.clone(),
            format!("{:.5} ± {:.5}", v.measured.value, v.measured.error),
            format!("{sign}{:.5} ± {:.5}{source}", v.published.value, v.published.error),
            format!("{:+.2}", v.deviation()),
            match (v.passes(), v.at_full_size.is_some() && v.agrees(), v.is_vague()) {
                (true, ..) => "pass",
                (false, true, _) => "fail: at full size",
                (false, false, true) => "fail: too vague",
                (false, false, false) => "fail",
            }
            .to_owned(),
        ]);
    }
    say::table(&table);
    for (name, full) in outcome.values.iter().filter_map(|v| Some((&v.name, v.at_full_size?))) {
        let [value, error] = full.measured;
        say!("  {name}: {value} ± {error} at full size; {}", full.why);
    }
}

fn write_plots(outcome: &Reproduction, folder: &Path) -> Result<(), Failure> {
    for (name, plot) in &outcome.plots {
        let svg = plot.render()?;
        work_folder(folder)?;
        write_bytes(&folder.join(format!("{name}.svg")), Existing::Keep, svg.as_bytes())?;
    }
    Ok(())
}
