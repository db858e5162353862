use crate::bytes::Bytes;
use psidpd_c::*;
use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};

/// The largest number of particles in a call.
const MOST: usize = 12;

/// Models for the engines, if the input has no text of its own.
const MODELS: [&str; 4] = [
    "title = \"a\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\n\
     A = \"n^2\"\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = -5\nrange = 1\n\
     [[thermostat]]\ngamma = 4.5\nrange = 1\n",
    "title = \"b\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"lucy\"\nrange = 1\n[density.m]\n\
     kernel = \"linear\"\nrange = 0.7\n[excess_free_energy]\nA = \"n_A*m_B + n^2\"\nB = \"ln(1 + n)\"\n\
     [[thermostat]]\ngamma = 1\nrange = 1.2\n",
    "title = \"c\"\ndimensions = 2\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
     [excess_free_energy]\nA = \"-kT*ln(1 - 0.1*n) - n\"\n",
    "title = \"d\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\nphi = \"1/r\"\nrange = 1\n",
];

/// Makes calls in any order, with any numbers, and with pointers that are valid or null. No call ends the program, and each
/// failing call sets an error message.
pub fn c_api(input: &[u8]) {
    let mut bytes = Bytes(input);
    let text = match bytes.below(5) {
        4 => CString::new(bytes.0).unwrap_or_default(),
        k => CString::new(MODELS[k]).unwrap_or_default(),
    };
    let mut model: *mut Model = null_mut();
    // SAFETY: both texts end with a zero byte, and `model` is a place to write to.
    let status = unsafe { psidpd_model_parse(c"fuzz".as_ptr(), text.as_ptr(), &mut model) };
    told(status);
    if status != Status::Ok {
        assert!(model.is_null());
        return;
    }
    let settings =
        Settings { precision: small(&mut bytes), instructions: small(&mut bytes), threads: bytes.below(4) };
    let mut engine: *mut Engine = null_mut();
    // SAFETY: `model` is valid until it is freed once, at the end of this block.
    unsafe {
        told(psidpd_engine_new(model, bytes.number(), &settings, &mut engine));
        if engine.is_null() {
            told(psidpd_engine_new(model, 1.0, null(), &mut engine));
        }
        psidpd_model_free(model);
    }
    // Twenty calls reach every state in a short time.
    for _ in 0..20 {
        if bytes.is_empty() {
            break;
        }
        call(engine, &mut bytes);
    }
    // SAFETY: `engine` is null or valid, and is freed only here.
    unsafe { psidpd_engine_free(engine) };
}

/// A whole number from -1 to 6.
fn small(bytes: &mut Bytes) -> i32 {
    bytes.below(8) as i32 - 1
}

/// Checks that a failed call has set a message.
fn told(status: Status) {
    assert!(status != Status::Panic, "{}", last_error());
    if status != Status::Ok {
        assert!(!last_error().is_empty());
    }
}

fn last_error() -> String {
    // SAFETY: the C interface keeps this text valid until the next failing call on this thread.
    unsafe { CStr::from_ptr(psidpd_last_error()) }.to_string_lossy().into_owned()
}

/// Particles with arrays of exactly the required length.
struct Cloud {
    owned: usize,
    x: Vec<f64>,
    v: Vec<f64>,
    tag: Vec<i32>,
    kind: Vec<i32>,
    force: Vec<f64>,
}

impl Cloud {
    fn new(bytes: &mut Bytes) -> Cloud {
        let all = bytes.below(MOST + 1);
        let x: Vec<f64> = (0..3 * all).map(|_| bytes.number()).collect();
        let v: Vec<f64> = (0..3 * all).map(|_| bytes.number()).collect();
        // Tags and kinds are either correct or arbitrary.
        let numbered = bytes.byte() > 8;
        let tag = (0..all).map(|k| if numbered { k as i32 + 1 } else { bytes.integer() }).collect();
        let kind = (0..all).map(|_| if numbered { 0 } else { small(bytes) }).collect();
        // One owned particle too many is an error that the call must report.
        let owned = bytes.below(all + 2);
        Cloud { owned, force: vec![0.0; 3 * all], x, v, tag, kind }
    }

    fn particles(&self) -> Particles {
        Particles {
            owned: self.owned,
            all: self.tag.len(),
            x: self.x.as_ptr(),
            tag: self.tag.as_ptr(),
            kind: self.kind.as_ptr(),
        }
    }
}

