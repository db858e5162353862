//! Merged models against the liquids that they are made of; tensions whose answer is known, in place of runs; layers by hand.

use super::*;
use crate::shipped::{SET6, SPLINE};
use psidpd_core::engine::{Engine, Instructions, Particles, PeriodicBox, Precision, Request, Settings, Want};
use psidpd_core::model::Model;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::num::NonZeroUsize;
use std::path::Path;

const SOFTER: &str = "title = \"softer\"\nspecies = [\"F\"]\n[parameters]\nA = -25.0\nB = 15.0\n[density.n]\nkernel = \"quadratic\"\n\
    range = 0.75\n[excess_free_energy]\nF = \"B/10*n + 1e-1*B*n_F^2\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\n\
    strength = \"A\"\nrange = 1.0\n[[thermostat]]\ngamma = 6.0\nrange = 1.0\n";

fn liquid(folder: &Path, name: &str, text: &str) -> Result<Liquid, ExperimentError> {
    let file = folder.join(format!("{name}.toml"));
    std::fs::write(&file, text).unwrap();
    Liquid::open(name, &file)
}

fn merged([a, b]: [&str; 2], cross: f64) -> Model {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("one", a), ("two", b)].map(|(name, text)| liquid(folder.path(), name, text).unwrap());
    let text = merge::text([&a, &b], 0.7, cross, "A comment\n\nof lines").unwrap();
    assert!(text.starts_with("# A comment\n#\n# of lines\n"), "{text}");
    Model::parse("mixture.toml", &text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The energy of 400 particles, of which every third is of the second species if there is one, and the forces on them.
fn energy(model: &Model, species: impl Fn(usize) -> i32) -> (f64, Vec<[f64; 3]>) {
    const COUNT: usize = 400;
    let mut rng = StdRng::seed_from_u64(11);
    let x: Vec<[f64; 3]> = (0..COUNT).map(|_| [(); 3].map(|()| rng.random_range(0.0..4.0))).collect();
    let tag: Vec<i32> = (1..=COUNT as i32).collect();
    let kind: Vec<i32> = (0..COUNT).map(species).collect();
    let settings = Settings {
        precision: Precision::Double,
        instructions: Instructions::best(),
        threads: NonZeroUsize::MIN,
    };
    let mut engine = Engine::new(&model.at(0.7).unwrap(), settings).unwrap();
    let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
    let mut forces = vec![[0.0; 3]; COUNT];
    let particles = Particles { owned: COUNT, x: &x, tag: &tag, kind: &kind };
    let request = Request { particles, v: &[], step: None, want: Want::TOTALS };
    let totals = engine.forces(&domain, &request, &mut forces, false).unwrap();
    (totals.energy(), forces)
}

/// A liquid and itself are one liquid, whatever its particles are called: energy and forces of random particles.
#[test]
fn a_liquid_mixed_with_itself_is_itself() {
    for text in [SET6, SPLINE, SOFTER] {
        let (expected, forces) = energy(&Model::parse("m.toml", text).unwrap(), |_| 0);
        let (found, of_both) = energy(&merged([text, text], 1.0), |k| i32::from(k % 3 == 0));
        assert!((found - expected).abs() < 1e-10 * expected.abs(), "{found} {expected}");
        for (a, b) in forces.iter().flatten().zip(of_both.iter().flatten()) {
            assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
        }
    }
}

/// In a mixture of two liquids particles of one alone have its energy; `cross` multiplies half the sum of both pair potentials.
#[test]
fn each_liquid_keeps_its_own_and_cross_is_between_them() {
    let both = merged([SET6, SOFTER], 0.6);
    for (k, text) in [SET6, SOFTER].into_iter().enumerate() {
        let (expected, _) = energy(&Model::parse("m.toml", text).unwrap(), |_| 0);
        let (found, _) = energy(&both, |_| k as i32);
        assert!((found - expected).abs() < 1e-10 * expected.abs(), "{found} {expected}");
    }
    let fluid = both.at(0.7).unwrap();
    assert_eq!(fluid.densities.len(), 1, "both count their particles by one kernel");
    // Of one range the formulas of both strengths are added up, of two, and of another form, each has its own potential.
    let apart = SOFTER.replace("strength = \"A\"\nrange = 1.0", "strength = \"A - 10\"\nrange = 0.8");
    let formula =
        SOFTER.replace("form = \"soft\"\nstrength = \"A\"", "form = \"expression\"\nphi = \"A/2*(1 - r)^2\"");
    assert!(apart != SOFTER && formula.contains("phi"));
    for fluid in [
        &fluid,
        &merged([SET6, &apart], 0.6).at(0.7).unwrap(),
        &merged([SET6, &formula], 0.6).at(0.7).unwrap(),
    ] {
        let at = |a: usize, b: usize, r: f64| -> f64 {
            use psidpd_core::model::pair::PairForm as _;
            fluid.pairs.iter().filter(|t| t.acts(a, b, 0.0)).map(|t| t.potential.at(r).0).sum()
        };
        for r in [0.1, 0.5, 0.9] {
            let expected = 0.6 * 0.5 * (at(0, 0, r) + at(1, 1, r));
            assert!((at(0, 1, r) - expected).abs() < 1e-12, "{r}: {} {expected}", at(0, 1, r));
        }
    }
    let gammas: Vec<f64> = fluid.thermostats.iter().map(|t| t.unwrap().gamma).collect();
    assert_eq!(gammas, [18.0, 12.0, 12.0, 6.0]);
    // Of another range the local density is another.
    let other = SOFTER.replace("range = 0.75", "range = 0.8");
    assert_eq!(merged([SET6, &other], 1.0).at(0.7).unwrap().densities.len(), 2);
}

#[test]
fn what_cannot_be_mixed_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str| liquid(folder.path(), "m", text).unwrap_err().to_string();
    let two_densities = include_str!("../../../../models/warren2003-set6-two-densities.toml");
    for (text, why) in [
        (two_densities, "no pair potentials"),
        (include_str!("../../../../models/binary-2d.toml"), "one species in three dimensions"),
        (include_str!("../../../../models/power-law-k3-corrected.toml"), "no pair potentials"),
        (&SOFTER.replace("range = 0.75", "range = 0.75\ncorrection = [1.5, 1.0]"), "correction of a density"),
    ] {
        let said = refused(text);
        assert!(said.contains(why) && said.contains("m.toml"), "{said}");
    }
    let units = |length: f64| format!("{SOFTER}[units]\nlength = {length:e}\nmass = 2e-25\nenergy = 4e-21\n");
    let of = |text: &str, name: &str| liquid(folder.path(), name, text).unwrap();
    let [plain, small, large] = [of(SOFTER, "plain"), of(&units(1e-9), "small"), of(&units(2e-9), "large")];
    let said = merge::units([&small, &large]).unwrap_err().to_string();
    assert!(said.contains("units of length differ") && said.contains("--rc 1e-9"), "{said}");
    assert!(merge::units([&plain, &small]).unwrap_err().to_string().contains("has none"));
    let heavy = of(&units(1e-9).replace("mass = 2e-25", "mass = 3e-25"), "heavy");
    assert!((merge::units([&small, &heavy]).unwrap().1 - 1.5).abs() < 1e-12);
    for (names, why) in
        [(["a", "a"], "both liquids are called a"), (["a b", "c"], "\"a b\""), (["a", ""], "\"\"")]
    {
        let mut sought = sought(folder.path(), 8.0);
        (0..2).for_each(|k| sought.liquids[k].name = names[k].into());
        let said = super::mixture(&sought, &mut |_| ()).unwrap_err().to_string();
        assert!(said.contains(why) && said.contains("--species"), "{said}");
    }
    // One name for both, or one that no species can have, is an error of the model.
    for name in ["small", "a b"] {
        let mut other = small.clone();
        other.name = name.into();
        let text = merge::text([&small, &other], 1.0, 1.0, "").unwrap();
        assert!(Model::parse("mixture.toml", &text).is_err(), "{text}");
    }
}

