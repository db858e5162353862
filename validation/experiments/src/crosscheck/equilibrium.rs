//! A slab in equilibrium: temperature, pressure, liquid density, energy and surface tension, with error
//! bars, in every code.

use super::setup::Setup;
use super::trace::{Length, Trace, run as run_code};
use super::{Context, Part};
use crate::ExperimentError;
use crate::code::Code;
use crate::fluids::{GAMMA, SET5, SET6, WarrenSet};
use crate::jobs;
use crate::start::{Filling, equilibrated};
use psidpd_core::engine::Precision;
use psidpd_core::model::ForceLaw;
use psidpd_observe::{Estimate, ProfileAccumulator, difference, estimate, interface_width};
use psidpd_report::{Check, Item, Plot, Section, Series, Style, Table};
use serde_json::json;
use std::sync::atomic::{AtomicU64, Ordering};

/// Seeds of start and noise; every run has its own noise.
pub const SEED: u64 = 20_020_922;

/// Chance that any of the comparisons of equal fluids fails although nothing is wrong.
pub const FALSE_ALARM: f64 = 1e-3;
/// How far the temperature may be from kT. The time step shifts it by 0.004 here; a drag that is 5 % wrong would by 0.05, such
/// a noise by 0.1.
const WARMER: f64 = 0.02;
/// How many errors, his and ours, a run may be from Warren's liquid density and surface tension.
const PUBLISHED: f64 = 3.0;

/// A code, its law, and the run it is compared with.
type Slot = (Code, ForceLaw, Option<usize>);

const RUNS: [Slot; 5] = [
    (Code::Native, ForceLaw::Conservative, None),
    (Code::Psi, ForceLaw::Conservative, Some(NATIVE)),
    (Code::MdpdPsi, ForceLaw::LucyLammps, None),
    (Code::Mdpd, ForceLaw::LucyLammps, Some(MDPD_PSI)),
    (Code::Eam, ForceLaw::Conservative, Some(NATIVE)),
];
const NATIVE: usize = 0;
const MDPD_PSI: usize = 2;
const BUILT_IN: usize = 3;

/// The first of them, as many as a set has. Tables take longest: a quick validation makes one run with them.
fn runs(set: &WarrenSet, full: bool) -> &'static [Slot] {
    if full || set.name == SET6.name { &RUNS } else { &RUNS[..=BUILT_IN] }
}

struct Slab {
    temperature: Estimate,
    pressure: Estimate,
    energy: Estimate,
    liquid: Estimate,
    tension: Estimate,
    /// By conservative forces alone, where the code tells; on every configuration that is the change of U with the area,
    /// see `forces`.
    conservative_tension: Option<Estimate>,
    width: Option<f64>,
    profile: Vec<(f64, f64)>,
}

