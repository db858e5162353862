//! Compares energy changes of single moves with the energy of the whole configuration.

use nalgebra::Matrix3;
use psidpd_core::engine::{EngineError, LocalEnergy, NoEnergy, Particles, PeriodicBox, noise};
use psidpd_core::model::kernel::{Kernel, KernelKind};
use psidpd_core::model::{Fluid, Model};
use psidpd_core::truth;
use std::path::Path;

struct Uniform(u32);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 += 1;
        f64::from(noise::threefry2x32::<20>([self.0, 0], [5, 9])[0]) / 4_294_967_296.0
    }

    fn point(&mut self, domain: &PeriodicBox, dimensions: usize) -> [f64; 3] {
        let s = [self.next(), self.next(), if dimensions == 3 { self.next() } else { 0.5 }];
        domain.point(s)
    }
}

/// Particles, and the energy that is updated with them.
struct Case {
    fluid: Fluid,
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    kind: Vec<i32>,
    tag: Vec<i32>,
    local: LocalEnergy,
    random: Uniform,
}

impl Case {
    fn new(fluid: Fluid, domain: PeriodicBox, count: usize) -> Case {
        let mut random = Uniform(17);
        let mut local = LocalEnergy::new(&fluid).unwrap();
        let kind: Vec<i32> = (0..count).map(|k| (k % fluid.species.len()) as i32).collect();
        let tag: Vec<i32> = (1..=count as i32).collect();
        // The start must have no infinite energies.
        for _ in 0..200 {
            let x: Vec<_> = (0..count).map(|_| random.point(&domain, fluid.dimensions)).collect();
            let particles = Particles { owned: count, x: &x, tag: &tag, kind: &kind };
            if local.load(&domain, &particles).is_ok() && energy(&fluid, &x, &kind, &domain).is_finite() {
                return Case { fluid, domain, x, kind, tag, local, random };
            }
        }
        panic!("{}: no start", fluid.title);
    }

    /// A new place, either anywhere or near the old one, perhaps outside the box.
    fn place(&mut self, particle: usize) -> [f64; 3] {
        let far = self.random.next() < 0.3;
        let to = self.random.point(&self.domain, self.fluid.dimensions);
        if far { to } else { [0, 1, 2].map(|c| self.x[particle][c] + 0.3 * (to[c] - self.x[particle][c])) }
    }

    /// Makes trial moves, accepts all of finite energy, and compares their changes with whole energies.
    fn check(&mut self, trials: usize) {
        let whole = |x: &[[f64; 3]], case: &Case| energy(&case.fluid, x, &case.kind, &case.domain);
        let mut before = whole(&self.x, self);
        for trial in 0..trials {
            let particle = (self.random.next() * self.x.len() as f64) as usize;
            let mut to = self.place(particle);
            if trial % 7 == 0 {
                (0..3).for_each(|c| to[c] -= self.domain.edge(0)[c]);
                if !self.domain.periodic()[0] {
                    to = self.x[particle];
                }
            }
            let Ok(change) = self.local.change(particle, to, self.tag[particle]) else { continue };
            let mut x = self.x.clone();
            self.domain.wrap(&mut to, &mut [0; 3]);
            x[particle] = to;
            let after = whole(&x, self);
            if !after.is_finite() {
                assert!(!change.is_finite(), "{}: {change} for {after}", self.fluid.title);
                continue;
            }
            let scale = before.abs() + after.abs() + 1.0;
            assert!(
                (change - (after - before)).abs() < 1e-10 * scale,
                "{}, trial {trial}: {change} for {} of {before}",
                self.fluid.title,
                after - before
            );
            self.local.accept(&mut [0; 3]);
            (self.x, before) = (x, after);
            assert_eq!(self.local.positions(), self.x);
        }
    }
}

fn energy(fluid: &Fluid, x: &[[f64; 3]], kind: &[i32], domain: &PeriodicBox) -> f64 {
    let species: Vec<usize> = kind.iter().map(|k| *k as usize).collect();
    truth::conservative(fluid, x, &species, domain).unwrap().energy
}

