//! A model of a liquid from its data sheet.
//!
//! 1. Density, temperature and the size of a particle are the units: mass, energy and length r_c of a model whose liquid has
//!    [`sheet::USUAL_DENSITY`] particles in r_c³. Compressibility, tension and viscosity are then goals in these units ([`Goals`]).
//! 2. Goals that no fluid has are refused before any run.
//! 3. The fluid ([`fluid`]) has as many free strengths as there are goals of its equilibrium: a theory guesses them, and
//!    Gauss–Newton steps on measured values find them ([`search`]).
//! 4. The drag, which changes no equilibrium, is then sought for the viscosity ([`drag`]).
//! 5. What is reported is measured again, three times as long and from another seed.

mod drag;
mod error;
mod fluid;
mod instrument;
mod numbers;
mod runs;
mod search;
mod sheet;
#[cfg(test)]
mod tests;
mod theory;

pub use drag::Tried;
pub use error::{LiquidError, Refusal};
pub use fluid::{Drag, Strengths};
pub use instrument::{Care, Equilibrium, Flow, Instrument};
pub use numbers::{Number, Properties, Scales};
pub use search::Trial;
pub use sheet::{ENTRIES, Entries, Entry, Goals, Liquid, TOLERANCE, Tolerance};

use crate::error::value_or_why;
use crate::{ExperimentError, Trouble};
use psidpd_formats::files::temporary_folder;
use psidpd_observe::Measured;
use search::End;
use serde::Serialize;
use std::fmt::Write;

/// Between these (1/kT) ∂p/∂ρ liquids neither boil nor freeze, and below this tension, in kT/r_c², they do not freeze: see
/// `docs/liquids.md`.
const SOFTEST: f64 = 8.0;
const STIFFEST: f64 = 110.0;
const TENSEST: f64 = 30.0;

/// How often the result is measured, sought again and measured.
const ROUNDS: u64 = 3;

/// A property in SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    pub name: &'static str,
    pub unit: &'static str,
    /// `None` is free.
    pub wanted: Option<f64>,
    pub got: Measured,
    pub tolerance: Option<f64>,
}

impl Row {
    /// Whether it is free, or as wanted within the tolerance and a standard error that is no larger.
    pub fn is_met(&self) -> bool {
        let (Some(wanted), Some(tolerance)) = (self.wanted, self.tolerance) else { return true };
        let (off, error) = ((self.got.value / wanted - 1.0).abs(), self.got.error / wanted);
        error <= tolerance && off <= tolerance + error
    }
}

/// A model, and how it compares with its liquid.
#[derive(Debug, Serialize)]
pub struct Found {
    pub liquid: String,
    /// Length (m), mass (kg), energy (J) and time (s).
    pub units: [f64; 4],
    pub molecules: Option<f64>,
    pub goals: Goals,
    pub fluid: Strengths,
    pub drag: Drag,
    /// The longest step with errors of about a percent.
    pub step: Option<f64>,
    pub trials: Vec<Trial>,
    pub drags: Vec<Tried>,
    pub rows: Vec<Row>,
    pub numbers: Vec<Number>,
    pub refusals: Vec<Refusal>,
    /// Whether all goals are met.
    pub good: bool,
    /// The model file; none where no fluid was found.
    #[serde(skip)]
    pub text: Option<String>,
}

/// Finds the model of a liquid by runs; `command` goes into its comment.
///
/// # Errors
/// Fails if runs cannot be carried out. A goal that is missed is no error: see [`Found::refusals`].
pub fn model(
    liquid: &Liquid,
    seed: u64,
    command: &str,
    told: &mut dyn FnMut(&str),
) -> Result<Found, ExperimentError> {
    let folder = temporary_folder()?;
    let mut runs = runs::Runs { liquid, folder: folder.path(), seed };
    let mut found = model_by(liquid, &mut runs, told)?;
    if found.text.is_some() {
        found.step = runs.longest_step(&found.fluid, &found.drag).ok().flatten();
        found.text = Some(fluid::text(liquid, &found.fluid, &found.drag, &found.head(command)));
    }
    Ok(found)
}

