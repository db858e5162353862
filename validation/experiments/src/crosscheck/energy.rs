//! Energy against time without thermostat, and why the built-in's is not kept.

use super::closed_loop;
use super::setup::Setup;
use super::trace::{Length, Trace, run as run_code};
use super::{Context, Part};
use crate::ExperimentError;
use crate::code::Code;
use crate::fluids::SET6;
use crate::jobs;
use crate::start::{Filling, equilibrated};
use psidpd_core::engine::Precision::{Double, Mixed};
use psidpd_core::model::ForceLaw;
use psidpd_observe::drift;
use psidpd_report::{Item, Plot, Section, Series, Style, Table};
use serde_json::json;

pub const SEED: u64 = 20_010_703;

const TIME: &str = "time [length √(mass/energy)]";
/// Drift allowed over the run, in kT per particle.
const LARGEST_DRIFT: f64 = 1e-4;
/// Rise of the temperature that counts as heating.
const HEATING: f64 = 0.1;

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let edge = if context.full { 12.0 } else { 5.2 };
    let filling = Filling::cube(edge);
    let state = equilibrated(Double, &SET6.fluid, filling, 1500, SEED)?;
    let length = Length { dt: 0.001, steps: 10_000, sample: 50, averaged: false, frame: 0 };
    let setups = [
        (Code::Native, Double),
        (Code::Native, Mixed),
        (Code::Psi, Double),
        (Code::Psi, Mixed),
        (Code::Mdpd, Double),
        (Code::Eam, Double),
    ]
    .map(|(code, precision)| {
        let law = if code == Code::Mdpd { ForceLaw::LucyLammps } else { ForceLaw::Conservative };
        Setup { precision, ..Setup::new(code, &SET6, law) }
    });
    let bar = |setup: &Setup| context.progress.bar(&format!("NVE: {}", setup.label()), length.steps);
    let runs = setups.iter().map(|setup| (setup, bar(setup))).collect();
    let traces = jobs::each(runs, |(setup, bar)| {
        let name = format!("nve-{}", setup.slug());
        run_code(context, setup, &state, length, &name, &|s| bar.set(s))
    });
    let traces = traces.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut part = Part::of("energy");
    let header = ["code", "energy drift, kT per particle", "largest excursion", "temperature, start", "end"];
    let mut table = Table::new(header);
    let (mut heat, mut energy) = (Vec::new(), Vec::new());
    for (setup, trace) in setups.iter().zip(&traces) {
        let (label, slug) = (setup.label(), setup.slug());
        let per_particle = trace.energy_per_particle();
        let duration = trace.time.last().copied().unwrap_or(0.0);
        let Change { net, largest, ends, heating } = change(trace)?;
        let energies = [net, largest].map(|x| format!("{x:.1e}"));
        let temperatures = ends.map(|t| format!("{t:.3}"));
        table.push([label.clone()].into_iter().chain(energies).chain(temperatures));
        part.values.push((
            format!("nve.{slug}"),
            json!({"drift": net, "largest": largest, "temperature_start": ends[0], "temperature_end": ends[1]}),
        ));
        if setup.code == Code::Mdpd {
            let what = "LAMMPS mdpd heats without thermostat (what the conservative law is there to avoid): rise of T";
            part.at_least("nve.mdpd.heating", what, heating, HEATING);
        } else {
            let what = format!("{label}: drift of U + K over {duration} time units, kT per particle");
            part.at_most(format!("nve.{slug}.drift"), what, net, LARGEST_DRIFT);
            let start = per_particle[0];
            let points = trace.time.iter().zip(&per_particle).map(|(t, e)| (*t, e - start)).collect();
            energy.push(Series::new(label.clone(), points, Style::Line));
        }
        let points = trace.time.iter().copied().zip(trace.temperature.iter().copied()).collect();
        heat.push(Series::new(label, points, Style::Line));
    }
    let heat = Plot::new("Temperature without thermostat", [TIME, "kinetic temperature [energy]"], heat);
    let energy =
        Plot::new("Total energy per particle, less its start", [TIME, "energy per particle [kT]"], energy);
    let text = format!(
        "{} particles of set 6 at density {}, no drag, no noise, Δt = {}. The built-in's law is its own; its energy is not \
         shown in the second figure because what it tallies is not the potential of its forces.",
        state.len(),
        SET6.fluid.density,
        length.dt
    );
    let heat = Item::figure(
        &heat,
        "The built-in heats; the other codes compute the gradient of an energy and keep it.",
    )?;
    let energy = Item::figure(&energy, "What is left is the error of the integrator.")?;
    let items = vec![Item::Prose(text), Item::Table(table), heat, energy];
    part.section = Section::new("Energy without thermostat", items);
    add_loop(context, &mut part)?;
    Ok(part)
}

