//! Tests laws of stated slopes: compares the engine with the plain reference, and with ψ if the slopes are those of one.

use psidpd_core::engine::{Newton, PeriodicBox, Plan, noise};
use psidpd_core::maximum::largest;
use psidpd_core::model::{Fluid, Model};
use psidpd_core::theory::{MeanField, TheoryError};
use psidpd_core::truth;
use with_images::Owned;

mod with_images;

const HEAD: &str = "title = \"t\"\nspecies = [\"A\", \"B\"]\n\
    [density.n]\nkernel = \"quadratic\"\nrange = 0.8\ncorrection = { \"A|B\" = [0.2, 1.1, 0.01] }\n\
    [density.m]\nkernel = \"lucy\"\nrange = 1.1\nself = true\n\
    [density.q]\nkernel = \"quadratic\"\nrange = 0.9\n\
    [[pair]]\nbetween = [\"A\", \"B\"]\nform = \"soft\"\nstrength = 10\nrange = 1\n\
    [excess_free_energy]\nA = \"n_A*n_B + 0.1*m^2 + 0.7*q\"\n";

/// ψ of species B, and the same law as stated slopes.
const FORMULA: &str = "B = \"kT*n_A^2*m_B + 0.3*m_A + 0.2*n\"\n";
const STATED: &str = "B = { energy = \"kT*n_A^2*m_B + 0.3*m_A + 0.2*n\", \
    slopes = { n_A = \"2*kT*n_A*m_B + 0.2\", n_B = \"0.2\", m_A = \"0.3\", m_B = \"kT*n_A^2\" } }\n";
/// Slopes that are the gradient of no function.
const OTHER: &str = "B = { energy = \"n_A\", slopes = { n = \"0.4*m_A\", m_B = \"n_A*n_B + 0.1\" } }\n";

fn fluid(psi_of_b: &str) -> Fluid {
    Model::parse("m.toml", &format!("{HEAD}{psi_of_b}")).unwrap_or_else(|e| panic!("{e}")).at(1.3).unwrap()
}

fn configuration() -> (Vec<[f64; 3]>, Vec<usize>, PeriodicBox) {
    let uniform = |k: usize| f64::from(noise::threefry2x32::<20>([k as u32, 0], [5, 9])[0]) / 4294967296.0;
    let x = (0..150).map(|k| std::array::from_fn(|c| 3.0 * uniform(3 * k + c))).collect();
    let domain = PeriodicBox::orthogonal([0.0; 3], [3.0; 3], [true; 3]).unwrap();
    (x, (0..150).map(|k| k % 2).collect(), domain)
}

/// Energy and forces of the engine.
fn engine(fluid: &Fluid, newton: Newton) -> (f64, Vec<[f64; 3]>) {
    let (x, species, domain) = configuration();
    let v = vec![[0.0; 3]; x.len()];
    let tag: Vec<i32> = (1..=x.len() as i32).collect();
    let owned = Owned { domain: &domain, x: &x, v: &v, species: &species, tag: &tag };
    let found = with_images::evaluate(fluid, owned, newton, None);
    (found.tally.energy(), found.forces)
}

fn assert_close(a: &[[f64; 3]], b: &[[f64; 3]]) {
    let scale = largest(b.as_flattened());
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((a - b).abs() < 1e-12 * scale, "{a} {b}");
    }
}

#[test]
fn the_engine_computes_what_the_reference_does() {
    let (x, species, domain) = configuration();
    for law in [STATED, OTHER] {
        let fluid = fluid(law);
        let truth = truth::conservative(&fluid, &x, &species, &domain).unwrap();
        for newton in [Newton::On, Newton::Off] {
            let (energy, forces) = engine(&fluid, newton);
            assert!((energy / truth.energy - 1.0).abs() < 1e-12, "{energy} {}", truth.energy);
            assert_close(&forces, &truth.forces);
        }
    }
}

#[test]
fn the_slopes_of_a_psi_give_its_forces() {
    let (energy, forces) = engine(&fluid(STATED), Newton::On);
    let (expected, of_psi) = engine(&fluid(FORMULA), Newton::On);
    assert!((energy / expected - 1.0).abs() < 1e-12, "{energy} {expected}");
    assert_close(&forces, &of_psi);
}

/// The plan reports a law without potential, and mean field refuses it.
#[test]
fn nobody_takes_it_for_a_free_energy() {
    let fluid = fluid(OTHER);
    assert!(!fluid.is_conservative());
    assert_eq!(fluid.stated_slopes(), Some("B"));
    let plan = Plan::new(&fluid).unwrap().to_string();
    assert!(plan.contains("slope of B    n_A: ") && plan.contains("NOT CONSERVATIVE"), "{plan}");
    // Every ψ is linear in q, which needs no pass, also with stated slopes in other densities.
    assert!(plan.contains("psi is linear in q"), "{plan}");
    assert_eq!(MeanField::new(&fluid).unwrap_err(), TheoryError::NoFreeEnergy("B".into()));
    assert!(self::fluid(FORMULA).is_conservative());
}

/// If all stated slopes are zero, no density is summed.
#[test]
fn a_law_of_zeros_needs_no_pass() {
    let text = "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"lucy\"\nrange = 1\n\
                [excess_free_energy]\nA = { slopes = { n = \"0\" } }\n";
    let fluid = Model::parse("m.toml", text).unwrap().at(1.0).unwrap();
    assert_eq!(Plan::new(&fluid).unwrap().slope_width(), 0);
}
