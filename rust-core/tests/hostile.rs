//! Hosts that pass what no host should, in safe Rust: the engine answers with an error, a panic or the right result, and reads
//! and writes nothing but its own memory. `.ci/sanitize` runs these tests under AddressSanitizer.

use psidpd_core::engine::thermostat::{Bodies, PairThermostat, Rank, Stream, Update};
use psidpd_core::engine::{
    Around, Engine, Instructions, Particles, Path, PeriodicBox, Plan, Pool, Precision, Request, Settings,
    SpecialPair, Step, Surroundings, Want, noise,
};
use psidpd_core::model::{Fluid, Model};
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};

const DT: f64 = 0.01;

/// A fluid with drag of as many species.
fn fluid(species: usize) -> Fluid {
    let names: Vec<String> = (0..species).map(|k| format!("S{k}")).collect();
    let list = names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let psi = names.iter().map(|name| format!("{name} = \"n^2\"\n")).collect::<String>();
    let text = format!(
        "title = \"t\"\nspecies = [{list}]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.9\n[excess_free_energy]\n{psi}\
         [[thermostat]]\ngamma = 4.5\nrange = 1\n"
    );
    Model::parse("m.toml", &text).unwrap().at(1.0).unwrap()
}

/// Numbers from 0 to 1.
fn numbers() -> impl FnMut() -> f64 {
    let mut k = 0;
    move || {
        k += 1;
        f64::from(noise::threefry2x32::<20>([k, 0], [5, 9])[0]) / 4_294_967_296.0
    }
}

/// Particles of a host.
#[derive(Clone)]
struct Cloud {
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
}

impl Cloud {
    fn new(count: usize, species: usize, edges: [f64; 3], periodic: [bool; 3]) -> Cloud {
        let mut next = numbers();
        let mut vectors = |size: [f64; 3]| (0..count).map(|_| size.map(|l| l * next())).collect();
        Cloud {
            domain: PeriodicBox::orthogonal([0.0; 3], edges, periodic).unwrap(),
            x: vectors(edges.map(|l: f64| l.min(6.0))),
            v: vectors([1.0; 3]),
            tag: (1..=count as i32).collect(),
            kind: (0..count).map(|k| (k % species) as i32).collect(),
        }
    }

    fn particles(&self) -> Particles<'_> {
        Particles { owned: self.x.len(), x: &self.x, tag: &self.tag, kind: &self.kind }
    }

    fn request(&self, step: Option<Step>) -> Request<'_> {
        Request { particles: self.particles(), v: &self.v, step, want: Want::TOTALS }
    }

    fn bodies<'a>(&'a self, mass: &'a [f64]) -> Bodies<'a> {
        Bodies { domain: &self.domain, x: &self.x, tag: &self.tag, species: &self.kind, mass, frozen: &[] }
    }

    /// Energy per particle; `None` for an error or a panic.
    fn energy(&self, engine: &mut Engine) -> Option<f64> {
        let mut force = vec![[0.0; 3]; self.x.len()];
        let request = self.request(None);
        let done =
            catch_unwind(AssertUnwindSafe(|| engine.forces(&self.domain, &request, &mut force, false)));
        Some(done.ok()?.ok()?.energy() / self.x.len() as f64)
    }
}

/// Every precision and instruction set, with one thread and with two.
fn all_settings() -> impl Iterator<Item = Settings> {
    let sets = [Instructions::Portable, Instructions::Avx2, Instructions::Avx512, Instructions::Avx512Vbmi2];
    let sets = sets.into_iter().filter(|set| set.available());
    sets.flat_map(|instructions| {
        [(Precision::Mixed, 1), (Precision::Double, 2)].map(|(precision, threads)| Settings {
            precision,
            instructions,
            threads: NonZeroUsize::new(threads).unwrap(),
        })
    })
}

fn sums_over_pairs(fluid: &Fluid) -> Engine {
    let mut engine = Engine::new(fluid, Settings::default()).unwrap();
    engine.use_pair_sums_only(true);
    engine
}

