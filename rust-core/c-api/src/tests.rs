//! Checks of the header, and of errors that no C program can cause.

use crate::status::{Failure, Status, guard};
use crate::*;
use std::ffi::CStr;
use std::path::Path;
use std::ptr::{null, null_mut};

/// Source files in the order of the header.
const SOURCES: [&str; 7] =
    ["version.rs", "status.rs", "model.rs", "settings.rs", "engine.rs", "evaluation.rs", "thermostat.rs"];

/// Structures of the engine that the header has too.
const STRUCTURES: [&str; 3] =
    ["../src/engine/step.rs", "../src/engine/surroundings.rs", "../passes/src/tally.rs"];

fn last_error() -> String {
    // SAFETY: the text is valid until the next failing call on this thread.
    unsafe { CStr::from_ptr(psidpd_last_error()) }.to_str().unwrap().to_owned()
}

fn header() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let builder = cbindgen::Builder::new().with_config(config);
    let sources = SOURCES.map(|file| root.join("src").join(file)).into_iter();
    let builder =
        sources.chain(STRUCTURES.map(|file| root.join(file))).fold(builder, cbindgen::Builder::with_src);
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    let mut text = String::from_utf8(text).unwrap();
    // Constants of structures that are left out leave empty lines.
    while text.contains("\n\n\n") {
        text = text.replace("\n\n\n", "\n\n");
    }
    text
}

/// The environment variable `PSIDPD_UPDATE_HEADER=1` writes the header.
#[test]
fn header_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/psidpd.h");
    let made = header();
    if std::env::var_os("PSIDPD_UPDATE_HEADER").is_some_and(|value| value == "1") {
        std::fs::write(&path, &made).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    let there = there.replace("\r\n", "\n");
    let difference = there.lines().zip(made.lines()).position(|(a, b)| a != b);
    assert!(
        there == made,
        "include/psidpd.h differs from src/ (first in line {:?}); set PSIDPD_UPDATE_HEADER=1 to \
         write it again",
        difference.map(|line| line + 1)
    );
}

/// The exported functions in the sources.
fn exported() -> Vec<String> {
    let mut names = Vec::new();
    for file in SOURCES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(file);
        let text = std::fs::read_to_string(path).unwrap();
        for after in text.split("#[unsafe(no_mangle)]").skip(1) {
            let name = after.split("fn ").nth(1).unwrap().split('(').next().unwrap();
            assert!(name.starts_with("psidpd_"), "{name}");
            names.push(name.to_owned());
        }
    }
    assert!(names.len() > 15);
    names
}

/// Every function occurs in the header once, after a comment of its own that names its errors, if it has any.
#[test]
fn every_function_is_documented() {
    let header = header();
    let (_, header) = header.split_once("extern \"C\"").unwrap();
    for name in exported() {
        let at = header.find(&format!("{name}(")).unwrap_or_else(|| panic!("{name} is not in the header"));
        assert_eq!(header.matches(&format!("{name}(")).count(), 1, "{name}");
        let begin = header[..at].rfind('\n').unwrap() + 1;
        let lines = header[..begin].lines().rev().take_while(|line| line.starts_with("///"));
        let comment: String = lines.collect();
        assert!(comment.len() > 40, "{name} has no comment: {comment}");
        if header[begin..at].contains("psidpd_status") {
            assert!(comment.contains("# Errors") && comment.contains("# Safety"), "{name}: {comment}");
        }
    }
}

/// Programs are compiled with these numbers.
#[test]
fn status_values_are_what_they_always_were() {
    let values = [
        (Status::Ok, 0),
        (Status::InvalidArgument, 1),
        (Status::NullPointer, 2),
        (Status::File, 3),
        (Status::Model, 4),
        (Status::Engine, 5),
        (Status::CallOrder, 6),
        (Status::Panic, 255),
    ];
    for (status, value) in values {
        assert_eq!(status as i32, value);
    }
    assert_eq!(psidpd_abi_version(), 3);
}

