//! Keys of body forces, stages and output.

use super::scene::{
    GRADIENT, INTEGRATOR, LAMBDA, MAX_MOVE, NOISE, SWEEPS, THERMOSTAT_EVERY, THERMOSTAT_STEP,
};
use super::ValueKind::*;
use super::{Key, OPTIONAL, REQUIRED, Table, key, names};
use crate::scene::number::AXES;
use crate::scene::round::{FLUIDS, SHAPES};
use crate::scene::wall::KINDS;

pub const WALL: Table = Table::array("wall",
    "Walls as a continuum: matter behind a reflecting face, around a cylinder or a sphere, or in one, which costs no particles and has \
     no layers or pits. A particle in front of it has the local densities and the energy that integrals over the matter say, the matter's own ψ responds to \
     first order, and drag and noise against it are a friction by the distance from the face. See `docs/walls.md`.",
    &[
        key("kind", Choice(|| names(KINDS)), REQUIRED, "`continuum`: matter of one density that fills all that is behind the surface.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\", \"zhi\"]\nspecies = \"A\"\ndensity = 3.0"),
        key("faces", Names, OPTIONAL,
            "The faces of the box behind which the matter lies: `xlo`, `xhi`, `ylo` … Their directions must be reflecting. Required \
             without a `shape`.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\"\ndensity = 3.0"),
        key("shape", Choice(|| names(&SHAPES)), OPTIONAL,
            "A round wall instead of faces: a `cylinder`, or a `sphere`, which in two dimensions is a circle; two dimensions have no \
             cylinder. It lies in the box, and the box is so large that nothing sees images of it: a diameter and the range of the forces \
             with the fluid inside, a diameter and twice the range with the fluid outside. Several with the fluid outside are a range apart.",
            "[[wall]]\nkind = \"continuum\"\nshape = \"cylinder\"\nradius = 2.0\nfluid = \"inside\"\nspecies = \"A\"\ndensity = 3.0"),
        key("radius", Positive, OPTIONAL,
            "The radius of a round wall, no smaller than the range of the forces; it has no default.",
            "[[wall]]\nkind = \"continuum\"\nshape = \"sphere\"\nradius = 1.5\nfluid = \"outside\"\nspecies = \"A\""),
        key("fluid", Choice(|| names(&FLUIDS)), OPTIONAL,
            "On which side of a round wall the fluid is: `inside`, with matter all around, as in a capillary, or `outside`, with the \
             matter in the cylinder or the sphere, as that of a fibre; it has no default. A density of the scene fills the side of the fluid, and so does \
             a part of `shape = \"rest\"`.",
            "[[wall]]\nkind = \"continuum\"\nshape = \"sphere\"\nradius = 1.5\nfluid = \"outside\"\nspecies = \"A\"\n\
             [[part]]\nshape = \"rest\"\ndensity = 3.0"),
        key("center", Point, OPTIONAL,
            "The centre of a round wall; the middle of the box if left out. Of a cylinder the two coordinates across its axis are enough.",
            "[[wall]]\nkind = \"continuum\"\nshape = \"sphere\"\nradius = 1.5\nfluid = \"outside\"\nspecies = \"A\"\n\
             center = [3.0, 3.0, 3.2]"),
        key("axis", Choice(|| names(&AXES)), OPTIONAL,
            "The direction along a cylinder; z if left out.",
            "[[wall]]\nkind = \"continuum\"\nshape = \"cylinder\"\nradius = 1.5\nfluid = \"outside\"\nspecies = \"A\"\naxis = \"x\""),
        key("species", Text, OPTIONAL,
            "The species of the matter, with the interactions that the model gives it; required if the model has several.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\""),
        key("density", Positive, OPTIONAL,
            "Number density of the matter; that of the fluid, in its largest part, if left out.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\"\ndensity = 6.0"),
        key("local_density", Positive, OPTIONAL,
            "The local density of a particle of the matter, at which its ψ responds to the fluid: the mean that the observable \
             `local_density` finds in a liquid. If left out that of theory with correlations to first order, which `check` prints for \
             the fluid; for several species the number density, as in mean field.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\"\ndensity = 6.05\nlocal_density = 2.3"),
        key("strength", Number, OPTIONAL,
            "Factor of the pair potentials between fluid and matter, 1 if left out: how strongly the wall attracts the fluid. \
             `psidpd model wall` finds that of a contact angle.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\"\nstrength = 0.8"),
        key("velocity", Point, OPTIONAL,
            "The velocity of the matter, along its face or along the axis of a cylinder; at rest if left out. A sphere rests, and a cylinder does not turn.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zhi\"]\nspecies = \"A\"\nvelocity = [0.5, 0.0, 0.0]"),
        key("viscosity", Positive, OPTIONAL,
            "The shear viscosity of the fluid: the drag gets the strength at which a flow extrapolates to the wall's velocity at \
             the face.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\", \"zhi\"]\nspecies = \"A\"\nviscosity = 0.85"),
        key("drag", Number, OPTIONAL,
            "Coefficient γ of the drag between fluid and matter, instead of `viscosity`; that of the model if both are left out. With 0 \
             the fluid slips freely.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\"\ndrag = 20.0"),
        key("drag_range", Positive, OPTIONAL,
            "Range of the drag between fluid and matter; that of the model if left out.",
            "[[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nspecies = \"A\"\ndrag = 20.0\ndrag_range = 0.8"),
    ]);

