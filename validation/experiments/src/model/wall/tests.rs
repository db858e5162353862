//! Walls whose answer is known, in place of runs; profiles and scenes by hand.

use super::runs::{both, split};
use super::search::{angle, attracts};
use super::*;
use crate::model::slabs::Setting;
use crate::shipped::{SET6, SPLINE, STANDARD};
use psidpd_dynamics::scene::Scene;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

const UNITS: Units = Units { kt: 1.0, range: 1.0, density: 6.0, dt: 0.04 };

/// A wall whose cosine is a curve of the strength, with noise of the standard error 0.014, uniform within ±0.024.
struct Known {
    curve: fn(f64) -> f64,
    /// Films leave walls with a lower cosine.
    leaves: f64,
    /// The ridge differs from Young's law by so many degrees.
    ridge_off: f64,
    vapour: f64,
    rng: StdRng,
    asked: Vec<f64>,
}

const TENSION: f64 = 7.5;

impl Known {
    fn new(curve: fn(f64) -> f64, seed: u64) -> Known {
        let rng = StdRng::seed_from_u64(seed);
        Known { curve, leaves: -0.95, ridge_off: 0.0, vapour: 0.0, rng, asked: Vec::new() }
    }

    fn film(&mut self, strength: f64, error: f64) -> Film {
        self.asked.push(strength);
        let exact = (self.curve)(strength);
        let cosine = exact + 3f64.sqrt() * error * self.rng.random_range(-1.0..1.0);
        // γ_WL = γ_WV − γ_LV cos θ
        let liquid = Measured { value: self.vapour - TENSION * cosine, error: TENSION * error };
        Film {
            liquid: (exact > self.leaves).then_some(liquid),
            vapour: self.vapour.into(),
            surface: 0.3 / strength,
        }
    }
}

impl Instrument for Known {
    fn units(&self) -> Units {
        UNITS
    }

    fn slab(&mut self) -> Result<Slab, Trouble> {
        Ok(Slab { tension: TENSION.into(), density: 6.0.into() })
    }

    fn films(&mut self, strengths: [f64; 2]) -> Result<[Film; 2], Trouble> {
        Ok(strengths.map(|strength| self.film(strength, 0.014)))
    }

    fn result(&mut self, strength: f64, surface: f64, _: u64) -> Result<(Film, Measured), Trouble> {
        // That of a wall of about this strength.
        assert!((surface * strength / 0.3 - 1.0).abs() < 0.5, "{surface} {strength}");
        let film = self.film(strength, 0.005);
        let exact = (self.curve)(strength).clamp(-1.0, 1.0).acos().to_degrees();
        Ok((film, Measured { value: exact + self.ridge_off, error: 1.0 }))
    }
}

fn sought(angle: f64) -> Sought {
    let model = Model::parse("m.toml", SET6).unwrap();
    Sought { model_file: "m.toml".into(), model, kt: 1.0, density: None, angle, seed: 1 }
}

fn of(known: &mut Known, angle: f64) -> Found {
    wall_by(&sought(angle), known, &mut |_| ()).unwrap()
}

/// As that of Warren's set 6, and one that is steep, one that is flat and far from the first guess.
const CURVES: [fn(f64) -> f64; 3] =
    [|s| -1.63 + 1.07 * s + 1.24 * s * s - 0.05 * s * s * s, |s| -2.5 + 8.0 * s.sqrt(), |s| -1.4 + 0.9 * s];

/// The line has a standard error of a degree at most; noise is bounded, and the seeds are given.
#[test]
fn the_wall_is_found_through_noise() {
    for curve in CURVES {
        for wanted in [30.0, 60.0, 90.0, 120.0, 150.0] {
            for seed in 0..20 {
                let mut known = Known::new(curve, seed);
                known.vapour = 0.4;
                let found = of(&mut known, wanted);
                let exact = curve(found.strength).acos().to_degrees();
                assert!((exact - wanted).abs() < 3.5, "{wanted}, seed {seed}: {exact} {:?}", found.trials);
                assert!(found.good && found.refusal.is_none(), "{wanted}, seed {seed}: {found:?}");
                assert!(known.asked.len() <= 20, "{wanted}, seed {seed}: {:?}", known.asked);
            }
        }
    }
}

/// The spline's half-space attracts from some distance on, though the spline repels on the whole, as one must for a liquid to last.
#[test]
fn what_attracts_is_known() {
    let attracts = |text: &str| attracts(&Model::parse("m.toml", text).unwrap().at(1.0).unwrap());
    assert_eq!([SET6, SPLINE].map(attracts), [true; 2]);
    assert_eq!(
        [STANDARD, include_str!("../../../../models/van-der-waals-3d.toml")].map(attracts),
        [false; 2]
    );
}