#[test]
fn panics_become_a_status_and_a_message() {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let fixed = guard(|| panic!("fixed"));
    let fixed_text = last_error();
    let made = guard(|| panic!("number {}", 7));
    let made_text = last_error();
    /// A panic payload that panics when it is dropped.
    struct Spiteful;
    impl Drop for Spiteful {
        fn drop(&mut self) {
            panic!("again");
        }
    }
    let spiteful = guard(|| std::panic::panic_any(Spiteful));
    let spiteful_text = last_error();
    std::panic::set_hook(hook);
    assert_eq!([fixed, made, spiteful], [Status::Panic; 3]);
    assert!(fixed_text.ends_with(": fixed"), "{fixed_text}");
    assert!(made_text.ends_with(": number 7"), "{made_text}");
    assert!(spiteful_text.ends_with("no message"), "{spiteful_text}");
}

#[test]
fn messages_belong_to_threads_and_survive_zero_bytes_and_successes() {
    let failed = guard(|| Err(Failure::new(Status::Engine, "a\0b")));
    assert_eq!(failed, Status::Engine);
    assert_eq!(guard(|| Ok(())), Status::Ok);
    assert_eq!(last_error(), "a\u{fffd}b");
    assert_eq!(std::thread::spawn(last_error).join().unwrap(), "");
}

fn model(text: &CStr) -> *mut Model {
    let mut model = null_mut();
    // SAFETY: the texts end with zero bytes, and `model` can be written to.
    let status = unsafe { psidpd_model_parse(c"test".as_ptr(), text.as_ptr(), &mut model) };
    assert_eq!(status, Status::Ok, "{}", last_error());
    model
}

const TEXT: &CStr = c"title = \"a fluid\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\n\
    range = 1\n[excess_free_energy]\nA = \"n^2\"\n";

/// Addresses and lengths that no array can have are refused before they are used.
#[test]
fn impossible_pointers_and_lengths_are_refused() {
    let model = model(TEXT);
    let mut engine = null_mut();
    let x = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0];
    let (tag, kind) = ([1, 2], [0, 0]);
    let particles = Particles { owned: 2, all: 2, x: x.as_ptr(), tag: tag.as_ptr(), kind: kind.as_ptr() };
    let good = Request { particles, v: null(), step: null(), want: 0 };
    // SAFETY: handles are alive, arrays as long as stated; the functions refuse the others before they read them.
    unsafe {
        let mut facts = std::mem::zeroed::<ModelFacts>();
        assert_eq!(psidpd_model_describe(model, &mut facts), Status::Ok);
        assert_eq!(CStr::from_ptr(facts.title).to_str().unwrap(), "a fluid");
        assert_eq!(psidpd_engine_new(model, 1.0, null(), &mut engine), Status::Ok);
        psidpd_model_free(model);

        let first = |particles: Particles, newton: i32| {
            psidpd_engine_first(engine, null(), null(), newton, &Request { particles, ..good })
        };
        let long = Particles { owned: 0, all: usize::MAX / 8, ..particles };
        assert_eq!(first(long, 1), Status::InvalidArgument);
        assert!(last_error().contains("cannot be as long"), "{}", last_error());
        let odd = Particles { x: x.as_ptr().wrapping_byte_add(1), ..particles };
        assert_eq!(first(odd, 1), Status::InvalidArgument);
        assert!(last_error().contains("not aligned"), "{}", last_error());

        let mut force = [0.0; 6];
        let second = |force: *mut f64| psidpd_engine_second(engine, &good, force, null_mut());
        assert_eq!(second(force.as_mut_ptr()), Status::CallOrder);
        assert_eq!(first(particles, 1), Status::Ok);
        assert_eq!(second(x.as_ptr().cast_mut()), Status::InvalidArgument);
        assert!(last_error().contains("overlap"), "{}", last_error());
        assert_eq!(second(force.as_mut_ptr()), Status::Ok);
        assert!(force[0] < 0.0 && force[0] == -force[3]);

        // After a failure the engine is not ready; after the next success it is.
        let nowhere = [f64::NAN, 0.0, 0.0, 0.5, 0.0, 0.0];
        assert_eq!(first(Particles { x: nowhere.as_ptr(), ..particles }, 1), Status::Engine);
        assert!(last_error().contains("particle 1 "), "{}", last_error());
        assert_eq!(second(force.as_mut_ptr()), Status::CallOrder);
        assert_eq!(first(particles, 0), Status::Ok);
        assert_eq!(second(force.as_mut_ptr()), Status::Ok);
        psidpd_engine_free(engine);
    }
}

