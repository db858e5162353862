//! What errors are told of, and how large they are.

use crate::observe::{Measured, Observation};
use serde::Serialize;

/// Kinds of quantities, each with one tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Class {
    /// Kinetic and configurational temperature.
    #[serde(rename = "T")]
    Temperature,
    /// Conservative pressure, in units of the larger of itself and ρ kT.
    #[serde(rename = "p")]
    Pressure,
    /// Coexisting densities, in units of the liquid's.
    #[serde(rename = "rho")]
    Density,
    /// Surface tension.
    #[serde(rename = "sigma")]
    Tension,
    /// Diffusion coefficient.
    #[serde(rename = "D")]
    Diffusion,
    /// The distance of g(r): root mean square difference over root mean square, weighed by shells.
    #[serde(rename = "g")]
    Structure,
}

impl Class {
    /// With the names on the command line.
    pub const ALL: [(&'static str, Class); 6] = [
        ("T", Class::Temperature),
        ("p", Class::Pressure),
        ("rho", Class::Density),
        ("sigma", Class::Tension),
        ("D", Class::Diffusion),
        ("g", Class::Structure),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Class::ALL.iter().find(|(_, class)| *class == self).map_or("", |found| found.0)
    }

    /// All names.
    pub fn names() -> String {
        Class::ALL.map(|(name, _)| name).join(", ")
    }
}

/// Where quantities are among the observations: class, name here, observation, column.
const SCALARS: [(Class, &str, &str, &str); 9] = [
    (Class::Temperature, "T_conf", "temperature", "configurational"),
    (Class::Pressure, "p", "pressure", "conservative"),
    (Class::Density, "rho_L", "interface_width", "liquid"),
    (Class::Density, "rho_V", "interface_width", "vapour"),
    (Class::Density, "rho_L drop", "drop", "liquid"),
    (Class::Density, "rho_V drop", "drop", "vapour"),
    (Class::Tension, "sigma", "surface_tension", "free_energy"),
    (Class::Tension, "sigma stress", "surface_tension", "stress"),
    (Class::Tension, "sigma drop", "drop", "tension"),
];

/// A measured quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Its kind.
    pub class: Class,
    /// Its name.
    pub name: String,
    /// Its value.
    pub measured: Measured,
}

/// A radial distribution function, for distances.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// Weight of each shell.
    pub weights: Vec<f64>,
    /// Values.
    pub g: Vec<f64>,
    /// Their errors.
    pub errors: Vec<f64>,
}

/// All that is known of one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantities {
    /// Numbers.
    pub scalars: Vec<Quantity>,
    /// g(r) of all particles.
    pub structure: Option<Structure>,
}

impl Quantities {
    /// From a kinetic temperature and what was observed.
    pub fn of(kinetic: Measured, observations: &[Observation], dimensions: usize) -> Quantities {
        let mut scalars =
            vec![Quantity { class: Class::Temperature, name: "T_kin".into(), measured: kinetic }];
        let known = |m: &Measured| m.value.is_finite() && m.error.is_finite();
        for (class, name, of, column) in SCALARS {
            let found = observations.iter().find(|o| o.name == of).and_then(|o| o.scalar(column));
            if let Some(measured) = found.filter(known) {
                scalars.push(Quantity { class, name: name.into(), measured });
            }
        }
        for o in observations.iter().filter(|o| o.name == "diffusion") {
            for c in &o.columns {
                if let Some(measured) = o.scalar(&c.name).filter(known) {
                    let name = c.name.replacen("diffusion", "D", 1);
                    scalars.push(Quantity { class: Class::Diffusion, name, measured });
                }
            }
        }
        let rdf = observations.iter().find(|o| o.name == "rdf");
        let structure = rdf.and_then(|o| {
            let (r, g) = (&o.x.as_ref()?.values, o.get("g")?);
            let weights = r.iter().map(|r| r.powi(dimensions as i32 - 1)).collect();
            let good = g.values.iter().chain(&g.errors).all(|v| v.is_finite());
            good.then(|| Structure { weights, g: g.values.clone(), errors: g.errors.clone() })
        });
        Quantities { scalars, structure }
    }

    /// The same values as if they were known without error.
    #[must_use]
    pub fn as_if_exact(&self) -> Quantities {
        let mut same = self.clone();
        same.scalars.iter_mut().for_each(|q| q.measured.error = 0.0);
        same.structure.iter_mut().flat_map(|s| &mut s.errors).for_each(|e| *e = 0.0);
        same
    }

    /// A quantity by its name.
    pub fn get(&self, name: &str) -> Option<Measured> {
        self.scalars.iter().find(|q| q.name == name).map(|q| q.measured)
    }
}

/// What is known better than by measuring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The temperature, where velocities must have Maxwell's distribution at it: no flow, forces with a potential.
    pub kt: Option<f64>,
    /// ρ kT.
    pub ideal_pressure: f64,
}

/// An error, in units of the quantity, with an error of its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Deviation {
    /// Its kind.
    pub class: Class,
    /// Of which quantity.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// One standard deviation of that.
    pub value_error: f64,
    /// The relative error, with its sign.
    pub relative: f64,
    /// One standard deviation of that, the reference's among it.
    pub uncertainty: f64,
    /// Whether the error is larger than two of these.
    pub resolved: bool,
}