const OWN: [f64; 2] = [11.6, 2.9];

/// Liquids whose tension is a curve of the strength, with bounded noise of a standard error of one percent of the sum.
struct Known {
    own: [f64; 2],
    curve: fn(f64) -> f64,
    /// Longer runs have a tension that differs by so much.
    off: f64,
    rng: StdRng,
    asked: Vec<f64>,
}

impl Known {
    fn new(curve: fn(f64) -> f64, seed: u64) -> Known {
        Known { own: OWN, curve, off: 0.0, rng: StdRng::seed_from_u64(seed), asked: Vec::new() }
    }

    fn layers_of(&mut self, cross: f64, error: f64) -> Layers {
        self.asked.push(cross);
        let value = (self.curve)(cross) + 3f64.sqrt() * error * self.rng.random_range(-1.0..1.0);
        Layers { tension: Measured { value, error }, dissolved: [Measured::from(0.0); 2] }
    }
}

impl Instrument for Known {
    fn alone(&mut self) -> Result<[Slab; 2], Trouble> {
        Ok(self.own.map(|tension| Slab { tension: tension.into(), density: 6.0.into() }))
    }

    fn layers(&mut self, cross: [f64; 2]) -> Result<[Layers; 2], Trouble> {
        Ok(cross.map(|cross| self.layers_of(cross, 0.14)))
    }

