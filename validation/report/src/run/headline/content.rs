//! What the files of a run say about its results.

use super::super::series::{self, last_stage};
use super::super::{About, Observation, with_error};
use super::HeadlineValue;
use crate::text::of_lengths;
use psidpd_formats::AboutStage;
use psidpd_observe::Kind;
use psidpd_observe::drift::drift;
use psidpd_observe::observation::Column;
use psidpd_observe::statistics::{MINIMUM_SAMPLES, estimate};
use std::ops::Range;

/// With fewer independent rows the error bars themselves are uncertain by a fifth.
const FEW: f64 = 12.0;

/// The slope of a series is called a drift if it differs from 0 by more than `DRIFT` of its errors, in at least `DRIFTING` rows.
const DRIFT: f64 = 4.0;
const DRIFTING: usize = 20;

/// The columns of `thermo.csv` that must not drift, and their names in words.
const SERIES: [(&str, &str); 3] =
    [("temperature", "temperature"), ("potential", "potential energy"), ("pressure", "pressure")];

/// A value, its error if it has one, and where it comes from.
type Found = (f64, Option<f64>, String);

/// The content of the files, of which any may be missing.
pub struct Content<'a> {
    about: Option<&'a About>,
    particles: Option<f64>,
    table: Option<&'a series::Table>,
    /// The rows of the last stage.
    rows: Option<Range<usize>>,
    /// The observations of the last stage.
    observables: Vec<&'a Observation>,
    stage: Option<&'a AboutStage>,
}