/// Both routes must have the angle.
#[test]
fn a_ridge_of_another_shape_is_a_miss() {
    let mut known = Known::new(CURVES[0], 3);
    known.ridge_off = 6.0;
    let found = of(&mut known, 70.0);
    assert!(!found.good && found.refusal.is_some());
    assert!(found.meets(found.young) && !found.meets(found.ridge));
    // An angle that is hardly known meets nothing.
    let at = |value: f64, error: f64| found.meets(Measured { value, error });
    assert_eq!([at(70.0, 2.9), at(70.0, 3.1), at(75.5, 2.9), at(76.1, 2.9)], [true, false, true, false]);
    assert!(!found.meets(Measured::NONE));
}

#[test]
fn what_no_wall_has_is_refused_with_the_nearest() {
    let found = of(&mut Known::new(|s| 0.2 - (-s).exp(), 1), 60.0);
    assert!(!found.good && found.strength.is_nan());
    let why = found.refusal.clone().unwrap();
    assert!(why.contains("nearest") && why.contains("strength = 4"), "{why}");
    assert_eq!(found.lines("\"zlo\"", None), None);
    // A film that leaves every wall.
    let found = of(&mut Known::new(|_| -1.0, 1), 150.0);
    assert!(found.refusal.unwrap().contains("leaves"));
}

#[test]
fn angles_have_the_errors_of_their_cosines() {
    let found = angle(Some(Measured { value: 0.5, error: 0.01 }));
    // dθ = dc/sin θ
    let expected = (0.01f64 / 0.75f64.sqrt()).to_degrees();
    assert!((found.value - 60.0).abs() < 1e-9 && (found.error - expected).abs() < 1e-3, "{found:?}");
    assert_eq!(angle(None).value, 180.0);
    assert_eq!(angle(Some(Measured { value: 1.3, error: 0.1 })).value, 0.0);
    assert_eq!([rounded(1.23456), rounded(0.0123456)], [1.235, 0.01235]);
}

/// A film on the lower wall of a box of height 11, its surface at 5: tensions −3, 7 and 0.5; and the same upside down.
#[test]
fn tensions_are_split_between_the_film_and_the_vapour() {
    let places: Vec<f64> = (0..110).map(|k| 0.1 * f64::from(k) + 0.05).collect();
    let step = |z: f64, at: f64| if z > at { 1.0 } else { 0.0 };
    let lower = |z: f64| -3.0 * step(z, 0.4) + 7.0 * step(z, 5.0) + 0.5 * step(z, 10.6);
    let upper = |z: f64| 0.5 * step(z, 0.4) + 7.0 * step(z, 6.0) - 3.0 * step(z, 10.6);
    let integral = |f: &dyn Fn(f64) -> f64| -> Vec<(f64, Measured)> {
        places.iter().map(|z| (*z, Measured { value: f(*z), error: 0.02 * z })).collect()
    };
    // The pressure of the particles, kT = 0.7, with a gap at the face.
    let ideal_of = |pressure: f64, low: f64, high: f64| -> Vec<(f64, Measured)> {
        let of = |z: f64| if (low..high).contains(&z) { pressure } else { 0.01 };
        places.iter().map(|z| (*z, of(*z).into())).collect()
    };
    let ideal = |low: f64, high: f64| ideal_of(4.2, low, high);
    let whole = Measured { value: 4.5, error: 0.22 };
    let film = |integral: Vec<(f64, Measured)>, ideal: Vec<(f64, Measured)>| {
        split((&integral, whole), &ideal, [11.0, 5.0], 4.2)
    };
    for found in [film(integral(&lower), ideal(0.15, 5.0)), film(integral(&upper), ideal(6.0, 10.85))] {
        let liquid = found.liquid.unwrap();
        assert!((liquid.value + 3.0).abs() < 1e-9 && (found.vapour.value - 0.5).abs() < 1e-9, "{found:?}");
        assert!(liquid.error > 0.03 && liquid.error < 0.22, "{found:?}");
        // Nothing up to 0.15: as much is missing from a liquid that begins at the face.
        assert!((found.surface - 0.15).abs() < 0.06, "{found:?}");
        // cos θ = (0.5 + 3)/7
        let slab = Slab { tension: 7.0.into(), density: 6.0.into() };
        assert!((found.cosine(&slab).unwrap().value - 0.5).abs() < 1e-9);
    }
    assert_eq!(film(integral(&lower), ideal(3.0, 8.0)).liquid, None);
    // A gap of 0.29 is that of a wall; a film nine tenths as dense as the liquid is one, one of seven tenths is not.
    for (part, is_film) in [(0.9, true), (0.7, false)] {
        for (f, low, high) in [(&lower as &dyn Fn(f64) -> f64, 0.29, 5.0), (&upper, 6.0, 10.71)] {
            let found = film(integral(f), ideal_of(part * 4.2, low, high));
            assert_eq!(found.liquid.is_some(), is_film, "{part} {low}");
        }
    }
}