fn name(code: Code, law: ForceLaw) -> String {
    match (code, law) {
        (Code::Mdpd, _) => "LAMMPS mdpd".into(),
        (code, ForceLaw::Conservative) => code.label(),
        (code, ForceLaw::LucyLammps) => format!("{}, law lucy", code.label()),
    }
}

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let sets = [SET5, SET6];
    // A wide and thin slab: the error of the tension goes with the root of thickness over area.
    let (edge, height, thickness, steps) =
        if context.full { (10.0, 24.0, 12.0, 50_000) } else { (6.0, 12.0, 4.8, 8_000) };
    let length = Length { dt: 0.01, steps, sample: 10, averaged: true, frame: 25 };
    let mut starts = Vec::new();
    for set in &sets {
        let filling = Filling { lengths: [edge, edge, height], thickness };
        starts.push(equilibrated(Precision::Double, &set.fluid, filling, 1000, SEED)?);
    }
    let count: usize = sets.iter().map(|set| runs(set, context.full).len()).sum();
    let made = context.progress.overall("equilibrium", steps * count as u64);
    let mut slots = Vec::new();
    for (k, set) in sets.iter().enumerate() {
        for (n, &(code, law, _)) in runs(set, context.full).iter().enumerate() {
            let seed = SEED + (10 * k + n) as u64;
            let setup = Setup { gamma: GAMMA, seed, ..Setup::new(code, set, law) };
            let folder = format!("nvt-{}-{}-{n}", set.slug(), setup.slug());
            let bar = context.progress.bar(&format!("NVT {}: {}", set.name, name(code, law)), steps);
            slots.push((setup, &starts[k], folder, bar));
        }
    }
    let traces = jobs::each(slots, |(setup, state, folder, bar)| {
        let before = AtomicU64::new(0);
        let advance = |step: u64| {
            bar.set(step);
            made.advance(step.saturating_sub(before.fetch_max(step, Ordering::Relaxed)));
        };
        let trace = run_code(context, &setup, state, length, &folder, &advance);
        advance(steps);
        trace
    });
    let traces = traces.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut traces = traces.iter();
    let text = format!(
        "A slab of liquid with its vapour at kT = 1, γ = {GAMMA}, {edge} × {edge} × {height}, {steps} steps of {} of which \
         the first fifth is left out; seeds from {SEED}. Error bars are standard errors from the autocorrelation of each \
         series. Runs of equal law must agree: over all comparisons the chance of a false alarm is {FALSE_ALARM}.",
        length.dt
    );
    let section = Section::new("A slab of liquid in equilibrium", vec![Item::Prose(text)]);
    let mut part = Part { section, ..Part::of("equilibrium") };
    let comparisons = sets
        .iter()
        .flat_map(|set| runs(set, context.full))
        .map(|(code, _, other)| compared(*code, *other).count())
        .sum();
    for set in &sets {
        let measured = traces
            .by_ref()
            .take(runs(set, context.full).len())
            .map(|t| measure(t, edge, height))
            .collect::<Result<Vec<_>, _>>()?;
        report_set(&mut part, set, &measured, comparisons)?;
    }
    Ok(part)
}

