//! Compares the engine with the plain reference, and both with the Hamiltonian.

use super::*;
use crate::maximum::largest;
use crate::model::{Fluid, ForceLaw, Model, WarrenPair, warren_ab};
use crate::truth;
use with_images::{Outcome, Owned};

#[path = "../../tests/with_images/mod.rs"]
mod with_images;

/// A small reproducible stream of uniform numbers, from the noise generator itself.
struct Uniform(u32);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 += 1;
        noise::threefry2x32::<20>([self.0, 0], [5, 9])[0] as f64 / 4294967296.0
    }
}

struct Configuration {
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    species: Vec<usize>,
}

fn configuration(count: usize, lengths: [f64; 3], species: usize, dimensions: usize) -> Configuration {
    let domain = PeriodicBox::orthogonal([-1.0, 0.5, 2.0], lengths, [true; 3]).unwrap();
    let mut u = Uniform(count as u32 * 1000);
    let x: Vec<[f64; 3]> = (0..count)
        .map(|_| {
            let mut s = [u.next(), u.next(), u.next()];
            if dimensions == 2 {
                s[2] = 0.5;
            }
            domain.point(s)
        })
        .collect();
    Configuration {
        v: (0..count)
            .map(|_| std::array::from_fn(|k| if k < dimensions { u.next() - 0.5 } else { 0.0 }))
            .collect(),
        tag: (1..=count as i32).collect(),
        species: (0..count).map(|k| k % species).collect(),
        x,
        domain,
    }
}

fn run_engine(fluid: &Fluid, c: &Configuration, newton: Newton, step: Option<Step>) -> Outcome {
    let owned = Owned { domain: &c.domain, x: &c.x, v: &c.v, species: &c.species, tag: &c.tag };
    with_images::evaluate(fluid, owned, newton, step)
}

/// An engine that sums over pairs only.
fn summing(fluid: &Fluid) -> Engine {
    let mut engine = Engine::new(fluid, Settings::default()).unwrap();
    engine.use_pair_sums_only(true);
    engine
}

fn request(particles: Particles) -> Request {
    Request { particles, v: &[], step: None, want: Want::FORCES }
}

fn warren(species: usize, law: ForceLaw) -> Fluid {
    let names: Vec<String> = ["A", "B", "C"][..species].iter().map(|s| (*s).to_owned()).collect();
    let pair = Some(WarrenPair { a: -40.0, b: 25.0, gamma: 18.0, rc: 1.0, rd: 0.75, weight: None });
    warren_ab(&names, &vec![pair; species * species], 3, law).unwrap().at(1.0).unwrap()
}

/// A fluid with two species, two densities of different ranges and kernels, a correction, a self term,
/// formulas that couple everything, three pair forms, and two thermostats.
const MIXTURE: &str = r#"
title = "everything at once"
species = ["A", "B"]
[parameters]
a = 3.0
[density.n]
kernel = "quadratic"
range = 0.8
correction = { "A|B" = [0.13, 1.1, 0.01], "B|B" = [1.5, 0.9] }
[density.m]
kernel = "lucy"
range = 1.1
self = true
[density.q]
kernel = "wendland-c2"
range = 0.9
[excess_free_energy]
A = "a*n_A*n_B + 0.1*m^2 + kT*ln(1 + m_B) + 0.7*q_B - 0.2*q_A"
B = "a*n_A^2 + exp(-0.1*n_B) + 0.02*m_A^3 + 0.3*q"
[[pair]]
between = ["A", "B"]
form = "soft"
strength = "10*a"
range = 1.0
[[pair]]
between = ["A", "A"]
form = "spline"
strength = 9.5
A = 2
B = 1
range_A = 0.8
range_B = 1.0
[[pair]]
between = ["B", "B"]
form = "expression"
phi = "2*(1 - r^2)^2"
range = 1.0
[[thermostat]]
gamma = 4.5
range = 1.0
[[thermostat]]
between = ["B", "A"]
gamma = 9.0
range = 0.7
exponent = 0.5
"#;

fn close(a: f64, b: f64, scale: f64, what: &str) {
    assert!((a - b).abs() <= 1e-12 * scale.max(1.0), "{what}: {a} against {b}");
}