#[test]
fn no_particles_need_no_arrays() {
    let model = model(TEXT);
    let mut engine = null_mut();
    let none = Particles { owned: 0, all: 0, x: null(), tag: null(), kind: null() };
    // SAFETY: handles are alive, and arrays have no elements.
    unsafe {
        assert_eq!(psidpd_engine_new(model, 1.0, null(), &mut engine), Status::Ok);
        let want = PSIDPD_WANT_ENERGY | PSIDPD_WANT_PARTICLE_VIRIAL;
        let request = Request { particles: none, v: null(), step: null(), want };
        assert_eq!(psidpd_engine_first(engine, null(), null(), 1, &request), Status::Ok);
        let status = psidpd_engine_second(engine, &request, null_mut(), null_mut());
        assert_eq!(status, Status::Ok, "{}", last_error());
        psidpd_engine_free(engine);
        psidpd_model_free(model);
    }
}

/// Special pairs act as listed pairs with factors do.
#[test]
fn special_pairs_have_their_factors() {
    let model = model(TEXT);
    let mut engine = null_mut();
    let x = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.2, 0.6, 0.0];
    let (tag, kind) = ([1, 2, 3], [0; 3]);
    let particles = Particles { owned: 3, all: 3, x: x.as_ptr(), tag: tag.as_ptr(), kind: kind.as_ptr() };
    let request = Request { particles, v: null(), step: null(), want: 0 };
    let open =
        Domain { origin: [-2.0; 3], edges: [5.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 5.0], periodic: [0; 3] };
    let (i, j, factor) = ([0, 0, 1], [1, 2, 2], [0.3, 1.0, 0.0]);
    let listed = Pairs { count: 3, i: i.as_ptr(), j: j.as_ptr(), factor: factor.as_ptr() };
    let special = [SpecialPair { i: 0, j: 1, factor: 0.3 }, SpecialPair { i: 1, j: 2, factor: 0.0 }];
    // SAFETY: handles are alive, and arrays are as long as stated.
    unsafe {
        assert_eq!(psidpd_engine_new(model, 1.0, null(), &mut engine), Status::Ok);
        psidpd_model_free(model);
        assert_eq!(psidpd_engine_first_of_pairs(engine, &listed, 1, &request), Status::Ok);
        let mut expected = [0.0; 9];
        assert_eq!(psidpd_engine_second(engine, &request, expected.as_mut_ptr(), null_mut()), Status::Ok);
        let evaluate = || {
            let mut force = [0.0; 9];
            let status = psidpd_engine_evaluate(engine, &open, &request, force.as_mut_ptr(), null_mut());
            (status, force)
        };
        let (_, plain) = evaluate();
        assert_eq!(psidpd_engine_set_special_pairs(engine, special.as_ptr(), 2), Status::Ok);
        let (status, found) = evaluate();
        assert_eq!(status, Status::Ok, "{}", last_error());
        assert!(
            found != plain && found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-12),
            "{found:?}"
        );
        let nobody = SpecialPair { i: 0, j: 7, factor: 0.5 };
        assert_eq!(psidpd_engine_set_special_pairs(engine, &nobody, 1), Status::Ok);
        assert_eq!(evaluate().0, Status::InvalidArgument);
        assert_eq!(psidpd_engine_set_special_pairs(engine, null(), 1), Status::NullPointer);
        assert_eq!(psidpd_engine_set_special_pairs(engine, null(), 0), Status::Ok);
        assert_eq!(evaluate(), (Status::Ok, plain));
        psidpd_engine_free(engine);
    }
}

