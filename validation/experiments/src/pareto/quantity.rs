//! What errors are told of, and how large they are.

use psidpd_observe::{Measured, Observation};
use serde::{Serialize, Serializer};

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Energy of the particles, in kT for each.
    Energy,
    /// Pressures of the conservative forces and of the momentum carried, in ρkT.
    Pressure,
    /// Kinetic and configurational temperature, in kT.
    Temperature,
    /// Coexisting densities, in units of the liquid's.
    Density,
    /// Surface tension, in units of itself.
    Tension,
    /// Diffusion coefficient, in units of itself.
    Diffusion,
    /// Shear viscosity, in units of itself.
    Viscosity,
    /// The distance of g(r): root mean square difference over root mean square, weighed by shells.
    Structure,
}

impl Class {
    pub const ALL: [(&'static str, Class); 8] = [
        ("u", Class::Energy),
        ("p", Class::Pressure),
        ("T", Class::Temperature),
        ("rho", Class::Density),
        ("sigma", Class::Tension),
        ("D", Class::Diffusion),
        ("eta", Class::Viscosity),
        ("g", Class::Structure),
    ];

    pub fn name(self) -> &'static str {
        Class::ALL.iter().find(|(_, class)| *class == self).map_or("", |found| found.0)
    }

    /// What it is in words with its symbol, and the unit of its errors.
    pub fn words(self) -> [&'static str; 2] {
        match self {
            Class::Energy => ["energy per particle u", "% of kT"],
            Class::Pressure => ["pressure p", "% of ρkT"],
            Class::Temperature => ["temperature T", "% of kT"],
            Class::Density => ["coexisting densities ρ", "% of the liquid's"],
            Class::Tension => ["surface tension σ", "%"],
            Class::Diffusion => ["diffusion coefficient D", "%"],
            Class::Viscosity => ["shear viscosity η", "%"],
            Class::Structure => ["radial distribution function g(r)", "%"],
        }
    }

    /// Whether it is a property of configurations alone, which a reference without a time step has.
    pub fn is_of_configurations(self) -> bool {
        !matches!(self, Class::Diffusion | Class::Viscosity)
    }
}

/// Where quantities are among the observations: class, name here, observation, column.
const SCALARS: [(Class, &str, &str, &str); 12] = [
    (Class::Pressure, "p_conservative", "pressure", "conservative"),
    (Class::Pressure, "p_carried", "pressure", "carried"),
    (Class::Temperature, "T_conf", "temperature", "configurational"),
    (Class::Density, "rho_L", "interface_width", "liquid"),
    (Class::Density, "rho_V", "interface_width", "vapour"),
    (Class::Density, "rho_L_drop", "drop", "liquid"),
    (Class::Density, "rho_V_drop", "drop", "vapour"),
    (Class::Tension, "sigma", "surface_tension", "free_energy"),
    (Class::Tension, "sigma_stress", "surface_tension", "stress"),
    (Class::Tension, "sigma_drop", "drop", "tension"),
    (Class::Viscosity, "eta", "viscosity", "viscosity"),
    (Class::Viscosity, "eta_flow", "poiseuille", "viscosity"),
];

/// The names of quantities that a tolerance can be for.
pub fn names() -> impl Iterator<Item = &'static str> {
    ["u", "T_kin", "p_total", "D", "g"].into_iter().chain(SCALARS.iter().map(|(_, name, ..)| *name))
}

#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    pub class: Class,
    pub name: String,
    pub measured: Measured,
}

/// A radial distribution function, for distances.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// Weight of each shell.
    pub weights: Vec<f64>,
    pub g: Vec<f64>,
    pub errors: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantities {
    pub scalars: Vec<Quantity>,
    pub structure: Option<Structure>,
}