/// A quantity by name, and the largest error of a difference that is accepted: no comparison with a larger one could tell
/// the two force laws apart, of which tensions differ by 1.4 and more and pressures by their share in it.
type Quantity = (&'static str, fn(&Slab) -> &Estimate, f64);

/// The quantities that equal fluids must agree in.
const QUANTITIES: [Quantity; 5] = [
    ("temperature", |m| &m.temperature, 0.005),
    ("pressure", |m| &m.pressure, 0.13),
    ("energy", |m| &m.energy, 0.02),
    ("liquid density", |m| &m.liquid, 0.012),
    ("surface tension", |m| &m.tension, 0.3),
];

/// The quantities in which a run is held to another.
fn compared(code: Code, other: Option<usize>) -> impl Iterator<Item = Quantity> {
    // The energy that the built-in tallies is not that of its forces, nor of any other.
    QUANTITIES
        .into_iter()
        .filter(move |(what, ..)| other.is_some() && !(code == Code::Mdpd && *what == "energy"))
}

fn measure(trace: &Trace, edge: f64, height: f64) -> Result<Slab, ExperimentError> {
    let of = |what: &str, series: &[f64]| {
        let kept = &series[series.len() / 5..];
        estimate(kept).map_err(|source| ExperimentError::Statistics { what: what.to_owned(), source })
    };
    let bins = (height / 0.1).round() as usize;
    let mut profile = ProfileAccumulator::new(height, bins, edge * edge);
    for frame in &trace.frames[trace.frames.len() / 5..] {
        profile.add(frame)?;
    }
    let liquid = profile.liquid_density(0.5 * (0.5 * height) - 2.0);
    let shape = profile.finish();
    // Two interfaces share the excess of the pressure across them.
    let tension = |[xx, yy, zz, ..]: &[Vec<f64>; 6]| {
        let at = |k: usize| 0.5 * height * (zz[k] - 0.5 * (xx[k] + yy[k]));
        of("surface tension", &(0..xx.len()).map(at).collect::<Vec<_>>())
    };
    let known = !trace.conservative[0].is_empty();
    let conservative_tension = known.then(|| tension(&trace.conservative)).transpose()?;
    let per_particle: Vec<f64> = trace.potential.iter().map(|u| u / trace.particles as f64).collect();
    Ok(Slab {
        temperature: of("temperature", &trace.temperature)?,
        pressure: of("pressure", &trace.scalar_pressure())?,
        energy: of("energy", &per_particle)?,
        liquid: estimate(&liquid)
            .map_err(|source| ExperimentError::Statistics { what: "liquid density".into(), source })?,
        tension: tension(&trace.pressure)?,
        conservative_tension,
        width: interface_width(&shape),
        profile: shape,
    })
}

fn shown(e: &Estimate) -> String {
    // Two digits of the error decide how many are worth showing.
    let digits = (1.0 - e.error.log10().floor()).clamp(0.0, 8.0);
    let digits = if digits.is_finite() { digits as usize } else { 4 };
    format!("{:.*} ± {:.*}", digits, e.mean, digits, e.error)
}

fn report_set(
    part: &mut Part,
    set: &WarrenSet,
    measured: &[Slab],
    comparisons: usize,
) -> Result<(), ExperimentError> {
    let slug = set.slug();
    let quantities = QUANTITIES.iter().map(|(name, ..)| *name);
    let mut table = Table::new(std::iter::once("code").chain(quantities).chain(["width"]));
    let levels = vec![(set.fluid.density, format!("Warren: {}", set.fluid.density))];
    let labels = ["z, from the middle of the slab [length]", "number density [1/length³]"];
    let mut plot = Plot { levels, ..Plot::new(format!("Density profile, {}", set.name), labels, Vec::new()) };
    let code_slug = |code: Code| Setup::new(code, set, ForceLaw::Conservative).slug();
    for ((code, law, _), m) in RUNS.iter().zip(measured) {
        let mut row = vec![name(*code, *law)];
        row.extend(QUANTITIES.iter().map(|(_, get, _)| shown(get(m))));
        row.push(m.width.map_or_else(|| "–".into(), |w| format!("{w:.2}")));
        table.push(row);
        let style = if *law == ForceLaw::Conservative { Style::Line } else { Style::Dashed };
        plot.series.push(Series::new(name(*code, *law), m.profile.clone(), style));
        for (what, get, _) in QUANTITIES {
            let id = format!("nvt.{slug}.{}-{}.{}", code_slug(*code), law_slug(*law), what.replace(' ', "-"));
            part.values.push((id, json!(get(m))));
        }
    }
    let published = set.published().map(|[value, error]| format!("{value} ± {error}"));
    table.push(["Warren, Table 2", "", "", ""].map(str::to_owned).into_iter().chain(published));
    for ((code, law, other), m) in RUNS.iter().zip(measured) {
        let Some(other) = other else { continue };
        let (reference_code, reference_law, _) = RUNS[*other];
        for (what, get, most) in compared(*code, Some(*other)) {
            let comparison = difference(get(m), get(&measured[*other]));
            let [ours, theirs] = [name(*code, *law), name(reference_code, reference_law)];
            let mut check = Check::agreement(
                format!("nvt.{slug}.{}.{}", code_slug(*code), what.replace(' ', "-")),
                "equilibrium",
                format!("{}: {what} of {ours} equals that of {theirs}", set.name),
                comparison.delta,
                comparison.error,
                psidpd_observe::threshold(comparisons, FALSE_ALARM),
                format!("z = {:.2}, p = {:.2}", comparison.z, comparison.p_value),
            );
            check.passed =
                !comparison.exceeds(comparisons, FALSE_ALARM) && (0.0..most).contains(&comparison.error);
            part.checks.push(check);
        }
    }
    for ((code, law, _), m) in RUNS.iter().zip(measured) {
        if matches!(code, Code::Native | Code::Psi) {
            part.checks.push(against_kt(set, *code, *law, m));
        }
    }
    let native = &measured[NATIVE];
    part.checks.extend(against_published(set, native));
    let built_in = &measured[BUILT_IN];
    let of = set.name;
    let shift = difference(&built_in.liquid, &native.liquid);
    let what =
        format!("{of}: the built-in's law shifts the liquid density (another fluid than Warren's): by");
    let check = Check::at_least(format!("nvt.{slug}.mdpd.shift"), part.topic, what, shift.delta, 0.1);
    part.checks.push(check.with_error(shift.error));
    let apart = difference(&built_in.tension, &native.tension).z.abs();
    let what = format!("{of}: the surface tension tells the two laws apart: difference over its error");
    let least = psidpd_observe::threshold(comparisons, FALSE_ALARM);
    part.at_least(format!("nvt.{slug}.mdpd.tension"), what, apart, least);
    part.section.items.push(Item::Table(table));
    let caption = format!(
        "{of}: full lines are the conservative law, dashed lines the built-in's law, in the plugin and in mdpd."
    );
    part.section.items.push(Item::figure(&plot, caption)?);
    Ok(())
}

fn against_kt(set: &WarrenSet, code: Code, law: ForceLaw, found: &Slab) -> Check {
    Check::at_most(
        format!("nvt.{}.{}.thermostat", set.slug(), Setup::new(code, set, law).slug()),
        "equilibrium",
        format!("{}: temperature of {} against kT", set.name, name(code, law)),
        found.temperature.mean - 1.0,
        WARMER,
    )
    .with_error(found.temperature.error)
}

/// Density and tension of the native runner against Warren's.
fn against_published(set: &WarrenSet, native: &Slab) -> [Check; 2] {
    let published = |what: &str, found: &Estimate, [value, error]: [f64; 2]| {
        Check::agreement(
            format!("nvt.{}.published.{what}", set.slug()),
            "equilibrium",
            format!("{}: {what} of native against Warren's Table 2, with his error and ours", set.name),
            found.mean - value,
            found.error.hypot(error),
            PUBLISHED,
            format!("{} ± {}", found.mean, found.error),
        )
    };
    let tension = native.conservative_tension.as_ref().unwrap_or(&native.tension);
    let [liquid, of_surface, _] = set.published();
    [published("density", &native.liquid, liquid), published("tension", tension, of_surface)]
}

fn law_slug(law: ForceLaw) -> &'static str {
    match law {
        ForceLaw::Conservative => "conservative",
        ForceLaw::LucyLammps => "lucy",
    }
}