/// The thermostat keeps the momentum and fixed velocities, and changes the others by the seed.
#[test]
fn a_thermostat_acts_on_velocities() {
    let text = c"title = \"t\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
    let (model, without) = (model(text), model(TEXT));
    let (mut engine, mut thermostat) = (null_mut(), null_mut());
    let number = |k: usize| ((k * 7919) % 1009) as f64 / 1009.0;
    let x: Vec<f64> = (0..300).map(|k| 3.0 * number(k)).collect();
    let start: Vec<f64> = (0..300).map(|k| number(k + 400) - 0.5).collect();
    let (tag, species): (Vec<i32>, Vec<i32>) = ((1..=100).collect(), vec![0; 100]);
    let frozen: Vec<i32> = (0..100).map(|k| i32::from(k == 3)).collect();
    let edges = [3.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 3.0];
    let domain = Domain { origin: [0.0; 3], edges, periodic: [1; 3] };
    let (step, mass) = (Step { seed: 5, number: 6, dt: 0.05 }, [2.0]);
    let bodies = Bodies {
        count: 100,
        x: x.as_ptr(),
        tag: tag.as_ptr(),
        species: species.as_ptr(),
        mass: mass.as_ptr(),
        frozen: null(),
    };
    // SAFETY: handles are alive, and arrays are as long as stated.
    unsafe {
        assert_eq!(psidpd_engine_new(without, 1.0, null(), &mut engine), Status::Ok);
        assert_eq!(psidpd_thermostat_new(engine, &mut thermostat), Status::Model);
        psidpd_engine_free(engine);
        assert_eq!(psidpd_engine_new(model, 1.0, null(), &mut engine), Status::Ok);
        assert_eq!(psidpd_thermostat_new(engine, &mut thermostat), Status::Ok);
        psidpd_engine_free(engine);
        psidpd_model_free(model);
        psidpd_model_free(without);
        let act = |bodies: &Bodies, rule, step: Step| {
            let (mut v, mut virial) = (start.clone(), [0.0; 6]);
            let status = psidpd_thermostat_act(
                thermostat,
                &domain,
                bodies,
                rule,
                &step,
                v.as_mut_ptr(),
                virial.as_mut_ptr(),
            );
            (status, v, virial)
        };
        let sum = |v: &[f64], c: usize| v.iter().skip(c).step_by(3).sum::<f64>();
        for rule in [PSIDPD_RULE_MIDPOINT, PSIDPD_RULE_PAIRWISE] {
            let (status, v, virial) = act(&bodies, rule, step);
            assert_eq!(status, Status::Ok, "{}", last_error());
            assert!(v != start && virial[0] != 0.0);
            assert!((0..3).all(|c| (sum(&v, c) - sum(&start, c)).abs() < 1e-12));
            assert_eq!(act(&bodies, rule, step), (Status::Ok, v.clone(), virial));
            assert!(act(&bodies, rule, Step { seed: 6, ..step }).1 != v);
            let held = act(&Bodies { frozen: frozen.as_ptr(), ..bodies }, rule, step).1;
            assert!(held[9..12] == start[9..12] && held[12..15] != start[12..15]);
        }
        let negative = [-1.0];
        let strangers = vec![1; 100];
        for (bodies, rule, step, message) in [
            (bodies, 7, step, "rule is 7"),
            (Bodies { mass: negative.as_ptr(), ..bodies }, 0, step, "mass has -1"),
            (Bodies { species: strangers.as_ptr(), ..bodies }, 0, step, "species has 1"),
            (bodies, 0, Step { dt: 0.0, ..step }, "step.dt"),
        ] {
            let (status, v, _) = act(&bodies, rule, step);
            assert!(status == Status::InvalidArgument && v == start, "{message}");
            assert!(last_error().contains(message), "{}", last_error());
        }
        psidpd_thermostat_free(thermostat);
        psidpd_thermostat_free(null_mut());
    }
}

/// The header allows threads to share models and to pass engines on.
#[test]
fn handles_may_cross_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Model>();
    shared::<Engine>();
    fn sent<T: Send>() {}
    sent::<Thermostat>();
}

/// The limits are the most threads of a pool, and one thread more.
#[test]
fn threads_are_those_of_a_pool() {
    let settings = |threads| Settings { threads, ..Settings::DEFAULT }.checked();
    assert_eq!(settings(1024).map(|s| s.threads.get()).ok(), Some(1024));
    for threads in [0, 1025, usize::MAX] {
        assert!(settings(threads).is_err(), "{threads}");
    }
}
