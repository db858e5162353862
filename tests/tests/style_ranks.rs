//! Ranks do not matter: random decks on 1 to 8 ranks have the forces, energy and virial of the reference evaluation,
//! and every shipped model has the trajectory of one rank. Ranks are thinner than the cut-off or empty in some of them.

mod style_common;

use nalgebra::Matrix3;
use psidpd_core::engine::{PeriodicBox, Step};
use psidpd_core::maximum::largest;
use psidpd_core::model::Model;
use psidpd_core::truth::{conservative, drag_and_noise};
use psidpd_tests::{lammps, root};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::path::Path;
use std::time::Duration;
use style_common::*;

const RANKS: [usize; 5] = [1, 2, 3, 4, 8];
/// Eight ranks take turns on the processors of a busy machine.
const PATIENCE: Duration = Duration::from_secs(900);

/// Runs decks in one LAMMPS after another, in a folder.
fn run_all(folder: &Path, decks: &[String], ranks: usize) {
    let path = folder.join("in.lammps");
    std::fs::write(&path, decks.join("clear\n")).unwrap();
    let done = lammps().0.run_script(ranks, folder, &path, &[], PATIENCE);
    done.unwrap_or_else(|e| panic!("{ranks} ranks: {e}"));
}

const ATOMS: &str = "custom NAME.dump id type x y z vx vy vz fx fy fz modify sort id format float %.17g\n";

/// Rows of numbers of a file, without those in `head` lines.
fn rows(path: &Path, head: usize) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let number = |word: &str| word.parse::<f64>().unwrap();
    text.lines().skip(head).map(|line| line.split_whitespace().map(number).collect()).collect()
}

/// Atoms at the end of a deck.
struct Atoms {
    tag: Vec<i32>,
    species: Vec<usize>,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    f: Vec<[f64; 3]>,
}

impl Atoms {
    fn read(folder: &Path, name: &str) -> Atoms {
        let rows = rows(&folder.join(format!("{name}.dump")), 9);
        let triple = |k: usize| rows.iter().map(|row| [row[k], row[k + 1], row[k + 2]]).collect();
        Atoms {
            tag: rows.iter().map(|row| row[0] as i32).collect(),
            species: rows.iter().map(|row| row[1] as usize - 1).collect(),
            x: triple(2),
            v: triple(5),
            f: triple(8),
        }
    }
}

/// A deck, and what its reference evaluation needs.
struct Deck {
    text: String,
    model: Model,
    periodic: [bool; 3],
    mixed: bool,
}

const RANDOM_DT: f64 = 0.01;

/// A random division of a box among ranks, with two dimensions not along z.
fn grid(random: &mut StdRng, ranks: usize, dimensions: usize) -> [usize; 3] {
    let mut grid = [1; 3];
    let mut left = ranks;
    for prime in [2, 2, 2, 3] {
        if left.is_multiple_of(prime) {
            grid[random.random_range(0..dimensions)] *= prime;
            left /= prime;
        }
    }
    grid
}