fn assert_matches_reference(fluid: &Fluid, c: &Configuration) {
    let step = Step { seed: 12, number: 77, dt: 0.01 };
    let truth = truth::conservative(fluid, &c.x, &c.species, &c.domain).unwrap();
    let (thermal, thermal_virial) =
        truth::drag_and_noise(fluid, &c.x, &c.v, &c.tag, &c.species, &c.domain, step);
    // In an infinite step the noise is zero.
    let endless = Step { dt: f64::INFINITY, ..step };
    let (_, drag) = truth::drag_and_noise(fluid, &c.x, &c.v, &c.tag, &c.species, &c.domain, endless);
    let scale = largest(truth.forces.as_flattened());
    for newton in [Newton::On, Newton::Off] {
        let quiet = run_engine(fluid, c, newton, None);
        for (i, force) in quiet.forces.iter().enumerate() {
            for k in 0..3 {
                close(force[k], truth.forces[i][k], scale, "force");
            }
        }
        close(quiet.tally.energy(), truth.energy, truth.energy.abs(), "energy");
        close(quiet.energy.iter().sum(), truth.energy, truth.energy.abs(), "sum of particle energies");
        for k in 0..6 {
            let size = largest(truth.virial);
            close(quiet.tally.virial[k], truth.virial[k], size, "virial");
            close(quiet.virial.iter().map(|w| w[k]).sum(), truth.virial[k], size, "sum of particle virials");
        }
        for (a, b) in quiet.densities.iter().zip(&truth.densities) {
            close(*a, *b, b.abs(), "density");
        }
        assert_eq!(quiet.counts.noise, 0);
        let loud = run_engine(fluid, c, newton, Some(step));
        for i in 0..c.x.len() {
            for k in 0..3 {
                close(loud.forces[i][k], truth.forces[i][k] + thermal[i][k], scale, "force with noise");
            }
        }
        for k in 0..6 {
            let size = thermal_virial.iter().fold(100.0f64, |m, w| m.max(w.abs()));
            close(loud.tally.thermostat_virial[k], thermal_virial[k], size, "thermostat virial");
            close(loud.tally.drag_virial[k], drag[k], size, "drag virial");
        }
    }
}

/// `U = Σ ψ(ñ) + Σ φ` by the definition, to test the reference; ψ must be a formula without bounds.
fn hamiltonian(fluid: &Fluid, c: &Configuration) -> f64 {
    let count = fluid.species.len();
    let mut energy = 0.0;
    for (i, &alpha) in c.species.iter().enumerate() {
        let mut n = vec![0.0; fluid.variables()];
        for (d, density) in fluid.densities.iter().enumerate().filter(|(_, d)| d.includes_self) {
            n[d * count + alpha] = density.kernel.value(0.0);
        }
        for (j, &beta) in c.species.iter().enumerate() {
            for shift in (0..125).map(|m| [m % 5 - 2, m / 5 % 5 - 2, m / 25 - 2]) {
                if i == j && shift == [0; 3] {
                    continue;
                }
                let image = |m: usize| (0..3).map(|k| f64::from(shift[k]) * c.domain.edge(k)[m]).sum::<f64>();
                let r = (0..3).map(|m| (c.x[i][m] - c.x[j][m] + image(m)).powi(2)).sum::<f64>().sqrt();
                for (d, density) in fluid.densities.iter().enumerate() {
                    n[d * count + beta] += density.kernel.value(r);
                }
                for term in fluid.pairs.iter().filter(|t| t.acts(alpha, beta, r)) {
                    energy += 0.5 * crate::model::pair::PairForm::at(&term.potential, r).0;
                }
            }
        }
        for (v, n) in n.iter_mut().enumerate() {
            *n = fluid.densities[v / count].correction[alpha * count + v % count].at(*n).0;
        }
        let crate::model::ExcessFreeEnergy::Formula(psi) = &fluid.excess[alpha] else { panic!("no formula") };
        energy += psi.value(&n);
    }
    energy
}

