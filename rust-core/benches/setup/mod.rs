//! Fluids and particles that micro-benchmarks and instruction counts share.

use psidpd_core::engine::{
    Around, Engine, Images, Instructions, Particles, PeriodicBox, Precision, Request, Settings, Step, Sweep,
    Want, noise,
};
use psidpd_core::model::{Fluid, Model};

/// A fluid and its number density.
pub struct Subject {
    /// Name in the names of measurements.
    pub name: &'static str,
    text: &'static str,
    pub density: f64,
    /// Time step.
    pub dt: f64,
    /// Of so many particles one is of the second species; with 0 species alternate.
    pub one_in: usize,
}

/// Mixtures of particle sizes, whose forces are those of an [`Engine`](psidpd_core::engine::Engine): the sweep leaves long ranges of rare
/// species to it.
pub static MIXTURES: [Subject; 2] = [
    Subject {
        name: "colloid",
        text: include_str!("../../../validation/experiments/src/bench/colloid.toml"),
        density: 3.0,
        dt: 0.01,
        one_in: 100,
    },
    Subject {
        name: "two-sizes",
        text: include_str!("../../../validation/experiments/src/bench/two-sizes.toml"),
        density: 3.0,
        dt: 0.01,
        one_in: 10,
    },
];

/// Warren's many-body fluid, standard DPD, and a fluid with two species and two densities as formulas.
pub static SUBJECTS: [Subject; 3] = [
    Subject {
        name: "mdpd",
        text: include_str!("../../../validation/models/warren2003-set6.toml"),
        density: 6.05,
        dt: 0.01,
        one_in: 0,
    },
    Subject {
        name: "dpd",
        text: include_str!("../../../validation/models/standard-dpd.toml"),
        density: 3.0,
        dt: 0.04,
        one_in: 0,
    },
    Subject {
        name: "formula",
        text: include_str!("../../../validation/experiments/src/bench/two-species.toml"),
        density: 6.05,
        dt: 0.01,
        one_in: 0,
    },
];

impl Subject {
    /// The fluid at kT = 1.
    pub fn fluid(&self) -> Fluid {
        Model::parse(self.name, self.text).expect("a model that ships").at(1.0).expect("a fluid at kT = 1")
    }
}

/// Finds a fluid, a precision and an instruction set of this processor by their names.
#[allow(dead_code)] // Not every user of this module is told these.
pub fn choose(
    fluid: &str,
    precision: &str,
    instructions: &str,
) -> Result<(&'static Subject, Precision, Instructions), String> {
    let subject = SUBJECTS.iter().chain(&MIXTURES).find(|s| s.name == fluid).ok_or("no such fluid")?;
    let (_, precision) =
        Precision::ALL.into_iter().find(|(name, _)| *name == precision).ok_or("no such precision")?;
    let (_, set) = Instructions::ALL
        .into_iter()
        .find(|(name, _)| *name == instructions)
        .ok_or("no such instruction set")?;
    if !set.available() {
        return Err(format!("this processor has no {instructions}"));
    }
    Ok((subject, precision, set))
}

/// A reproducible pseudo-random number from 0 to 1.
pub fn uniform(k: usize) -> f64 {
    f64::from(noise::threefry2x32::<20>([k as u32, 0], [5, 9])[0]) / 4_294_967_296.0
}

/// Particles in a cubic box, and their forces.
pub struct Cloud {
    pub domain: PeriodicBox,
    edge: f64,
    pub x: Vec<[f64; 3]>,
    pub v: Vec<[f64; 3]>,
    pub tag: Vec<i32>,
    pub kind: Vec<i32>,
    pub force: Vec<[f64; 3]>,
    step: Step,
}

impl Cloud {
    /// Puts `count` particles on a disturbed lattice, which resembles a fluid more than random points do.
    pub fn new(subject: &Subject, fluid: &Fluid, count: usize) -> Cloud {
        let edge = (count as f64 / subject.density).cbrt();
        let side = (count as f64).cbrt().ceil() as usize;
        let position = |k: usize| {
            let cell = [k % side, k / side % side, k / side / side];
            std::array::from_fn(|c| (edge / side as f64) * (cell[c] as f64 + 0.1 + 0.8 * uniform(6 * k + c)))
        };
        // Variance 1: kT = 1.
        let velocity = |k: usize| std::array::from_fn(|c| 12f64.sqrt() * (uniform(6 * k + 3 + c) - 0.5));
        let kind = |k: usize| match subject.one_in {
            0 => (k % fluid.species.len()) as i32,
            one_in => i32::from(k.is_multiple_of(one_in)),
        };
        Cloud {
            domain: PeriodicBox::orthogonal([0.0; 3], [edge; 3], [true; 3]).expect("a box"),
            edge,
            x: (0..count).map(position).collect(),
            v: (0..count).map(velocity).collect(),
            tag: (1..=count as i32).collect(),
            kind: (0..count).map(kind).collect(),
            force: vec![[0.0; 3]; count],
            step: Step { seed: 1, number: 0, dt: subject.dt },
        }
    }

    /// Time step.
    #[allow(dead_code)] // Not every user of this module asks for it.
    pub fn dt(&self) -> f64 {
        self.step.dt
    }

    /// Moves particles along their velocities by one step: forces on a lattice would heat it.
    pub fn drift(&mut self) {
        for (x, v) in self.x.iter_mut().zip(&self.v) {
            for c in 0..3 {
                x[c] += self.step.dt * v[c];
                if x[c] < 0.0 {
                    x[c] += self.edge;
                } else if x[c] >= self.edge {
                    x[c] -= self.edge;
                }
            }
        }
    }

