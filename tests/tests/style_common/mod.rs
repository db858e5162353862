//! Decks for the pair styles, and their reference values.

#![allow(dead_code)]

use nalgebra::Matrix3;
use psidpd::lammps::Lammps;
use psidpd_core::engine::{PeriodicBox, Step};
use psidpd_core::maximum::largest;
use psidpd_core::model::Model;
use psidpd_core::truth::{Truth, conservative, drag_and_noise};
use psidpd_tests::{lammps, root};
use std::ops::Deref;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

pub const LIMIT: Duration = Duration::from_secs(120);
pub const SEED: u64 = 5;
pub const DT: f64 = 0.005;

/// The shipped model of a many-body fluid.
pub fn warren() -> String {
    root().join("validation/models/warren2003-set6.toml").display().to_string()
}

/// Two species and two nonlinear densities, which give four slopes per particle.
pub const WIDE: &str = "title = \"wide\"\nspecies = [\"A\", \"B\"]\n\
    [density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
    [density.m]\nkernel = \"lucy\"\nrange = 0.9\n\
    [excess_free_energy]\nA = \"0.5*n_A^2 + 0.2*n_A*n_B + 0.05*m^3 + 3*n\"\nB = \"0.4*n^2 + 0.1*m_A*m_B + 0.02*m_B^2\"\n\
    [[pair]]\nbetween = [\"A\", \"B\"]\nform = \"soft\"\nstrength = 5\nrange = 1\n\
    [[thermostat]]\ngamma = 4.5\nrange = 1\n";

/// Warren's fluid in two dimensions.
pub const FLAT: &str = "title = \"flat\"\ndimensions = 2\nspecies = [\"F\"]\n\
    [density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
    [excess_free_energy]\nF = \"0.7*n^2\"\n\
    [[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = -20\nrange = 1\n\
    [[thermostat]]\ngamma = 4.5\nrange = 1\n";

/// Writes a text to a file, and returns its path.
pub fn file(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    std::fs::write(&path, text).unwrap();
    let name = path.display().to_string();
    (folder, name)
}

/// A command that loads the plugin.
pub fn load() -> String {
    format!("plugin load \"{}\"\n", lammps().1.display())
}

/// Exclusions of an empty group, more than the styles store, so that pairs come from LAMMPS's list. The text
/// is for `neigh_modify`, after a `group nobody empty`.
pub fn listed() -> String {
    format!("group nobody empty\nneigh_modify{}\n", " exclude group nobody nobody".repeat(17))
}

/// A box with particles of `types` types, before any pair style.
pub fn particles(before_box: &str, region: &str, types: usize, count: usize) -> String {
    let set = if types > 1 { format!("set type 1 type/ratio {types} 0.4 8731\n") } else { String::new() };
    format!(
        "units lj\natom_style atomic\natom_modify map yes\n{before_box}\ncomm_modify vel yes\n\
         region b {region}\ncreate_box {types} b\ncreate_atoms 1 random {count} 4711 NULL overlap 0.3 maxtry 200\n\
         {set}mass * 1\nvelocity all create 1.0 87 loop geom\n{}",
        load()
    )
}

/// Splits a list into triples.
pub fn triples(flat: Vec<f64>) -> Vec<[f64; 3]> {
    flat.as_chunks::<3>().0.to_vec()
}

/// The state of LAMMPS after a run.
#[derive(Debug, Clone)]
pub struct Frame {
    pub kind: Vec<i32>,
    pub x: Vec<[f64; 3]>,
    pub v: Vec<[f64; 3]>,
    pub f: Vec<[f64; 3]>,
}

/// The only LAMMPS of this process with the plugin: closing one unloads plugins from all, so tests take
/// turns. Opening a second one in the same thread deadlocks.
pub struct Only {
    lammps: Lammps,
    _turn: MutexGuard<'static, ()>,
}

impl Deref for Only {
    type Target = Lammps;
    fn deref(&self) -> &Lammps {
        &self.lammps
    }
}

/// Opens a LAMMPS in this process and executes a script.
pub fn open(script: &str) -> Only {
    static TURN: Mutex<()> = Mutex::new(());
    let turn = TURN.lock().unwrap_or_else(|e| e.into_inner());
    let l = Only { lammps: Lammps::open(&lammps().0, &[]).unwrap(), _turn: turn };
    l.commands(script).unwrap_or_else(|e| panic!("{e}\n{script}"));
    l
}