impl Deck {
    fn new(random: &mut StdRng, name: &str, ranks: usize, models: &[(String, &str)], on_gpu: bool) -> Deck {
        let (path, text) = &models[random.random_range(0..models.len())];
        let model = Model::parse("random", text).unwrap();
        let (dimensions, types) = (model.dimensions(), model.species().len());
        let mut chance = |percent: u32| random.random_range(0..100) < percent;
        let (tilted, mixed, drop, newton, tiled, hybrid, follows) =
            (chance(30), chance(25), chance(30), chance(50), chance(30), chance(20), chance(30));
        let length: [f64; 3] = std::array::from_fn(|_| random.random_range(2.4..7.5));
        let mut kinds = [0, 1, 2].map(|_| ["p", "p", "f", "s", "m"][random.random_range(0..5)]);
        if tilted {
            // LAMMPS tilts periodic directions only.
            kinds = [if kinds[0] == "f" { "f" } else { "p" }, "p", "p"];
        }
        if dimensions == 2 {
            kinds[2] = "p";
        }
        let [a, b, c] = if dimensions == 2 { [length[0], length[1], 0.1] } else { length };
        let low = if dimensions == 2 { -0.1 } else { 0.0 };
        let region = if tilted {
            let mut tilt = |limit: f64| random.random_range(-0.3..0.3) * limit;
            let [xy, xz, yz] = [tilt(a), tilt(a), tilt(b)].map(|t| t.clamp(-0.7, 0.7));
            let [xz, yz] = if dimensions == 2 { [0.0; 2] } else { [xz, yz] };
            format!("prism 0 {a} 0 {b} {low} {c} {xy} {xz} {yz}")
        } else {
            format!("block 0 {a} 0 {b} {low} {c}")
        };
        let volume = if dimensions == 2 { a * b } else { a * b * c };
        let count = ((volume * random.random_range(0.5..6.0)) as usize).clamp(1, 600);
        // A drop is in a corner, where it leaves many ranks empty.
        let (inside, count) = if drop { ("drop", count.min(150)) } else { ("NULL", count) };
        let [px, py, pz] = grid(random, ranks, dimensions);
        let balance = match (ranks > 1, tiled, follows) {
            (false, ..) | (true, false, false) => "",
            (true, true, false) => "balance 1.0 rcb\n",
            (true, true, true) => "balance 1.0 rcb\nfix balance all balance 2 1.0 rcb\n",
            (true, false, true) if dimensions == 2 => "fix balance all balance 2 1.0 shift xy 5 1.0\n",
            (true, false, true) => "fix balance all balance 2 1.0 shift xyz 5 1.0\n",
        };
        let style = format!(
            "dpd/psi 1.0 {SEED} precision {} threads {}",
            if mixed { "mixed" } else { "double" },
            1 + random.random_range(0..2)
        );
        let (style, mixed) =
            if on_gpu { (format!("dpd/psi 1.0 {SEED} device gpu"), true) } else { (style, mixed) };
        let names = model.species().join(" ");
        let style = match hybrid {
            true => format!("pair_style hybrid {style}\npair_coeff * * dpd/psi \"{path}\" {names}\n"),
            false => format!("pair_style {style}\npair_coeff * * \"{path}\" {names}\n"),
        };
        let [seed, other, skin, steps] =
            [1..10_000, 1..10_000, 2..80, 0..7].map(|range| random.random_range(range));
        let text = format!(
            "units lj\ndimension {dimensions}\natom_style atomic\natom_modify map yes\nnewton {}\nboundary {}\n\
             comm_style {}\nprocessors {px} {py} {pz}\ncomm_modify vel yes\nneighbor 0.{skin:02} bin\n\
             neigh_modify delay 0 every 1 check yes\nregion b {region}\ncreate_box {types} b\n\
             region drop block 0 2.2 0 2.2 {low} 2.2\n\
             create_atoms 1 random {count} {seed} {inside} overlap 0.3 maxtry 100\n{}mass * 1\n\
             velocity all create 1.0 {other} loop geom\n{}{style}fix 1 all nve\n{}timestep {RANDOM_DT}\n{balance}\
             compute w all pressure NULL virial\n\
             thermo_style custom step pe c_w[1] c_w[2] c_w[3] c_w[4] c_w[5] c_w[6]\nthermo_modify norm no lost ignore\n\
             run {steps}\n\
             print \"$(pe:%.17g) $(c_w[1]:%.17g) $(c_w[2]:%.17g) $(c_w[3]:%.17g) $(c_w[4]:%.17g) $(c_w[5]:%.17g) \
             $(c_w[6]:%.17g) $(xlo:%.17g) $(xhi:%.17g) $(ylo:%.17g) $(yhi:%.17g) $(zlo:%.17g) $(zhi:%.17g) $(xy:%.17g) \
             $(xz:%.17g) $(yz:%.17g) $(step)\" file {name}.totals screen no\nwrite_dump all {}",
            if newton { "on" } else { "off" },
            kinds.join(" "),
            if tiled { "tiled" } else { "brick" },
            if types > 1 { format!("set type 1 type/ratio 2 0.4 {seed}\n") } else { String::new() },
            load(),
            if dimensions == 2 { "fix flat all enforce2d\n" } else { "" },
            ATOMS.replace("NAME", name),
        );
        Deck { text, model, periodic: kinds.map(|kind| kind == "p"), mixed }
    }