fn cube(edge: f64) -> PeriodicBox {
    PeriodicBox::orthogonal([-1.0, 0.5, 2.0], [edge; 3], [true; 3]).unwrap()
}

/// A box with edges along the axes for a two- or three-dimensional model, in which `count`
/// particles have the density `density`.
fn fitting(fluid: &Fluid, count: usize, density: f64) -> PeriodicBox {
    cube((count as f64 / density).powf(1.0 / fluid.dimensions as f64))
}

fn shipped(name: &str) -> Fluid {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/models").join(name);
    Model::open(&path).unwrap().at(1.0).unwrap()
}

fn mixture(dimensions: usize) -> Fluid {
    let text = format!(
        r#"
title = "mixture"
dimensions = {dimensions}
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range = 0.8
self = true
bounds = [0.8, 3.0]
correction = {{ "A|A" = [0.1, 1.1, 0.02], "A|B" = [0.0, 1.0], "B|A" = [0.2, 0.9], "B|B" = [0.0, 1.0, 0.01] }}
[density.m]
kernel = "lucy"
range = 1.0
self = true
[density.q]
kernel = "wendland-c2"
range = 0.7
self = true
[excess_free_energy]
A = "kT*n_A*ln(n_A) + 0.3*n_A^2*n_B + m_B^3 + 0.2*m_A^2 + 0.7*q_A"
B = "n_B^3 + sqrt(n_A)*m_A^2 + 0.4*q_A - 0.2*q_B"
[[pair]]
between = ["A", "B"]
form = "soft"
strength = 10
range = 1
[[pair]]
between = ["B", "B"]
form = "expression"
phi = "3*(1 - r)^2*cos(r)"
range = 0.9
"#
    );
    Model::parse("m.toml", &text).unwrap_or_else(|e| panic!("{e}")).at(1.3).unwrap()
}

#[test]
fn changes_are_those_of_the_whole_energy_in_every_model_that_ships() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/models");
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    names.sort();
    assert!(names.len() > 20);
    for name in names {
        let fluid = shipped(&name);
        let domain = fitting(&fluid, 50, if fluid.dimensions == 2 { 12.0 } else { 4.0 });
        Case::new(fluid, domain, 50).check(40);
    }
}

#[test]
fn changes_are_those_of_the_whole_energy_in_every_box() {
    let skew = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 3.0);
    let open = |periodic| PeriodicBox::orthogonal([0.0; 3], [4.0, 3.0, 5.0], periodic).unwrap();
    let boxes = [
        PeriodicBox::new([1.0, 2.0, 3.0], skew, [true; 3]).unwrap(),
        open([true, false, true]),
        open([false; 3]),
        cube(3.1),
        // The box is narrower than the range, or than twice the range: particles are near
        // images of others and of themselves.
        cube(0.9),
        cube(1.7),
        PeriodicBox::orthogonal([0.0; 3], [0.8, 6.0, 6.0], [true; 3]).unwrap(),
    ];
    for domain in boxes {
        let count = (3.0 * domain.volume(3)).clamp(4.0, 80.0) as usize;
        Case::new(mixture(3), domain, count).check(60);
    }
    let plane = PeriodicBox::orthogonal([0.0, 0.0, -0.5], [5.0, 7.0, 1.0], [true; 3]).unwrap();
    Case::new(mixture(2), plane, 60).check(60);
}

