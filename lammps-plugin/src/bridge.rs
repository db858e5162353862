//! The style's interface to C++. Errors and panics arrive there as exceptions.

use crate::converted::triples;
use crate::error::StyleError;
use crate::style::{Style, guard};
use crate::thermostat::Noise;
use nalgebra::Matrix3;
use psidpd_core::document::Document;
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Effort, Need};
use psidpd_core::engine::{
    Around, Mark, Newton, PairsOfHost, Particles, Path, PeriodicBox, Request, SpecialPair, Step,
    Surroundings, Tally, Want,
};
use psidpd_core::model::{SplinePair, WarrenPair};

#[cxx::bridge(namespace = "psidpd")]
mod ffi {
    /// Coefficients of one pair of types, in the order of `pair_coeff`.
    #[derive(Clone, Copy, PartialEq)]
    struct Coefficients {
        /// Whether pair_coeff set them.
        set: bool,
        value: [f64; 6],
    }

    /// Energy of a pair, and the force along the line from the second particle to the first.
    struct PairValue {
        energy: f64,
        force: f64,
    }

    /// The box as LAMMPS stores it.
    #[derive(Clone, Copy)]
    struct Extent {
        origin: [f64; 3],
        /// Edges xx, yy, zz, yz, xz, xy.
        edges: [f64; 6],
        /// Periodic directions along which this rank has all of the box.
        closed: [bool; 3],
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

    /// Input of the thermostat in one step.
    struct Heat {
        seed: u64,
        step: u64,
        /// Whether noise is uniform instead of Gaussian.
        uniform: bool,
        /// Time for which the thermostat acts.
        time: f64,
        virial: bool,
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
        fn read_model(path: &str) -> Result<String>;
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
        fn cutoff(self: &Style) -> f64;
        fn slope_width(self: &Style) -> usize;
        /// The number of densities times the number of species: the largest slope width.
        fn variables(self: &Style) -> usize;
        fn needs_velocities(self: &Style) -> bool;
        /// Range of the noise; 0 without noise.
        fn noise_range(self: &Style) -> f64;

        fn configure(self: &mut Style, mixed: bool, threads: usize) -> Result<()>;
        /// Evaluates on the device of a name: `cpu`, `gpu` or `gpu:N`.
        fn use_device(self: &mut Style, name: &str) -> Result<()>;
        fn threads(self: &Style) -> usize;
        /// Sets the pairs with reduced strength for all later evaluations, unless LAMMPS lists the pairs.
        fn set_special_pairs(self: &mut Style, pairs: &[SpecialPair]) -> Result<()>;
        /// Sets excluded pairs by two words for each atom and ghost, the members of `Mark`; an empty slice excludes none.
        fn set_exclusions(self: &mut Style, marks: &[u32], between_molecules: bool) -> Result<()>;

        /// Whether this rank can compute the request without images along the closed directions of the box.
        fn fits(self: &Style, extent: &Extent, request: &Request) -> Result<bool>;
        /// Computes all forces, without ghosts.
        fn style_evaluate(
            style: &mut Style,
            extent: &Extent,
            atoms: &Atoms,
            request: &Request,
            f: &mut [f64],
        ) -> Result<Totals>;
        /// Adds all forces but those of the slopes of ghosts. `images` flags ghosts to be left out: see `Around`.
        fn style_densities(
            style: &mut Style,
            extent: &Extent,
            images: &[bool],
            newton: bool,
            atoms: &Atoms,
            request: &Request,
            f: &mut [f64],
        ) -> Result<()>;
        /// Computes densities and slopes over pairs that LAMMPS lists; adds no forces yet.
        fn densities_of_pairs(
            style: &mut Style,
            listed: &Listed,
            newton: bool,
            atoms: &Atoms,
            request: &Request,
        ) -> Result<()>;
        fn slopes_mut(self: &mut Style) -> &mut [f64];
        /// Copies slopes of owned particles after an evaluation without ghosts, and makes room for those of ghosts.
        fn fetch_slopes(self: &mut Style, all: usize) -> Result<()>;
        fn style_forces(style: &mut Style, atoms: &Atoms, request: &Request, f: &mut [f64])
        -> Result<Totals>;
        /// One unit of energy of the model in the units of LAMMPS; multiply energies and virials of particles by it.
        fn energy_unit(self: &Style) -> f64;
        /// One unit of velocity of the model in the units of LAMMPS.
        fn velocity_unit(self: &Style) -> f64;
        fn particle_energy(self: &Style) -> &[f64];
        /// Virials, six numbers for each particle.
        fn particle_virial(self: &Style) -> &[f64];
        /// Sums all densities at the positions of the last evaluation.
        fn sum_densities(style: &mut Style, atoms: &Atoms) -> Result<()>;
        /// Densities of owned particles, a row of [`variables`] for each.
        fn local_densities(self: &mut Style) -> &[f64];
        /// ψ of owned particles.
        fn excess_of_owned(self: &mut Style) -> Result<&[f64]>;
        fn style_single(
            style: &mut Style,
            kind_i: i32,
            kind_j: i32,
            i: i32,
            j: i32,
            r: f64,
        ) -> Result<PairValue>;
        fn memory(self: &Style) -> usize;