#[cfg(test)]
mod tests {
    use super::super::trace::native;
    use super::*;
    use psidpd_core::engine::Fault;

    /// What is measured of a fluid fails the same checks if a force of the engine is 5 % wrong, in shorter runs than those of
    /// `psidpd validate`. The virial moves no particle: `forces` has a check of it.
    #[test]
    fn physics_tells_of_faults() {
        let (edge, height, thickness, steps) = (5.0, 12.0, 5.2, 2000);
        let filling = Filling { lengths: [edge, edge, height], thickness };
        let state = equilibrated(Precision::Double, &SET6.fluid, filling, 600, SEED).unwrap();
        let length = Length { dt: 0.01, steps, sample: 10, averaged: true, frame: 10 };
        let setup = Setup {
            precision: Precision::Mixed,
            gamma: GAMMA,
            seed: SEED,
            ..Setup::new(Code::Native, &SET6, ForceLaw::Conservative)
        };
        let failed = |fault: Option<Fault>| -> Vec<String> {
            let trace = Fault::during(fault, || native(&setup, &state, length, &|_| ())).unwrap();
            let found = measure(&trace, edge, height).unwrap();
            let mut checks = vec![against_kt(&SET6, Code::Native, ForceLaw::Conservative, &found)];
            checks.extend(against_published(&SET6, &found));
            checks.into_iter().filter(|c| !c.passed).map(|c| c.id).collect()
        };
        assert_eq!(failed(None), Vec::<String>::new());
        for (fault, sign) in [
            (Fault::PairForce, "nvt.set6.published.density"),
            (Fault::ManyBodyForce, "nvt.set6.published.density"),
            (Fault::Drag, "nvt.set6.native.thermostat"),
            (Fault::Noise, "nvt.set6.native.thermostat"),
        ] {
            let failed = failed(Some(fault));
            assert!(failed.iter().any(|id| id == sign), "{fault:?}: {failed:?}");
        }
    }
}
