//! Keys of the top level, the box and the masses.

use super::ValueKind::*;
use super::{Key, OPTIONAL, REQUIRED, Table, key, names};
use crate::integrator::{Integrator, THERMOSTAT_STEPS};
use crate::scene::domain::BOUNDARIES;
use psidpd_core::engine::Precision;
use psidpd_core::engine::noise::Law;

pub(super) const INTEGRATOR: Key = key("integrator", Choice(|| names(&Integrator::NAMED)), OPTIONAL,
    "The integrator; `velocity-verlet` if left out, in which the dissipative force uses the half-step velocity, \
     as in LAMMPS. `monte-carlo` makes trial moves without time. `docs/integrators.md` states each integrator, \
     what is exact in it and which step it allows.",
    "integrator = \"groot-warren\"");

pub(super) const LAMBDA: Key = key("lambda", Number, OPTIONAL,
    "The parameter of `groot-warren`, from 0 to 1, 0.65 if left out (0.5 is velocity Verlet); of `two-stage`, \
     from 0 to 0.5, 0.21 if left out; and of `force-gradient`, 0.17 if left out.",
    "integrator = \"groot-warren\"\nlambda = 0.5");

pub(super) const GRADIENT: Key = key("gradient", Number, OPTIONAL,
    "The parameter ξ of `force-gradient`, from 0 to 1; 1/24 if left out, which makes the step fourth-order \
     without a thermostat.",
    "integrator = \"force-gradient\"\ngradient = 0.045");

pub(super) const THERMOSTAT_STEP: Key = key("thermostat_step", Choice(|| names(&THERMOSTAT_STEPS)), OPTIONAL,
    "The thermostat of `aboba`, `baoab`, `two-stage` and `force-gradient`; `midpoint` if left out: the implicit midpoint rule over all \
     pairs at once. `pairwise` is the exact Ornstein–Uhlenbeck process of one pair after the other.",
    "integrator = \"aboba\"\nthermostat_step = \"pairwise\"");

pub(super) const THERMOSTAT_EVERY: Key = key("thermostat_every", Count, OPTIONAL,
    "Number of steps between applications of the thermostat in `aboba`, `baoab`, `two-stage` and \
     `force-gradient`; each application covers as many time steps; 1 if left out.",
    "integrator = \"two-stage\"\nthermostat_every = 2");

pub(super) const NOISE: Key = key("noise", Choice(|| names(&Law::ALL)), OPTIONAL,
    "The distribution of the noise in integrators that apply it apart from the forces; `gaussian` if left out. \
     With `uniform` the distribution of velocities differs slightly from Maxwell's at large time steps. The \
     noise of `velocity-verlet` and `groot-warren` is uniform, that of `lowe-andersen` Gaussian.",
    "integrator = \"aboba\"\nnoise = \"uniform\"");

pub(super) const SWEEPS: Key = key("sweeps", Count, OPTIONAL,
    "Number of sweeps in a step of `monte-carlo`, each with one trial move for every particle that moves; 1 if \
     left out.",
    "integrator = \"monte-carlo\"\nsweeps = 10");

pub(super) const MAX_MOVE: Key = key("max_move", Positive, OPTIONAL,
    "The largest trial move of `monte-carlo` along each direction. If left out, it is adjusted so that 40 % of \
     the moves are accepted, in the first stage of Monte Carlo, or in the first quarter of the stage if there \
     is only one.",
    "integrator = \"monte-carlo\"\nmax_move = 0.1");

pub const TOP: Table = Table::new("",
    "The fluid, its temperature, the box and the length of the run. A scene needs a model, kT, a box, \
     particles (`density`, `[initial]` or `[[part]]`) and steps (`steps` or `[[stage]]`).",
    &[
        key("title", Text, OPTIONAL,
            "The name of the scene; the title of the model if left out.",
            "title = \"A drop of Warren's liquid\""),
        key("model", File, REQUIRED, "The model file, which describes the fluid.", "model = \"fluid.toml\""),
        key("kT", Positive, REQUIRED,
            "The temperature of the initial velocities, of the thermostat, and in the formulas of the model.",
            "kT = 1.0"),
        key("seed", Count, OPTIONAL,
            "Seed of the initial state and of the noise; 1 if left out. The same file gives the same run.",
            "seed = 4711"),
        key("box", Box, OPTIONAL,
            "The box, from the origin along the axes: one length for all edges, one for each, or a table. A \
             scene that starts from a file takes the box from the file.",
            "box = [8.0, 8.0, 16.0]"),
        key("density", Positive, OPTIONAL,
            "Number density of every region that has no density or count of its own. Without `[initial]` and \
             `[[part]]` particles fill the whole box, at random positions and with equal shares of the species.",
            "density = 3.0"),
        key("steps", Count, OPTIONAL, "Number of steps of a run with one stage, named `produce`.", "steps = 2000"),
        key("equilibrate", Count, OPTIONAL,
            "Number of steps of a stage `equilibrate` before `produce`.", "equilibrate = 500\nsteps = 2000"),
        key("dt", Positive, OPTIONAL, "The time step; 0.01 if left out.", "dt = 0.02"),
        INTEGRATOR,
        key("precision", Choice(|| names(&Precision::ALL)), OPTIONAL,
            "Precision in which `psidpd run` computes pair forces; `mixed` if left out: single precision, with \
             positions exact to 2⁻³² of the box and sums in double precision. The option `--precision` \
             overrides it. A deck for LAMMPS uses this key if it is given; otherwise its pair styles compute in \
             double precision.",
            "precision = \"double\""),
        key("device", Text, OPTIONAL,
            "The processor that computes the steps of `psidpd run`: `cpu` if left out; `gpu` is the first GPU, `gpu:N` \
             that with the number N in the list of `psidpd devices`. The option `--device` overrides it. A run on a GPU \
             needs a program that was built for it: see `docs/gpu.md`, which also states what a GPU does not compute.",
            "device = \"gpu\""),
        LAMBDA,
        GRADIENT,
        THERMOSTAT_STEP,
        THERMOSTAT_EVERY,
        NOISE,
        SWEEPS,
        MAX_MOVE,
    ]);

pub const BOX: Table = Table::new("box",
    "The box, if it needs more than lengths.",
    &[
        key("lengths", Lengths, OPTIONAL,
            "Lengths of its edges; required, except in a scene that starts from a file, where they are left \
             out.",
            "[box]\nlengths = [8.0, 8.0, 16.0]"),
        key("boundary", EachOf(|| names(&BOUNDARIES)), OPTIONAL,
            "The boundary at its faces; if left out, `periodic`, or the boundary of the checkpoint or \
             `final.data` that the scene starts from. A particle that meets a reflecting face bounces on its exact path \
             under the force of the step, in which the velocity across the face is reversed; no force acts through the \
             face. For matter behind it use `[[wall]]`, for a wall of particles freeze a `layer` in front of it.",
            "[box]\nlengths = [8.0, 8.0, 16.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]"),
    ]);

pub const MASSES: Table = Table::new("masses",
    "Masses of the species; 1, or the mass in the data file, for species left out.",
    &[key("SPECIES", Positive, OPTIONAL, "The mass of a species.", "[masses]\nB = 2.0")]);