        // Loops over atoms, which the threads divide.
        fn kick(self: &Style, h: f64, movers: &Movers, f: &[f64], v: &mut [f64]);
        fn drift(self: &Style, h: f64, movers: &Movers, v: &[f64], x: &mut [f64]);
        fn find_shifts(self: &Style, h: f64, movers: &Movers, f: &[f64], shifts: &mut [f64]);
        fn shift(self: &Style, shifts: &[f64], x: &mut [f64]);
        fn copy(self: &Style, from: &[f64], to: &mut [f64]);
        fn find_masses(self: &Style, unit: f64, movers: &Movers, held: &[u8], masses: &mut [f64]);

        /// Announces that the thermostat will act for a time where the next forces are computed.
        fn expect_thermostat(self: &mut Style, time: f64, virial: bool) -> Result<()>;
        /// Finds the pairs of the thermostat and draws their noise; returns false if the model has no thermostat. All is in
        /// the units of LAMMPS, with masses in energy over squared velocity; the rounds take velocities of the model.
        fn thermostat_pairs(
            style: &mut Style,
            extent: &Extent,
            images: &[bool],
            atoms: &Atoms,
            mass: &[f64],
            heat: &Heat,
        ) -> Result<bool>;
        /// Changes the velocities of all atoms, and returns the virial.
        fn act_alone(self: &mut Style, v: &mut [f64]) -> Result<[f64; 6]>;
        /// Begins the thermostat on several ranks, with velocities of all atoms and ghosts.
        fn thermostat_begin(style: &mut Style, vectors: &mut [f64]) -> Result<Round>;
        fn thermostat_go_on(
            style: &mut Style,
            totals: [f64; 3],
            vectors: &mut [f64],
            v: &mut [f64],
        ) -> Result<Round>;
        /// Iterations of the thermostat in its last update.
        fn iterations(self: &mut Style) -> usize;
        fn effort(style: &mut Style) -> Effort;
    }
}

pub use ffi::Movers;

fn thermostat_pairs(
    style: &mut Style,
    extent: &ffi::Extent,
    images: &[bool],
    atoms: &ffi::Atoms,
    mass: &[f64],
    heat: &ffi::Heat,
) -> Result<bool, StyleError> {
    let ffi::Heat { seed, step, uniform, time, virial } = *heat;
    let noise = Noise { seed, step, law: if uniform { Law::Uniform } else { Law::Gaussian } };
    let domain = style.scale().domain(domain_of(extent)?);
    let around = Around { domain: &domain, images };
    style.find_thermostat_pairs(around, &particles_of(atoms), mass, time, virial, noise)
}

fn effort(style: &mut Style) -> ffi::Effort {
    let Effort { updates, iterations, most, listed, inaccurate } = style.effort();
    ffi::Effort { updates, iterations, most, listed, inaccurate }
}

fn round(need: Need) -> ffi::Round {
    let (wants, parts, virial) = match need {
        Need::Nothing(virial) => (ffi::Wants::Nothing, [0.0; 3], virial),
        Need::Totals(parts) => (ffi::Wants::Totals, parts, [0.0; 6]),
        Need::Ghosts => (ffi::Wants::Ghosts, [0.0; 3], [0.0; 6]),
    };
    ffi::Round { wants, parts, virial }
}

fn thermostat_begin(style: &mut Style, vectors: &mut [f64]) -> Result<ffi::Round, StyleError> {
    style.begin_rounds(vectors).map(round)
}

fn thermostat_go_on(
    style: &mut Style,
    totals: [f64; 3],
    vectors: &mut [f64],
    v: &mut [f64],
) -> Result<ffi::Round, StyleError> {
    style.next_round(totals, vectors, v).map(round)
}

pub fn read_model(path: &str) -> Result<String, StyleError> {
    guard(|| {
        let document = Document::open(path.as_ref()).map_err(|e| StyleError(e.to_string()))?;
        Ok(document.source().text().to_owned())
    })
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
        let [strength, repulsion, attraction, repulsion_range, attraction_range, gamma] = c.value;
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
        let [a, b, gamma, rc, rd, _] = c.value;
        WarrenPair { a, b, gamma, rc, rd }
    };
    let pairs: Vec<Option<WarrenPair>> = pairs.iter().map(|c| c.set.then(|| warren(c))).collect();
    let masses = Some(masses).filter(|m| !m.is_empty());
    Style::from_coefficients(kt, &pairs, types, dimensions, masses).map(Box::new)
}