/// Velocities after drag and noise, with the pairs of the forces if an engine is given.
fn heated(settings: Settings, fluid: &Fluid, cloud: &Cloud, ask: Option<&mut Engine>) -> Vec<[f64; 3]> {
    let mut thermostat = PairThermostat::new(&Plan::new(fluid).unwrap(), &settings).unwrap();
    let (pool, mut v) = (Pool::new(settings.threads), cloud.v.clone());
    let mass = vec![1.0; fluid.species.len()];
    let bodies = cloud.bodies(&mass);
    if let Some(engine) = ask {
        thermostat.ask(engine, DT);
        cloud.energy(engine).unwrap();
        thermostat.find_pairs_with(engine, &bodies, DT, true).unwrap();
    } else {
        thermostat.find_pairs(&pool, &bodies, DT, true).unwrap();
    }
    thermostat.draw(1, 1, Stream(0), noise::Law::Gaussian);
    thermostat.act(&pool, Update::Midpoint, &mut v);
    v
}

fn furthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A thermostat that asks an engine of another fluid finds its pairs itself.
#[test]
fn a_thermostat_asks_an_engine_of_another_fluid() {
    let cloud = Cloud::new(400, 1, [6.0; 3], [true; 3]);
    for settings in all_settings() {
        for (one, other) in [(1, 5), (1, 40), (5, 1)] {
            let mut cloud = cloud.clone();
            cloud.kind = (0..400).map(|k| k % one.min(other) as i32).collect();
            let mut engine = Engine::new(&fluid(other), settings).unwrap();
            let alone = cloud.energy(&mut engine).unwrap();
            let expected = heated(settings, &fluid(one), &cloud, None);
            let found = heated(settings, &fluid(one), &cloud, Some(&mut engine));
            assert!(furthest(&expected, &found) < 1e-12 && cloud.energy(&mut engine) == Some(alone));
        }
    }
}

/// Pairs that an evaluation has listed for one thermostat are no other's.
#[test]
fn a_thermostat_takes_the_pairs_of_another() {
    let (cloud, fluid) = (Cloud::new(400, 1, [6.0; 3], [true; 3]), fluid(1));
    for settings in all_settings() {
        let mut engine = Engine::new(&fluid, settings).unwrap();
        let pool = Pool::new(settings.threads);
        let [mut a, mut b] = [(); 2].map(|()| PairThermostat::new(engine.plan(), &settings).unwrap());
        a.ask(&mut engine, DT);
        b.ask(&mut engine, 4.0 * DT);
        cloud.energy(&mut engine).unwrap();
        let mut v = cloud.v.clone();
        a.find_pairs_with(&mut engine, &cloud.bodies(&[1.0]), DT, false).unwrap();
        a.draw(1, 1, Stream(0), noise::Law::Gaussian);
        a.act(&pool, Update::Midpoint, &mut v);
        assert!(furthest(&v, &heated(settings, &fluid, &cloud, None)) < 1e-6);
    }
}