#[test]
fn after_many_moves_densities_are_those_from_the_beginning() {
    for (fluid, domain, count) in [
        (shipped("warren2003-set6.toml"), cube(4.0), 387),
        (mixture(3), cube(3.1), 90),
        (mixture(3), cube(1.5), 12),
    ] {
        let mut case = Case::new(fluid, domain, count);
        let mut accepted = 0;
        let mut image = [0; 3];
        while accepted < 10_000 {
            let particle = (case.random.next() * count as f64) as usize;
            let to = case.place(particle);
            if case.local.change(particle, to, 1).is_ok_and(f64::is_finite) {
                case.local.accept(&mut image);
                case.x[particle] = case.local.positions()[particle];
                accepted += 1;
            }
        }
        let followed = case.local.densities().to_vec();
        let particles = Particles { owned: count, x: &case.x, tag: &case.tag, kind: &case.kind };
        case.local.load(&case.domain, &particles).unwrap();
        let error =
            followed.iter().zip(case.local.densities()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-9, "{}: {error}", case.fluid.title);
        case.check(20);
    }
}

/// A gas in which pairs meet and part: a density that loses its last neighbour is zero, or `w(0)`, to the last bit. Powers that
/// are steep at zero, or are no number below, would tell; so would a formula that refuses all that is below `w(0)`.
fn gas(dimensions: usize, own: bool) -> Fluid {
    let w = Kernel::new(KernelKind::Quadratic, 1.0, dimensions).value(0.0);
    let psi = match own {
        false => "A = \"0.5*n_A^2.5 + sqrt(n_B) + m_A^1.5\"\nB = \"n_A^0.1 + 0.2*n_B^1.5 + 0.1*m_A^0.5\"\n"
            .to_owned(),
        true => {
            format!("A = \"0.5*(n_A - {w:?})^2.5 + sqrt(n_B)\"\nB = \"sqrt(n_B - {w:?}) + 0.1*m_A^0.5\"\n")
        }
    };
    let text = format!(
        "title = \"gas\"\ndimensions = {dimensions}\nspecies = [\"A\", \"B\"]\n\
         [density.n]\nkernel = \"quadratic\"\nrange = 1.0\nself = {own}\n\
         [density.m]\nkernel = \"lucy\"\nrange = 0.8\n[excess_free_energy]\n{psi}"
    );
    Model::parse("m.toml", &text).unwrap_or_else(|e| panic!("{e}")).at(1.0).unwrap()
}

#[test]
fn a_density_that_loses_its_last_neighbour_is_zero() {
    for (dimensions, own) in [(3, false), (2, false), (3, true), (2, true)] {
        let fluid = gas(dimensions, own);
        let domain = match dimensions {
            3 => cube(3.4),
            _ => PeriodicBox::orthogonal([0.0, 0.0, -0.5], [5.0, 4.0, 1.0], [true, false, true]).unwrap(),
        };
        let mut case = Case::new(fluid, domain, 12);
        case.check(2000);
        let least = if own { case.fluid.densities[0].kernel.value(0.0) } else { 0.0 };
        let width = case.local.densities().len() / 12;
        let own_densities: Vec<f64> = (0..12).map(|k| case.local.densities()[k * width + k % 2]).collect();
        assert!(own_densities.iter().all(|n| *n >= least), "{own_densities:?}");
        assert!(own_densities.contains(&least), "no particle is alone: {own_densities:?}");
    }
}

/// A million sweeps of a few particles, without fresh sums: rounding errors of densities stay those of some hundred additions
/// of numbers near 10, and the energy that all changes add up to is that of the last configuration.
#[test]
fn densities_do_not_drift_in_a_million_sweeps() {
    let fluid = gas(2, false);
    let domain = PeriodicBox::orthogonal([0.0, 0.0, -0.5], [2.6, 2.4, 1.0], [true; 3]).unwrap();
    let count = 3;
    let mut case = Case::new(fluid, domain, count);
    let start = energy(&case.fluid, &case.x, &case.kind, &case.domain);
    let (mut sum, mut image) = (0.0, [0; 3]);
    // Marsaglia's xorshift, as Threefry would take most of the time.
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for trial in 0..1_000_000 * count {
        let k = trial % count;
        let x = case.local.positions()[k];
        let to = [0, 1, 2].map(|c| if c < 2 { x[c] + 1.2 * (random() - 0.5) } else { x[c] });
        let change = case.local.change(k, to, 1).unwrap();
        if random() < (-change).exp() {
            case.local.accept(&mut image);
            sum += change;
        }
    }
    case.x = case.local.positions().to_vec();
    let end = energy(&case.fluid, &case.x, &case.kind, &case.domain);
    assert!((start + sum - end).abs() < 1e-6, "{start} {sum} {end}");
    let followed = case.local.densities().to_vec();
    let particles = Particles { owned: count, x: &case.x, tag: &case.tag, kind: &case.kind };
    case.local.load(&case.domain, &particles).unwrap();
    for (a, b) in followed.iter().zip(case.local.densities()) {
        assert!((a - b).abs() < 1e-12 && (*b > 0.0 || a == b), "{followed:?} {:?}", case.local.densities());
    }
}