    fn result(&mut self, cross: f64, _: u64) -> Result<Layers, Trouble> {
        let mut layers = self.layers_of(cross, 0.05);
        layers.tension.value += self.off;
        Ok(layers)
    }
}

fn sought(folder: &Path, tension: f64) -> Sought {
    let of = |name: &str| liquid(folder, name, SOFTER).unwrap();
    Sought { liquids: [of("a"), of("b")], kt: 1.0, densities: None, tension, seed: 1 }
}

fn of(known: &mut Known, tension: f64) -> Found {
    let folder = tempfile::tempdir().unwrap();
    mixture_by(&sought(folder.path(), tension), known, &mut |_| ()).unwrap()
}

/// As that of water and an oil, and one that is steep.
const CURVES: [fn(f64) -> f64; 2] = [|s| 14.0 - 9.0 * s - 4.0 * s * s, |s| 14.5 - 16.0 * s.powf(0.8)];

#[test]
fn the_attraction_is_found_through_noise() {
    for curve in CURVES {
        for wanted in [2.5, 5.0, 8.0, 12.0] {
            for seed in 0..20 {
                let mut known = Known::new(curve, seed);
                let found = of(&mut known, wanted);
                let exact = curve(found.cross);
                assert!(found.good && found.refusal.is_none(), "{wanted}, seed {seed}: {found:?}");
                assert!((exact / wanted - 1.0).abs() < 0.075, "{wanted}, seed {seed}: {exact}");
                // A small tension needs all pairs, twice.
                let most = if wanted < 5.0 { 30 } else { 20 };
                assert!(known.asked.len() <= most, "{wanted}, seed {seed}: {:?}", known.asked);
            }
        }
    }
}

#[test]
fn what_no_mixture_has_is_refused_with_the_nearest() {
    // The sum of both tensions, at which the liquids do not touch.
    let mut known = Known::new(CURVES[0], 1);
    let found = of(&mut known, 14.6);
    assert!(!found.good && found.refusal.unwrap().contains("do not touch") && known.asked.is_empty());
    // A tension that stays above the wanted one.
    let found = of(&mut Known::new(|s| 5.0 + 5.0 * (-s).exp(), 1), 3.0);
    let why = found.refusal.clone().unwrap();
    assert!(!found.good && why.contains("nearest") && found.cross.is_nan(), "{why}");
    // The nearest of those that stay above it, and of those that stay below it.
    let curves: [fn(f64) -> f64; 2] = [|s| 5.0 + 5.0 * (-s).exp(), |s| 9.0 - 2.0 * s];
    for (curve, wanted) in curves.into_iter().zip([3.0, 13.0]) {
        let mut known = Known::new(curve, 1);
        let found = of(&mut known, wanted);
        // By what noise may add.
        let off = |cross: f64| (curve(cross) - wanted).abs();
        let least = known.asked.iter().map(|cross| off(*cross)).fold(f64::INFINITY, f64::min);
        let [near, far]: [Vec<f64>; 2] =
            known.asked.iter().partition(|cross| off(**cross) < least + 0.5).into();
        let why = found.refusal.unwrap();
        let says = |cross: &f64| why.contains(&format!("the nearest: cross = {cross:.3}:"));
        assert!(near.iter().any(says) && !far.is_empty(), "{near:?} {far:?}: {why}");
    }
    // Longer runs that disagree.
    let mut known = Known { off: 1.5, ..Known::new(CURVES[0], 1) };
    let found = of(&mut known, 8.0);
    assert!(!found.good && found.refusal.unwrap().contains("not within"));
}