pub fn frame(l: &Lammps) -> Frame {
    Frame {
        kind: l.gather_ints("type", 1).unwrap(),
        x: triples(l.gather("x", 3).unwrap()),
        v: triples(l.gather("v", 3).unwrap()),
        f: triples(l.gather("f", 3).unwrap()),
    }
}

/// Runs a script as a program on `ranks` ranks and returns the last frame.
pub fn run(script: &str, ranks: usize) -> Frame {
    run_in(tempfile::tempdir().unwrap().path(), script, ranks)
}

/// As `run`, in the given folder.
pub fn run_in(folder: &Path, script: &str, ranks: usize) -> Frame {
    let path = folder.join("in.lammps");
    let dump =
        "write_dump all custom end.dump id type x y z vx vy vz fx fy fz modify sort id format float %.17g\n";
    std::fs::write(&path, format!("{script}{dump}")).unwrap();
    lammps()
        .0
        .run_script(ranks, folder, &path, &[], LIMIT)
        .unwrap_or_else(|e| panic!("{ranks} ranks: {e}\n{script}"));
    let text = std::fs::read_to_string(folder.join("end.dump")).unwrap();
    let mut end = Frame { kind: vec![], x: vec![], v: vec![], f: vec![] };
    for line in text.lines().skip(9) {
        let n: Vec<f64> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
        end.kind.push(n[1] as i32);
        end.x.push([n[2], n[3], n[4]]);
        end.v.push([n[5], n[6], n[7]]);
        end.f.push([n[8], n[9], n[10]]);
    }
    end
}

/// The largest difference of two sets of vectors, over the root mean square of the second.
pub fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>();
    let rms = (b.iter().map(square).sum::<f64>() / b.len() as f64).sqrt();
    let far = |(a, b): (&[f64; 3], &[f64; 3])| square(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]).sqrt();
    largest(a.iter().zip(b).map(far)) / rms
}

/// The box of LAMMPS.
pub fn domain(l: &Lammps) -> PeriodicBox {
    let b = l.simulation_box().unwrap();
    let [xy, xz, yz] = b.tilt;
    let s: [f64; 3] = std::array::from_fn(|k| b.hi[k] - b.lo[k]);
    PeriodicBox::new(b.lo, Matrix3::new(s[0], xy, xz, 0.0, s[1], yz, 0.0, 0.0, s[2]), b.periodic).unwrap()
}

/// The reference evaluation of the model for LAMMPS's particles, with types in the order of species; forces
/// and virial include drag and noise of `step`.
pub fn truth(l: &Lammps, model: &Model, kt: f64, step: Option<u64>) -> Truth {
    let now = frame(l);
    let fluid = model.at(kt).unwrap();
    let species: Vec<usize> = now.kind.iter().map(|k| *k as usize - 1).collect();
    let domain = domain(l);
    let mut all = conservative(&fluid, &now.x, &species, &domain).unwrap();
    if let Some(number) = step {
        let tags: Vec<i32> = (1..=now.x.len() as i32).collect();
        let step = Step { seed: SEED, number, dt: DT };
        let (f, w) = drag_and_noise(&fluid, &now.x, &now.v, &tags, &species, &domain, step);
        for (all, f) in all.forces.iter_mut().zip(&f) {
            (0..3).for_each(|k| all[k] += f[k]);
        }
        (0..6).for_each(|k| all.virial[k] += w[k]);
    }
    all
}