/// Finds a model with what `instrument` measures, without a recommended step.
fn model_by(
    liquid: &Liquid,
    instrument: &mut dyn Instrument,
    told: &mut dyn FnMut(&str),
) -> Result<Found, ExperimentError> {
    let units = &liquid.units;
    let mut found = Found {
        liquid: liquid.name.clone(),
        units: [units.length, units.mass, units.energy, sheet::time(units)],
        molecules: liquid.molecules(),
        goals: liquid.goals,
        fluid: theory::start(&liquid.goals),
        drag: fluid::USUAL,
        step: None,
        trials: Vec::new(),
        drags: Vec::new(),
        rows: Vec::new(),
        numbers: Vec::new(),
        refusals: impossible(liquid),
        good: false,
        text: None,
    };
    if !found.refusals.is_empty() {
        found.rows = rows(liquid, None, None);
        return Ok(found);
    }
    let equilibrium = value_or_why(equilibrium(liquid, instrument, &mut found, told))?;
    let equilibrium = found.unless_refused(equilibrium);
    let flow = match equilibrium {
        Some(_) => value_or_why(flow(liquid, instrument, &mut found, told))?,
        None => Ok(None),
    };
    let flow = found.unless_refused(flow);
    found.rows = rows(liquid, equilibrium.as_ref(), flow.as_ref());
    found.numbers = compared(liquid, &found.rows);
    found.good = found.refusals.is_empty() && found.rows.iter().all(Row::is_met) && flow.is_some();
    found.text = flow.is_some().then(String::new);
    Ok(found)
}

/// What is known to be impossible without a run.
fn impossible(liquid: &Liquid) -> Vec<Refusal> {
    let (goals, volume) = (&liquid.goals, liquid.volume());
    let molecules = |volume: f64| Some(liquid.molecules()? * volume / liquid.volume());
    let mut all = Vec::new();
    if let (Some(stiffness), Some(compressibility)) = (goals.stiffness, liquid.compressibility) {
        let nearest = |most: f64| volume * most / stiffness;
        if stiffness > STIFFEST {
            all.push(Refusal::TooStiff {
                compressibility,
                volume,
                stiffness,
                most: STIFFEST,
                nearest_volume: nearest(STIFFEST),
                nearest_molecules: molecules(nearest(STIFFEST)),
                nearest_compressibility: compressibility * stiffness / STIFFEST,
            });
        } else if stiffness < SOFTEST {
            all.push(Refusal::TooSoft {
                compressibility,
                volume,
                stiffness,
                least: SOFTEST,
                nearest_volume: nearest(SOFTEST),
                nearest_molecules: molecules(nearest(SOFTEST)),
            });
        }
    }
    if let Some(reduced) = goals.tension.filter(|tension| *tension > TENSEST) {
        let nearest = volume * (TENSEST / reduced).powf(1.5);
        all.push(Refusal::TooTense {
            tension: reduced * liquid.tension_unit(),
            volume,
            reduced,
            most: TENSEST,
            nearest_volume: nearest,
            nearest_molecules: molecules(nearest),
            nearest_tension: TENSEST * liquid.tension_unit(),
        });
    }
    all
}

/// Seeks the strengths and measures the result; `None` without a fluid.
fn equilibrium(
    liquid: &Liquid,
    instrument: &mut dyn Instrument,
    found: &mut Found,
    told: &mut dyn FnMut(&str),
) -> Result<Option<Equilibrium>, Trouble> {
    let goals = &liquid.goals;
    let mut result = None;
    for round in 0..ROUNDS {
        let end = search::search(goals, &TOLERANCE, instrument, &mut found.trials, told)?;
        let Some(best) = search::best(&found.trials, goals, &TOLERANCE) else {
            if let End::Blocked(why) = end {
                found.refusals.push(Refusal::NoLiquid { why });
            }
            return Ok(None);
        };
        found.fluid = best.fluid;
        told("measuring the result, three times as long and from another seed");
        let again = instrument.equilibrium(&best.fluid, Care::Result(round))?;
        result = Some(again);
        let met = search::score(&again, goals, &TOLERANCE) <= 1.0;
        match end {
            End::Met if !met && round + 1 < ROUNDS => {
                // A longer run of a fluid replaces the shorter one.
                found.trials.retain(|trial| trial.fluid != best.fluid);
                found.trials.push(Trial { fluid: best.fluid, found: again });
            }
            End::Met => break,
            // What the table calls met is not refused, though chance may have kept the search from its end.
            End::Missed | End::Blocked(_) if met || all_met(liquid, &again) => break,
            End::Missed => {
                found.refusals.push(conflict(liquid, &again, None));
                break;
            }
            End::Blocked(why) => {
                found.refusals.push(conflict(liquid, &again, Some(why)));
                break;
            }
        }
    }
    Ok(result)
}

