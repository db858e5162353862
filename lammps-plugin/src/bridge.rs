//! The style's interface to C++. Errors and panics arrive there as exceptions.

use crate::error::StyleError;
use crate::style::{Style, guard};
use psidpd_core::document::Document;
use psidpd_core::engine::{Mark, Path, SpecialPair, Surroundings, Want};
use psidpd_core::model::{DragWeight, SplinePair, WarrenPair};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

#[cxx::bridge(namespace = "psidpd")]
mod ffi {
    /// What a style knows of its fluid without an evaluation, in the units of LAMMPS.
    struct Facts {
        cutoff: f64,
        slope_width: usize,
        /// The number of densities times the number of species: the largest slope width.
        variables: usize,
        needs_velocities: bool,
        /// Range of the noise; 0 without noise.
        noise_range: f64,
        /// One unit of energy of the model; multiply energies and virials of particles by it.
        energy_unit: f64,
        /// One unit of velocity of the model.
        velocity_unit: f64,
        /// One unit of force of the model.
        force_unit: f64,
        /// The number of threads that run.
        threads: usize,
    }

    /// Coefficients of one pair of types, in the order of `pair_coeff`.
    #[derive(Clone, Copy, PartialEq)]
    struct Coefficients {
        /// Whether pair_coeff set them.
        set: bool,
        value: [f64; 7],
    }

    /// The box as LAMMPS stores it.
    #[derive(Clone, Copy)]
    struct Extent {
        origin: [f64; 3],
        /// Edges xx, yy, zz, yz, xz, xy.
        edges: [f64; 6],
        /// Periodic directions along which this rank has all of the box.
        closed: [bool; 3],
        periodic: [bool; 3],
    }