/// How many standard deviations an error is taken to be larger than it was found, where it must be within bounds.
const MARGIN: f64 = 2.0;

impl Deviation {
    fn new(class: Class, name: &str, measured: Measured, relative: f64, uncertainty: f64) -> Deviation {
        let Measured { value, error: value_error } = measured;
        let resolved = relative.abs() > MARGIN * uncertainty;
        Deviation { class, name: name.into(), value, value_error, relative, uncertainty, resolved }
    }

    /// The largest error that is likely: what tolerances bound.
    pub fn bound(&self) -> f64 {
        self.relative.abs() + MARGIN * self.uncertainty
    }

    /// Where it is on a plot: at its error, or if that is not resolved at what it may be.
    pub fn shown(&self) -> f64 {
        if self.resolved { self.relative.abs() } else { self.bound() }
    }
}

/// The errors of `run` against what is known, and against `reference` otherwise.
pub fn deviations(run: &Quantities, reference: &Quantities, known: Known) -> Vec<Deviation> {
    let liquid = reference
        .scalars
        .iter()
        .filter(|q| q.class == Class::Density)
        .map(|q| q.measured.value.abs())
        .fold(0.0, f64::max);
    let mut found = Vec::new();
    for Quantity { class, name, measured } in &run.scalars {
        let exact = known.kt.filter(|_| *class == Class::Temperature);
        let truth = match exact {
            Some(value) => Some(Measured { value, error: 0.0 }),
            None => reference.get(name),
        };
        let Some(truth) = truth else { continue };
        let scale = match class {
            Class::Pressure => truth.value.abs().max(known.ideal_pressure),
            Class::Density => liquid,
            _ => truth.value.abs(),
        };
        if scale > 0.0 && measured.error.is_finite() && truth.error.is_finite() {
            let relative = (measured.value - truth.value) / scale;
            let uncertainty = measured.error.hypot(truth.error) / scale;
            found.push(Deviation::new(*class, name, *measured, relative, uncertainty));
        }
    }
    if let (Some(a), Some(b)) = (&run.structure, &reference.structure)
        && a.g.len() == b.g.len()
    {
        let [distance, error] = distance(a, b);
        let measured = Measured { value: distance, error };
        found.push(Deviation::new(Class::Structure, "g(r)", measured, distance, error));
    }
    found
}

/// `√(Σ w Δg² / Σ w g²)` without what noise adds to Δg², and its error. Shells are taken to be independent.
fn distance(a: &Structure, b: &Structure) -> [f64; 2] {
    let (mut square, mut variance, mut whole) = (0.0, 0.0, 0.0);
    for k in 0..a.g.len() {
        let (w, difference) = (a.weights[k], a.g[k] - b.g[k]);
        let noise = a.errors[k].powi(2) + b.errors[k].powi(2);
        square += w * (difference * difference - noise);
        variance += w * w * (4.0 * (difference * difference - noise).max(0.0) * noise + 2.0 * noise * noise);
        whole += w * b.g[k] * b.g[k];
    }
    if whole <= 0.0 {
        return [f64::NAN; 2];
    }
    let (square, spread) = (square / whole, variance.sqrt() / whole);
    let distance = square.max(0.0).sqrt();
    // Far from zero the error of a square root, near it the root of the error.
    let error = if square > spread { spread / (2.0 * distance) } else { spread.sqrt() };
    [distance, error]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(kinetic: f64, error: f64) -> Quantities {
        Quantities::of(Measured { value: kinetic, error }, &[], 3)
    }

    #[test]
    fn temperatures_are_held_against_what_is_known() {
        let known = Known { kt: Some(2.0), ideal_pressure: 1.0 };
        let found = deviations(&run(2.1, 0.01), &run(1.9, 0.5), known);
        assert_eq!(found.len(), 1);
        assert!((found[0].relative - 0.05).abs() < 1e-12 && (found[0].uncertainty - 0.005).abs() < 1e-12);
        assert!(found[0].resolved && (found[0].bound() - 0.06).abs() < 1e-12);
        assert_eq!(found[0].shown(), found[0].relative.abs());
        // Against a reference both are uncertain.
        let found = deviations(&run(2.1, 0.3), &run(2.0, 0.4), Known { kt: None, ..known });
        assert!((found[0].uncertainty - 0.25).abs() < 1e-12 && !found[0].resolved);
        assert_eq!(found[0].shown(), found[0].bound());
    }

    #[test]
    fn noise_is_no_distance() {
        let of = |g: Vec<f64>, e: f64| Structure { weights: vec![1.0; g.len()], errors: vec![e; g.len()], g };
        let n = 400;
        // Differences of ±2e as noise of two functions with errors e would on average, but for their spread.
        let wobble = |k: usize| if k.is_multiple_of(2) { 0.01 } else { -0.01 };
        let a = of((0..n).map(|k| 1.0 + 2f64.sqrt() * wobble(k)).collect(), 0.01);
        let b = of(vec![1.0; n], 0.01);
        let [d, error] = distance(&a, &b);
        assert!(d < 1e-9 && error > 0.0, "{d} {error}");
        // A shift by a tenth is seen as one.
        let shifted = of(vec![1.1; n], 0.001);
        let [d, error] = distance(&shifted, &of(vec![1.0; n], 0.001));
        assert!((d - 0.1).abs() < 1e-3 && error < 1e-3, "{d} {error}");
    }
}