/// After a search that fails, for whatever reason, a thermostat has no pairs, and a search gives it pairs again.
#[test]
fn a_thermostat_has_no_pairs_after_a_search_that_failed() {
    let (cloud, fluid) = (Cloud::new(400, 1, [6.0; 3], [true; 3]), fluid(1));
    let updates = [
        Update::Midpoint,
        Update::ImplicitDrag,
        Update::OrnsteinUhlenbeck,
        Update::Shardlow { reversed: true },
        Update::LoweAndersen,
    ];
    for (number, settings) in all_settings().enumerate() {
        let pool = Pool::new(settings.threads);
        let mut thermostat = PairThermostat::new(&Plan::new(&fluid).unwrap(), &settings).unwrap();
        let spoil: [fn(&mut Cloud); 6] = [
            |cloud| cloud.tag.truncate(cloud.tag.len() / 2),
            |cloud| cloud.kind.truncate(7),
            |cloud| cloud.x[200] = [f64::NAN, 0.0, 0.0],
            |cloud| cloud.x[399][1] = f64::INFINITY,
            |cloud| cloud.kind[13] = 1,
            |cloud| cloud.tag[399] = 0,
        ];
        for (k, spoil) in spoil.into_iter().enumerate() {
            thermostat.find_pairs(&pool, &cloud.bodies(&[1.0]), DT, true).unwrap();
            let mut bad = cloud.clone();
            spoil(&mut bad);
            thermostat.find_pairs(&pool, &bad.bodies(&[1.0]), DT, true).unwrap_err();
            let mut v = cloud.v.clone();
            let update = updates[(k + number) % updates.len()];
            let act = AssertUnwindSafe(|| thermostat.act(&pool, update, &mut v));
            catch_unwind(act).unwrap_err();
            catch_unwind(AssertUnwindSafe(|| thermostat.warmth(&cloud.v, |_| 1.0))).unwrap_err();
            thermostat.begin_midpoint(&pool, &mut v).unwrap_err();
        }
        thermostat.find_pairs(&pool, &cloud.bodies(&[]), DT, true).unwrap_err();
        thermostat.find_pairs(&pool, &cloud.bodies(&[1.0]), DT, true).unwrap();
        thermostat.draw(1, 1, Stream(0), noise::Law::Gaussian);
        // Fewer velocities than particles, then the right number.
        let mut few = cloud.v[..100].to_vec();
        catch_unwind(AssertUnwindSafe(|| thermostat.act(&pool, Update::Midpoint, &mut few))).unwrap_err();
        let mut v = cloud.v.clone();
        thermostat.act(&pool, Update::Midpoint, &mut v);
        assert!(furthest(&v, &heated(settings, &fluid, &cloud, None)) == 0.0);
    }
}

/// The host takes other lists between the rounds of the midpoint rule, or calls them in another order.
#[test]
fn rounds_of_the_thermostat_in_a_wrong_order() {
    let (cloud, fluid) = (Cloud::new(300, 1, [6.0; 3], [true; 3]), fluid(1));
    for settings in all_settings() {
        let mut engine = Engine::new(&fluid, settings).unwrap();
        engine.map_kinds(&[0, -1]).unwrap();
        let pool = Pool::new(settings.threads);
        let mut thermostat = PairThermostat::new(engine.plan(), &settings).unwrap();
        let mut half = cloud.clone();
        half.kind = (0..300).map(|k| k % 2).collect();
        let around = Around { domain: &cloud.domain, images: &[] };
        let mass = vec![1.0; 300];
        let rank = Rank { around, particles: half.particles(), species_of_kind: &[0, -1], mass: &mass };
        thermostat.find_pairs_of_rank(&pool, &rank, DT, false).unwrap();
        thermostat.draw(1, 1, Stream(0), noise::Law::Gaussian);
        let (mut vectors, mut v) = (cloud.v.clone(), cloud.v.clone());
        thermostat.begin_midpoint(&pool, &mut vectors).unwrap();
        thermostat.ask(&mut engine, DT);
        cloud.energy(&mut engine).unwrap();
        thermostat.find_pairs_of_rank_with(&mut engine, &rank, DT, false).unwrap();
        thermostat.go_on(&pool, [0.0; 3], &mut vectors, &mut v).unwrap_err();
    }
}