/// What has no tension beside its vapour is no liquid, whichever of both it is.
#[test]
fn what_is_no_liquid_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (own, name) in [([f64::NAN, 2.9], "a"), ([11.6, -0.1], "b"), ([0.0, 2.9], "a")] {
        let mut known = Known { own, ..Known::new(CURVES[0], 1) };
        let said = mixture_by(&sought(folder.path(), 8.0), &mut known, &mut |_| ()).unwrap_err().to_string();
        assert!(said.contains(&format!("{name} has a tension")) && said.contains("lower kT"), "{said}");
    }
}

/// The file is that of both liquids at kT, with the strength in it.
#[test]
fn the_file_has_both_liquids() {
    let folder = tempfile::tempdir().unwrap();
    let text = super::text(&sought(folder.path(), 8.0), 0.375, "found today").unwrap();
    let model = Model::parse("mixture.toml", &text).unwrap();
    assert_eq!(model.species(), ["a", "b"]);
    assert!(text.contains("found today") && text.contains("0.375"), "{text}");
}

/// Tensions are in the unit of the models, energy over length²: what is 8 in it is found as 8 of it.
#[test]
fn tensions_have_the_unit_of_the_models() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{SOFTER}[units]\nlength = 2e-9\nmass = 2e-25\nenergy = 4e-21\n");
    let of = |name: &str| liquid(folder.path(), name, &text).unwrap();
    let sought = Sought { liquids: [of("a"), of("b")], kt: 1.0, densities: None, tension: 8e-3, seed: 1 };
    let found = mixture_by(&sought, &mut Known::new(CURVES[0], 1), &mut |_| ()).unwrap();
    assert!((found.unit - 1e-3).abs() < 1e-15 && found.good, "{found:?}");
    assert!(
        (CURVES[0](found.cross) / 8.0 - 1.0).abs() < 0.075 && (found.tension().value - 8e-3).abs() < 1e-3
    );
}

/// A spreading coefficient and a verdict by hand.
#[test]
fn verdicts_are_those_of_the_tension() {
    let mut found = of(&mut Known::new(CURVES[0], 1), 8.0);
    let mut set = |value: f64, error: f64| {
        let tension = Measured { value, error };
        found.layers = Some(Layers { tension, dissolved: [Measured::from(0.0); 2] });
        (found.meets(), found.spreading())
    };
    assert!(set(8.0, 0.2).0 && set(8.4, 0.2).0);
    assert!(!set(8.5, 0.2).0 && !set(7.5, 0.2).0 && !set(8.0, 0.3).0);
    // Of the liquid with the lower tension on the other: 11.6 − 2.9 − 8.
    let (_, (below, coefficient)) = set(8.0, 0.2);
    assert_eq!(below, 0);
    assert!((coefficient.value - 0.7).abs() < 1e-12 && (coefficient.error - 0.2).abs() < 1e-12);
    // All of them in a unit of 0.01 N/m: only the tension that is sought is in it before.
    let mut found = Found { unit: 0.01, wanted: 0.08, ..found };
    let tension = Measured { value: 8.0, error: 0.2 };
    found.layers = Some(Layers { tension, dissolved: [Measured::from(0.0); 2] });
    let (_, coefficient) = found.spreading();
    assert!(found.meets() && (coefficient.value - 0.007).abs() < 1e-12, "{coefficient:?}");
    assert!((coefficient.error - 0.002).abs() < 1e-12, "{coefficient:?}");
}