/// Compares forces, energy, virial and the forces on walls of fix dpd/wall, which have names like `w[1]`, with the reference evaluation, at the
/// start of a run.
pub fn compare_walls(script: &str, model: &Model, walls: &[&str]) {
    let mut fixes = walls.to_vec();
    fixes.dedup_by_key(|name| name.split('[').next().unwrap().to_owned());
    let modify: String = fixes
        .iter()
        .map(|name| format!("fix_modify {} energy yes virial yes\n", name.split('[').next().unwrap()))
        .collect();
    let outputs: String = walls.iter().map(|name| format!(" f_{name}")).collect();
    let l = open(&format!(
        "{script}\n{modify}compute w all pressure NULL virial\n\
         thermo_style custom step pe c_w[1]{outputs}\nthermo_modify norm no\nfix 1 all nve\ntimestep {DT}\nrun 0\n"
    ));
    let truth = truth(&l, model, 1.0, Some(0));
    let found = frame(&l).f;
    let apart = difference(&found, &truth.forces);
    assert!(apart < 1e-10, "forces differ by {apart}\n{script}");
    let energy = l.thermo("pe").unwrap();
    assert!((energy / truth.energy - 1.0).abs() < 1e-10, "{energy} {}\n{script}", truth.energy);
    let (virial, volume) = (l.compute_vector("w").unwrap(), l.eval("vol").unwrap());
    let scale = largest(truth.virial);
    for (c, w) in
        truth.virial.iter().enumerate().filter(|(c, _)| model.dimensions() == 3 || [0, 1, 3].contains(c))
    {
        let found = virial[c] * volume;
        assert!((found - w).abs() < 1e-9 * scale, "virial {c}: {found} {w}\n{script}");
    }
    // Forces between atoms add up to zero: what is left is that of the walls.
    for axis in 0..3 {
        let sum: f64 = found.iter().map(|f| f[axis]).sum();
        let on_walls: f64 =
            walls.iter().map(|name| l.eval(&format!("f_{name}[{}]", axis + 1)).unwrap()).sum();
        assert!((sum + on_walls).abs() < 1e-8 * scale, "{axis}: {sum} {on_walls}\n{script}");
    }
}

/// A data file of chains of five particles with harmonic bonds, types 1 and 2 along each chain, in a box of length 5.
pub fn chains(count: usize) -> String {
    let (mut atoms, mut bonds) = (String::new(), String::new());
    let mut word = 12_345u64;
    let mut uniform = || {
        word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (word >> 11) as f64 / (1u64 << 53) as f64
    };
    for c in 0..count {
        let mut at = [uniform() * 5.0, uniform() * 5.0, uniform() * 5.0];
        for k in 0..5 {
            let id = 5 * c + k + 1;
            at = at.map(|x| (x + 0.6 * (uniform() - 0.5)).rem_euclid(5.0));
            let kind = if k < 3 { 1 } else { 2 };
            atoms += &format!("{id} {} {kind} {} {} {}\n", c + 1, at[0], at[1], at[2]);
            if k > 0 {
                bonds += &format!("{} 1 {} {id}\n", 4 * c + k, id - 1);
            }
        }
    }
    format!(
        "chains\n\n{} atoms\n{} bonds\n2 atom types\n1 bond types\n\n0 5 xlo xhi\n0 5 ylo yhi\n0 5 zlo zhi\n\n\
         Masses\n\n1 1\n2 1\n\nAtoms # bond\n\n{atoms}\nBonds\n\n{bonds}",
        5 * count,
        4 * count
    )
}

/// Energy and conservative forces, by the formulas, of Warren's fluid with a strength for each pair.
pub fn scaled(x: &[[f64; 3]], length: f64, strength: impl Fn(usize, usize) -> f64) -> (f64, Vec<[f64; 3]>) {
    let model = Model::open(warren().as_ref()).unwrap();
    let fluid = model.at(1.0).unwrap();
    let (kernel, coefficient) =
        (fluid.densities[0].kernel, std::f64::consts::PI / 30.0 * 0.75f64.powi(4) * 25.0);
    let pairs: Vec<(usize, usize, [f64; 3], f64, f64)> = (0..x.len())
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .filter_map(|(i, j)| {
            let d: [f64; 3] = std::array::from_fn(|c| {
                let d = x[i][c] - x[j][c];
                d - length * (d / length).round()
            });
            let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            (r < 1.0).then(|| (i, j, d, r, strength(i, j)))
        })
        .collect();
    let mut n = vec![0.0; x.len()];
    let mut energy = 0.0;
    for (i, j, _, r, s) in &pairs {
        n[*i] += s * kernel.value(*r);
        n[*j] += s * kernel.value(*r);
        energy += s * -20.0 * (1.0 - r).powi(2);
    }
    energy += n.iter().map(|n| coefficient * n * n).sum::<f64>();
    let mut f = vec![[0.0; 3]; x.len()];
    for (i, j, d, r, s) in &pairs {
        let force = s * (-40.0 * (1.0 - r) - 2.0 * coefficient * (n[*i] + n[*j]) * kernel.slope(*r));
        for c in 0..3 {
            f[*i][c] += force * d[c] / r;
            f[*j][c] -= force * d[c] / r;
        }
    }
    (energy, f)
}
