//! Results as tables and plots.

use super::advice;
use super::outcome::{Asked, Benchmark, Machine, Timed};
use super::spread::Spread;
use crate::ExperimentError;
use psidpd_core::engine::Instructions;
use psidpd_report::{Item, Plot, Report, Section, Series, Style, Table};

fn shown(spread: &Spread) -> String {
    format!("{:.2} ({:.2}–{:.2})", spread.median, spread.min, spread.max)
}

pub fn speeds(outcome: &Benchmark) -> Table {
    let mut table =
        Table::new(["fluid", "particles", "code", "10⁶ particle-steps/s", "against built-in", "ns per pair"]);
    for run in &outcome.runs {
        table.push([
            run.fluid.to_owned(),
            run.particles.to_string(),
            run.code.clone(),
            shown(&run.mega_particle_steps_per_second),
            run.ratio_to_built_in.as_ref().map_or_else(|| "–".into(), shown),
            format!("{:.2}", run.nanoseconds_per_pair),
        ]);
    }
    table
}

/// Who is timed in large boxes, in words; `None` without such a box.
pub fn few(options: &Asked) -> Option<String> {
    let limit = options.few_above;
    options.sizes.iter().any(|size| *size > limit).then(|| {
        format!(
            "In boxes of more than {limit} particles of the many-body fluid only these are timed: the built-in, the plugin \
             in mixed precision, the native runner in mixed precision with the best instructions, and what was \
             asked for by name."
        )
    })
}

/// The fastest setting natively and in LAMMPS, of each fluid at each size.
pub fn fastest(outcome: &Benchmark) -> Table {
    let mut table =
        Table::new(["fluid", "particles", "fastest natively", "10⁶/s", "fastest in LAMMPS", "10⁶/s"]);
    for (fluid, size) in
        outcome.fluids.iter().flat_map(|f| outcome.options.sizes.iter().map(|s| (f.name, *s)))
    {
        let of = |native: bool| {
            let here = |r: &&Timed| r.fluid == fluid && r.size == size && r.skin.is_none() == native;
            let rate = |r: &Timed| r.mega_particle_steps_per_second.median;
            // In a box of its own size: one repeated for two ranks is another.
            let runs = outcome.runs.iter().filter(here).filter(|r| !r.code.ends_with("weak"));
            runs.max_by(|a, b| rate(a).total_cmp(&rate(b))).map(|r| (r, rate(r)))
        };
        let shown = |(run, rate): (&Timed, f64)| [run.code.clone(), format!("{rate:.2}")];
        let both = [true, false].map(of);
        let Some(particles) = both.iter().flatten().next().map(|(run, _)| run.particles) else { continue };
        let both = both.into_iter().flat_map(|run| run.map_or_else(|| ["–", "–"].map(Into::into), shown));
        table.push([fluid.to_owned(), particles.to_string()].into_iter().chain(both));
    }
    table
}

/// The instruction set that the engine takes, and why no better one.
pub fn instructions(machine: &Machine) -> String {
    let best = machine.instructions.last().map_or("none", String::as_str);
    let takes = format!("the engine takes {best}");
    std::iter::once(&takes).chain(&machine.better).map(String::as_str).collect::<Vec<_>>().join("; ")
}

/// Where the time goes natively, in the fastest precision on one thread.
pub fn native_parts(outcome: &Benchmark) -> Table {
    parts(outcome, |r| r.code == format!("native mixed {} 1", Instructions::best()), &NATIVE_PARTS)
}

/// Where the time goes in LAMMPS with the plugin, on one thread of one rank.
pub fn plugin_parts(outcome: &Benchmark) -> Table {
    parts(outcome, |r| r.code == "plugin dpd/psi precision mixed", &LAMMPS_PARTS)
}

const NATIVE_PARTS: [&str; 6] = ["sort", "pairs", "psi", "many-body", "forces", "integrate"];
const LAMMPS_PARTS: [&str; 6] = ["pair", "neigh", "comm", "output", "modify", "other"];

pub fn cycles(machine: &Machine) -> String {
    machine.gigahertz.map_or_else(
        || "no counter of cycles on this machine".into(),
        |clock| format!("cycles of the processor's nominal clock, {clock:.2} GHz by its time stamp counter"),
    )
}

/// Where the time goes, of the runs for which `wanted` says so.
fn parts(outcome: &Benchmark, wanted: impl Fn(&Timed) -> bool, names: &[&str]) -> Table {
    let header =
        ["fluid", "particles", "code"].iter().chain(names).chain(&["all", "cycles", "cycles per pair"]);
    let cycles = |nanoseconds: f64| match outcome.machine.gigahertz {
        Some(clock) => format!("{:.0}", nanoseconds * clock),
        None => "–".into(),
    };
    let mut table = Table::new(header.map(|s| (*s).to_owned()));
    for run in outcome.runs.iter().filter(|r| wanted(r)) {
        let mut row = vec![run.fluid.to_owned(), run.particles.to_string(), run.code.clone()];
        row.extend(names.iter().map(|n| run.parts.get(*n).map_or_else(|| "–".into(), |t| format!("{t:.1}"))));
        row.push(format!("{:.1}", run.nanoseconds_per_particle_step));
        row.extend([run.nanoseconds_per_particle_step, run.nanoseconds_per_pair].map(cycles));
        table.push(row);
    }
    table
}