    /// The atoms of a rank, owned ones first, and ghosts if they take part. `v` may be empty if drag and noise do not act.
    struct Atoms<'a> {
        owned: usize,
        x: &'a [f64],
        v: &'a [f64],
        tag: &'a [i32],
        kind: &'a [i32],
    }

    /// Pairs that LAMMPS lists.
    struct Listed<'a> {
        i: &'a [i32],
        j: &'a [i32],
        factor: &'a [f64],
    }

    /// A pair with reduced strength: an atom, and another atom or ghost.
    #[derive(Clone, Copy)]
    struct SpecialPair {
        i: i32,
        j: i32,
        factor: f64,
    }

    /// What an evaluation is asked to compute.
    struct Request {
        /// Whether to compute dissipative and random forces.
        thermostat: bool,
        seed: u64,
        step: u64,
        dt: f64,
        energy: bool,
        virial: bool,
        particle_energy: bool,
        particle_virial: bool,
    }

    /// Energies of one rank, and the virial of all its forces.
    struct Totals {
        excess: f64,
        pair: f64,
        virial: [f64; 6],
        /// Evaluations of ψ below and above the bounds of a density, since the engine was made.
        below: f64,
        above: f64,
    }

    /// The surface of a wall.
    enum Shape {
        Face,
        Cylinder,
        Sphere,
    }

    /// A wall of matter, as fix dpd/wall describes it.
    #[derive(Clone, PartialEq)]
    struct WallOfFix {
        shape: Shape,
        /// The direction across a face, or along a cylinder.
        axis: usize,
        high: bool,
        /// Those of a cylinder or a sphere, and whether the fluid is inside.
        center: [f64; 3],
        radius: f64,
        inside: bool,
        /// The species of its matter, by name or, if that is empty, by type; type 0 is that of the only species.
        species: String,
        kind: i32,
        density: f64,
        /// Empty, one for all densities of the model, or one for each.
        local_densities: Vec<f64>,
        strength: f64,
        velocity: [f64; 3],
        /// Drag coefficient and range; negative if they are those of the model.
        drag: f64,
        drag_range: f64,
        /// The viscosity of the fluid, which determines the drag; 0 if it is not given.
        viscosity: f64,
        fluid_density: f64,
    }

    /// What a wall takes from the atoms of a rank.
    struct OnWall {
        /// The force across it and away from the fluid, added up over its surface, without drag and noise.
        force: f64,
        vector: [f64; 3],
        energy: f64,
        virial: [f64; 6],
    }

    /// A drift of owned atoms that a fix has made.
    struct Drift<'a> {
        /// 0 for a whole timestep, 1 and 2 for its halves.
        part: u8,
        /// The timestep.
        dt: f64,
        /// How much of the kick by the present forces the velocities have got.
        kicked: f64,
        /// The walls that reflect: the index of the first one, and their number.
        first: usize,
        count: usize,
        /// Masses as energies over squared velocities, infinite for atoms that stay.
        mass: &'a [f64],
        f: &'a [f64],
    }

    /// Input of drag and noise of walls in one timestep.
    struct Rub {
        seed: u64,
        step: u64,
        time: f64,
        /// The walls that act: the index of the first one, and their number.
        first: usize,
        count: usize,
    }

    /// Input of the thermostat in one step.
    struct Heat {
        seed: u64,
        step: u64,
        /// Whether noise is uniform instead of Gaussian.
        uniform: bool,
        /// Time for which the thermostat acts.
        time: f64,
        virial: bool,
        /// Whether to find the forces on atoms of infinite mass.
        fixed: bool,
    }

    /// The atoms of a rank, of which a group moves.
    struct Movers<'a> {
        /// The bit of the group in the masks.
        group: i32,
        mask: &'a [i32],
        kind: &'a [i32],
        mass_of_kind: &'a [f64],
        /// The mass of each atom, or empty if they have those of their types.
        mass: &'a [f64],
    }

    /// What the thermostat needs from the other ranks.
    enum Wants {
        /// Nothing: the velocities are final.
        Nothing,
        /// Sums over all ranks.
        Totals,
        /// Vectors of the ghosts.
        Ghosts,
    }

    /// Iterations of the thermostat since the style was set up.
    struct Effort {
        updates: u64,
        iterations: u64,
        /// The most iterations of one update.
        most: usize,
        /// Updates of pairs that forces had listed.
        listed: u64,
        /// Updates that ended before they were accurate.
        inaccurate: u64,
    }

    struct Round {
        wants: Wants,
        parts: [f64; 3],
        /// Virial of drag and noise, set at the end.
        virial: [f64; 6],
    }

    extern "Rust" {
        type Style;

        /// The text of a model file.
        /// The path is bytes, which need not be UTF-8.
        fn read_model(path: &[u8]) -> Result<String>;
        fn style_from_text(
            source: &str,
            text: &str,
            units: &str,
            kt: f64,
            names: &Vec<String>,
            dimensions: usize,
        ) -> Result<Box<Style>>;
        fn warren_style(
            kt: f64,
            pairs: &[Coefficients],
            types: usize,
            dimensions: usize,
            masses: &[f64],
        ) -> Result<Box<Style>>;
        fn spline_style(
            kt: f64,
            pairs: &[Coefficients],
            types: usize,
            dimensions: usize,
            thermostat_range: f64,
        ) -> Result<Box<Style>>;

        fn set_temperature(self: &mut Style, kt: f64) -> Result<()>;
        fn description(self: &Style, search: &str, listed: bool, apart: bool) -> String;
        fn facts(self: &Style) -> Facts;

        fn configure(self: &mut Style, mixed: bool, threads: usize) -> Result<()>;
        /// Evaluates on the device of a name: `cpu`, `gpu` or `gpu:N`.
        fn use_device(self: &mut Style, name: &str) -> Result<()>;
        /// Sets the pairs with reduced strength for all later evaluations, unless LAMMPS lists the pairs.
        fn set_special_pairs(self: &mut Style, pairs: &[SpecialPair]) -> Result<()>;
        /// Sets excluded pairs by two words for each atom and ghost, the members of `Mark`; an empty slice excludes none.
        fn set_exclusions(self: &mut Style, marks: &[u32], between_molecules: bool) -> Result<()>;

        /// Whether this rank can compute the request without images along the closed directions of the box.
        fn fits(self: &Style, extent: &Extent, request: &Request) -> Result<bool>;
        /// Computes all forces, without ghosts.
        fn evaluate(
            self: &mut Style,
            extent: &Extent,
            atoms: &Atoms,
            request: &Request,
            f: &mut [f64],
        ) -> Result<Totals>;
        /// Adds all forces but those of the slopes of ghosts. `images` flags ghosts to be left out: see `Around`.
        fn densities(
            self: &mut Style,
            extent: &Extent,
            images: &[bool],
            newton: bool,
            atoms: &Atoms,
            request: &Request,
            f: &mut [f64],
        ) -> Result<()>;
        /// Computes densities and slopes over pairs that LAMMPS lists; adds no forces yet.
        fn densities_of_pairs(
            self: &mut Style,
            listed: &Listed,
            newton: bool,
            atoms: &Atoms,
            request: &Request,
        ) -> Result<()>;
        fn slopes_mut(self: &mut Style) -> &mut [f64];
        /// Copies slopes of owned particles after an evaluation without ghosts, and makes room for those of ghosts.
        fn fetch_slopes(self: &mut Style, all: usize) -> Result<()>;
        fn forces(self: &mut Style, atoms: &Atoms, request: &Request, f: &mut [f64]) -> Result<Totals>;
        fn particle_energy(self: &Style) -> &[f64];
        /// Virials, six numbers for each particle.
        fn particle_virial(self: &Style) -> &[f64];
        /// Sums all densities at the positions of the last evaluation.
        fn sum_densities(self: &mut Style, extent: &Extent, atoms: &Atoms) -> Result<()>;
        /// Densities of owned particles, a row of `Facts::variables` for each.
        fn local_densities(self: &mut Style) -> &[f64];
        /// ψ of owned particles.
        fn excess_of_owned(self: &mut Style) -> Result<&[f64]>;
        /// Energy of a pair of types at a distance, and the force along the line from the second particle to the first. A
        /// many-body force uses the slopes that the two particles had in the last evaluation.
        fn single(self: &mut Style, kinds: [i32; 2], r: f64, particles: [i32; 2]) -> Result<[f64; 2]>;
        fn memory(self: &Style) -> usize;

        // Loops over atoms, which the threads divide.
        fn kick(self: &Style, h: f64, movers: &Movers, f: &[f64], v: &mut [f64]);
        fn drift(self: &Style, h: f64, movers: &Movers, v: &[f64], x: &mut [f64]);
        fn find_shifts(self: &Style, h: f64, movers: &Movers, f: &[f64], shifts: &mut [f64]);
        fn shift(self: &Style, shifts: &[f64], x: &mut [f64]);
        fn copy(self: &Style, from: &[f64], to: &mut [f64]);
        fn find_masses(self: &Style, unit: f64, movers: &Movers, held: &[u8], masses: &mut [f64]);

        /// Puts walls around the fluid, in place of those before; `mass` is the mean mass of atoms in energy over squared velocity.
        fn set_walls(self: &mut Style, walls: &[WallOfFix], mass: f64) -> Result<()>;
        fn on_walls(self: &Style) -> Vec<OnWall>;
        /// Lets drag and noise of walls act on the velocities of owned atoms. Writes the mean force on each wall, and returns the
        /// virial of that on the atoms.
        fn rub(
            self: &mut Style,
            extent: &Extent,
            atoms: &Atoms,
            mass: &[f64],
            rub: &Rub,
            given: &mut [f64],
            v: &mut [f64],
        ) -> Result<[f64; 6]>;

        /// Whether round walls fit into the box.
        fn check_room(self: &Style, extent: &Extent) -> Result<()>;
        /// The first atom in the matter of a round wall; -1 if there is none.
        fn find_in_matter(self: &Style, extent: &Extent, atoms: &Atoms) -> Result<i64>;
        /// Reflects atoms at round walls. `beyond` is kept for each atom from the first half of a timestep to the second; to `given` the
        /// mean force on each wall in the timestep is added, and what presses on its surface.
        fn bounce(
            self: &Style,
            extent: &Extent,
            drift: &Drift,
            beyond: &mut [f64],
            given: &mut [f64],
            x: &mut [f64],
            v: &mut [f64],
        ) -> Result<()>;
        /// Mirrors places in the matter of round walls at their surfaces.
        fn mirror(self: &Style, extent: &Extent, x: &mut [f64]) -> Result<()>;

        /// Announces that the thermostat will act for a time where the next forces are computed.
        fn expect_thermostat(self: &mut Style, time: f64) -> Result<()>;
        /// Finds the pairs of the thermostat and draws their noise; returns false if the model has no thermostat. All is in
        /// the units of LAMMPS, with masses in energy over squared velocity; the rounds take velocities of the model.
        fn thermostat_pairs(
            self: &mut Style,
            extent: &Extent,
            images: &[bool],
            atoms: &Atoms,
            mass: &[f64],
            heat: &Heat,
        ) -> Result<bool>;
        /// Changes the velocities of all atoms, and returns the virial.
        fn act_alone(self: &mut Style, v: &mut [f64]) -> Result<[f64; 6]>;
        /// Begins the thermostat on several ranks, with velocities of all atoms and ghosts.
        fn thermostat_begin(self: &mut Style, vectors: &mut [f64]) -> Result<Round>;
        fn thermostat_go_on(
            self: &mut Style,
            totals: [f64; 3],
            vectors: &mut [f64],
            v: &mut [f64],
        ) -> Result<Round>;
        /// The mean force of drag and noise in the last update on each owned atom of infinite mass, in units of the model, if
        /// it was asked for.
        fn forces_on_fixed(self: &Style) -> &[f64];
        /// Iterations of the thermostat in its last update.
        fn iterations(self: &Style) -> usize;
        fn effort(self: &Style) -> Effort;
    }
}

