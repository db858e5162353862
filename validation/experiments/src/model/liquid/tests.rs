//! Liquids whose answer is known, by fluids that are known in place of runs; the units by hand; and runs of a fluid that is published.

use super::fluid::{RANGE, USUAL};
use super::sheet::BOLTZMANN;
use super::*;
use psidpd_core::model::Model;
use psidpd_core::theory::MeanField;

fn entries(all: &[(&str, f64)]) -> Entries {
    let mut entries = Entries::default();
    all.iter().for_each(|(key, value)| entries.set(key, *value).unwrap());
    entries
}

/// Water at 25 °C, by tables of IAPWS.
const WATER: [(&str, f64); 6] = [
    ("density", 997.05),
    ("tension", 0.07197),
    ("compressibility", 4.525e-10),
    ("viscosity", 8.90e-4),
    ("temperature", 298.15),
    ("molar_mass", 0.0180153),
];

fn water(more: &[(&str, f64)]) -> Result<Liquid, LiquidError> {
    water_without(&[], more)
}

fn water_without(keys: &[&str], more: &[(&str, f64)]) -> Result<Liquid, LiquidError> {
    let rest = WATER.iter().filter(|(key, _)| !keys.contains(key)).chain(more);
    Liquid::new("water", &entries(&rest.copied().collect::<Vec<_>>()))
}

/// A liquid with the usual density and this number of particles in r_c³.
fn of_number_density(number_density: f64) -> Liquid {
    let all = [("density", 1000.0), ("temperature", 300.0), ("rc", 1e-9), ("number_density", number_density)];
    Liquid::new("w", &entries(&all)).unwrap()
}

fn close(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} {expected}");
}

/// A molecule of water has 0.0180153/(997.05 N_A) = 3.00038e-29 m³, and 1/(n kT κ) of it is 3.00038e-29/(4.116405e-21 · 4.525e-10)
/// = 16.108. With three of them, 18 make the cube of r_c: 5.40068e-28 m³, 0.81435 nm.
#[test]
fn units_are_those_of_si() {
    let liquid = water(&[("molecules", 3.0)]).unwrap();
    close(liquid.units.length, 8.1435e-10, 1e-4);
    close(liquid.units.mass, 3.0 * 2.99151e-26, 1e-4);
    close(liquid.units.energy, 4.116405e-21, 1e-6);
    close(liquid.goals.stiffness.unwrap(), 48.32, 1e-3);
    close(liquid.goals.tension.unwrap(), 0.07197 * 8.1435e-10 * 8.1435e-10 / 4.116405e-21, 1e-3);
    // η r_c³/(kT τ), with τ = r_c √(m/kT).
    let time = 8.1435e-10 * (8.97453e-26f64 / 4.116405e-21).sqrt();
    close(liquid.goals.viscosity.unwrap(), 8.90e-4 * 5.40068e-28 / (4.116405e-21 * time), 1e-3);
    close(liquid.molecules().unwrap(), 3.0, 1e-9);
    // The other ways to say the same size.
    let of_rc = water(&[("rc", 8.14354e-10)]).unwrap();
    close(of_rc.molecules().unwrap(), 3.0, 1e-3);
    let drop = water(&[("drop", 2e-8), ("particles", 4.18879e-24 / 9.00114e-29)]).unwrap();
    close(drop.molecules().unwrap(), 3.0, 1e-3);
    // c² = 1/ρκ.
    let fast = water_without(&["compressibility"], &[("sound_speed", 1488.8), ("molecules", 3.0)]).unwrap();
    close(fast.goals.stiffness.unwrap(), 48.32, 1e-3);
}