/// How the energy of a particle and the temperature have changed in a run.
struct Change {
    /// The drift of the energy from the start to the end, and the largest excursion.
    net: f64,
    largest: f64,
    /// The temperatures at the start and at the end, and the rise.
    ends: [f64; 2],
    heating: f64,
}

fn change(trace: &Trace) -> Result<Change, ExperimentError> {
    let found = drift(&trace.time, &trace.energy_per_particle())?;
    let duration = trace.time.last().copied().unwrap_or(0.0);
    let ends = ends(&trace.temperature);
    Ok(Change { net: found.slope * duration, largest: found.largest, ends, heating: ends[1] - ends[0] })
}

/// Means of the first and the last twentieth of a series.
fn ends(series: &[f64]) -> [f64; 2] {
    let count = (series.len() / 20).max(1);
    let mean = |s: &[f64]| s.iter().sum::<f64>() / s.len() as f64;
    [mean(&series[..count]), mean(&series[series.len() - count..])]
}

fn add_loop(context: &Context, part: &mut Part) -> Result<(), ExperimentError> {
    use ForceLaw::{Conservative, LucyLammps};
    let rows = [
        ("native", "conservative", closed_loop::native(context, Conservative)?),
        ("plugin dpd/psi", "conservative", closed_loop::lammps(context, Code::Psi, Conservative)?),
        ("native", "Lucy", closed_loop::native(context, LucyLammps)?),
        ("LAMMPS mdpd", "its own", closed_loop::lammps(context, Code::Mdpd, LucyLammps)?),
    ];
    let mut table = Table::new(["code", "law", "work around the loop", "over the integral of |F|"]);
    for (code, law, w) in rows {
        let (work, share) = (format!("{:.3e}", w.work), format!("{:.1e}", w.work / w.scale));
        table.push([code, law, &work, &share]);
    }
    let [native, plugin, lucy, built_in] = rows.map(|r| r.2);
    for (id, what, w) in [("native", "native", native), ("psi", "plugin dpd/psi", plugin)] {
        let what = format!("{what}, conservative law: work around a closed loop, over the integral of |F|");
        part.at_most(format!("loop.{id}"), what, w.work / w.scale, 1e-12);
    }
    let what = "LAMMPS mdpd: work around a closed loop, over the integral of |F| (a force with a potential does none)";
    part.at_least("loop.mdpd", what, (built_in.work / built_in.scale).abs(), 1e-3);
    let what = "the Lucy law in the native engine does the same work as LAMMPS mdpd, relative";
    part.at_most("loop.lucy", what, (lucy.work - built_in.work) / built_in.work, 1e-9);
    let works =
        json!({"native": native.work, "plugin": plugin.work, "lucy": lucy.work, "mdpd": built_in.work});
    part.values.push(("loop".into(), works));
    part.section.items.push(Item::prose(
        "Why: two particles rest and a third goes once around a circle. A force with a potential does no work on \
         the way. The built-in's density has the Lucy kernel and its force falls off linearly; the derivative of \
         the one is not proportional to the other, which is the condition for a potential (Warren, eq. 10), and \
         the force does work. A fluid full of such triples heats.",
    ));
    part.section.items.push(Item::Table(table));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten particles whose energy rises by 0.02 per unit of time, for 40 units, and whose temperature rises from 0.7 by 0.01 a sample.
    #[test]
    fn changes_of_a_made_up_run() {
        let samples = 0..=100;
        let trace = Trace {
            particles: 10,
            time: samples.clone().map(|k| 0.4 * f64::from(k)).collect(),
            potential: samples.clone().map(|k| -30.0 + 0.05 * f64::from(k)).collect(),
            kinetic: samples.clone().map(|k| 15.0 + 0.03 * f64::from(k)).collect(),
            temperature: samples.map(|k| 0.7 + 0.01 * f64::from(k)).collect(),
            ..Trace::default()
        };
        let Change { net, largest, ends, heating } = change(&trace).unwrap();
        assert!((net - 0.8).abs() < 1e-9 && largest.abs() >= net - 1e-9, "{net} {largest}");
        // The first and the last five samples.
        assert!((ends[0] - 0.72).abs() < 1e-12 && (ends[1] - 1.68).abs() < 1e-12, "{ends:?}");
        assert!((heating - 0.96).abs() < 1e-12, "{heating}");
    }
}