/// Whatever a host passes, the next evaluation of good particles has the same bits as ever.
#[test]
fn an_engine_survives_bad_particles() {
    let fluid = fluid(2);
    let cloud = Cloud::new(240, 2, [6.0; 3], [true, true, false]);
    let spoil: [fn(&mut Cloud); 13] = [
        |cloud| cloud.tag.truncate(120),
        |cloud| cloud.kind.truncate(1),
        |cloud| cloud.v.truncate(200),
        |cloud| cloud.x.truncate(30),
        |cloud| cloud.x[239] = [f64::NAN; 3],
        |cloud| cloud.x[3][2] = f64::NEG_INFINITY,
        |cloud| cloud.x[3][0] = 1e300,
        |cloud| cloud.x[3][0] = -1e13,
        |cloud| cloud.x.iter_mut().for_each(|x| *x = [1.0; 3]),
        |cloud| cloud.tag.iter_mut().for_each(|tag| *tag = 7),
        |cloud| cloud.tag[5] = i32::MIN,
        |cloud| cloud.kind[5] = i32::MIN,
        |cloud| cloud.kind[5] = i32::MAX,
    ];
    for settings in all_settings() {
        let mut engine = Engine::new(&fluid, settings).unwrap();
        let expected = cloud.energy(&mut engine).unwrap();
        for spoil in spoil {
            let mut bad = cloud.clone();
            spoil(&mut bad);
            for step in [None, Some(Step { seed: 1, number: 1, dt: DT })] {
                let mut force = vec![[0.0; 3]; bad.x.len()];
                let _ = engine.forces(&bad.domain, &bad.request(step), &mut force, true);
                // Results of an evaluation that has failed are nobody's.
                engine.fetch_slopes(300);
                let _ = engine.single([0, 1], 0.5, [280, 3]);
                let _ = (engine.excess().len(), engine.results());
                let request = bad.request(step);
                let first = engine.first(Surroundings::Box(&bad.domain), &request, &mut force);
                if let Ok(mut pending) = first {
                    pending.slopes_mut().fill(f64::NAN);
                    let _ = pending.finish(&mut engine, &cloud.request(step), &mut force);
                }
            }
            let mut short = vec![[0.0; 3]; 20];
            engine.forces(&cloud.domain, &cloud.request(None), &mut short, false).unwrap_err();
            engine.set_special_pairs([SpecialPair { i: 0, j: u32::MAX, factor: 0.0 }]);
            assert!(cloud.energy(&mut engine).is_none());
            engine.set_special_pairs([]);
            assert_eq!(cloud.energy(&mut engine), Some(expected));
        }
    }
}

/// Types that were species of a model with more of them are not those of another model.
#[test]
fn an_engine_renewed_with_fewer_species() {
    // More species take minutes with an address sanitizer.
    let (many, few) = (fluid(16), fluid(2));
    let mut cloud = Cloud::new(300, 2, [6.0; 3], [true; 3]);
    cloud.kind = vec![1; 300];
    for settings in all_settings() {
        let expected = cloud.energy(&mut Engine::new(&few, settings).unwrap()).unwrap();
        for pair_sums in [false, true] {
            let mut engine = Engine::new(&many, settings).unwrap();
            engine.map_kinds(&[0, 15]).unwrap();
            engine.use_pair_sums_only(pair_sums);
            cloud.energy(&mut engine).unwrap();
            engine.renew(&few, settings).unwrap();
            let error = cloud.energy(&mut engine).unwrap() / expected - 1.0;
            assert!(error.abs() < 1e-5, "{settings:?} {pair_sums}: {error}");
        }
    }
}

/// After an evaluation that has failed there are no densities, and asking for them does not end the host.
#[test]
fn densities_after_an_evaluation_that_failed() {
    let mut engine = sums_over_pairs(&fluid(1));
    let [large, small] = [300, 100].map(|count| Cloud::new(count, 1, [6.0; 3], [true; 3]));
    let want = Want { densities: false, ..Want::TOTALS };
    let mut force = vec![[0.0; 3]; 300];
    engine.forces(&large.domain, &Request { want, ..large.request(None) }, &mut force, false).unwrap();
    let request = Request { want, ..small.request(None) };
    let narrow = PeriodicBox::orthogonal([0.0; 3], [1e-9, 6.0, 6.0], [true; 3]).unwrap();
    engine.forces(&narrow, &request, &mut force, false).unwrap_err();
    let around = Surroundings::Box(&small.domain);
    assert!(engine.sum_densities(around, &small.particles()).unwrap().is_empty());
    let pending = engine.first(around, &request, &mut force).unwrap();
    assert!(pending.finish(&mut engine, &request, &mut force).is_ok());
}