fn call(engine: *mut Engine, bytes: &mut Bytes) {
    let which = bytes.below(14);
    let mut cloud = Cloud::new(bytes);
    let step = Step { seed: u64::from(bytes.byte()), number: 3, dt: bytes.number() };
    let step = if bytes.flag() { &raw const step } else { null() };
    let want = u32::from(bytes.byte());
    let v = if bytes.flag() { cloud.v.as_ptr() } else { null() };
    let request = Request { particles: cloud.particles(), v, step, want };
    let mut tally = Tally::default();
    let newton = small(bytes);
    let force = cloud.force.as_mut_ptr();
    // SAFETY: the engine is null or valid. All arrays have the lengths that the structures state, do not overlap, and live
    // until the end of this function. All other pointers are null.
    unsafe {
        told(match which {
            0..=3 => psidpd_engine_evaluate(engine, &domain(bytes), &request, force, &mut tally),
            4 | 5 => {
                let ghosts = cloud.tag.len().saturating_sub(cloud.owned);
                let images: Vec<i32> = (0..ghosts).map(|_| i32::from(bytes.byte() > 128)).collect();
                let image = if bytes.flag() { images.as_ptr() } else { null() };
                let domain = domain(bytes);
                let domain = if bytes.flag() { &raw const domain } else { null() };
                let first = psidpd_engine_first(engine, domain, image, newton, &request);
                told(first);
                if bytes.flag() { psidpd_engine_second(engine, &request, force, null_mut()) } else { first }
            }
            6 => {
                let count = bytes.below(9);
                let [i, j] = [(); 2].map(|()| (0..count).map(|_| small(bytes)).collect::<Vec<i32>>());
                let factor: Vec<f64> = (0..count).map(|_| bytes.number()).collect();
                let factor = if bytes.flag() { factor.as_ptr() } else { null() };
                let pairs = Pairs { count, i: i.as_ptr(), j: j.as_ptr(), factor };
                let first = psidpd_engine_first_of_pairs(engine, &pairs, newton, &request);
                told(first);
                if bytes.flag() { psidpd_engine_second(engine, &request, force, &mut tally) } else { first }
            }
            7 => psidpd_engine_second(engine, &request, force, &mut tally),
            8 => {
                let species: Vec<i32> = (0..bytes.below(6)).map(|_| small(bytes)).collect();
                psidpd_engine_map_kinds(engine, species.as_ptr(), species.len())
            }
            9 | 10 => {
                let (mut slopes, mut length) = (null_mut(), 0);
                let status = psidpd_engine_slopes(engine, &mut slopes, &mut length);
                if status == Status::Ok {
                    // A host adds to the slopes and writes those of ghosts.
                    for k in 0..length {
                        *slopes.add(k) += bytes.number();
                    }
                }
                status
            }
            11 => {
                let index = |bytes: &mut Bytes| small(bytes) as u32;
                let special: Vec<SpecialPair> = (0..bytes.below(9))
                    .map(|_| SpecialPair { i: index(bytes), j: index(bytes), factor: bytes.number() })
                    .collect();
                psidpd_engine_set_special_pairs(engine, special.as_ptr(), special.len())
            }
            12 => {
                let mut thermostat: *mut Thermostat = null_mut();
                let made = psidpd_thermostat_new(engine, &mut thermostat);
                let mass = [(); 2].map(|()| bytes.number().abs());
                let frozen: Vec<i32> = cloud.tag.iter().map(|_| i32::from(bytes.flag())).collect();
                let Particles { all, x, tag, kind, .. } = cloud.particles();
                let (mass, frozen) = (mass.as_ptr(), if bytes.flag() { frozen.as_ptr() } else { null() });
                let bodies = Bodies { count: all, x, tag, species: kind, mass, frozen };
                let mut virial = [0.0; 6];
                let virial = if bytes.flag() { virial.as_mut_ptr() } else { null_mut() };
                let (domain, rule) = (domain(bytes), small(bytes));
                told(psidpd_thermostat_act(thermostat, &domain, &bodies, rule, step, force, virial));
                psidpd_thermostat_free(thermostat);
                made
            }
            _ => {
                let mut results = std::mem::zeroed::<Results>();
                let status = psidpd_engine_results(engine, &mut results);
                if status == Status::Ok {
                    let Results { density, densities, energy, energies, virial, virials } = results;
                    for (numbers, length) in [(density, densities), (energy, energies), (virial, virials)] {
                        let _ = (0..length).map(|k| *numbers.add(k)).sum::<f64>();
                    }
                }
                status
            }
        });
    }
}

fn domain(bytes: &mut Bytes) -> Domain {
    let mut edges = [0.0; 9];
    if bytes.byte() > 16 {
        for k in [0, 4, 8] {
            edges[k] = 2.5 + bytes.number().abs();
        }
    } else {
        edges = std::array::from_fn(|_| bytes.number());
    }
    Domain {
        origin: std::array::from_fn(|_| bytes.number()),
        edges,
        periodic: std::array::from_fn(|_| i32::from(bytes.flag())),
    }
}