/// Two films on either side of a cosine, whose line has an error of 0.01 there: within a degree of 90, where a degree is 0.017, and not
/// of 160, where it is 0.006.
#[test]
fn a_degree_is_less_of_a_cosine_near_its_ends() {
    let asked = |wanted: f64| {
        let goal = wanted.to_radians().cos();
        let at = |strength: f64, off: f64| Trial {
            strength,
            cosine: Some(Measured { value: goal + off, error: 0.014 }),
            surface: 0.3,
        };
        let mut trials = vec![at(0.8, -0.02), at(0.82, 0.02)];
        let mut known = Known::new(|s| -1.4 + 0.9 * s, 1);
        let slab = known.slab().unwrap();
        let _ = search::search(wanted, &slab, &mut known, &mut trials, &mut |_| ()).unwrap();
        known.asked.len()
    };
    assert_eq!(asked(90.0), 0);
    assert!(asked(160.0) > 0);
}

/// Means have the error of two, and a film that left the wall leaves no tension.
#[test]
fn two_films_are_averaged() {
    let film = |liquid: f64, surface: f64| Film {
        liquid: Some(Measured { value: liquid, error: 0.3 }),
        vapour: Measured { value: 0.5 * liquid, error: 0.4 },
        surface,
    };
    let found = both([film(-3.0, 0.2), film(-5.0, 0.3)]);
    let liquid = found.liquid.unwrap();
    assert!((liquid.value + 4.0).abs() < 1e-12 && (found.vapour.value + 2.0).abs() < 1e-12, "{found:?}");
    assert!((liquid.error - 0.3 / 2f64.sqrt()).abs() < 1e-12 && (found.surface - 0.25).abs() < 1e-12);
    assert!((found.vapour.error - 0.4 / 2f64.sqrt()).abs() < 1e-12, "{found:?}");
    assert_eq!(both([film(-3.0, 0.2), Film { liquid: None, ..film(-5.0, 0.3) }]).liquid, None);
}

fn known_film() -> Film {
    Known::new(CURVES[0], 1).film(0.8, 0.01)
}

/// The scenes are valid, in units of kT 0.7 and a range of 2, and the wall is as strong as it is said.
#[test]
fn scenes_have_the_wall() {
    let folder = tempfile::tempdir().unwrap();
    let long = SET6.replace("range    = 1.0", "range    = 2.0");
    std::fs::write(folder.path().join("m.toml"), long).unwrap();
    let units = Units { kt: 0.7, range: 2.0, density: 0.75, dt: 0.1 };
    let parsed = |setting: &Setting| {
        let text = setting.text("m.toml", units.kt, 5);
        Scene::parse("s.toml", &text, folder.path()).unwrap_or_else(|error| panic!("{error:?}\n{text}"))
    };
    for strength in [0.8, 1.234] {
        let scene = parsed(&Setting::film(strength, 100.0, &units));
        let fluid = scene.model.at(0.7).unwrap();
        let [lower, upper] = &fluid.walls[..] else { panic!("{:?}", fluid.walls) };
        assert_eq!([lower, upper].map(|wall| wall.wall.surface.face().unwrap().1), [false, true]);
        assert_eq!(
            [lower.wall.density, lower.wall.strength, upper.wall.strength],
            [0.75, strength, strength]
        );
        assert_eq!(scene.domain.lengths(), [12.0, 12.0, 22.0]);
        // A film 10 thick in a box of 12 × 12.
        let expected = 0.75 * 10.0 * 144.0;
        assert!((scene.initial.count() as f64 / expected - 1.0).abs() < 0.1, "{}", scene.initial.count());
    }
    assert!(parsed(&Setting::slab(&units)).model.at(0.7).unwrap().walls.is_empty());
    for wanted in ANGLES {
        let found = Found { wanted, strength: 0.8, ..of(&mut Known::new(CURVES[0], 1), 90.0) };
        let found = Found { units, ..found };
        let found = Found { film: Some(Film { surface: 0.21, ..known_film() }), ..found };
        let text = found.scene(("m.toml", Some(7.0)), 3, "psidpd model wall m.toml").unwrap();
        let scene = Scene::parse("s.toml", &text, folder.path()).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
        let fluid = scene.model.at(0.7).unwrap();
        assert_eq!((fluid.walls.len(), fluid.walls[0].wall.strength), (1, 0.8));
        assert!(text.contains("surface = 0.21"), "{text}");
        assert!(fluid.walls[0].wall.drag[0].is_some_and(|gamma| gamma > 0.0), "its liquid does not slip");
    }
}

#[test]
fn only_liquids_beside_their_vapour_have_walls() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("m.toml");
    let refused = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let model = Model::open(&file).unwrap();
        let sought = Sought { model_file: file.clone(), model, ..sought(60.0) };
        wall(&sought, &mut |_| ()).unwrap_err().to_string()
    };
    let why = refused(STANDARD);
    assert!(why.contains("do not attract"), "{why}");
    let weak = SET6.replace("A  = -40.0", "A  = -4.0");
    assert!(weak != SET6);
    let why = refused(&weak);
    assert!(why.contains("--density"), "{why}");
    let why = refused(include_str!("../../../../models/van-der-waals-2d.toml"));
    assert!(why.contains("three dimensions"), "{why}");
}