/// A panic in the middle of an evaluation leaves nothing that a later call could take for a result.
#[test]
fn lists_of_a_fluid_that_do_not_fit_are_refused() {
    let spoil: [fn(&mut Fluid); 3] =
        [|f| f.thermostats.truncate(1), |f| f.dimensions = 7, |f| f.excess.truncate(1)];
    for spoil in spoil {
        let mut fluid = fluid(5);
        spoil(&mut fluid);
        catch_unwind(|| Plan::new(&fluid).is_ok()).unwrap_err();
    }
    // More species than a model file can have.
    let ideal = Model::parse("m.toml", "title = \"t\"\nspecies = [\"F\"]\n").unwrap().at(1.0).unwrap();
    let of = |count: usize| Fluid {
        species: vec!["F".to_owned(); count],
        excess: vec![ideal.excess[0].clone(); count],
        thermostats: vec![None; count * count],
        ..ideal.clone()
    };
    assert!(Plan::new(&of(256)).is_ok());
    catch_unwind(|| Plan::new(&of(257)).is_ok()).unwrap_err();
}

/// Boxes at the ends of numbers: the result is that of the sums over pairs, or an error.
#[test]
fn extreme_boxes() {
    let fluid = fluid(1);
    let mut expected = sums_over_pairs(&fluid);
    for settings in all_settings() {
        let mut engine = Engine::new(&fluid, settings).unwrap();
        for edges in [
            [1e30; 3],
            [1e15, 4.0, 4.0],
            [4.0, 1e9, 4.0],
            [1e102; 3],
            [1e25, 1e25, 6.0],
            [6.0, 6.0, 1e200],
            [1e9, 1e9, 1e9],
            [2.5, 2.5, 2e5],
        ] {
            for periodic in [[true; 3], [true, true, false], [false, true, true], [false; 3]] {
                let cloud = Cloud::new(300, 1, edges, periodic);
                let (sweep, sums) = (cloud.energy(&mut engine), cloud.energy(&mut expected));
                if let (Some(a), Some(b)) = (sweep, sums) {
                    assert!((a - b).abs() < 1e-4 * b.abs(), "{edges:?} {periodic:?} {settings:?}: {a} {b}");
                }
            }
        }
        for tilt in [1e8, 1e150, f64::MAX] {
            let edges = nalgebra::Matrix3::new(6.0, tilt, tilt, 0.0, 6.0, -tilt, 0.0, 0.0, 6.0);
            let mut cloud = Cloud::new(300, 1, [6.0; 3], [true; 3]);
            let Ok(domain) = PeriodicBox::new([0.0; 3], edges, [true; 3]) else { continue };
            cloud.domain = domain;
            let _ = cloud.energy(&mut engine);
        }
    }
}

/// Boxes so skew that coordinates are much larger than the edges: no pair is lost, or the sums over pairs do it.
#[test]
fn skew_boxes() {
    let fluid = fluid(1);
    let mut expected = sums_over_pairs(&fluid);
    for (length, tilt) in [
        ([6.58, 60.1, 714_886.0], [65.19, 12_178_937.0, 10_890_778.0]),
        ([10.68, 489.2, 790_988.0], [298.9, 18_636_792.0, 30_763_446.0]),
        ([7.5, 75.65, 964_893.0], [46.95, 9_792_021.0, 17_052_177.0]),
        ([9.05, 2_178.0, 575_081.0], [1_937.2, 9_486_543.0, 10_793_990.0]),
        ([6.0, 2_000.0, 2_000.0], [0.0, 0.0, 150_000.0]),
        ([20.0, 20.0, 20.0], [-60.0, 55.0, 40.0]),
    ] {
        let ([lx, ly, lz], [xy, xz, yz]) = (length, tilt);
        let edges = nalgebra::Matrix3::new(lx, xy, xz, 0.0, ly, yz, 0.0, 0.0, lz);
        let mut cloud = Cloud::new(300, 1, [4.0; 3], [true; 3]);
        cloud.domain = PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap();
        let corner = cloud.domain.point([0.9, 0.97, 0.99]);
        cloud.x.iter_mut().for_each(|x| (0..3).for_each(|c| x[c] += corner[c]));
        let sums = cloud.energy(&mut expected).unwrap();
        for settings in all_settings() {
            let found = cloud.energy(&mut Engine::new(&fluid, settings).unwrap()).unwrap();
            assert!((found / sums - 1.0).abs() < 1e-4, "{length:?} {tilt:?} {settings:?}: {found} {sums}");
            let mut thermostat = PairThermostat::new(&Plan::new(&fluid).unwrap(), &settings).unwrap();
            let _ = thermostat.find_pairs(&Pool::new(settings.threads), &cloud.bodies(&[1.0]), DT, true);
        }
    }
}

