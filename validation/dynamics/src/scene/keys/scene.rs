//! Keys of the top level, the box and the masses.

use super::ValueKind::*;
use super::{Key, OPTIONAL, REQUIRED, Table, key, names};
use crate::integrator::{Integrator, THERMOSTAT_STEPS};
use crate::scene::domain::BOUNDARIES;
use psidpd_core::engine::Precision;
use psidpd_core::engine::noise::Law;

pub(super) const INTEGRATOR: Key = key("integrator", Choice(|| names(&Integrator::NAMED)), OPTIONAL,
    "How a step is made; `velocity-verlet` if left out, in which the dissipative force sees the half-step \
     velocity, as in LAMMPS. `monte-carlo` makes trial moves without time. `docs/integrators.md` states each, says what is exact in \
     it and which step it allows.",
    "integrator = \"groot-warren\"");

pub(super) const LAMBDA: Key = key("lambda", Number, OPTIONAL,
    "The parameter of `groot-warren`, from 0 to 1, 0.65 if left out, which is velocity Verlet with 0.5; and that of \
     `two-stage`, from 0 to 0.5, 0.21 if left out, and of `force-gradient`, 1/6 if left out.",
    "integrator = \"groot-warren\"\nlambda = 0.5");

pub(super) const GRADIENT: Key = key("gradient", Number, OPTIONAL,
    "The parameter ξ of `force-gradient`, from 0 to 1; 1/24 if left out, with which the step is of fourth order without \
     thermostat.",
    "integrator = \"force-gradient\"\ngradient = 0.045");

pub(super) const THERMOSTAT_STEP: Key = key("thermostat_step", Choice(|| names(&THERMOSTAT_STEPS)), OPTIONAL,
    "The thermostat of `aboba`, `baoab`, `two-stage` and `force-gradient`; `midpoint` if left out: the implicit midpoint rule over all \
     pairs at once. `pairwise` is the exact Ornstein–Uhlenbeck process of one pair after the other.",
    "integrator = \"aboba\"\nthermostat_step = \"pairwise\"");

pub(super) const THERMOSTAT_EVERY: Key = key("thermostat_every", Count, OPTIONAL,
    "Steps from one thermostat to the next in `aboba`, `baoab`, `two-stage` and `force-gradient`, each for as many time steps; 1 if left \
     out.",
    "integrator = \"two-stage\"\nthermostat_every = 2");

pub(super) const NOISE: Key = key("noise", Choice(|| names(&Law::ALL)), OPTIONAL,
    "The law of the noise where it acts apart from the forces; `gaussian` if left out. With `uniform` the distribution of \
     velocities is not quite that of Maxwell at large time steps. The noise of `velocity-verlet` and \
     `groot-warren` is uniform, that of `lowe-andersen` Gaussian.",
    "integrator = \"aboba\"\nnoise = \"uniform\"");

pub(super) const SWEEPS: Key = key("sweeps", Count, OPTIONAL,
    "Sweeps in a step of `monte-carlo`, each with one trial move for every particle that moves; 1 if left out.",
    "integrator = \"monte-carlo\"\nsweeps = 10");

pub(super) const MAX_MOVE: Key = key("max_move", Positive, OPTIONAL,
    "The furthest that a trial move of `monte-carlo` goes along each direction. If left out it is found, for 40 % of accepted \
     moves, in the first stage of Monte Carlo, or in the first quarter of the only one.",
    "integrator = \"monte-carlo\"\nmax_move = 0.1");

pub const TOP: Table = Table {
    path: "",
    title: "",
    array: false,
    forms: ("", &[]),
    about: "Which fluid, how warm, in which box, for how long. A scene needs a model, kT, a box, something in it \
            (`density`, `[initial]` or `[[part]]`) and steps (`steps` or `[[stage]]`).",
    keys: &[
        key("title", Text, OPTIONAL,
            "What the scene is called; the title of the model if left out.",
            "title = \"A drop of Warren's liquid\""),
        key("model", File, REQUIRED, "The model file: the fluid.", "model = \"fluid.toml\""),
        key("kT", Positive, REQUIRED,
            "The temperature: of the initial velocities, of the thermostat, and in the formulas of the model.",
            "kT = 1.0"),
        key("seed", Count, OPTIONAL,
            "Seed of the initial state and of the noise; 1 if left out. The same file gives the same run.",
            "seed = 4711"),
        key("box", Box, OPTIONAL,
            "The box, from the origin along the axes: one length for all edges, one for each, or a table. A start \
             from a file takes its box from there.",
            "box = [8.0, 8.0, 16.0]"),
        key("density", Positive, OPTIONAL,
            "Number density of everything that is filled and has no density or count of its own. Without \
             `[initial]` and `[[part]]` the whole box is filled, at random and with equal shares of the species.",
            "density = 3.0"),
        key("steps", Count, OPTIONAL, "Steps of a run of one stage, named `produce`.", "steps = 2000"),
        key("equilibrate", Count, OPTIONAL,
            "Steps of a stage `equilibrate` before it.", "equilibrate = 500\nsteps = 2000"),
        key("dt", Positive, OPTIONAL, "The time step; 0.01 if left out.", "dt = 0.02"),
        INTEGRATOR,
        key("precision", Choice(|| names(&Precision::ALL)), OPTIONAL,
            "Precision in which `psidpd run` computes pair forces; `mixed` if left out: single precision, with positions \
             exact to 2⁻³² of the box and sums in double precision. The option `--precision` overrides it. A deck \
             for LAMMPS takes it over if it is given; pair styles are in double precision otherwise.",
            "precision = \"double\""),
        LAMBDA,
        GRADIENT,
        THERMOSTAT_STEP,
        THERMOSTAT_EVERY,
        NOISE,
        SWEEPS,
        MAX_MOVE,
    ],
};

pub const BOX: Table = Table {
    path: "box",
    title: "",
    array: false,
    forms: ("", &[]),
    about: "The box, where it needs more than lengths.",
    keys: &[
        key("lengths", Lengths, OPTIONAL,
            "Lengths of its edges; left out in a start from a file, needed otherwise.",
            "[box]\nlengths = [8.0, 8.0, 16.0]"),
        key("boundary", EachOf(|| names(&BOUNDARIES)), OPTIONAL,
            "What happens at its faces; `periodic` if left out, or as it was in a checkpoint, or a `final.data`, that is started from. A \
             face that reflects puts a particle as far inside as it was outside and reverses its velocity across the \
             face; nothing acts through it. For a wall of particles freeze a `layer` in front of it.",
            "[box]\nlengths = [8.0, 8.0, 16.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]"),
    ],
};

pub const MASSES: Table = Table {
    path: "masses",
    title: "",
    array: false,
    forms: ("", &[]),
    about: "Masses of the species; 1, or what a data file says, for those left out.",
    keys: &[key("SPECIES", Positive, OPTIONAL, "The mass of a species.", "[masses]\nB = 2.0")],
};