    /// Compares forces, energy and virial at the end with the reference evaluation.
    fn check(&self, folder: &Path, name: &str, ranks: usize) {
        let totals = rows(&folder.join(format!("{name}.totals")), 0).remove(0);
        let [a, b, c] = [7, 9, 11].map(|k| totals[k + 1] - totals[k]);
        let [xy, xz, yz] = [totals[13], totals[14], totals[15]];
        let edges = Matrix3::new(a, xy, xz, 0.0, b, yz, 0.0, 0.0, c);
        let domain = PeriodicBox::new([totals[7], totals[9], totals[11]], edges, self.periodic).unwrap();
        let Atoms { tag, species, mut x, v, f } = Atoms::read(folder, name);
        for x in &mut x {
            domain.wrap(x, &mut [0; 3]);
        }
        // LAMMPS prints the velocities of the end of the step; forces are those of its middle. At step 0 both are one.
        let number = totals[16] as u64;
        let half = if number == 0 { 0.0 } else { 0.5 * RANDOM_DT };
        let v: Vec<[f64; 3]> =
            v.iter().zip(&f).map(|(v, f)| std::array::from_fn(|c| v[c] - half * f[c])).collect();
        let fluid = self.model.at(1.0).unwrap();
        let mut truth = conservative(&fluid, &x, &species, &domain).unwrap();
        let step = Step { seed: SEED, number, dt: RANDOM_DT };
        let (heat, w) = drag_and_noise(&fluid, &x, &v, &tag, &species, &domain, step);
        for (all, f) in truth.forces.iter_mut().zip(&heat) {
            (0..3).for_each(|k| all[k] += f[k]);
        }
        (0..6).for_each(|k| truth.virial[k] += w[k]);

        let says = || format!("{ranks} ranks\n{}", self.text);
        let tolerance = if self.mixed { MIXED } else { DOUBLE };
        let far = |(a, b): (&[f64; 3], &[f64; 3])| largest((0..3).map(|c| (a[c] - b[c]).abs()));
        let most = largest(truth.forces.iter().flatten().map(|f| f.abs())).max(1.0);
        let apart = largest(f.iter().zip(&truth.forces).map(far)) / most;
        assert!(apart < tolerance, "forces: {apart:e}, {}", says());
        let scale = truth.energy.abs().max(most);
        let apart = (totals[0] - truth.energy).abs() / scale;
        assert!(apart < tolerance, "energy {} instead of {}, {}", totals[0], truth.energy, says());
        let (flat, volume) = (fluid.dimensions == 2, domain.volume(fluid.dimensions));
        let scale = largest(truth.virial.iter().map(|w| w.abs())).max(most);
        for (k, w) in truth.virial.iter().enumerate().filter(|(k, _)| !flat || [0, 1, 3].contains(k)) {
            let apart = (totals[1 + k] * volume - w).abs() / scale;
            assert!(apart < tolerance, "virial {k}: {} instead of {w}, {}", totals[1 + k] * volume, says());
        }
    }
}

/// Allowed differences from the reference evaluation, over the largest force: of rounding in double precision, and in
/// mixed precision, in which separations have 24 bits.
const DOUBLE: f64 = 1e-11;
const MIXED: f64 = 2e-4;

/// Boxes from 2.4 cut-offs, tilted ones and such with open sides, in two and three dimensions; any division among ranks,
/// skins, newton on and off, drops in a corner, hybrids, tiled and balanced layouts.
fn random_decks(all_ranks: &[usize], for_each_number_of_ranks: usize, on_gpu: bool) {
    let folder = tempfile::tempdir().unwrap();
    let shipped = |name: &str| std::fs::read_to_string(root().join("validation/models").join(name)).unwrap();
    let texts =
        [WIDE.to_owned(), FLAT.to_owned(), shipped("warren2003-set6.toml"), shipped("standard-dpd.toml")];
    let models: Vec<(String, &str)> = (0..texts.len())
        .map(|k| {
            let path = folder.path().join(format!("model-{k}.toml"));
            std::fs::write(&path, &texts[k]).unwrap();
            (path.display().to_string(), &texts[k][..])
        })
        .collect();
    let mut random = StdRng::seed_from_u64(30);
    for &ranks in all_ranks {
        let name = |k: usize| format!("deck-{k}");
        let decks: Vec<Deck> = (0..for_each_number_of_ranks)
            .map(|k| Deck::new(&mut random, &name(k), ranks, &models, on_gpu))
            .collect();
        let texts: Vec<String> = decks.iter().map(|deck| deck.text.clone()).collect();
        run_all(folder.path(), &texts, ranks);
        for (k, deck) in decks.iter().enumerate() {
            deck.check(folder.path(), &name(k), ranks);
        }
    }
}

#[test]
fn random_decks_have_the_forces_of_the_model_on_any_ranks() {
    random_decks(&RANKS, 3, false);
}