    /// Applies the forces of a step to the velocities.
    #[allow(dead_code)] // Not every user of this module moves particles so.
    pub fn kick(&mut self) {
        for (v, f) in self.v.iter_mut().zip(&self.force) {
            for c in 0..3 {
                v[c] += self.step.dt * f[c];
            }
        }
    }

    /// One evaluation of all forces, with noise.
    pub fn evaluate(&mut self, sweep: &mut Sweep) {
        self.forces(|domain, request, force| sweep.evaluate(domain, request, force, false));
    }

    /// The same by an engine.
    #[allow(dead_code)] // Not every user of this module has one.
    pub fn evaluate_by(&mut self, engine: &mut Engine) {
        self.forces(|domain, request, force| engine.forces(domain, request, force, false));
    }

    fn forces<T, E: std::fmt::Debug>(
        &mut self,
        evaluate: impl FnOnce(&PeriodicBox, &Request, &mut [[f64; 3]]) -> Result<T, E>,
    ) {
        self.step.number += 1;
        let particles = Particles { owned: self.x.len(), x: &self.x, tag: &self.tag, kind: &self.kind };
        let request = Request { particles, v: &self.v, step: Some(self.step), want: Want::FORCES };
        evaluate(&self.domain, &request, &mut self.force).expect("forces");
    }
}

/// Numbers of sides with ghosts: those of one rank, of 2 ranks, of 4, and of 8 or more.
#[allow(dead_code)] // Some targets that include this module do not use it.
pub const FACES: [usize; 4] = [0, 2, 4, 6];

/// Reads a number of sides with ghosts.
#[allow(dead_code)] // Some targets that include this module do not use it.
pub fn faces(word: Option<&String>) -> Result<usize, &'static str> {
    let number = word.map_or(Some(0), |word| word.parse().ok());
    number.filter(|n| FACES.contains(n)).ok_or("FACES is 0, 2, 4 or 6")
}

/// The skin of LAMMPS: ghosts reach further than the cut-off by this.
const SKIN: f64 = 0.3;

/// Particles of a rank that has all of the box, with ghosts on some sides, which are its own images.
#[allow(dead_code)] // Some targets that include this module do not use it.
pub struct Rank {
    /// The box and the owned particles.
    pub cloud: Cloud,
    pub around: PeriodicBox,
    along: PeriodicBox,
    pub images: Images,
    /// Owned particles, followed by ghosts.
    pub x: Vec<[f64; 3]>,
    pub v: Vec<[f64; 3]>,
    pub tag: Vec<i32>,
    pub kind: Vec<i32>,
}

#[allow(dead_code)] // Some targets that include this module do not use it.
impl Rank {
    /// Creates the particles as [`Cloud::new`], with ghosts on `faces` sides of the box: two along z, two
    /// along y, two along x. [`Rank::find_ghosts`] adds them.
    pub fn new(subject: &Subject, fluid: &Fluid, count: usize, faces: usize) -> Rank {
        let cloud = Cloud::new(subject, fluid, count);
        let part = |periodic| PeriodicBox::orthogonal([0.0; 3], [cloud.edge; 3], periodic).expect("a box");
        let is_open = [faces > 4, faces > 2, faces > 0];
        let (around, along) = (part(is_open.map(|open| !open)), part(is_open));
        let (tag, kind, images) = (cloud.tag.clone(), cloud.kind.clone(), Images::default());
        Rank { cloud, around, along, images, x: vec![], v: vec![], tag, kind }
    }

    /// Finds the images within the cut-off and the skin of the box.
    pub fn find_ghosts(&mut self, cutoff: f64) {
        let owned = self.cloud.x.len();
        self.x.clone_from(&self.cloud.x);
        self.images.build(&self.along, 3, cutoff + SKIN, owned, &mut self.x);
        self.v.clone_from(&self.cloud.v);
        self.images.forward(1, &mut self.v);
        self.images.forward(1, &mut self.tag);
        self.images.forward(1, &mut self.kind);
    }

    /// Moves owned particles and ghosts along their velocities by one step.
    pub fn drift(&mut self) {
        for (x, v) in self.x.iter_mut().zip(&self.v) {
            (0..3).for_each(|c| x[c] += self.cloud.step.dt * v[c]);
        }
    }

    /// One evaluation of all forces, with noise; `between` is called before and after slopes go to ghosts.
    pub fn evaluate(&mut self, sweep: &mut Sweep, mut between: impl FnMut()) {
        self.cloud.step.number += 1;
        let owned = self.cloud.x.len();
        let particles = Particles { owned, x: &self.x, tag: &self.tag, kind: &self.kind };
        let around = Around { domain: &self.around, images: &[] };
        let (v, step, force) = (&self.v, Some(self.cloud.step), &mut self.cloud.force);
        // As hosts do, before every evaluation.
        force.fill([0.0; 3]);
        sweep.first(around, &Request { particles, v, step, want: Want::FORCES }, force).expect("densities");
        between();
        let width = sweep.plan().slope_width();
        self.images.copy_to_ghosts(width, sweep.slopes_mut());
        between();
        sweep.second(&particles, &mut self.cloud.force).expect("forces");
    }
}

/// The sweep on one thread.
#[allow(dead_code)] // Some targets that include this module do not use it.
pub fn sweep(fluid: &Fluid, precision: Precision, instructions: Instructions) -> Sweep {
    let settings = Settings { precision, instructions, ..Settings::default() };
    Sweep::new(fluid, settings).expect("a plan")
}