#[test]
fn data_sheets_that_cannot_be_used_are_refused() {
    let density = ("density", 997.0);
    let of = |all: &[(&str, f64)]| Liquid::new("w", &entries(all)).unwrap_err();
    assert!(matches!(of(&[("rc", 1e-9)]), LiquidError::Missing { key: "density", .. }));
    assert_eq!(of(&[density, ("temperature", 300.0)]), LiquidError::NoSize);
    let size = ("molecules", 3.0);
    assert!(matches!(of(&[density, size]), LiquidError::Missing { key: "molar_mass", .. }));
    assert!(matches!(of(&[density, ("drop", 1e-8)]), LiquidError::Missing { key: "particles", .. }));
    assert_eq!(of(&[density, size, ("rc", 1e-9)]), LiquidError::Twice("molecules", "rc"));
    assert!(matches!(
        of(&[density, ("rc", 1e-9), ("viscosity", 1e-3)]),
        LiquidError::Missing { key: "temperature", .. }
    ));
    let both = [density, ("rc", 1e-9), ("compressibility", 4e-10), ("sound_speed", 1500.0)];
    assert_eq!(of(&both), LiquidError::Twice("compressibility", "sound_speed"));
    let mut entries = Entries::default();
    // Grams in a cubic centimetre, degrees Celsius, and numbers that are none.
    for (key, value) in
        [("density", 0.997), ("temperature", -3.0), ("molar_mass", f64::NAN), ("tension", -0.07)]
    {
        let why = entries.set(key, value).unwrap_err();
        assert!(matches!(why, LiquidError::Range { .. }) && why.to_string().contains("SI"), "{why}");
    }
    assert_eq!(entries.set("colour", 1.0), Err(LiquidError::Unknown("colour".into())));
}

#[test]
fn files_have_the_same_numbers_and_say_where_they_are_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("water.toml");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Entries::read(&path)
    };
    let found = read("density = 997.0\nsound_speed = 1497.0\n").unwrap();
    assert_eq!((found.get("density"), found.get("sound_speed")), (Some(997.0), Some(1497.0)));
    for (text, line) in
        [("density = 997.0\nhue = 1\n", 2), ("\ndensity = 0.997\n", 2), ("tension = \"high\"\n", 1)]
    {
        assert_eq!(read(text).unwrap_err().line(), line, "{text}");
    }
}

/// What is possible instead is possible.
#[test]
fn impossible_numbers_name_the_nearest_possible_ones() {
    let refused = |liquid: &Liquid| impossible(liquid).pop();
    let stiff = water(&[("molecules", 50.0)]).unwrap();
    let Some(Refusal::TooStiff { nearest_molecules: Some(fewer), .. }) = impossible(&stiff).first().cloned()
    else {
        panic!("{:?}", impossible(&stiff))
    };
    close(fewer, STIFFEST / 16.108, 1e-3);
    assert_eq!(refused(&water(&[("molecules", 0.999 * fewer)]).unwrap()), None);
    let Some(Refusal::TooStiff { nearest_compressibility, nearest_volume, .. }) =
        impossible(&stiff).first().cloned()
    else {
        panic!()
    };
    // Of the same particles with that compressibility, and of particles with that volume.
    let of = |kappa: f64, more: (&'static str, f64)| {
        water_without(&["compressibility", "tension"], &[("compressibility", kappa), more]).unwrap()
    };
    assert_eq!(refused(&of(1.001 * nearest_compressibility, ("molecules", 50.0))), None);
    assert!(refused(&of(0.999 * nearest_compressibility, ("molecules", 50.0))).is_some());
    let rc = |volume: f64| (6.0 * volume).cbrt();
    assert_eq!(refused(&of(4.525e-10, ("rc", rc(0.999 * nearest_volume)))), None);
    assert!(refused(&of(4.525e-10, ("rc", rc(1.001 * nearest_volume)))).is_some());
    let Some(Refusal::TooSoft { nearest_molecules: Some(more), .. }) =
        refused(&water(&[("molecules", 0.1)]).unwrap())
    else {
        panic!()
    };
    assert_eq!(refused(&water(&[("molecules", 1.001 * more)]).unwrap()), None);
    let of = |n: f64| water_without(&["compressibility"], &[("molecules", n)]).unwrap();
    let Some(Refusal::TooTense { nearest_molecules: Some(fewer), nearest_tension, .. }) = refused(&of(1e3))
    else {
        panic!()
    };
    assert_eq!(refused(&of(0.999 * fewer)), None);
    // 1000 molecules of a liquid with that tension, whose compressibility is free.
    let of = |sigma: f64| {
        water_without(&["compressibility", "tension"], &[("tension", sigma), ("molecules", 1e3)]).unwrap()
    };
    assert_eq!(refused(&of(0.999 * nearest_tension)), None);
    assert!(refused(&of(1.001 * nearest_tension)).is_some());
    // A drop of a micrometre has no such limits if its energy is free.
    let large = [("density", 997.0), ("tension", 0.072), ("drop", 1e-6), ("particles", 1e5)];
    assert_eq!(refused(&Liquid::new("w", &entries(&large)).unwrap()), None);
}