/// Eight ranks on two cores wait for each other most of the time: ten minutes and more.
#[test]
#[ignore = "takes over ten minutes on two cores"]
fn a_hundred_random_decks_have_the_forces_of_the_model_on_any_ranks() {
    random_decks(&RANKS, 20, false);
}

/// Ranks share one device.
#[test]
#[ignore = "needs a plugin with `device gpu`, and Vulkan: .ci/gpu"]
fn random_decks_have_the_forces_of_the_model_on_a_gpu() {
    random_decks(&[1, 2, 3], 8, true);
}

/// A balanced drop keeps the style's own search in a tiled layout, and the log says what such a layout costs.
#[test]
fn the_log_says_what_a_tiled_layout_costs() {
    let folder = tempfile::tempdir().unwrap();
    for (head, balance, tiled) in [("", "shift xyz 5 1.0", false), ("comm_style tiled", "rcb", true)] {
        let script = format!(
            "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\nfix 1 all nve\ntimestep {DT}\n\
             balance 1.0 {balance}\nrun 2\n",
            particles(head, "block 0 8 0 8 0 8", 1, 300),
            warren()
        );
        run_all(folder.path(), &[script], 4);
        let log = std::fs::read_to_string(folder.path().join("log.lammps")).unwrap();
        assert!(log.contains("own cell list every step; no neighbor list is requested"), "{log}");
        assert_eq!(log.contains("in a tiled layout each rank works on ghosts"), tiled, "{log}");
    }
}

/// Forces of the first step, and positions and velocities after ten, in a box of edge 5 with both kinds of particles.
#[test]
fn every_shipped_model_moves_as_on_one_rank() {
    let folder = tempfile::tempdir().unwrap();
    let mut models: Vec<_> = std::fs::read_dir(root().join("validation/models"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|end| end == "toml"))
        .collect();
    models.sort();
    assert!(models.len() > 20, "models that ship");
    let name = |k: usize| models[k].file_stem().unwrap().to_str().unwrap().to_owned();
    let decks = |deck: &dyn Fn(&Model, usize) -> String| -> Vec<String> {
        (0..models.len()).map(|k| deck(&Model::open(&models[k]).unwrap(), k)).collect()
    };
    // The numbers of atoms depend on the ranks that create them.
    let starts = decks(&|model, k| {
        let (types, flat) = (model.species().len(), model.dimensions() == 2);
        let (before, region) =
            if flat { ("dimension 2", "block 0 6 0 6 -0.1 0.1") } else { ("", "block 0 5 0 5 0 5") };
        let count = if flat { 180 } else { 400 };
        format!(
            "{}pair_style zero 1.0\npair_coeff * *\nwrite_data {}.data nocoeff\n",
            particles(before, region, types, count),
            name(k)
        )
    });
    run_all(folder.path(), &starts, 1);
    let runs = decks(&|model, k| {
        let [name, names] = [name(k), model.species().join(" ")];
        let dump = |at: &str| format!("write_dump all {}", ATOMS.replace("NAME", &format!("{name}-{at}")));
        format!(
            "units lj\ndimension {}\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\nread_data {name}.data\n{}\
             pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" {names}\nfix 1 all nve\ntimestep 0.002\nrun 0\n{}run 10\n{}",
            model.dimensions(),
            load(),
            models[k].display(),
            dump("start"),
            dump("end")
        )
    });
    let outcome = |ranks| {
        run_all(folder.path(), &runs, ranks);
        let atoms =
            |k: usize| ["start", "end"].map(|at| Atoms::read(folder.path(), &format!("{}-{at}", name(k))));
        (0..models.len()).map(atoms).collect::<Vec<_>>()
    };
    let one = outcome(1);
    for ranks in &RANKS[1..] {
        for (k, ([start, end], [start_of_one, end_of_one])) in outcome(*ranks).iter().zip(&one).enumerate() {
            assert!(!start.tag.is_empty() && start.tag == start_of_one.tag && end.tag == end_of_one.tag);
            let apart = difference(&start.f, &start_of_one.f);
            assert!(apart < 1e-12, "{}, {ranks} ranks: forces {apart:e}", name(k));
            let apart = [difference(&end.x, &end_of_one.x), difference(&end.v, &end_of_one.v)];
            assert!(apart.iter().all(|d| *d < 1e-12), "{}, {ranks} ranks: {apart:?}", name(k));
        }
    }
}
