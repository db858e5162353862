//! Forces for a host that keeps the particles, whole and divided among two ranks, beside the plain reference.
#![cfg(feature = "wgpu")]

mod common;

use common::{device, model, particles};
use nalgebra::Matrix3;
use psidpd_core::engine::{
    Around, Engine, EngineError, Mark, Newton, Particles, Path, PeriodicBox, Reason, Request, Settings, Step,
    Surroundings, Tally, Want,
};
use psidpd_core::maximum::largest;
use psidpd_core::model::{Fluid, Model};
use psidpd_core::truth;
use psidpd_gpu::GpuForces;

const STEP: Step = Step { seed: 99, number: 3, dt: 0.01 };

fn engine(fluid: &Fluid) -> Engine {
    let mut engine = Engine::new(fluid, Settings::default()).unwrap();
    engine.use_device(Some(Box::new(GpuForces::new(&device(), fluid).unwrap())));
    // Types are counted from 1, and those of type 4 do not interact.
    let mut kinds = vec![-1, -1, -1, -1, -1];
    (0..fluid.species.len()).for_each(|s| kinds[s + 1] = s as i32);
    engine.map_kinds(&kinds).unwrap();
    engine
}

/// What a host passes.
#[derive(Default)]
struct Arrays {
    owned: usize,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
    images: Vec<bool>,
}

impl Arrays {
    fn request(&self, step: Option<Step>) -> Request<'_> {
        let particles = Particles { owned: self.owned, x: &self.x, tag: &self.tag, kind: &self.kind };
        Request { particles, v: &self.v, step, want: Want::TOTALS }
    }

    fn add(&mut self, all: &Arrays, k: usize, by: [f64; 3]) {
        self.x.push([0, 1, 2].map(|c| all.x[k][c] + by[c]));
        self.v.push(all.v[k]);
        self.tag.push(all.tag[k]);
        self.kind.push(all.kind[k]);
    }
}

/// One of two ranks along the first direction, with its ghosts up to the cutoff and a skin. Directions that are `closed` have
/// images along them flagged.
fn rank(
    all: &Arrays,
    domain: &PeriodicBox,
    closed: [bool; 3],
    half: usize,
    reach: f64,
    dimensions: usize,
) -> Arrays {
    let is_own = |k: usize| (domain.fraction(all.x[k])[0].rem_euclid(1.0) >= 0.5) == (half == 1);
    let mut rank = Arrays::default();
    (0..all.x.len()).filter(|k| is_own(*k)).for_each(|k| rank.add(all, k, [0.0; 3]));
    rank.owned = rank.x.len();
    let shifts = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
    for shift in shifts.filter(|shift| dimensions == 3 || shift[2] == 0) {
        let by = [0, 1, 2].map(|e| (0..3).map(|k| f64::from(shift[k]) * domain.edge(k)[e]).sum());
        for k in (0..all.x.len()).filter(|k| shift != [0; 3] || !is_own(*k)) {
            let at: [f64; 3] = [0, 1, 2].map(|c| all.x[k][c] + by[c]);
            let near = |x: &[f64; 3]| (0..3).map(|c| (x[c] - at[c]).powi(2)).sum::<f64>() < reach * reach;
            if rank.x[..rank.owned].iter().any(near) {
                rank.add(all, k, by);
                rank.images.push((0..3).any(|k| closed[k] && shift[k] != 0));
            }
        }
    }
    rank
}

/// Evaluates on two ranks, which exchange slopes by tag as their host would.
fn on_two_ranks(
    engines: &mut [Engine; 2],
    ranks: &[Arrays; 2],
    around: &PeriodicBox,
    by_tag: &mut [[f64; 3]],
) -> Result<Tally, EngineError> {
    let mut forces = [0, 1].map(|r| vec![[0.0; 3]; ranks[r].x.len()]);
    let mut pending = Vec::new();
    for r in 0..2 {
        let images = if around.periodic() == [false; 3] { &[][..] } else { &ranks[r].images };
        let around = Surroundings::Ghosts(Around { domain: around, images }, Newton::Off);
        pending.push(engines[r].first(around, &ranks[r].request(Some(STEP)), &mut forces[r])?);
        assert_eq!(engines[r].path(), Some(Path::Device));
    }
    let width = engines[0].plan().slope_width();
    let mut slopes = vec![0.0; (by_tag.len() + 1) * width];
    let of = |tag: i32| tag as usize * width..(tag as usize + 1) * width;
    for (pending, rank) in pending.iter_mut().zip(ranks) {
        for k in 0..rank.owned {
            slopes[of(rank.tag[k])].copy_from_slice(&pending.slopes_mut()[k * width..][..width]);
        }
    }
    let mut sum = Tally::default();
    for (r, mut pending) in pending.into_iter().enumerate() {
        for k in ranks[r].owned..ranks[r].x.len() {
            pending.slopes_mut()[k * width..][..width].copy_from_slice(&slopes[of(ranks[r].tag[k])]);
        }
        sum += pending.finish(&mut engines[r], &ranks[r].request(Some(STEP)), &mut forces[r])?;
        assert!(forces[r][ranks[r].owned..].iter().all(|f| *f == [0.0; 3]), "ghosts get no forces");
        (0..ranks[r].owned).for_each(|k| by_tag[ranks[r].tag[k] as usize - 1] = forces[r][k]);
    }
    Ok(sum)
}