/// The theory's guess has the goals of the theory; Warren's set 6 is near its own liquid.
#[test]
fn guesses_have_the_goals_of_the_theory() {
    let warren = Strengths {
        attraction: -40.0,
        linear: 0.0,
        square: std::f64::consts::PI / 30.0 * RANGE.powi(4) * 25.0,
    };
    let (at, _) = theory::theory(&warren, 6.05);
    assert!(at[0].abs() < 4.0 && (at[1] - 47.0).abs() < 2.0 && (at[2] - 7.45).abs() < 0.3, "{at:?}");
    for (stiffness, tension) in [(None, None), (Some(30.0), None), (None, Some(6.0)), (Some(30.0), Some(6.0))]
    {
        let goals = Goals { density: 6.0, stiffness, tension, viscosity: None };
        let (found, _) = theory::theory(&theory::start(&goals), 6.0);
        assert!(found[0].abs() < 1e-6, "{goals:?} {found:?}");
        assert!(stiffness.is_none_or(|k| (found[1] - k).abs() < 1e-6), "{goals:?} {found:?}");
        assert!(tension.is_none_or(|t| (found[2] - t).abs() < 1e-6), "{goals:?} {found:?}");
    }
}

/// The equation of state of the model in mean field, by hand: p = ρ + (π/30) A ρ² + c₁ρ² + 2c₂ρ³; and its units.
#[test]
fn model_files_have_the_strengths_and_the_units() {
    let liquid = water(&[("molecules", 3.0)]).unwrap();
    let fluid = Strengths { attraction: -45.0, linear: 2.0, square: 0.5 };
    let drag = Drag { gamma: 31.0, range: 1.5, exponent: 0.25 };
    let text = fluid::text(&liquid, &fluid, &drag, "water, by\n  psidpd model liquid \"water\"");
    let model = Model::parse("m.toml", &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(model.units, Some(liquid.units));
    let fluid = model.at(1.0).unwrap();
    let thermostat = fluid.thermostats[0].unwrap();
    assert_eq!([thermostat.gamma, thermostat.range, thermostat.exponent], [31.0, 1.5, 0.25]);
    let pressure = MeanField::new(&fluid).unwrap().pressure(&[3.0]);
    close(pressure, 3.0 - 45.0 * std::f64::consts::PI / 30.0 * 9.0 + 18.0 + 27.0, 1e-9);
}

/// A fluid whose answer is known: not the theory's, with slopes that the theory does not know, and noise.
struct Known {
    answer: Strengths,
    /// It freezes with a stronger attraction.
    freezes: f64,
    /// Its viscosity without drag.
    thin: f64,
    /// Deviations in errors.
    noise: f64,
    calls: f64,
    asked: Vec<Strengths>,
    /// The viscosities that were expected.
    guesses: Vec<f64>,
    /// How often a result was measured.
    results: usize,
}

impl Known {
    fn new() -> Known {
        let answer = Strengths { attraction: -46.0, linear: 2.2, square: 0.62 };
        Known {
            answer,
            freezes: -1e3,
            thin: 4.0,
            noise: 1.3,
            calls: 0.0,
            asked: Vec::new(),
            guesses: Vec::new(),
            results: 0,
        }
    }

    fn exact(fluid: &Strengths) -> [f64; 3] {
        let (at, _) = theory::theory(fluid, 6.0);
        let Strengths { linear, square, .. } = fluid;
        [0.7 * at[0] + 5.0 * linear, 1.3 * at[1] - 1.5 * linear, 0.85 * at[2] + 0.3 * linear + 1.5 * square]
    }

    fn noisy(&mut self, value: f64, error: f64) -> Measured {
        self.calls += 1.0;
        Measured { value: value + error * self.noise * (self.calls * 2.4).sin(), error }
    }

    fn viscosity(&self, drag: &Drag) -> f64 {
        let wide = drag.range.powi(5) * if drag.exponent < 1.0 { 5.0 } else { 1.0 };
        self.thin + 0.1 * wide * drag.gamma.powf(0.9)
    }

    /// The data sheet of a liquid that this fluid is, with two numbers changed by factors.
    fn sheet(&self, tension: f64, viscosity: f64) -> Liquid {
        let [_, k, t] = Known::exact(&self.answer);
        let (kt, rc) = (BOLTZMANN * 300.0, 1e-9f64);
        let time = rc * (1000.0 * rc.powi(3) / 6.0 / kt).sqrt();
        let all = [
            ("density", 1000.0),
            ("temperature", 300.0),
            ("rc", rc),
            ("tension", tension * t * kt / (rc * rc)),
            ("compressibility", rc.powi(3) / (6.0 * k * kt)),
            ("viscosity", viscosity * kt * time / rc.powi(3)),
        ];
        Liquid::new("known", &entries(&all)).unwrap()
    }
}

impl Instrument for Known {
    fn equilibrium(&mut self, fluid: &Strengths, care: Care) -> Result<Equilibrium, Trouble> {
        self.asked.push(*fluid);
        self.results += usize::from(care != Care::Search);
        if fluid.attraction < self.freezes {
            return Err(Trouble::Frozen("ordered".into()));
        }
        let ([p, k, t], [none, ..]) = (Known::exact(fluid), Known::exact(&self.answer));
        let less = if care == Care::Search { 1.0 } else { 0.5 };
        Ok(Equilibrium {
            pressure: self.noisy(p - none, 0.1 * less),
            stiffness: self.noisy(k, 0.3 * less),
            tension: self.noisy(t, 0.04 * less),
            liquid: Measured::from(6.0),
        })
    }

    fn flow(&mut self, _: &Strengths, drag: &Drag, guess: f64, _: Care) -> Result<Flow, Trouble> {
        self.guesses.push(guess);
        let viscosity = self.noisy(self.viscosity(drag), 0.01 * self.viscosity(drag));
        Ok(Flow { viscosity, diffusion: Measured::from(0.02), dt: 0.05 })
    }
}

#[test]
fn the_answer_of_a_known_fluid_is_found() {
    for viscosity in [6.0, 20.0, 150.0, 700.0] {
        let mut known = Known::new();
        let liquid = known.sheet(1.0, viscosity);
        let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
        assert!(found.good && found.refusals.is_empty(), "{found:#?}");
        close(found.fluid.attraction, known.answer.attraction, 0.05);
        close(found.fluid.square, known.answer.square, 0.15);
        close(known.viscosity(&found.drag), viscosity, 0.06);
        assert!(found.trials.len() <= 9 && found.drags.len() <= 6, "{found:#?}");
        // At first the part of the usual drag, 2πγρ²/1575, and some.
        let [first, later @ ..] = &known.guesses[..] else { panic!("no flow") };
        let usual = 2.0 + 2.0 * std::f64::consts::PI * USUAL.gamma * 36.0 / 1575.0;
        assert!((first / usual - 1.0).abs() < 1e-9, "{first} {usual}");
        later.iter().for_each(|guess| close(*guess, viscosity, 0.1));
        let [_, k, t] = Known::exact(&found.fluid);
        let [_, stiffness, tension] = Known::exact(&known.answer);
        close(k, stiffness, 0.03);
        close(t, tension, 0.02);
    }
}

/// A first guess without a result is moved halfway to the liquid that has no wish but its density, again and again.
#[test]
fn a_guess_that_freezes_is_moved_toward_a_liquid() {
    let mut known = Known { freezes: 0.0, ..Known::new() };
    let liquid = known.sheet(1.3, 20.0);
    let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
    assert!(!found.good && known.asked.len() == 3, "{found:#?}");
    let goals = Goals { density: liquid.goals.density, stiffness: None, tension: None, viscosity: None };
    let plain = theory::start(&goals).array();
    for pair in known.asked.windows(2) {
        for (k, plain) in plain.iter().enumerate() {
            close(pair[1].array()[k], 0.5 * (pair[0].array()[k] + plain), 1e-9);
        }
    }
}

/// What its own measurement confirms is measured once.
#[test]
fn a_result_that_is_met_ends_the_search() {
    let mut known = Known { noise: 0.0, ..Known::new() };
    let liquid = known.sheet(1.0, 20.0);
    assert!(model_by(&liquid, &mut known, &mut |_| ()).unwrap().good);
    assert_eq!(known.results, 1);
}

/// A liquid whose table has all goals met is never refused, wherever chance has left the search.
#[test]
fn what_the_table_calls_met_is_not_refused() {
    let (mut met, mut refused) = (0, 0);
    for k in 0..300 {
        // Goals about the edge of what the fluid with its freezing point has.
        let tension = 1.0 + 0.0005 * f64::from(k);
        let mut known = Known { calls: 0.37 * f64::from(k), freezes: -46.5, ..Known::new() };
        let liquid = known.sheet(tension, 6.0);
        let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
        let goals = || found.rows.iter().filter(|row| row.name != "viscosity");
        if goals().all(Row::is_met) {
            met += 1;
            assert!(found.refusals.is_empty(), "{k}: {found:#?}");
        } else {
            refused += 1;
            assert!(!found.good);
        }
    }
    assert!(met > 20 && refused > 20, "{met} {refused}");
}

#[test]
fn what_is_free_is_left_alone_and_reported() {
    let mut known = Known::new();
    let bare = [("density", 1000.0), ("temperature", 300.0), ("rc", 1e-9)];
    let liquid = Liquid::new("bare", &entries(&bare)).unwrap();
    let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
    assert!(found.good, "{found:#?}");
    assert!(known.asked.iter().all(|f| f.attraction == -40.0 && f.linear == 0.0));
    assert_eq!(found.drag, USUAL);
    let free = |name: &str| {
        found.rows.iter().any(|r| r.name == name && r.wanted.is_none() && r.got.value.is_finite())
    };
    assert!(["compressibility", "tension", "viscosity", "diffusion"].into_iter().all(free), "{found:#?}");
}

/// The fluid freezes before it has the tension: the pair is named, with what was reached.
#[test]
fn a_tension_that_no_fluid_has_is_refused_with_its_pair() {
    let mut known = Known { freezes: -50.0, ..Known::new() };
    let liquid = known.sheet(1.7, 20.0);
    let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
    assert!(!found.good);
    let [
        Refusal::Pair {
            first: "tension",
            first_wanted,
            first_nearest,
            second: "compressibility",
            why: Some(why),
            ..
        },
    ] = &found.refusals[..]
    else {
        panic!("{found:#?}")
    };
    assert!(first_nearest < first_wanted && why.contains("freezes"), "{found:#?}");
    assert!(found.text.is_some() && found.rows[3].got.value == *first_nearest, "{found:#?}");
    // If even the guess freezes there is no model.
    let mut known = Known { freezes: -10.0, ..Known::new() };
    let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
    assert!(
        matches!(&found.refusals[..], [Refusal::NoLiquid { .. }]) && found.text.is_none() && !found.good,
        "{found:#?}"
    );
}

#[test]
fn viscosities_out_of_reach_are_refused_at_either_end() {
    for (viscosity, end, side) in [(2.0, "weakest", 1.0), (1e5, "strongest", -1.0)] {
        let mut known = Known::new();
        let liquid = known.sheet(1.0, viscosity);
        let found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
        let [Refusal::Viscosity { viscosity, end: found_end, nearest, .. }] = &found.refusals[..] else {
            panic!("{found:#?}")
        };
        assert!(*found_end == Some(end) && side * (nearest - viscosity) > 0.0 && !found.good, "{found:#?}");
        let limit = if side > 0.0 { drag::WEAKEST } else { drag::STRONGEST };
        // The best of them by noise may be a little before the end.
        assert!((found.drag.gamma / limit).ln().abs() < 0.3, "{found:#?}");
    }
}

/// By hand, of particles of 1.6e-27 m³ and 1.92e-24 kg at 400 K: ε = 5.522596e-21 J, r_c = 2 nm, τ = r_c √(m/ε) = 3.729138e-11 s.
/// The liquid without pressure is thinner by p/(ρ ∂p/∂ρ) = 2/(5 · 40); κ = 1/(ρ ∂p/∂ρ); c² = ∂p/∂ρ over the mass of a particle;
/// and errors are those of products and roots.
#[test]
fn results_are_in_si_with_their_errors() {
    let all = [("density", 1200.0), ("rc", 2e-9), ("number_density", 5.0), ("temperature", 400.0)];
    let liquid = Liquid::new("w", &entries(&all)).unwrap();
    let measured = |value: f64, error: f64| Measured { value, error };
    let equilibrium = Equilibrium {
        pressure: measured(2.0, 0.5),
        stiffness: measured(40.0, 2.0),
        tension: measured(7.0, 0.14),
        liquid: measured(5.0, 0.1),
    };
    let flow = Flow { viscosity: measured(9.0, 0.36), diffusion: measured(0.03, 0.0003), dt: 0.05 };
    let found = rows(&liquid, Some(&equilibrium), Some(&flow));
    for (name, value, error) in [
        ("density", 1188.0, 3.05941),
        ("compressibility", 7.242970e-9, 0.05 * 7.242970e-9),
        ("speed of sound", 339.1964, 0.025 * 339.1964),
        ("tension", 9.664543e-3, 0.02 * 9.664543e-3),
        // 9 ε τ/r_c³ and 0.03 r_c²/τ.
        ("viscosity", 2.316909e-4, 0.04 * 2.316909e-4),
        ("diffusion", 3.217902e-9, 0.01 * 3.217902e-9),
    ] {
        let row = found.iter().find(|row| row.name == name).unwrap();
        close(row.got.value, value, 1e-5);
        close(row.got.error, error, 1e-4);
    }
}

/// The size of a drop is the length of its numbers, if no other is stated: Bond's is ρ g D²/σ.
#[test]
fn numbers_of_a_drop_have_its_diameter() {
    let all = [("density", 800.0), ("tension", 0.02), ("drop", 3e-4), ("particles", 1e5), ("gravity", 5.0)];
    let bond = |more: &[(&'static str, f64)]| {
        let liquid = Liquid::new("w", &entries(&[&all[..], more].concat())).unwrap();
        let found = compared(&liquid, &rows(&liquid, None, None));
        found.iter().find(|n| n.name.starts_with("Bond")).unwrap().of_liquid.unwrap()
    };
    close(bond(&[]), 0.018, 1e-9);
    close(bond(&[("length", 6e-4)]), 0.072, 1e-9);
}

/// A step of 0.04 of τ = 6.3434e-12 s.
#[test]
fn the_model_says_its_step_and_what_it_measured() {
    let mut known = Known::new();
    let liquid = known.sheet(1.0, 20.0);
    let mut found = model_by(&liquid, &mut known, &mut |_| ()).unwrap();
    assert_eq!(found.advice(), None);
    found.step = Some(0.04);
    let head = found.head("psidpd model liquid");
    assert!(head.contains("dt = 0.04 (2.54e-13 s)"), "{head}");
    assert!(
        head.contains("r_c = 1.0000e-9 m, a particle 1.6667e-25 kg, the unit of time 6.3434e-12 s"),
        "{head}"
    );
    assert!(
        found.rows.iter().all(|row| head.contains(&format!("{}: {:.4e} +- ", row.name, row.got.value))),
        "{head}"
    );
}

/// Standard DPD at ρ = 3 with γ = 100 has a viscosity of 2.578(6) (`docs/choosing.md`), 1.095 with the usual drag: the flow is that of
/// the drag that is asked for. Five standard errors and the 5 % of shear thinning and of the size of boxes.
#[test]
fn flows_have_the_viscosity_of_their_drag() {
    let liquid = of_number_density(3.0);
    let folder = temporary_folder().unwrap();
    let mut runs = runs::Runs { liquid: &liquid, folder: folder.path(), seed: 3 };
    let fluid = Strengths { attraction: 25.0, linear: 0.0, square: 0.0 };
    let drag = Drag { gamma: 100.0, ..USUAL };
    let Measured { value, error } = runs.flow(&fluid, &drag, 2.6, Care::Search).unwrap().viscosity;
    assert!((value - 2.578).abs() < 5.0 * error + 0.13 && error < 0.15, "{value} +- {error}");
}

/// By Poiseuille, in halves of width D = 6 a flow has the velocity ρ a D²/8η in the middle, less than that of sound and of heat. Results
/// come from another seed and runs that are three times as long, and from the liquid at rest, at its density.
#[test]
fn flows_are_slow_and_results_longer() {
    let liquid = of_number_density(5.0);
    let folder = temporary_folder().unwrap();
    let runs = runs::Runs { liquid: &liquid, folder: folder.path(), seed: 3 };
    let fluid = Strengths { attraction: -40.0, linear: 0.0, square: 0.8 };
    let of = |care: Care| runs.scenes_of_flows((&fluid, &USUAL), 12.0, 0.05, care);
    let (search, result) = (of(Care::Search), of(Care::Result(1)));
    let time = |scene: &psidpd_dynamics::scene::Scene| {
        let last = scene.stages.last().unwrap();
        last.steps as f64 * last.dt
    };
    assert_eq!((search.len(), result.len()), (1, 2));
    for flow in [&search[0], &result[1]] {
        let force = &flow.body_forces[0];
        let velocity = 5.0 * force.acceleration[0] * 36.0 / (8.0 * 12.0);
        assert!((velocity - 0.15).abs() < 1e-9, "{velocity}");
        // The flow is there before it is measured: it comes about as exp(−π² η t/ρD²).
        let settling: f64 = flow.stages.iter().rev().skip(1).map(|s| s.steps as f64 * s.dt).sum();
        assert!((-std::f64::consts::PI.powi(2) * 12.0 * settling / (5.0 * 36.0)).exp() < 1e-3, "{settling}");
    }
    close(time(&result[1]), 3.0 * time(&search[0]), 1e-9);
    close(time(&result[0]), time(&result[1]), 1e-9);
    assert!(result[0].body_forces.is_empty());
    close(result[0].densities()[0], 5.0, 1e-3);
    let mut seeds = vec![search[0].seed, result[0].seed, of(Care::Result(2))[0].seed];
    seeds.dedup();
    assert_eq!(seeds.len(), 3);
}

#[test]
fn rows_are_met_within_the_tolerance_and_its_error() {
    let row = |value: f64, error: f64| Row {
        name: "tension",
        unit: "N/m",
        wanted: Some(1.0),
        got: Measured { value, error },
        tolerance: Some(0.02),
    };
    assert!(row(1.0199, 0.0).is_met() && row(0.975, 0.01).is_met());
    assert!(!row(1.025, 0.001).is_met() && !row(1.0, 0.03).is_met() && !row(f64::NAN, 0.0).is_met());
    assert!(Row { wanted: None, ..row(7.0, 1.0) }.is_met());
}

/// A drop of water of 1 mm that falls at 1 m/s.
#[test]
fn dimensionless_numbers_are_those_of_textbooks() {
    let water = Properties {
        density: Some(1000.0),
        tension: Some(0.072),
        viscosity: Some(1e-3),
        sound_speed: Some(1500.0),
        diffusion: Some(2.3e-9),
    };
    let scales = Scales { length: Some(1e-3), velocity: Some(1.0), gravity: Some(9.81) };
    let found = numbers::numbers(&water, &Properties { tension: None, ..water }, &scales);
    let of = |name: &str| found.iter().find(|n| n.name.starts_with(name)).unwrap().clone();
    for (name, expected) in [
        ("Ohnesorge", 3.727e-3),
        ("Weber", 13.89),
        ("capillary", 0.01389),
        ("Reynolds", 1000.0),
        ("Bond", 0.1363),
        ("Mach", 6.667e-4),
        ("Schmidt", 434.8),
    ] {
        close(of(name).of_liquid.unwrap(), expected, 1e-3);
    }
    assert!(of("Weber").of_model.is_none() && !of("Weber").is_off(0.1));
    let other = numbers::numbers(&water, &Properties { viscosity: Some(2e-3), ..water }, &scales);
    assert!(other.iter().filter(|n| n.is_off(0.1)).count() == 4, "{other:?}");
    assert!(numbers::numbers(&water, &water, &Scales::default()).len() == 1);
}

/// Runs of Warren's set 6 have his tension 7.45(4) and ∂p/∂ρ 47(2), and his density 6.05(1) of the liquid; and the fluid of three
/// times the attraction is a crystal.
#[test]
fn runs_measure_a_published_liquid_and_see_a_crystal() {
    let liquid = of_number_density(6.05);
    let folder = temporary_folder().unwrap();
    let mut runs = runs::Runs { liquid: &liquid, folder: folder.path(), seed: 5 };
    let unit = std::f64::consts::PI / 30.0 * RANGE.powi(4);
    let warren = Strengths { attraction: -40.0, linear: 0.0, square: 25.0 * unit };
    let found = runs.equilibrium(&warren, Care::Search).unwrap();
    assert!((found.tension.value - 7.45).abs() < 4.0 * found.tension.error.hypot(0.04), "{found:?}");
    assert!((found.stiffness.value - 47.0).abs() < 4.0 * found.stiffness.error.hypot(2.0), "{found:?}");
    assert!((found.liquid.value - 6.05).abs() < 0.06, "{found:?}");
    assert!(
        found.tension.error < 0.2 && found.stiffness.error < 1.5 && found.pressure.error < 0.3,
        "{found:?}"
    );
    let cold = Strengths { attraction: -120.0, linear: 0.0, square: 96.0 * unit };
    let cold = runs.equilibrium(&cold, Care::Search);
    assert!(matches!(cold, Err(Trouble::Frozen(_))), "{cold:?}");
}

/// The gallery of `docs/liquids.md`: numbers of CoolProp 8 at saturation; the mixture, 62 % of glycerol, by tables. Density, tension,
/// compressibility, viscosity, temperature, molar mass, molecules.
const GALLERY: [(&str, [f64; 7]); 7] = [
    ("water, 298 K", [997.0, 0.072055, 4.5258e-10, 8.9004e-4, 298.15, 0.018015, 1.0]),
    ("water, 350 K", [973.7, 0.063296, 4.5815e-10, 3.6845e-4, 350.0, 0.018015, 1.0]),
    ("hexane, 298 K", [654.76, 0.017881, 1.7034e-9, 2.977e-4, 298.15, 0.086175, 1.0]),
    ("glycerol–water, 10 mPa s", [1156.0, 0.068, 2.53e-10, 0.01, 298.15, 0.03594, 1.0]),
    ("ethanol, 298 K", [785.05, 0.021884, 1.1659e-9, 1.0817e-3, 298.15, 0.046068, 1.0]),
    ("decane, 298 K", [726.44, 0.023387, 1.1202e-9, 8.4708e-4, 298.15, 0.14228, 1.0]),
    ("water, 298 K, 3 molecules", [997.0, 0.072055, 4.5258e-10, 8.9004e-4, 298.15, 0.018015, 3.0]),
];

/// Prints the gallery, or the liquid that PSIDPD_LIQUID names.
#[test]
#[ignore = "takes minutes for each liquid"]
fn gallery() {
    let keys =
        ["density", "tension", "compressibility", "viscosity", "temperature", "molar_mass", "molecules"];
    let only = std::env::var("PSIDPD_LIQUID").unwrap_or_default();
    for (name, numbers) in GALLERY.iter().filter(|(name, _)| name.contains(&only)) {
        let all: Vec<(&str, f64)> = keys.into_iter().zip(*numbers).collect();
        let liquid = Liquid::new(name, &entries(&all)).unwrap();
        let found = model(&liquid, 1, "gallery", &mut |line| println!("{line}")).unwrap();
        println!("{name}: {:?} {:?} step {:?}", found.fluid, found.drag, found.step);
        for row in &found.rows {
            let off = row.wanted.map(|wanted| 100.0 * (row.got.value / wanted - 1.0));
            println!(
                "  {}: {:.5e} +- {:.1e} {}, off by {off:?} %",
                row.name, row.got.value, row.got.error, row.unit
            );
        }
        found.refusals.iter().for_each(|refusal| println!("  {refusal}"));
        assert!(!found.trials.is_empty() || !found.refusals.is_empty());
    }
}

/// The error of a tension falls with the root of the time, so half the tension needs four times as much of it.
#[test]
fn small_tensions_are_measured_longer() {
    let time = |care, tension| super::runs::slab_time(care, tension);
    let usual = time(Care::Result(1), None);
    assert_eq!([9.0, 4.5].map(|tension| time(Care::Result(1), Some(tension))), [usual; 2]);
    assert!((time(Care::Result(1), Some(3.0)) / usual - 2.25).abs() < 1e-12);
    assert_eq!(time(Care::Result(1), Some(0.1)), 4.0 * usual);
    assert_eq!(time(Care::Search, Some(0.1)), usual / 3.0);
}