fn scaling(outcome: &Benchmark) -> Table {
    let header = ["code", "kind", "size", "ranks", "speed-up", "ghosts", "kB sent, computed", "µs in comm"];
    let mut table = Table::new(header);
    for s in &outcome.scaling {
        table.push([
            s.code.clone(),
            s.kind.to_owned(),
            s.size.to_string(),
            s.ranks.to_string(),
            shown(&s.speed_up),
            format!("{:.0}", s.ghosts),
            s.bytes_per_step.map_or_else(|| "–".into(), |b| format!("{:.0}", 1e-3 * b)),
            format!("{:.0}", s.communication_microseconds),
        ]);
    }
    table
}

fn memory(outcome: &Benchmark) -> Table {
    let mut table = Table::new(["particles", "bytes per particle", "of these in the engine", "MB"]);
    for m in &outcome.memory {
        table.push([
            m.particles.to_string(),
            format!("{:.0}", m.bytes_per_particle),
            format!("{:.0}", m.engine_bytes_per_particle),
            format!("{:.0}", 1e-6 * m.peak_bytes as f64),
        ]);
    }
    table
}

/// Speed against the number of particles, for those that a plot can hold.
fn plot(outcome: &Benchmark, fluid: &'static str, title: &str) -> Plot {
    let best = Instructions::best();
    let wanted = [
        ("lammps mdpd".to_owned(), "LAMMPS, mdpd"),
        ("lammps eam/alloy".to_owned(), "LAMMPS, eam/alloy"),
        ("lammps dpd".to_owned(), "LAMMPS, dpd"),
        ("plugin dpd/psi precision mixed".to_owned(), "psidpd in LAMMPS, mixed precision"),
        ("plugin dpd/psi precision double".to_owned(), "psidpd in LAMMPS, double precision"),
        (format!("native mixed {best} 1"), "psidpd, mixed precision"),
        (format!("native double {best} 1"), "psidpd, double precision"),
        (format!("native mixed {best} 2"), "psidpd, mixed precision, 2 threads"),
    ];
    let series = wanted.into_iter().filter_map(|(code, name)| {
        let runs: Vec<&Timed> = outcome.runs.iter().filter(|r| r.fluid == fluid && r.code == code).collect();
        let speed = |r: &Timed| r.mega_particle_steps_per_second;
        let points = runs.iter().map(|r| (r.particles as f64, speed(r).median)).collect();
        let errors = runs.iter().map(|r| 0.5 * (speed(r).max - speed(r).min)).collect();
        let style = if runs.len() > 1 { Style::Line } else { Style::Points };
        (!runs.is_empty()).then(|| Series::new(name, points, style).with_errors(errors))
    });
    let labels = ["number of particles", "speed [10⁶ particle-steps/s]"];
    Plot { log_x: true, log_y: true, ..Plot::new(title, labels, series.collect()) }
}

pub fn report(outcome: &Benchmark) -> Result<String, ExperimentError> {
    let rounds = outcome.options.rounds;
    let mut speed = vec![Item::Prose(format!(
        "Medians of {rounds} interleaved rounds, with the least and the greatest in brackets. Ratios are taken within a \
         round. All codes start from one state of each fluid and size; LAMMPS is timed by its own loop time, without \
         output in the loop, at the fastest of the skins tried. DPD is timed in the boxes of the many-body fluid."
    ))];
    speed.extend(few(&outcome.options).map(Item::Prose));
    for fluid in &outcome.fluids {
        let caption = "On one thread of one rank, unless the name says otherwise. Bands and bars: half of the range of the rounds.";
        speed.push(Item::figure(&plot(outcome, fluid.name, fluid.title), caption)?);
    }
    speed.push(Item::Table(speeds(outcome)));
    speed.push(Item::Table(fastest(outcome)));
    let natively = "Nanoseconds per particle and step. Sort: into bins. Pairs: search, conservative, dissipative and random \
                    forces of pairs, weights. Psi: densities, ψ and its slopes. Many-body: their forces. Forces: back to the \
                    host's order. Integrate: all else.";
    let in_lammps = "Nanoseconds per particle and step, as LAMMPS accounts for them.";
    let under = |text: &str, table: Table| vec![Item::prose(text), Item::Table(table)];
    let ranks_or_threads = match advice::of(outcome) {
        Some((text, table)) => under(&text, table),
        None => vec![Item::prose("Not known without runs on two threads and on two ranks.")],
    };
    let native = under(natively, parts(outcome, |r| r.instructions.is_some(), &NATIVE_PARTS));
    let lammps = under(in_lammps, parts(outcome, |r| r.skin.is_some(), &LAMMPS_PARTS));
    let sections = vec![
        Section::new("Speed", speed),
        Section::new("Where the time goes, natively", native),
        Section::new("Where the time goes in LAMMPS", lammps),
        Section::new("Two MPI ranks", vec![Item::Table(scaling(outcome))]),
        Section::new("Ranks or threads", ranks_or_threads),
        Section::new("Memory, native, mixed precision", vec![Item::Table(memory(outcome))]),
    ];
    let missing = match outcome.lammps.missing.join(", ") {
        none if none.is_empty() => "none".to_owned(),
        some => some,
    };
    let load = outcome.machine.load.map_or_else(|| "unknown".into(), |l| format!("{l:.2}"));
    let report = Report {
        title: "psidpd bench".into(),
        subtitle: "Speed compared with LAMMPS in one run".into(),
        facts: vec![
            ("psidpd".into(), outcome.version.into()),
            ("LAMMPS".into(), outcome.lammps.version.clone()),
            ("not in this LAMMPS".into(), missing),
            ("machine".into(), outcome.machine.processor.clone()),
            ("instruction sets".into(), outcome.machine.instructions.join(", ")),
            ("instructions".into(), instructions(&outcome.machine)),
            ("cycles".into(), cycles(&outcome.machine)),
            ("load before".into(), load),
        ],
        sections,
        ..Report::default()
    };
    Ok(report.render())
}