fn case(name: &str, fluid: &Fluid, edges: Matrix3<f64>, density: f64) {
    let domain = PeriodicBox::new([-1.0, 0.5, 0.0], edges, [true; 3]).unwrap();
    let found = particles(3, fluid, &domain, density);
    let kind: Vec<i32> = found.species.iter().map(|s| s + 1).collect();
    let all = Arrays { owned: kind.len(), x: found.x, v: found.v, tag: found.tag, kind, images: Vec::new() };
    let species: Vec<usize> = found.species.iter().map(|s| *s as usize).collect();
    let exact = truth::conservative(fluid, &all.x, &species, &domain).unwrap();
    let (heat, of_heat) = truth::drag_and_noise(fluid, &all.x, &all.v, &all.tag, &species, &domain, STEP);
    let mut expected = vec![[0.0; 3]; all.x.len()];
    for (k, tag) in all.tag.iter().enumerate() {
        expected[*tag as usize - 1] = [0, 1, 2].map(|c| exact.forces[k][c] + heat[k][c]);
    }
    let scale = largest(expected.iter().flatten().copied());
    let check = |what: &str, forces: &[[f64; 3]], tally: Tally| {
        let apart = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
        let error = forces.iter().zip(&expected).map(|(a, b)| apart(a, b)).fold(0.0, f64::max) / scale;
        let count = all.x.len() as f64;
        let energy = (tally.energy() - exact.energy).abs() / exact.energy.abs().max(count);
        let size = largest(exact.virial).max(count);
        let virial = (0..6)
            .map(|c| (tally.total_virial()[c] - exact.virial[c] - of_heat[c]).abs() / size)
            .fold(0.0, f64::max);
        println!("{name}, {what}: forces {error:.1e}, energy {energy:.1e}, virial {virial:.1e}");
        assert!(
            error <= 2e-5 && energy <= 1e-6 && virial <= 1e-5,
            "{name}, {what}: {error} {energy} {virial}"
        );
    };
    let mut engines = [engine(fluid), engine(fluid)];
    let mut forces = vec![[1.0; 3]; all.x.len()];
    let tally = engines[0].forces(&domain, &all.request(Some(STEP)), &mut forces, true).unwrap();
    let mut by_tag = vec![[0.0; 3]; forces.len()];
    all.tag.iter().zip(&forces).for_each(|(tag, f)| by_tag[*tag as usize - 1] = f.map(|f| f - 1.0));
    check("whole", &by_tag, tally);
    let reach = fluid.cutoff() + 0.4;
    let tilted = edges.iter().filter(|e| **e != 0.0).count() > 3;
    let mut surroundings = vec![("open", [false; 3], PeriodicBox::OPEN)];
    if !tilted {
        let closed = [false, true, fluid.dimensions == 3];
        surroundings.push(("closed", closed, PeriodicBox::new([-1.0, 0.5, 0.0], edges, closed).unwrap()));
    }
    for (what, closed, around) in surroundings {
        let ranks = [0, 1].map(|half| rank(&all, &domain, closed, half, reach, fluid.dimensions));
        let tally = on_two_ranks(&mut engines, &ranks, &around, &mut by_tag).unwrap();
        check(what, &by_tag, tally);
    }
}

#[test]
fn forces_for_a_host_are_those_of_the_reference() {
    let set6 = model("warren2003-set6.toml").at(1.0).unwrap();
    case("set 6", &set6, Matrix3::new(6.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 3.0), 6.0);
    case("set 6, tilted", &set6, Matrix3::new(6.0, 1.5, -1.0, 0.0, 4.0, 0.8, 0.0, 0.0, 3.0), 6.0);
    let binary = model("binary-2d.toml").at(1.0).unwrap();
    case("binary-2d", &binary, Matrix3::new(12.0, 3.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0), 5.0);
    case("binary-2d, straight", &binary, Matrix3::new(12.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0), 5.0);
    let dpd = model("standard-dpd.toml").at(1.0).unwrap();
    case("standard DPD", &dpd, Matrix3::new(5.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 3.0), 3.0);
    let huggins = model("huggins.toml").at(1.0).unwrap();
    case("Huggins", &huggins, Matrix3::new(5.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 3.0), 5.0);
}