impl Quantities {
    /// From what was measured at every sample, by class and name, and what was observed.
    pub fn of(
        sampled: impl IntoIterator<Item = (Class, &'static str, Measured)>,
        observations: &[Observation],
        dimensions: usize,
    ) -> Quantities {
        let mut scalars: Vec<Quantity> = sampled
            .into_iter()
            .map(|(class, name, measured)| Quantity { class, name: name.into(), measured })
            .collect();
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

    /// These quantities as if they were known without error.
    pub fn as_if_exact(&self) -> Quantities {
        let mut same = self.clone();
        same.scalars.iter_mut().for_each(|q| q.measured.error = 0.0);
        same.structure.iter_mut().flat_map(|s| &mut s.errors).for_each(|e| *e = 0.0);
        same
    }

    /// These quantities with the diffusion and viscosities of another run, if there is one.
    pub fn with_dynamics_of(mut self, other: Option<&Quantities>) -> Quantities {
        self.scalars.retain(|q| q.class.is_of_configurations());
        let theirs = other.iter().flat_map(|other| &other.scalars);
        self.scalars.extend(theirs.filter(|q| !q.class.is_of_configurations()).cloned());
        self
    }

    pub fn get(&self, name: &str) -> Option<Measured> {
        self.scalars.iter().find(|q| q.name == name).map(|q| q.measured)
    }
}

/// What is known better than by measuring, and units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    pub kt: f64,
    /// Whether that is the temperature of velocities and configurations: no flow, forces with a potential.
    pub temperature: bool,
    pub ideal_pressure: f64,
}

impl Known {
    /// What is known of a code with another force law, whose temperature is what its own small steps have.
    pub fn of_another_law(self) -> Known {
        Known { temperature: false, ..self }
    }
}

/// The error of a quantity, in the unit of its class, with an error of its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Deviation {
    #[serde(skip)]
    pub class: Class,
    #[serde(skip)]
    pub name: String,
    pub value: f64,
    /// One standard deviation of that, the reference's among it.
    pub error: f64,
    /// Whether the error is larger than two of these.
    pub resolved: bool,
    /// What was measured, in the unit of the model.
    pub measured: Measured,
}

/// How many standard deviations an error is taken to be larger than it was found, where it must be within bounds.
const MARGIN: f64 = 2.0;

impl Deviation {
    pub fn new(class: Class, name: &str, measured: Measured, value: f64, error: f64) -> Deviation {
        Deviation { class, name: name.into(), measured, value, error, resolved: value.abs() > MARGIN * error }
    }

    /// The largest error that is likely: what tolerances bound.
    pub fn bound(&self) -> f64 {
        self.value.abs() + MARGIN * self.error
    }

    /// Where it is on a plot: at its error, or if that is not resolved at what it may be.
    pub fn shown(&self) -> f64 {
        if self.resolved { self.value.abs() } else { self.bound() }
    }

    /// Whether an error of `bound` would be resolved.
    pub fn resolves(&self, bound: f64) -> bool {
        MARGIN * self.error <= bound
    }
}