/// Whether the goals of a liquid at rest are met as the table says.
fn all_met(liquid: &Liquid, found: &Equilibrium) -> bool {
    let rows = rows(liquid, Some(found), None);
    rows.iter().filter(|row| row.name != "viscosity").all(Row::is_met)
}

/// The two goals that were not met together.
fn conflict(liquid: &Liquid, nearest: &Equilibrium, why: Option<String>) -> Refusal {
    let of = |equilibrium| rows(liquid, Some(equilibrium), None);
    let all = of(nearest);
    let row = |name: &str| all.iter().find(|row| row.name == name && row.wanted.is_some());
    let pair = [row("tension"), row("compressibility"), row("density")];
    let mut wanted = pair.into_iter().flatten();
    match (wanted.next(), wanted.next()) {
        (Some(first), Some(second)) => Refusal::Pair {
            first: first.name,
            first_wanted: first.wanted.unwrap_or(f64::NAN),
            first_nearest: first.got.value,
            second: second.name,
            second_wanted: second.wanted.unwrap_or(f64::NAN),
            second_nearest: second.got.value,
            why,
        },
        _ => Refusal::NoLiquid { why: why.unwrap_or("the search did not find it".into()) },
    }
}

/// Seeks the drag and measures the result; `None` if the fluid does not run.
fn flow(
    liquid: &Liquid,
    instrument: &mut dyn Instrument,
    found: &mut Found,
    told: &mut dyn FnMut(&str),
) -> Result<Option<Flow>, Trouble> {
    let goals = &liquid.goals;
    found.drags = drag::search(goals, &found.fluid, 0.5 * TOLERANCE.viscosity, instrument, told)?;
    let Some(Tried { drag, flow: first }) = found.drags.last().copied() else { return Ok(None) };
    found.drag = drag;
    let mut guess = first.viscosity.value;
    let mut flow = None;
    for round in 0..ROUNDS {
        let again = instrument.flow(&found.fluid, &found.drag, guess, Care::Result(round))?;
        flow = Some(again);
        guess = again.viscosity.value;
        let Some(goal) = goals.viscosity else { break };
        let share = goal / again.viscosity.value;
        let ends = (drag::WEAKEST..=drag::STRONGEST).contains(&(found.drag.gamma * share));
        if (share - 1.0).abs() <= TOLERANCE.viscosity || !ends || round + 1 == ROUNDS {
            break;
        }
        found.drag.gamma *= share;
    }
    if let (Some(goal), Some(flow)) = (goals.viscosity, &flow)
        && (flow.viscosity.value / goal - 1.0).abs() > TOLERANCE.viscosity + flow.viscosity.error / goal
    {
        found.refusals.push(Refusal::Viscosity {
            viscosity: goal * liquid.viscosity_unit(),
            volume: liquid.volume(),
            gamma: found.drag.gamma,
            end: drag::end(found.drag.gamma),
            nearest: flow.viscosity.value * liquid.viscosity_unit(),
        });
    }
    Ok(flow)
}