fn particles_of<'a>(atoms: &ffi::Atoms<'a>) -> Particles<'a> {
    Particles { owned: atoms.owned, x: triples(atoms.x), tag: atoms.tag, kind: atoms.kind }
}

fn request_of<'a>(atoms: &ffi::Atoms<'a>, request: &ffi::Request) -> Request<'a> {
    let step = Step { seed: request.seed, number: request.step, dt: request.dt };
    Request {
        particles: particles_of(atoms),
        v: triples(atoms.v),
        step: request.thermostat.then_some(step),
        want: want_of(request),
    }
}

fn want_of(request: &ffi::Request) -> Want {
    Want {
        energy: request.energy,
        virial: request.virial,
        particle_energy: request.particle_energy,
        particle_virial: request.particle_virial,
        densities: false,
    }
}

fn newton_of(newton: bool) -> Newton {
    if newton { Newton::On } else { Newton::Off }
}

/// The box, with periods along the closed directions only.
fn domain_of(extent: &ffi::Extent) -> Result<PeriodicBox, StyleError> {
    let [xx, yy, zz, yz, xz, xy] = extent.edges;
    let edges = Matrix3::new(xx, xy, xz, 0.0, yy, yz, 0.0, 0.0, zz);
    PeriodicBox::new(extent.origin, edges, extent.closed).map_err(|e| StyleError(e.to_string()))
}

fn style_evaluate(
    style: &mut Style,
    extent: &ffi::Extent,
    atoms: &ffi::Atoms,
    request: &ffi::Request,
    f: &mut [f64],
) -> Result<ffi::Totals, StyleError> {
    let domain = style.scale().domain(domain_of(extent)?);
    let tally = style.evaluate(&domain, &request_of(atoms, request), f)?;
    Ok(totals(style, &tally))
}

fn totals(style: &Style, tally: &Tally) -> ffi::Totals {
    let [below, above] = style.engine().statistics().out_of_bounds.map(|n| n as f64);
    ffi::Totals { excess: tally.excess, pair: tally.pair, virial: tally.total_virial(), below, above }
}

fn style_densities(
    style: &mut Style,
    extent: &ffi::Extent,
    images: &[bool],
    newton: bool,
    atoms: &ffi::Atoms,
    request: &ffi::Request,
    f: &mut [f64],
) -> Result<(), StyleError> {
    let domain = style.scale().domain(domain_of(extent)?);
    let surroundings = Surroundings::Ghosts(Around { domain: &domain, images }, newton_of(newton));
    style.densities(surroundings, &request_of(atoms, request), f)
}