pub use ffi::{
    Atoms, Drift, Effort, Extent, Heat, Listed, Movers, OnWall, Request, Round, Rub, Shape, Totals,
    WallOfFix, Wants,
};

pub fn read_model(path: &[u8]) -> Result<String, StyleError> {
    guard(|| Ok(Document::open(OsStr::from_bytes(path).as_ref())?.source.text().to_owned()))
}

#[allow(clippy::ptr_arg)] // cxx passes a reference to a vector.
fn style_from_text(
    source: &str,
    text: &str,
    units: &str,
    kt: f64,
    names: &Vec<String>,
    dimensions: usize,
) -> Result<Box<Style>, StyleError> {
    Style::from_text(source, text, units, kt, names, dimensions).map(Box::new)
}

fn spline_style(
    kt: f64,
    pairs: &[ffi::Coefficients],
    types: usize,
    dimensions: usize,
    thermostat_range: f64,
) -> Result<Box<Style>, StyleError> {
    let spline = |c: &ffi::Coefficients| {
        let [strength, repulsion, attraction, repulsion_range, attraction_range, gamma, _] = c.value;
        SplinePair { strength, repulsion, attraction, repulsion_range, attraction_range, gamma }
    };
    let pairs: Vec<Option<SplinePair>> = pairs.iter().map(|c| c.set.then(|| spline(c))).collect();
    Style::from_spline_coefficients(kt, &pairs, types, thermostat_range, dimensions).map(Box::new)
}