#[test]
fn the_energy_of_the_reference_is_the_hamiltonian() {
    let mixture = Model::parse("mixture", MIXTURE).unwrap().at(1.3).unwrap();
    for (fluid, lengths) in [(warren(1, ForceLaw::Conservative), [2.3, 2.1, 2.5]), (mixture, [2.3, 0.9, 1.2])]
    {
        let c = configuration(60, lengths, fluid.species.len(), 3);
        let truth = hamiltonian(&fluid, &c);
        let found = truth::conservative(&fluid, &c.x, &c.species, &c.domain).unwrap().energy;
        assert!((found - truth).abs() < 1e-11 * truth.abs(), "{found} {truth}");
    }
}

#[test]
fn engine_equals_reference_for_warren_in_both_laws() {
    let c = configuration(300, [3.1, 4.0, 3.5], 1, 3);
    assert_matches_reference(&warren(1, ForceLaw::Conservative), &c);
    assert_matches_reference(&warren(1, ForceLaw::LucyLammps), &c);
}

#[test]
fn engine_equals_reference_for_a_mixture_of_everything() {
    let fluid = Model::parse("mixture", MIXTURE).unwrap().at(1.3).unwrap();
    assert_matches_reference(&fluid, &configuration(250, [3.1, 4.0, 3.5], 2, 3));
}

/// In boxes narrower than the cut-off a particle is near several images of its neighbours and of itself.
#[test]
fn engine_equals_reference_in_tiny_boxes() {
    let fluid = Model::parse("mixture", MIXTURE).unwrap().at(1.3).unwrap();
    let c = configuration(7, [0.9, 1.3, 0.6], 2, 3);
    let truth = truth::conservative(&fluid, &c.x, &c.species, &c.domain).unwrap();
    for newton in [Newton::On, Newton::Off] {
        let engine = run_engine(&fluid, &c, newton, None);
        close(engine.tally.energy(), truth.energy, truth.energy.abs(), "energy");
        for (a, b) in engine.forces.iter().flatten().zip(truth.forces.iter().flatten()) {
            close(*a, *b, 1e3, "force");
        }
    }
}

#[test]
fn engine_equals_reference_in_two_dimensions() {
    let text = r#"
title = "flat"
dimensions = 2
species = ["A"]
[density.n]
kernel = "quadratic"
range = 1.0
[excess_free_energy]
A = "-kT*ln(1 - 0.016*n) - 0.03*n - 0.0012*n^2"
[[thermostat]]
gamma = 1.0
range = 1.0
"#;
    let fluid = Model::parse("flat", text).unwrap().at(0.75).unwrap();
    assert_matches_reference(&fluid, &configuration(200, [5.0, 4.0, 1.0], 1, 2));
}

/// The mixture with bounds that most particles violate, in two densities, on both sides.
fn bounded_mixture(below: &str) -> Fluid {
    let text = MIXTURE
        .replace("range = 0.8\ncorr", "range = 0.8\nbounds = [1.7, 3.5]\ncorr")
        .replace("self = true", &format!("self = true\nbounds = [2.4, 4.2]\nbelow = \"{below}\""));
    Model::parse("bounded", &text).unwrap().at(1.3).unwrap()
}

#[test]
fn engine_equals_reference_out_of_bounds() {
    for below in ["linear", "constant"] {
        let fluid = bounded_mixture(below);
        let c = configuration(250, [3.1, 4.0, 3.5], 2, 3);
        assert_matches_reference(&fluid, &c);
        let [low, high] = run_engine(&fluid, &c, Newton::On, None).out_of_bounds;
        assert!(low > 100 && high > 100 && low <= 250 && high <= 250, "{low} {high}");
    }
    assert_eq!(
        run_engine(&warren(1, ForceLaw::Conservative), &configuration(50, [3.0; 3], 1, 3), Newton::On, None)
            .out_of_bounds,
        [0; 2]
    );
}