/// An energy that is NaN is an error; one beyond a pole is refused as infinite; from an infinite
/// energy any finite one is accepted.
#[test]
fn energies_that_are_not_finite() {
    let fluid = |psi: &str, pair: &str| {
        let text = format!(
            "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
             [excess_free_energy]\nA = \"{psi}\"\n{pair}"
        );
        Model::parse("m.toml", &text).unwrap().at(1.0).unwrap()
    };
    let domain = cube(6.0);
    let at = |r: f64| [[0.0, 1.0, 3.0], [r, 1.0, 3.0]];
    let load = |fluid: &Fluid, r: f64| {
        let mut local = LocalEnergy::new(fluid).unwrap();
        let particles = Particles { owned: 2, x: &at(r), tag: &[7, 9], kind: &[0, 0] };
        local.load(&domain, &particles).map(|()| local)
    };
    // w(0) is 2.4: one ψ has a pole at n = 1, the other has no finite energy for an isolated particle.
    let pole = fluid("-ln(1 - n) + ln(n + 1)", "");
    assert_eq!(load(&pole, 0.9).unwrap().change(1, at(0.1)[1], 9).unwrap(), f64::INFINITY);
    let stopped = load(&pole, 0.1).unwrap_err();
    assert!(matches!(stopped, EngineError::ExcessFreeEnergy { tag: 7, .. }), "{stopped}");
    let logarithm = fluid("n*ln(n)", "");
    let stopped = load(&logarithm, 0.5).unwrap().change(1, at(2.0)[1], 9).unwrap_err();
    assert!(matches!(stopped, EngineError::ExcessFreeEnergy { tag: 9, .. }), "{stopped}");
    let stopped = load(&fluid("ln(n)", ""), 0.5).unwrap().change(1, at(2.0)[1], 9).unwrap_err();
    assert!(matches!(stopped, EngineError::ExcessFreeEnergy { tag: 9, .. }), "{stopped}");
    let overlap = fluid(
        "0",
        "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\nphi = \"(1 - r)^2/r\"\nrange = 1.0\n",
    );
    assert_eq!(load(&overlap, 0.0).unwrap().change(1, at(0.1)[1], 9).unwrap(), f64::NEG_INFINITY);
    assert_eq!(load(&overlap, 0.5).unwrap().change(1, at(0.0)[1], 9).unwrap(), f64::INFINITY);
}

#[test]
fn laws_without_energy_are_refused() {
    let head = "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n";
    let texts = [
        format!("{head}[excess_free_energy]\nA = {{ energy = \"n\", slopes = {{ n = \"n\" }} }}\n"),
        format!("{head}force_kernel = \"lucy\"\n[excess_free_energy]\nA = \"n^2\"\n"),
    ];
    for (text, what) in texts.iter().zip(["slopes of A", "density n"]) {
        let fluid = Model::parse("m.toml", text).unwrap_or_else(|e| panic!("{e}")).at(1.0).unwrap();
        let refused = LocalEnergy::new(&fluid).unwrap_err();
        assert!(matches!(&refused, NoEnergy::NotConservative(w) if w.contains(what)), "{refused}");
    }
}