/// Particles that have gone far away, along directions that are open next to others that are not, change nothing for the rest.
#[test]
fn particles_far_away() {
    let fluid = fluid(1);
    let mut sums = sums_over_pairs(&fluid);
    for settings in all_settings() {
        let mut engine = Engine::new(&fluid, settings).unwrap();
        for (far, tolerance) in
            [(1e3, 1e-6), (8e3, 1e-5), (3e4, 1e-6), (1e5, 1e-6), (1e7, 1e-6), (1e9, 1e-6), (1e14, 1e-6)]
        {
            for open in [[true; 3], [true, false, false], [false, true, false], [false, false, true]] {
                let mut cloud = Cloud::new(250, 1, [4.0; 3], open.map(|open| !open));
                let last = cloud.x.len() - 1;
                (0..3).for_each(|c| cloud.x[last - c][c] += if open[c] { far } else { 0.0 });
                let (found, expected) = (cloud.energy(&mut engine), cloud.energy(&mut sums).unwrap());
                let found = found.unwrap();
                let error = (found / expected - 1.0).abs();
                assert!(error < tolerance, "{far:e} {open:?} {settings:?}: {found} {expected}");
                assert!(far > 1e6 || engine.path() == Some(Path::Sweep), "{far:e} {open:?}");
            }
        }
    }
}

/// The length of an open edge is no property of the particles: drag and noise do not depend on it. Where particles themselves are
/// far away they are right as well, up to an error.
#[test]
fn drag_in_boxes_with_open_edges() {
    let fluid = fluid(1);
    for settings in all_settings() {
        let of_edge = |edge: f64| Cloud::new(300, 1, [6.0, 6.0, edge], [true, true, false]);
        let expected = heated(settings, &fluid, &of_edge(6.0), None);
        for edge in [1e3, 2.5e6, 2.9e6, 1e7, 1e10, 1e20, 1e200] {
            assert_eq!(heated(settings, &fluid, &of_edge(edge), None), expected, "{edge:e}");
        }
        let mut engine = Engine::new(&fluid, settings).unwrap();
        for far in [1e3, 3e4, 1e5, 1e6, 2e6] {
            let mut cloud = of_edge(6.0);
            // Its partners lack one pair each.
            let gone = cloud.x.iter().position(|x| x[2] > 5.5).unwrap();
            cloud.x[gone][2] = 60.0;
            let near = heated(settings, &fluid, &cloud, None);
            cloud.x[gone][2] = far;
            for ask in [None, Some(&mut engine)] {
                let error = furthest(&heated(settings, &fluid, &cloud, ask), &near);
                assert!(error < 1e-5, "{far:e} {settings:?} {error:e}");
            }
        }
        let mut cloud = of_edge(6.0);
        cloud.x[0][2] = 1e9;
        let mut thermostat = PairThermostat::new(&Plan::new(&fluid).unwrap(), &settings).unwrap();
        thermostat.find_pairs(&Pool::new(settings.threads), &cloud.bodies(&[1.0]), DT, false).unwrap_err();
    }
}

/// All streams of noise of a step differ, and from the noise of the forces.
#[test]
fn streams_of_noise() {
    let (cloud, fluid) = (Cloud::new(60, 1, [6.0; 3], [true; 3]), fluid(1));
    let settings = Settings::default();
    let pool = Pool::new(settings.threads);
    let mut thermostat = PairThermostat::new(&Plan::new(&fluid).unwrap(), &settings).unwrap();
    thermostat.find_pairs(&pool, &cloud.bodies(&[1.0]), DT, false).unwrap();
    let mut seen: Vec<Vec<u64>> = (0..=255)
        .map(|stream| {
            let mut v = cloud.v.clone();
            thermostat.draw(1, 1, Stream(stream), noise::Law::Gaussian);
            thermostat.act(&pool, Update::OrnsteinUhlenbeck, &mut v);
            v.as_flattened().iter().map(|v| v.to_bits()).collect()
        })
        .collect();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 256);
}