fn warren_style(
    kt: f64,
    pairs: &[ffi::Coefficients],
    types: usize,
    dimensions: usize,
    masses: &[f64],
) -> Result<Box<Style>, StyleError> {
    let warren = |c: &ffi::Coefficients| {
        let [a, b, gamma, rc, rd, range, exponent] = c.value;
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let weight = DragWeight { range: or(range, rc), exponent: or(exponent, 1.0) };
        WarrenPair { a, b, gamma, rc, rd, weight: Some(weight) }
    };
    let pairs: Vec<Option<WarrenPair>> = pairs.iter().map(|c| c.set.then(|| warren(c))).collect();
    let masses = Some(masses).filter(|m| !m.is_empty());
    Style::from_coefficients(kt, &pairs, types, dimensions, masses).map(Box::new)
}

impl Request {
    pub fn want(&self) -> Want {
        Want {
            energy: self.energy,
            virial: self.virial,
            particle_energy: self.particle_energy,
            particle_virial: self.particle_virial,
            densities: false,
        }
    }
}

impl Style {
    fn facts(&self) -> ffi::Facts {
        let (plan, scale) = (self.engine.plan(), &self.scale);
        ffi::Facts {
            cutoff: scale.length * plan.cutoff(),
            slope_width: plan.slope_width(),
            variables: plan.densities().count() * plan.species().len(),
            needs_velocities: plan.needs_velocities(),
            noise_range: scale.length * plan.noise_range().unwrap_or(0.0),
            energy_unit: scale.energy,
            velocity_unit: scale.velocity(),
            force_unit: scale.force(),
            threads: self.engine.settings().threads.get(),
        }
    }

    fn set_special_pairs(&mut self, pairs: &[ffi::SpecialPair]) -> Result<(), StyleError> {
        // The engine refuses a negative index as it does one that is too large.
        let number = |k: i32| u32::try_from(k).unwrap_or(u32::MAX);
        let pairs = pairs.iter().map(|p| SpecialPair { i: number(p.i), j: number(p.j), factor: p.factor });
        guard(|| {
            self.engine.set_special_pairs(pairs);
            Ok(())
        })
    }

    fn set_exclusions(&mut self, marks: &[u32], between_molecules: bool) -> Result<(), StyleError> {
        let (marks, _) = marks.as_chunks::<2>();
        guard(|| {
            let marks = marks.iter().map(|[sides, molecule]| Mark { sides: *sides, molecule: *molecule });
            self.engine.set_exclusions(marks, between_molecules);
            Ok(())
        })
    }

    fn fits(&self, extent: &Extent, request: &Request) -> Result<bool, StyleError> {
        guard(|| {
            let Ok(domain) = self.scale.domain(extent) else { return Ok(false) };
            let path = self.engine.path_for(Surroundings::Box(&domain), request.want());
            Ok(matches!(path, Path::Sweep | Path::Device))
        })
    }

    fn fetch_slopes(&mut self, all: usize) -> Result<(), StyleError> {
        guard(|| {
            self.engine.fetch_slopes(all);
            Ok(())
        })
    }

    fn memory(&self) -> usize {
        self.engine.memory()
    }

    fn particle_energy(&self) -> &[f64] {
        self.engine.results().particle_energy
    }

    fn particle_virial(&self) -> &[f64] {
        self.engine.results().particle_virial.as_flattened()
    }
}