/// With every density below its bounds and ψ′ constant there, only a pair force is left.
#[test]
fn constant_continuation_is_plain_dpd_in_thin_regions() {
    let text = r#"
title = "thin"
species = ["A"]
[density.n]
kernel = "quadratic"
range = 1.0
bounds = [1e3, 1e4]
below = "constant"
[excess_free_energy]
A = "ln(n)"
"#;
    let thin = Model::parse("thin", text).unwrap().at(1.0).unwrap();
    let pair = r#"
title = "pair"
species = ["A"]
[[pair]]
between = ["A", "A"]
form = "soft"
strength = "1e-3*30/pi"
range = 1.0
"#;
    let pair = Model::parse("pair", pair).unwrap().at(1.0).unwrap();
    let c = configuration(200, [4.0, 4.0, 4.0], 1, 3);
    let a = run_engine(&thin, &c, Newton::On, None);
    let b = run_engine(&pair, &c, Newton::On, None);
    for (f, g) in a.forces.iter().flatten().zip(b.forces.iter().flatten()) {
        close(*f, *g, 1.0, "force");
    }
    assert_eq!(a.out_of_bounds, [200, 0]);
}

/// Compares forces with central differences of the energy, and the virial with differences in a strain.
#[test]
fn forces_and_virial_are_gradients_of_the_energy() {
    let free = Model::parse("mixture", MIXTURE).unwrap().at(1.3).unwrap();
    for fluid in [free, bounded_mixture("linear"), bounded_mixture("constant")] {
        are_gradients(&fluid);
    }
}

fn are_gradients(fluid: &Fluid) {
    let c = configuration(60, [2.3, 2.1, 2.5], 2, 3);
    let energy = |x: &[[f64; 3]], domain: &PeriodicBox| {
        truth::conservative(fluid, x, &c.species, domain).unwrap().energy
    };
    let here = run_engine(fluid, &c, Newton::On, None);
    let scale = largest(here.forces.as_flattened());
    for i in [0, 7, 31] {
        for k in 0..3 {
            let difference = five_point(|h| {
                let mut x = c.x.clone();
                x[i][k] += h;
                energy(&x, &c.domain)
            });
            assert!(
                (here.forces[i][k] + difference).abs() < 1e-8 * scale,
                "force on {i}: {} against {}",
                here.forces[i][k],
                -difference
            );
        }
    }
    for (w, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        let difference = five_point(|h| {
            // The strain x_a → x_a + h x_b acts on the box and the particles.
            let strain = |p: [f64; 3]| {
                let mut q = p;
                q[a] += h * p[b];
                q
            };
            let edges = nalgebra::Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|k| {
                nalgebra::Vector3::from(strain(c.domain.edge(k)))
            }));
            let domain = PeriodicBox::new(strain(c.domain.origin()), edges, [true; 3]).unwrap();
            let x: Vec<_> = c.x.iter().map(|p| strain(*p)).collect();
            energy(&x, &domain)
        });
        let size = largest(here.tally.virial);
        assert!(
            (here.tally.virial[w] + difference).abs() < 1e-8 * size,
            "virial {w}: {} against {}",
            here.tally.virial[w],
            -difference
        );
    }
}

/// The fourth-order central difference.
fn five_point(f: impl Fn(f64) -> f64) -> f64 {
    let h = 2e-4;
    (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)
}

#[test]
fn one_species_equals_identical_species() {
    let one = configuration(300, [3.1, 4.0, 3.5], 1, 3);
    let three = Configuration {
        species: (0..300).map(|k| k % 3).collect(),
        ..configuration(300, [3.1, 4.0, 3.5], 1, 3)
    };
    let step = Some(Step { seed: 3, number: 5, dt: 0.02 });
    let a = run_engine(&warren(1, ForceLaw::Conservative), &one, Newton::On, step);
    let b = run_engine(&warren(3, ForceLaw::Conservative), &three, Newton::On, step);
    close(a.tally.energy(), b.tally.energy(), a.tally.energy().abs(), "energy");
    for (f, g) in a.forces.iter().flatten().zip(b.forces.iter().flatten()) {
        close(*f, *g, 1e3, "force");
    }
}