fn densities_of_pairs(
    style: &mut Style,
    listed: &ffi::Listed,
    newton: bool,
    atoms: &ffi::Atoms,
    request: &ffi::Request,
) -> Result<(), StyleError> {
    let ffi::Listed { i, j, factor } = *listed;
    let surroundings = Surroundings::Listed(PairsOfHost { i, j, factor }, newton_of(newton));
    style.densities(surroundings, &request_of(atoms, request), &mut [])
}

fn style_forces(
    style: &mut Style,
    atoms: &ffi::Atoms,
    request: &ffi::Request,
    f: &mut [f64],
) -> Result<ffi::Totals, StyleError> {
    let tally = style.forces(&request_of(atoms, request), f)?;
    Ok(totals(style, &tally))
}

fn sum_densities(style: &mut Style, atoms: &ffi::Atoms) -> Result<(), StyleError> {
    style.sum_densities(&particles_of(atoms))
}

fn style_single(
    style: &mut Style,
    kind_i: i32,
    kind_j: i32,
    i: i32,
    j: i32,
    r: f64,
) -> Result<ffi::PairValue, StyleError> {
    let (energy, force) = style.single([kind_i, kind_j], r, [i, j])?;
    Ok(ffi::PairValue { energy, force })
}

impl Style {
    fn variables(&self) -> usize {
        let plan = self.engine().plan();
        plan.densities().count() * plan.species().len()
    }

    fn set_special_pairs(&mut self, pairs: &[ffi::SpecialPair]) -> Result<(), StyleError> {
        // The engine refuses a negative index as it does one that is too large.
        let number = |k: i32| u32::try_from(k).unwrap_or(u32::MAX);
        let pairs = pairs.iter().map(|p| SpecialPair { i: number(p.i), j: number(p.j), factor: p.factor });
        guard(|| {
            self.engine_mut().set_special_pairs(pairs);
            Ok(())
        })
    }

    fn set_exclusions(&mut self, marks: &[u32], between_molecules: bool) -> Result<(), StyleError> {
        let (marks, _) = marks.as_chunks::<2>();
        guard(|| {
            let marks = marks.iter().map(|[sides, molecule]| Mark { sides: *sides, molecule: *molecule });
            self.engine_mut().set_exclusions(marks, between_molecules);
            Ok(())
        })
    }

    fn fits(&self, extent: &ffi::Extent, request: &ffi::Request) -> Result<bool, StyleError> {
        let want = want_of(request);
        let path = |domain| {
            let domain = self.scale().domain(domain);
            self.engine().path_for(Surroundings::Box(&domain), want)
        };
        guard(|| Ok(domain_of(extent).is_ok_and(|domain| matches!(path(domain), Path::Sweep | Path::Device))))
    }

    fn fetch_slopes(&mut self, all: usize) -> Result<(), StyleError> {
        guard(|| {
            self.engine_mut().fetch_slopes(all);
            Ok(())
        })
    }

    fn excess_of_owned(&mut self) -> Result<&[f64], StyleError> {
        guard(|| Ok(self.excess()))
    }

    fn energy_unit(&self) -> f64 {
        self.scale().energy
    }

    fn velocity_unit(&self) -> f64 {
        self.scale().velocity()
    }

    fn memory(&self) -> usize {
        self.engine().memory()
    }

    fn cutoff(&self) -> f64 {
        self.scale().length * self.engine().plan().cutoff()
    }

    fn slope_width(&self) -> usize {
        self.engine().plan().slope_width()
    }

    fn needs_velocities(&self) -> bool {
        self.engine().plan().needs_velocities()
    }

    fn noise_range(&self) -> f64 {
        self.scale().length * self.engine().plan().noise_range().unwrap_or(0.0)
    }

    fn particle_energy(&self) -> &[f64] {
        self.engine().results().particle_energy
    }

    fn particle_virial(&self) -> &[f64] {
        self.engine().results().particle_virial.as_flattened()
    }
}