pub const BODY_FORCE: Table = Table::array("body_force",
    "An external acceleration. A scene may have several, which add up. Potential energies and virials do \
     not include it.",
    &[
        key("acceleration", Point, REQUIRED,
            "The acceleration, for example gravity; the force is the mass times the acceleration.",
            "[[body_force]]\nacceleration = [0.0, 0.0, -0.02]"),
        key("reversed_along", Choice(|| names(&AXES)), OPTIONAL,
            "A direction along which the second half of the box has the opposite acceleration: two Poiseuille \
             flows side by side, without walls, whose profile gives the viscosity.",
            "[[body_force]]\nacceleration = [0.02, 0.0, 0.0]\nreversed_along = \"z\""),
        key("species", Names, OPTIONAL,
            "The species it acts on; all if left out.",
            "[[body_force]]\nacceleration = [0.0, 0.0, -0.02]\nspecies = [\"B\"]"),
        key("parts", Names, OPTIONAL,
            "The parts whose particles it acts on, wherever they go; all if left out.",
            "[[body_force]]\nacceleration = [0.0, 0.0, -0.02]\nparts = [\"drop\"]\n\
             [[part]]\nname = \"drop\"\nshape = \"sphere\"\nradius = 2.0\ndensity = 6.0\n\
             [[part]]\nshape = \"rest\"\ndensity = 0.1"),
    ]);

/// A key of the top level in a stage.
const fn of_stage(of_top: Key, about: &'static str, example: &'static str) -> Key {
    Key { about, example, ..of_top }
}

pub const STAGE: Table = Table::array("stage",
    "The stages of a run, one after the other, each with its own conditions; they replace `steps`.",
    &[
        key("name", Text, REQUIRED,
            "The name of the stage.", "[[stage]]\nname = \"equilibrate\"\nsteps = 500"),
        key("steps", Count, REQUIRED,
            "Number of steps, at least 1.",
            "[[stage]]\nname = \"equilibrate\"\nsteps = 500\n[[stage]]\nname = \"produce\"\nsteps = 2000"),
        key("dt", Positive, OPTIONAL,
            "The time step; that of the top level if left out.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\ndt = 0.005"),
        of_stage(INTEGRATOR,
            "The integrator; that of the top level if left out.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"groot-warren\""),
        of_stage(LAMBDA,
            "The parameter of `groot-warren`, from 0 to 1, or of `two-stage` and `force-gradient`, from 0 to 0.5.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"groot-warren\"\nlambda = 0.5"),
        of_stage(GRADIENT,
            "The parameter of `force-gradient`; as at the top level.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"force-gradient\"\ngradient = 0.045"),
        of_stage(THERMOSTAT_STEP,
            "The thermostat of the integrator; as at the top level.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"aboba\"\nthermostat_step = \"pairwise\""),
        of_stage(THERMOSTAT_EVERY,
            "Number of steps between applications of the thermostat; as at the top level.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"aboba\"\nthermostat_every = 4"),
        of_stage(NOISE,
            "The distribution of the noise of the integrator; as at the top level.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"aboba\"\nnoise = \"uniform\""),
        of_stage(SWEEPS,
            "Number of sweeps in a step of `monte-carlo`; as at the top level.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"monte-carlo\"\nsweeps = 10"),
        of_stage(MAX_MOVE,
            "The largest trial move of `monte-carlo`; as at the top level.",
            "[[stage]]\nname = \"produce\"\nsteps = 1000\nintegrator = \"monte-carlo\"\nmax_move = 0.1"),
        key("kT", Temperature, OPTIONAL,
            "The temperature; that of the top level if left out. Two temperatures, `[from, to]`, make a ramp in \
             levels of equal steps; the last level is at `to`.",
            "[[stage]]\nname = \"quench\"\nsteps = 1000\nkT = [2.0, 1.0]"),
        key("levels", Count, OPTIONAL,
            "Number of levels of a ramp; 20 if left out.",
            "[[stage]]\nname = \"quench\"\nsteps = 1000\nkT = [2.0, 1.0]\nlevels = 50"),
        key("thermostat", Flag, OPTIONAL,
            "Whether dissipative and random forces act; true if left out.",
            "[[stage]]\nname = \"alone\"\nsteps = 1000\nthermostat = false"),
        key("body_forces", Flag, OPTIONAL,
            "Whether body forces act; true if left out.",
            "[[body_force]]\nacceleration = [0.0, 0.0, -0.02]\n[[stage]]\nname = \"settle\"\nsteps = 1000\nbody_forces = false"),
    ]);

pub const OUTPUT: Table = Table::new("output",
    "What a run writes in addition to its final state.",
    &[
        key("thermo", Count, OPTIONAL,
            "Number of steps between rows of totals; 100 if left out, 0 for no rows.", "[output]\nthermo = 50"),
        key("dump", Count, OPTIONAL,
            "Number of steps between frames with every particle; 0, no frames, if left out.", "[output]\ndump = 500"),
        key("xyz", Count, OPTIONAL,
            "Number of steps between frames with every particle as extended XYZ; 0, no frames, if left out.",
            "[output]\nxyz = 500"),
        key("gsd", Count, OPTIONAL,
            "Number of steps between frames with every particle in the format of HOOMD-blue; 0, no frames, if left out.",
            "[output]\ngsd = 500"),
        key("vtk", Count, OPTIONAL,
            "Number of steps between files for ParaView with every particle, and with the weighted local density on a \
             grid; 0, no files, if left out.",
            "[output]\nvtk = 500"),
        key("snapshot", Count, OPTIONAL,
            "Number of steps between pictures of the particles; 0, no pictures, if left out.", "[output]\nsnapshot = 1000"),
        key("checkpoint", Count, OPTIONAL,
            "Number of steps between checkpoints, from which an interrupted run continues; every ten minutes if \
             left out, 0 for a checkpoint only at the end.",
            "[output]\ncheckpoint = 10000"),
    ]);