impl<'a> Content<'a> {
    pub fn new(
        about: Option<&'a About>,
        particles: Option<f64>,
        table: Option<&'a series::Table>,
        observables: &'a [Observation],
    ) -> Content<'a> {
        let stage = about.and_then(|a| a.stages.last());
        let of_stage = |o: &&Observation| stage.is_none_or(|s| o.stage == s.name) || o.stage.is_empty();
        Content {
            about,
            particles,
            table,
            rows: table.map(|t| last_stage(t, about)),
            observables: observables.iter().filter(of_stage).collect(),
            stage,
        }
    }

    /// The first of these columns of observables that has a finite value.
    fn scalar(&self, from: &[(&str, &str)]) -> Option<Found> {
        from.iter().find_map(|(name, column)| {
            let found = self.observables.iter().find(|o| o.name == *name)?;
            let found = found.scalar(column).filter(|found| found.value.is_finite())?;
            Some((found.value, Some(found.error), format!("{name}.{column}")))
        })
    }

    /// A column of `thermo.csv` in the last stage.
    fn column(&self, name: &str) -> Option<&'a [f64]> {
        let (table, rows) = self.table.zip(self.rows.clone())?;
        table.get(name)?.get(rows)
    }

    fn mean_of_rows(&self, name: &str) -> Option<Found> {
        let values = self.column(name)?;
        let source = format!("thermo.csv, {}", rows_in_words(values.len()));
        match estimate(values) {
            Ok(e) => Some((e.mean, Some(e.error), source)),
            Err(_) => Some((values.iter().sum::<f64>() / values.len() as f64, None, source)),
        }
    }

    /// Whether body forces or moving walls drive a flow, which is no heat.
    fn is_driven(&self) -> bool {
        self.stage.is_some_and(|s| s.body_forces)
    }

    /// The temperature about the flow that is driven.
    fn temperature_without_flow(&self) -> Option<Found> {
        self.is_driven().then(|| self.scalar(&[(WITHOUT_FLOW, "mean")])).flatten()
    }

    /// Of the two routes to the tension of a slab the one with the smaller error; else that of a drop.
    fn tension(&self) -> Option<Found> {
        let routes = ["stress", "free_energy"].map(|route| self.scalar(&[("surface_tension", route)]));
        let error = |found: &Found| found.1.filter(|e| *e > 0.0).unwrap_or(f64::INFINITY);
        let tension = routes.into_iter().flatten().min_by(|a, b| error(a).total_cmp(&error(b)));
        tension.or_else(|| self.scalar(&[("drop", "tension"), ("pendant", "tension")]))
    }

    /// The values that are there and finite, the most important first.
    pub fn values(&self) -> Vec<HeadlineValue> {
        let dimensions = self.about.map_or(3, |a| a.dimensions);
        let volume = self.about.map(About::volume);
        let density = self.particles.zip(volume);
        let whole =
            || self.scalar(&[("temperature", "kinetic")]).or_else(|| self.mean_of_rows("temperature"));
        let liquid = ["interface_width", "drop", "pendant", "contact_angle"].map(|name| (name, "liquid"));
        let both = |column| self.scalar(&[("interface_width", column), ("drop", column)]);
        let width = both("width").map(|(w, error, from)| (w, error, format!("{from}: 2 d of tanh(z/d)")));
        let named = [
            (
                "density",
                "1/volume",
                density.map(|(n, v)| (n / v, None, "all particles / volume of the box".into())),
            ),
            ("temperature", "energy", self.temperature_without_flow().or_else(whole)),
            (
                "pressure",
                "energy/volume",
                self.scalar(&[("pressure", "carried")]).or_else(|| self.mean_of_rows("pressure")),
            ),
            ("liquid", "1/volume", self.scalar(&liquid)),
            ("vapour", "1/volume", both("vapour")),
            ("tension", "energy/area", self.tension()),
            ("width", "length", width),
            ("radius", "length", self.scalar(&[("drop", "radius")])),
            ("contact_angle", "degree", self.scalar(&[("contact_angle", "angle")])),
            (
                "viscosity",
                "mass/(r_c time)",
                self.scalar(&[("poiseuille", "viscosity"), ("viscosity", "viscosity")]),
            ),
        ];
        let named = named.map(|(name, unit, found)| (name.to_owned(), unit.to_owned(), found));
        let others = others(&self.observables).into_iter();
        let others = others.filter(|(_, o, _)| !self.is_driven() || o.name != WITHOUT_FLOW);
        let others = others.map(|(name, observable, column)| {
            let source = format!("{}.{}", observable.name, column.name);
            let found = observable.scalar(&column.name);
            (name, column.unit.clone(), found.map(|found| (found.value, Some(found.error), source)))
        });
        let value = |(name, unit, found): (String, String, Option<Found>)| {
            let (value, error, source) = found.filter(|f| f.0.is_finite())?;
            let expected = self.about.and_then(|a| a.expected.iter().find(|e| e.name == name));
            Some(HeadlineValue {
                name,
                value,
                error: error.filter(|e| e.is_finite() && *e > 0.0),
                unit: of_lengths(&unit, dimensions),
                source,
                mean_field: expected.and_then(|e| e.mean_field),
                published: expected.and_then(|e| e.published),
            })
        };
        named.into_iter().chain(others).filter_map(value).collect()
    }

    /// Warnings for users of the values.
    pub fn notes(&self, values: &[HeadlineValue]) -> Vec<String> {
        let mut notes = Vec::new();
        notes.extend(self.few_rows());
        notes.extend(self.few_independent_rows());
        notes.extend(SERIES.iter().filter_map(|(key, title)| self.drifting(key, title)));
        notes.extend(self.wrong_temperature(values));
        notes.extend(self.about.and_then(|about| image_of_drop(about, values)));
        let of_observables = self.observables.iter().filter(|o| !o.note.is_empty() && o.x.is_none());
        notes.extend(of_observables.map(|o| format!("{}: {}", o.name, o.note)));
        notes
    }

    /// The rows of the last stage, if there are any, and its name.
    fn rows_of_stage(&self) -> Option<(usize, &str)> {
        let rows = self.rows.as_ref().filter(|rows| !rows.is_empty())?;
        Some((rows.len(), self.stage.map_or("run", |s| s.name.as_str())))
    }

    fn few_rows(&self) -> Option<String> {
        let (rows, name) = self.rows_of_stage().filter(|(rows, _)| *rows < MINIMUM_SAMPLES)?;
        Some(format!(
            "too short for error bars: {} of thermo.csv in stage \"{name}\", {MINIMUM_SAMPLES} are needed; write \
             rows more often (`thermo` in [output]) or make more steps",
            rows_in_words(rows)
        ))
    }

    fn few_independent_rows(&self) -> Option<String> {
        let (_, name) = self.rows_of_stage()?;
        let few = SERIES.iter().filter_map(|(key, title)| {
            let worth = estimate(self.column(key)?).ok()?.effective();
            (worth < FEW).then_some((worth, title))
        });
        let (worth, title) = few.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!(
            "short: stage \"{name}\" has about {:.0} independent values of the {title}, so its error is itself uncertain by \
             {:.0} %; make more steps",
            worth.max(1.0),
            100.0 / (2.0 * worth.max(1.0)).sqrt()
        ))
    }

    fn drifting(&self, key: &str, title: &str) -> Option<String> {
        let values = self.column(key).filter(|values| values.len() >= DRIFTING)?;
        let rows: Vec<f64> = (0..values.len()).map(|k| k as f64).collect();
        let d = drift(&rows, values).ok().filter(|d| d.slope.abs() > DRIFT * d.slope_error)?;
        let over = (values.len() - 1) as f64;
        Some(format!(
            "drifting: over the last stage the {title} changes by {}; it is not in equilibrium: equilibrate longer, and do \
             not trust the errors",
            with_error(d.slope * over, Some(d.slope_error * over))
        ))
    }

    fn wrong_temperature(&self, values: &[HeadlineValue]) -> Option<String> {
        let stage = self.stage.filter(|s| s.thermostat && !s.integrator.starts_with("monte-carlo"))?;
        let measured = values.iter().find(|v| v.name == "temperature")?;
        let off = measured.value - stage.kt;
        if off.abs() <= (4.0 * measured.error?).max(0.01 * stage.kt) {
            return None;
        }
        // A flow that body forces or walls drive counts as heat, at any time step.
        let because = match self.is_driven() && self.temperature_without_flow().is_none() {
            true => "it includes the flow that body forces or moving walls drive; `temperature_profile` in [observe] leaves the flow out".into(),
            false => format!("a smaller time step than {} brings it nearer", stage.dt),
        };
        let off = 100.0 * (measured.value / stage.kt - 1.0);
        Some(format!("the temperature is {off:+.1} % off the kT = {} of its stage: {because}", stage.kt))
    }
}