/// Tests translation, permutation and rotation of the box by a quarter turn.
#[test]
fn invariances() {
    let fluid = Model::parse("mixture", MIXTURE).unwrap().at(1.3).unwrap();
    let c = configuration(200, [3.1, 4.0, 3.5], 2, 3);
    let step = Some(Step { seed: 3, number: 5, dt: 0.02 });
    let here = run_engine(&fluid, &c, Newton::On, step);
    let total: [f64; 3] = std::array::from_fn(|k| here.forces.iter().map(|f| f[k]).sum());
    assert!(total.iter().all(|t| t.abs() < 1e-9), "momentum: {total:?}");

    let mut moved = configuration(200, [3.1, 4.0, 3.5], 2, 3);
    for x in &mut moved.x {
        *x = [x[0] + 0.77, x[1] - 1.9, x[2] + 30.1];
        moved.domain.wrap(x, &mut [0; 3]);
    }
    let there = run_engine(&fluid, &moved, Newton::On, step);
    for (f, g) in here.forces.iter().flatten().zip(there.forces.iter().flatten()) {
        close(*f, *g, 1e4, "translated force");
    }

    let order: Vec<usize> = (0..200).map(|k| (k * 77 + 13) % 200).collect();
    let pick = |k: usize| order[k];
    let shuffled = Configuration {
        domain: c.domain.clone(),
        x: (0..200).map(|k| c.x[pick(k)]).collect(),
        v: (0..200).map(|k| c.v[pick(k)]).collect(),
        tag: (0..200).map(|k| c.tag[pick(k)]).collect(),
        species: (0..200).map(|k| c.species[pick(k)]).collect(),
    };
    let there = run_engine(&fluid, &shuffled, Newton::On, step);
    for k in 0..200 {
        for m in 0..3 {
            close(there.forces[k][m], here.forces[pick(k)][m], 1e3, "permuted force");
        }
    }

    let turn = |p: [f64; 3]| [-p[1], p[0], p[2]];
    let corner = [-(0.5 + 4.0), -1.0, 2.0];
    let turned = Configuration {
        domain: PeriodicBox::orthogonal(corner, [4.0, 3.1, 3.5], [true; 3]).unwrap(),
        x: c.x.iter().map(|x| turn(*x)).collect(),
        v: c.v.iter().map(|v| turn(*v)).collect(),
        tag: c.tag.clone(),
        species: c.species.clone(),
    };
    let there = run_engine(&fluid, &turned, Newton::On, step);
    for k in 0..200 {
        let expected = turn(here.forces[k]);
        for m in 0..3 {
            close(there.forces[k][m], expected[m], 1e3, "turned force");
        }
    }
}

/// Warren eq. 15: two densities, of which the linear one is equivalent to a pair force, equal the pair
/// form; the linear density needs no pass.
#[test]
fn two_density_form_equals_pair_form_and_leaves_the_linear_pass_out() {
    let text = r#"
title = "Warren eq. 15"
species = ["A"]
[density.n]
kernel = "quadratic"
range = 1.0
[density.m]
kernel = "quadratic"
range = 0.75
[excess_free_energy]
A = "pi/30*(-40)*n + pi*0.75^4/30*25*m^2"
"#;
    let two = Model::parse("two", text).unwrap().at(1.0).unwrap();
    let c = configuration(300, [3.1, 4.0, 3.5], 1, 3);
    let mut engine = summing(&two);
    assert_eq!(engine.plan().slope_width(), 1);
    let a = run_engine(&two, &c, Newton::On, None);
    let b = run_engine(&warren(1, ForceLaw::Conservative), &c, Newton::On, None);
    close(a.tally.energy(), b.tally.energy(), a.tally.energy().abs(), "energy");
    for (f, g) in a.forces.iter().flatten().zip(b.forces.iter().flatten()) {
        close(*f, *g, 1e3, "force");
    }
    let kind = vec![0; 300];
    let particles = Particles { owned: 300, x: &c.x, tag: &c.tag, kind: &kind };
    let request = request(particles);
    let mut f = vec![[0.0; 3]; 300];
    let pending = engine.first(Surroundings::ghosts(Newton::On), &request, &mut f).unwrap();
    pending.finish(&mut engine, &request, &mut f).unwrap();
    let counts = engine.statistics().counts;
    assert_eq!((counts.density, counts.excess), (1, 1));
    assert_eq!((counts.noise, counts.energy, counts.virial), (0, 0, 0));
}