/// Images of one particle in one cell share a tag; the cutoff of this box is as long as its edges.
#[test]
fn narrow_boxes_have_images_in_one_cell() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let all = Arrays {
        owned: 1,
        x: vec![[0.1; 3]],
        v: vec![[0.0; 3]],
        tag: vec![1],
        kind: vec![1],
        images: Vec::new(),
    };
    let edges = Matrix3::new(0.55, 0.05, 0.1, 0.0, 0.5, 0.1, 0.0, 0.0, 0.52);
    let domain = PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap();
    let mut with_images = Arrays { owned: 1, ..Arrays::default() };
    with_images.add(&all, 0, [0.0; 3]);
    let shifts = (0..343).map(|k| [k % 7 - 3, k / 7 % 7 - 3, k / 49 - 3]).filter(|shift| *shift != [0; 3]);
    for shift in shifts {
        let by = [0, 1, 2].map(|e| (0..3).map(|k| f64::from(shift[k]) * domain.edge(k)[e]).sum());
        with_images.add(&all, 0, by);
    }
    let mut engines = [Engine::new(&fluid, Settings::default()).unwrap(), engine(&fluid)];
    engines[0].map_kinds(&[-1, 0]).unwrap();
    let [cpu, gpu] = engines.each_mut().map(|engine| {
        let mut force = vec![[0.0; 3]; with_images.x.len()];
        let request = with_images.request(None);
        let mut pending = engine.first(Surroundings::ghosts(Newton::Off), &request, &mut force).unwrap();
        let slope = pending.slopes_mut()[0];
        pending.slopes_mut().fill(slope);
        let tally = pending.finish(engine, &request, &mut force).unwrap();
        (tally.energy(), tally.virial)
    });
    assert!((gpu.0 / cpu.0 - 1.0).abs() < 1e-6, "{gpu:?} {cpu:?}");
    let size = largest(cpu.1);
    assert!((0..6).all(|c| (gpu.1[c] - cpu.1[c]).abs() < 1e-5 * size), "{gpu:?} {cpu:?}");
}

#[test]
fn what_a_gpu_cannot_do_is_done_otherwise_or_refused() {
    let text = "title = \"s\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n[excess_free_energy]\nA = \"kT*ln(n)\"\n";
    let model = Model::parse("s.toml", text).unwrap();
    let mut engine = engine(&model.at(1.0).unwrap());
    let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
    let x: Vec<[f64; 3]> = (0..64).map(|k| [k % 4, k / 4 % 4, k / 16].map(|c| 0.9 * f64::from(c))).collect();
    let tag: Vec<i32> = (1..=64).collect();
    let kind = vec![1; 64];
    let mut all = Arrays { owned: 64, x, v: vec![[0.0; 3]; 64], tag, kind, images: Vec::new() };
    let mut force = vec![[0.0; 3]; 64];
    let mut energy = |engine: &mut Engine, all: &Arrays, want: Want| {
        let request = Request { want, ..all.request(None) };
        engine.forces(&domain, &request, &mut force, false).map(|tally| tally.energy())
    };
    let cold = energy(&mut engine, &all, Want::TOTALS).unwrap();
    assert_eq!(engine.path(), Some(Path::Device));
    // Values of single particles.
    let found = energy(&mut engine, &all, Want::ALL).unwrap();
    assert!(
        engine.path() == Some(Path::PairSums(Reason::ParticleValues)) && (found / cold - 1.0).abs() < 1e-6
    );
    energy(&mut engine, &all, Want::TOTALS).unwrap();
    let summed =
        engine.sum_densities(Surroundings::Box(&domain), &all.request(None).particles).unwrap().to_vec();
    assert!(summed.len() == 64 && summed.iter().all(|n| *n > 0.0));
    // The engine goes on at another temperature.
    let mut gpu = engine.use_device(None).unwrap();
    gpu.set_fluid(&model.at(2.0).unwrap()).unwrap();
    engine.use_device(Some(gpu));
    assert!((energy(&mut engine, &all, Want::TOTALS).unwrap() / cold - 2.0).abs() < 1e-5);
    // Particles that do not interact, and faults.
    all.kind[5] = 4;
    assert!(energy(&mut engine, &all, Want::TOTALS).is_ok());
    all.kind[5] = 9;
    assert_eq!(energy(&mut engine, &all, Want::TOTALS), Err(EngineError::Kind { tag: 6, kind: 9 }));
    all.kind[5] = 1;
    all.x[5] = [f64::NAN; 3];
    assert_eq!(energy(&mut engine, &all, Want::TOTALS), Err(EngineError::Position { tag: 6 }));
    all.x = vec![[2.0; 3]];
    (all.owned, all.v, all.tag, all.kind) = (1, vec![[0.0; 3]], vec![7], vec![1]);
    let alone = energy(&mut engine, &all, Want::TOTALS).unwrap_err().to_string();
    assert!(alone.contains("particle 7 is not finite: psi is singular"), "{alone}");
    engine.set_exclusions([Mark { sides: 1, molecule: 0 }], false);
    let refused = energy(&mut engine, &all, Want::TOTALS).unwrap_err().to_string();
    assert!(refused.contains("leaves no pairs out"), "{refused}");
}