/// Goals and measurements in SI units.
fn rows(liquid: &Liquid, equilibrium: Option<&Equilibrium>, flow: Option<&Flow>) -> Vec<Row> {
    let goals = &liquid.goals;
    let none = Measured::NONE;
    let [density, compressibility, tension] = equilibrium.map_or([none; 3], |e| {
        let modulus = e.stiffness.times(goals.density);
        // The density at no pressure: that of the vapour is nearly none.
        let denser = e.pressure.over(modulus);
        [
            Measured::from(1.0).minus(denser).times(liquid.density),
            Measured::from(1.0).over(modulus.times(liquid.pressure_unit())),
            e.tension.times(liquid.tension_unit()),
        ]
    });
    let [viscosity, diffusion] = flow.map_or([none; 2], |f| {
        let [length, time] = [liquid.units.length, sheet::time(&liquid.units)];
        [f.viscosity.times(liquid.viscosity_unit()), f.diffusion.times(length * length / time)]
    });
    // c² = 1/ρκ, so its relative error is half of that of κ.
    let speed = 1.0 / (liquid.density * compressibility.value).sqrt();
    let speed = Measured { value: speed, error: 0.5 * speed * compressibility.error / compressibility.value };
    let goal = |name, unit, wanted: Option<f64>, got, tolerance| Row {
        name,
        unit,
        wanted,
        got,
        tolerance: Some(tolerance),
    };
    let result = |name, unit, got| Row { name, unit, wanted: None, got, tolerance: None };
    vec![
        goal("density", "kg/m3", Some(liquid.density), density, TOLERANCE.density),
        goal("compressibility", "1/Pa", liquid.compressibility, compressibility, TOLERANCE.compressibility),
        result("speed of sound", "m/s", speed),
        goal("tension", "N/m", liquid.entries.get("tension"), tension, TOLERANCE.tension),
        goal("viscosity", "Pa s", liquid.entries.get("viscosity"), viscosity, TOLERANCE.viscosity),
        result("diffusion", "m2/s", diffusion),
    ]
}

fn compared(liquid: &Liquid, rows: &[Row]) -> Vec<Number> {
    let row = |name: &str| rows.iter().find(|row| row.name == name);
    let got = |name: &str| Some(row(name)?.got.value).filter(|x| x.is_finite());
    let wanted = |name: &str| row(name)?.wanted;
    let of_liquid = Properties {
        density: wanted("density"),
        tension: wanted("tension"),
        viscosity: wanted("viscosity"),
        sound_speed: wanted("compressibility").map(|kappa| 1.0 / (liquid.density * kappa).sqrt()),
        diffusion: None,
    };
    let of_model = Properties {
        density: got("density"),
        tension: got("tension"),
        viscosity: got("viscosity"),
        sound_speed: got("speed of sound"),
        diffusion: got("diffusion"),
    };
    let of = |key: &str| liquid.entries.get(key);
    let scales =
        Scales { length: of("length").or(of("drop")), velocity: of("velocity"), gravity: of("gravity") };
    numbers::numbers(&of_liquid, &of_model, &scales)
}

impl Found {
    /// What was measured; what the fluid does instead is a refusal.
    fn unless_refused<T>(&mut self, measured: Result<Option<T>, String>) -> Option<T> {
        measured.unwrap_or_else(|why| {
            self.refusals.push(Refusal::NoLiquid { why });
            None
        })
    }

    /// The step to take, in words.
    pub fn advice(&self) -> Option<String> {
        let (step, [.., time]) = (self.step?, self.units);
        let seconds = step * time;
        Some(format!(
            "integrator = \"force-gradient\", lambda = 0.17, thermostat_every = 2, dt = {step} ({seconds:.2e} s)"
        ))
    }

    /// What the model file says of itself.
    fn head(&self, command: &str) -> String {
        let [length, mass, _, time] = self.units;
        let mut head = format!("{}, by\n  {command}\n", self.liquid);
        let _ = writeln!(
            head,
            "r_c = {length:.4e} m, a particle {mass:.4e} kg, the unit of time {time:.4e} s; kT = 1, {} particles in r_c3.",
            self.goals.density
        );
        for row in self.rows.iter().filter(|row| row.got.value.is_finite()) {
            let wanted = row.wanted.map_or("free".to_owned(), |wanted| format!("wanted {wanted:.4e}"));
            let _ = writeln!(
                head,
                "{}: {:.4e} +- {:.1e} {} ({wanted})",
                row.name, row.got.value, row.got.error, row.unit
            );
        }
        if let Some(step) = self.advice() {
            let _ = writeln!(head, "Step: {step}.");
        }
        for refusal in &self.refusals {
            let _ = writeln!(head, "MISSED: {refusal}");
        }
        head
    }
}