/// A linear ψ with the quadratic kernel is standard DPD to rounding, without any density pass.
#[test]
fn linear_psi_is_standard_dpd_and_needs_no_density_pass() {
    let head = "title = \"t\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
    let psi = format!(
        "{head}[density.n]\nkernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\nA = \"pi/30*25*n\"\n"
    );
    let soft =
        format!("{head}[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n");
    let psi = Model::parse("psi", &psi).unwrap().at(1.0).unwrap();
    let soft = Model::parse("soft", &soft).unwrap().at(1.0).unwrap();
    let c = configuration(200, [4.0, 4.0, 4.0], 1, 3);
    let step = Some(Step { seed: 3, number: 5, dt: 0.02 });
    let a = run_engine(&psi, &c, Newton::On, step);
    let b = run_engine(&soft, &c, Newton::On, step);
    close(a.tally.energy(), b.tally.energy(), a.tally.energy().abs(), "energy");
    for (f, g) in a.forces.iter().flatten().zip(b.forces.iter().flatten()) {
        close(*f, *g, 1e3, "force");
    }
    assert_eq!(a.counts.excess, 0);
    assert_eq!(summing(&psi).plan().slope_width(), 0);
}

#[test]
fn trouble_is_an_error_that_names_the_particle() {
    let fluid = warren(1, ForceLaw::Conservative);
    let mut engine = summing(&fluid);
    let check = |engine: &mut Engine, x: [[f64; 3]; 2], tag: [i32; 2], kind: [i32; 2]| {
        let particles = Particles { owned: 2, x: &x, tag: &tag, kind: &kind };
        engine.first(Surroundings::ghosts(Newton::On), &request(particles), &mut []).map(drop)
    };
    let fine = [[0.0; 3], [0.5, 0.0, 0.0]];
    assert_eq!(check(&mut engine, fine, [1, 2], [0, 0]), Ok(()));
    let lost = [[0.0; 3], [f64::NAN, 0.0, 0.0]];
    assert_eq!(check(&mut engine, lost, [1, 8], [0, 0]), Err(EngineError::Position { tag: 8 }));
    assert_eq!(check(&mut engine, fine, [1, 0], [0, 0]), Err(EngineError::Tag { tag: 0 }));
    assert_eq!(check(&mut engine, fine, [1, 2], [0, 3]), Err(EngineError::Kind { tag: 2, kind: 3 }));

    let text = "title = \"vdw\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                [excess_free_energy]\nA = \"-ln(1 - n)\"\n";
    let mut engine = summing(&Model::parse("vdw", text).unwrap().at(1.0).unwrap());
    let on_top = [[0.0; 3], [0.0, 0.0, 0.0]];
    let error = check(&mut engine, on_top, [1, 2], [0, 0]).unwrap_err();
    assert!(matches!(error, EngineError::ExcessFreeEnergy { tag: 1, .. }), "{error}");
}

/// A particle far away must not enlarge the grid without limit.
#[test]
fn a_runaway_particle_costs_no_memory() {
    let fluid = warren(1, ForceLaw::Conservative);
    let mut engine = summing(&fluid);
    let x = [[0.0; 3], [1e300, -1e250, 3e12], [0.4, 0.0, 0.0]];
    let particles = Particles { owned: 3, x: &x, tag: &[1, 2, 3], kind: &[0, 0, 0] };
    let _pending = engine.first(Surroundings::ghosts(Newton::On), &request(particles), &mut []).unwrap();
    let densities = engine.results().densities;
    assert!(densities[0] > 0.0 && densities[1] == 0.0);
}

/// Particles without a species are left out.
#[test]
fn unmapped_kinds_are_ignored() {
    let fluid = warren(1, ForceLaw::Conservative);
    let mut engine = summing(&fluid);
    engine.map_kinds(&[-1, 0, -1]).unwrap();
    let x = [[0.0; 3], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0]];
    let particles = Particles { owned: 3, x: &x, tag: &[1, 2, 3], kind: &[1, 2, 1] };
    let request = request(particles);
    let mut f = vec![[0.0; 3]; 3];
    let pending = engine.first(Surroundings::ghosts(Newton::On), &request, &mut f).unwrap();
    pending.finish(&mut engine, &request, &mut f).unwrap();
    assert_eq!(f[1], [0.0; 3]);
    assert!(f[0][1] != 0.0 && f[0][0] == 0.0);
    assert!(engine.map_kinds(&[0, 1]).is_err());
}