/// The temperature about the mean flow of slices.
pub const WITHOUT_FLOW: &str = "temperature_profile_mean";

/// Scalars that have no name of their own among the results: all coexisting compositions, diffusion coefficients, mean flows and
/// peaks, and the first number of any other observable.
fn others<'a>(all: &[&'a Observation]) -> Vec<(String, &'a Observation, &'a Column)> {
    const NAMED: [&str; 8] = [
        "temperature",
        "pressure",
        "interface_width",
        "drop",
        "surface_tension",
        "contact_angle",
        "poiseuille",
        "viscosity",
    ];
    let scalars = all
        .iter()
        .copied()
        .filter(|o| o.kind == Kind::Scalar && o.x.is_none() && !NAMED.contains(&o.name.as_str()));
    let mut found = Vec::new();
    for observable in scalars {
        let plain = ["coexistence", "diffusion"].contains(&observable.name.as_str());
        let whole = plain || observable.name == "velocity_profile_mean" || observable.name.ends_with("_peak");
        for column in observable.columns.iter().take(if whole { usize::MAX } else { 1 }) {
            let name = match plain {
                true => column.name.clone(),
                // `stress_profile_integral` has the column `integral`.
                false if observable.name.ends_with(&column.name) => observable.name.clone(),
                false => format!("{}_{}", observable.name, column.name),
            };
            found.push((name, observable, column));
        }
    }
    found
}

/// The warning about a drop that interacts with its own image through a face of the box.
fn image_of_drop(about: &About, found: &[HeadlineValue]) -> Option<String> {
    let value = |name: &str| found.iter().find(|v| v.name == name).map(|v| v.value);
    let reach = about.densities.iter().map(|d| d.range).fold(1.0, f64::max);
    let extent = 2.0 * value("radius")? + value("width")?;
    let length = |k: usize| about.box_edges[k].iter().map(|c| c * c).sum::<f64>().sqrt();
    let narrow = (0..about.dimensions)
        .filter(|k| about.box_periodic[*k])
        .map(length)
        .min_by(f64::total_cmp)
        .filter(|length| length - extent < reach)?;
    Some(format!(
        "the drop touches its image: it is {extent:.2} across with its interface, in a box of {narrow:.2}; use a larger box"
    ))
}

fn rows_in_words(count: usize) -> String {
    if count == 1 { "1 row".to_owned() } else { format!("{count} rows") }
}