/// By name; the order of the table is not kept.
pub fn by_name<S: Serializer>(deviations: &[Deviation], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(deviations.iter().map(|d| (&d.name, d)))
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
        let truth = match known.temperature && *class == Class::Temperature {
            true => Some(Measured { value: known.kt, error: 0.0 }),
            false => reference.get(name),
        };
        let Some(truth) = truth else { continue };
        let unit = match class {
            Class::Energy | Class::Temperature => known.kt,
            Class::Pressure => known.ideal_pressure,
            Class::Density => liquid,
            _ => truth.value.abs(),
        };
        if unit > 0.0 && measured.error.is_finite() && truth.error.is_finite() {
            let value = (measured.value - truth.value) / unit;
            let error = measured.error.hypot(truth.error) / unit;
            found.push(Deviation::new(*class, name, *measured, value, error));
        }
    }
    if let (Some(a), Some(b)) = (&run.structure, &reference.structure)
        && a.g.len() == b.g.len()
    {
        let [distance, error] = distance(a, b);
        if distance.is_finite() && error.is_finite() {
            let measured = Measured { value: distance, error };
            found.push(Deviation::new(Class::Structure, "g", measured, distance, error));
        }
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
    use psidpd_observe::{Kind, Series};

    fn run(kinetic: f64, error: f64) -> Quantities {
        Quantities::of([(Class::Temperature, "T_kin", Measured { value: kinetic, error })], &[], 3)
    }

    #[test]
    fn temperatures_are_held_against_what_is_known() {
        let known = Known { kt: 2.0, temperature: true, ideal_pressure: 1.0 };
        let found = deviations(&run(2.1, 0.01), &run(1.9, 0.5), known);
        assert_eq!(found.len(), 1);
        assert!((found[0].value - 0.05).abs() < 1e-12 && (found[0].error - 0.005).abs() < 1e-12);
        assert!(found[0].resolved && (found[0].bound() - 0.06).abs() < 1e-12);
        assert_eq!(found[0].shown(), found[0].value.abs());
        assert!(found[0].resolves(0.0101) && !found[0].resolves(0.0099));
        // Of another law both are uncertain, and kT is not what it has to have.
        let found = deviations(&run(2.1, 0.3), &run(2.0, 0.4), known.of_another_law());
        assert!((found[0].value - 0.05).abs() < 1e-12 && (found[0].error - 0.25).abs() < 1e-12);
        // Against a reference both are uncertain.
        let found = deviations(&run(2.1, 0.3), &run(2.0, 0.4), Known { temperature: false, ..known });
        assert!((found[0].error - 0.25).abs() < 1e-12 && !found[0].resolved);
        assert_eq!(found[0].shown(), found[0].bound());
    }

    /// Energies are in kT, pressures in ρkT, densities in that of the liquid; diffusion is another run's.
    #[test]
    fn every_class_has_its_unit() {
        let of = |u: f64, p: f64, liquid: f64, vapour: f64, d: f64| {
            let exact = |value| Measured { value, error: 0.0 };
            Quantities::of(
                [
                    (Class::Energy, "u", exact(u)),
                    (Class::Pressure, "p_carried", exact(p)),
                    (Class::Density, "rho_L", exact(liquid)),
                    (Class::Density, "rho_V", exact(vapour)),
                    (Class::Diffusion, "D", exact(d)),
                ],
                &[],
                3,
            )
        };
        let reference = of(-26.0, 1.0, 8.0, 0.5, 9.0).with_dynamics_of(Some(&of(0.0, 0.0, 0.0, 0.0, 4.0)));
        let known = Known { kt: 2.0, temperature: true, ideal_pressure: 12.0 };
        let found = deviations(&of(-25.0, 4.0, 8.4, 0.9, 5.0), &reference, known);
        let values: Vec<f64> = found.iter().map(|d| d.value).collect();
        let expected = [0.5, 0.25, 0.05, 0.05, 0.25];
        assert!(values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{values:?}");
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
        // Of a distance of zero the square of its error is what the squares of the noise scatter by, √(2 n) 2 e² of n shells.
        let expected = ((2.0 * n as f64).sqrt() * 2.0 * 1e-4 / n as f64).sqrt();
        assert!((error / expected - 1.0).abs() < 1e-3, "{error} {expected}");
        // A shift by a tenth is seen as one.
        let shifted = of(vec![1.1; n], 0.001);
        let [d, error] = distance(&shifted, &of(vec![1.0; n], 0.001));
        assert!((d - 0.1).abs() < 1e-3, "{d}");
        // The mean of n differences, each ± √2 e, and half of them by the rounding of the sum of squares: √2 · 0.001/√400.
        assert!((error / (2f64.sqrt() * 0.001 / 20.0) - 1.0).abs() < 0.02, "{error}");
    }

    /// Every column of every observable has its own number: what a name stands for is read where it is.
    #[test]
    fn quantities_are_read_where_they_are_observed() {
        let of = |name: &str, columns: &[(&str, f64)]| {
            let new = Observation::new(name, name, Kind::Scalar, &Series::new(1));
            columns.iter().fold(new, |o, (column, value)| {
                o.column(column, "1", [Measured { value: *value, error: 0.01 * value }])
            })
        };
        let observed = [
            of("pressure", &[("conservative", 1.0), ("carried", 2.0), ("total", 3.0)]),
            of("temperature", &[("kinetic", 4.0), ("configurational", 5.0)]),
            of("interface_width", &[("liquid", 6.0), ("vapour", 7.0), ("width", 8.0)]),
            of("drop", &[("liquid", 9.0), ("vapour", 10.0), ("tension", 11.0), ("radius", 12.0)]),
            of("surface_tension", &[("stress", 13.0), ("free_energy", 14.0)]),
            of("viscosity", &[("viscosity", 15.0)]),
            of("poiseuille", &[("viscosity", 16.0)]),
            of("diffusion", &[("diffusion", 17.0), ("diffusion_B", 18.0)]),
        ];
        let found =
            Quantities::of([(Class::Energy, "u", Measured { value: -1.0, error: 0.1 })], &observed, 3);
        let expected = [
            ("u", "u", -1.0),
            ("p", "p_conservative", 1.0),
            ("p", "p_carried", 2.0),
            ("T", "T_conf", 5.0),
            ("rho", "rho_L", 6.0),
            ("rho", "rho_V", 7.0),
            ("rho", "rho_L_drop", 9.0),
            ("rho", "rho_V_drop", 10.0),
            ("sigma", "sigma", 14.0),
            ("sigma", "sigma_stress", 13.0),
            ("sigma", "sigma_drop", 11.0),
            ("eta", "eta", 15.0),
            ("eta", "eta_flow", 16.0),
            ("D", "D", 17.0),
            ("D", "D_B", 18.0),
        ];
        for (class, name, value) in expected {
            let q = found.scalars.iter().find(|q| q.name == name).unwrap_or_else(|| panic!("{name}"));
            let error = if name == "u" { 0.1 } else { 0.01 * value };
            assert_eq!((q.class.name(), q.measured), (class, Measured { value, error }), "{name}");
            // A tolerance for the kind, and for it alone, is one for this.
            let d = Deviation::new(q.class, name, q.measured, 0.0, 0.0);
            for (kind, _) in Class::ALL {
                let tolerance: super::super::Tolerance = format!("{kind}=1%").parse().unwrap();
                assert_eq!(tolerance.applies(&d), kind == class || kind == name, "{kind} {name}");
            }
        }
        assert_eq!(found.scalars.len(), expected.len());
        // What is known to nobody's error is not known.
        let vague = [of("pressure", &[("carried", f64::NAN)])];
        assert!(Quantities::of([], &vague, 3).scalars.is_empty());

        // Diffusion and viscosities are another run's, or nobody's.
        let other = Quantities::of(
            [],
            &[of("viscosity", &[("viscosity", 25.0)]), of("pressure", &[("carried", 26.0)])],
            3,
        );
        let mixed = found.clone().with_dynamics_of(Some(&other));
        let values =
            ["eta", "p_carried", "sigma", "D", "eta_flow"].map(|name| mixed.get(name).map(|m| m.value));
        assert_eq!(values, [Some(25.0), Some(2.0), Some(14.0), None, None]);
        let none = found.clone().with_dynamics_of(None);
        assert!(none.get("eta").is_none() && none.scalars.len() == expected.len() - 4);
        let exact = found.as_if_exact();
        assert!(
            exact.scalars.iter().all(|q| q.measured.error == 0.0) && exact.get("rho_L").unwrap().value == 6.0
        );
    }

    /// Two shells, at r = 1 and 2, of which the second alone is off, by a half of one: its weight is r^(d − 1), so the distance is
    /// ½ √(4/5) in space, ½ √(2/3) in the plane.
    #[test]
    fn shells_count_by_their_size() {
        let of = |g: [f64; 2], dimensions: usize| {
            let rdf =
                Observation::new("rdf", "g", Kind::Curve, &Series::new(1)).against("r", "1", vec![1.0, 2.0]);
            let known = g.map(|value| Measured { value, error: 1e-9 });
            Quantities::of([], &[rdf.column("g", "1", known)], dimensions)
        };
        let known = Known { kt: 2.0, temperature: true, ideal_pressure: 1.0 };
        for (dimensions, share) in [(3, 0.8f64), (2, 2.0 / 3.0)] {
            let found = deviations(&of([1.0, 1.5], dimensions), &of([1.0, 1.0], dimensions), known);
            assert!(found.len() == 1 && found[0].name == "g" && found[0].class == Class::Structure);
            assert!((found[0].value - 0.5 * share.sqrt()).abs() < 1e-6, "{found:?}");
        }
    }
}
