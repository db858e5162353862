//! Keys of the initial particles.

use super::ValueKind::*;
use super::{Key, OPTIONAL, REQUIRED, Table, form_key, key, names};
use crate::scene::arrangement::{FLAT_LATTICES, LATTICES};
use crate::scene::initial::{FILLED, KINDS, SAVED};
use crate::scene::number::AXES;
use crate::scene::shape::{FACES, SHAPES};
use crate::scene::velocities::Velocities;

fn lattices() -> Vec<&'static str> {
    [names(&LATTICES), names(&FLAT_LATTICES)].concat()
}

const ROUND: &[&str] = &["sphere", "cylinder"];

pub const INITIAL: Table = Table {
    path: "initial",
    title: "",
    array: false,
    forms: ("kind", KINDS),
    about: "One initial region or state: the whole box, a slab, a sphere or a cylinder of fluid, or the state \
            of another run.",
    keys: &[
        key("kind", Choice(|| KINDS.to_vec()), REQUIRED,
            "`random`: the whole box, at random positions. `lattice`: the whole box, on a lattice, for fluids \
             whose particles must not overlap at the start. `slab`, `sphere`, `cylinder`: a region of that \
             shape. `data`: a LAMMPS data file with its box; types are species. `checkpoint`: a checkpoint, or \
             the folder of a run, with its box; time starts again at 0.",
            "[initial]\nkind = \"lattice\"\ndensity = 3.0"),
        of(DENSITY, FILLED, "[initial]\nkind = \"random\"\ndensity = 3.0"),
        of(COUNT, FILLED, "[initial]\nkind = \"random\"\ncount = 500"),
        of(COMPOSITION, FILLED,
            "[initial]\nkind = \"random\"\ndensity = 3.0\ncomposition = { A = 0.25, B = 0.75 }"),
        of(SPECIES, FILLED, "[initial]\nkind = \"random\"\ndensity = 3.0\nspecies = \"A\""),
        of(LATTICE, FILLED, "[initial]\nkind = \"slab\"\nthickness = 3.0\ndensity = 3.0\nlattice = \"fcc\""),
        of(MIN_DISTANCE, FILLED, "[initial]\nkind = \"random\"\ndensity = 3.0\nmin_distance = 0.4"),
        of(AXIS, &["slab", "cylinder"],
            "[initial]\nkind = \"slab\"\naxis = \"x\"\nthickness = 3.0\ndensity = 3.0"),
        of(THICKNESS, &["slab"], "[initial]\nkind = \"slab\"\nthickness = 3.0\ndensity = 3.0"),
        of(AT, &["slab"], "[initial]\nkind = \"slab\"\nthickness = 3.0\nat = 2.0\ndensity = 3.0"),
        of(RADIUS, ROUND, "[initial]\nkind = \"sphere\"\nradius = 3.0\ndensity = 3.0"),
        of(CENTER, ROUND, "[initial]\nkind = \"sphere\"\nradius = 2.0\ncenter = [2.5, 3.0, 3.0]\ndensity = 3.0"),
        of(LENGTH, &["cylinder"], "[initial]\nkind = \"cylinder\"\nradius = 2.0\nlength = 3.0\ndensity = 3.0"),
        form_key(SAVED, "file", File, REQUIRED,
            "The file.", "[initial]\nkind = \"data\"\nfile = \"start.data\""),
        form_key(SAVED, "frozen_ids", Ids, OPTIONAL,
            "The particles that never move, by the ids of the file. Ids of a scene with parts count from 1, \
             part by part.",
            "[initial]\nkind = \"data\"\nfile = \"start.data\"\nfrozen_ids = [1, 2]"),
        key("velocities", Choice(|| names(&Velocities::OF_FILES)), OPTIONAL,
            "`thermal`: Maxwell's distribution at kT, with zero total momentum. `zero`: particles at rest. \
             `keep`, for a file only: the velocities of the file. If left out, a checkpoint keeps its own \
             velocities, and everything else is thermal.",
            "[initial]\nkind = \"data\"\nfile = \"start.data\"\nvelocities = \"keep\""),
        of(VELOCITY, FILLED,
            "[initial]\nkind = \"sphere\"\nradius = 2.0\ndensity = 3.0\nvelocity = [0.0, 0.0, -1.0]"),
    ],
};

pub const PART: Table = Table {
    path: "part",
    title: "",
    array: true,
    forms: ("shape", SHAPES),
    about: "Several initial regions, instead of `[initial]`: they do not overlap, and each is filled with \
            particles. Two colliding drops are two spheres with velocities, and the impact parameter is the \
            distance of their centres normal to the velocities; a pendant drop is a cylinder under a frozen \
            cylinder; a wall is a frozen layer; separated phases are parts of one species each. Particles are \
            numbered part by part.",
    keys: &[
        key("shape", Choice(|| SHAPES.to_vec()), REQUIRED,
            "`box`: a block between two corners. `slab`: a slab across the box. `layer`: a slab at a face. \
             `sphere`: a sphere, in two dimensions a disc. `cylinder`: a cylinder. `rest`: the box without the \
             other parts.",
            "[[part]]\nshape = \"sphere\"\nradius = 2.0\ndensity = 6.0\n[[part]]\nshape = \"rest\"\ndensity = 0.1"),
        key("name", Text, OPTIONAL,
            "The name of the part, for body forces; `part 1`, `part 2` … if left out.",
            "[[part]]\nname = \"drop\"\nshape = \"sphere\"\nradius = 2.0\ndensity = 6.0"),
        key("frozen", Flag, OPTIONAL,
            "Whether its particles never move. They act on the moving particles through every force, drag and \
             noise included; temperature and momentum count only the moving particles. False if left out.",
            "[[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 1.0\ndensity = 3.0\nfrozen = true\n\
             [[part]]\nshape = \"rest\"\ndensity = 3.0"),
        of(DENSITY, &[], "[[part]]\nshape = \"box\"\ndensity = 3.0"),
        of(COUNT, &[], "[[part]]\nshape = \"box\"\ncount = 500"),
        of(COMPOSITION, &[], "[[part]]\nshape = \"box\"\ndensity = 3.0\ncomposition = { A = 0.9, B = 0.1 }"),
        of(SPECIES, &[],
            "[[part]]\nshape = \"sphere\"\nradius = 2.0\ndensity = 3.0\nspecies = \"A\"\n\
             [[part]]\nshape = \"rest\"\ndensity = 3.0\nspecies = \"B\""),
        of(LATTICE, &[], "[[part]]\nshape = \"sphere\"\nradius = 2.0\ndensity = 3.0\nlattice = \"bcc\""),
        of(MIN_DISTANCE, &[], "[[part]]\nshape = \"box\"\ndensity = 3.0\nmin_distance = 0.4"),
        form_key(&["box"], "low", Point, OPTIONAL,
            "The lower corner; that of the box if left out.",
            "[[part]]\nshape = \"box\"\nlow = [1.0, 1.0, 1.0]\ndensity = 3.0"),
        form_key(&["box"], "high", Point, OPTIONAL,
            "The upper corner; that of the box if left out.",
            "[[part]]\nshape = \"box\"\nhigh = [6.0, 6.0, 3.0]\ndensity = 3.0"),
        of(AXIS, &["slab", "cylinder"],
            "[[part]]\nshape = \"cylinder\"\naxis = \"x\"\nradius = 2.0\ndensity = 3.0"),
        of(THICKNESS, &["slab", "layer"],
            "[[part]]\nshape = \"layer\"\nface = \"xhi\"\nthickness = 2.0\ndensity = 3.0"),
        form_key(&["layer"], "face", Choice(|| names(&FACES)), REQUIRED,
            "The face of the box at which the layer lies.",
            "[[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 1.0\ndensity = 3.0"),
        of(AT, &["slab"], "[[part]]\nshape = \"slab\"\nthickness = 3.0\nat = 2.0\ndensity = 3.0"),
        of(RADIUS, ROUND, "[[part]]\nshape = \"sphere\"\nradius = 2.0\ndensity = 3.0"),
        of(CENTER, ROUND,
            "[[part]]\nshape = \"cylinder\"\nradius = 2.0\nlength = 2.0\ncenter = [3.0, 3.0, 5.0]\ndensity = 3.0"),
        of(LENGTH, &["cylinder"], "[[part]]\nshape = \"cylinder\"\nradius = 2.0\nlength = 3.0\ndensity = 3.0"),
        form_key(&[], "velocities", Choice(|| names(&Velocities::OF_PARTS)), OPTIONAL,
            "`thermal`: Maxwell's distribution at kT, with zero total momentum. `zero`: particles at rest. \
             Thermal if left out.",
            "[[part]]\nshape = \"box\"\ndensity = 3.0\nvelocities = \"zero\""),
        of(VELOCITY, &[],
            "[[part]]\nshape = \"sphere\"\nradius = 1.4\ncenter = [3.0, 3.0, 1.5]\ndensity = 3.0\nvelocity = [0.0, 0.0, 1.0]\n\
             [[part]]\nshape = \"sphere\"\nradius = 1.4\ncenter = [3.5, 3.0, 4.5]\ndensity = 3.0\nvelocity = [0.0, 0.0, -1.0]"),
    ],
};

/// A key in a table whose `forms` have it.
const fn of(key: Key, forms: &'static [&'static str], example: &'static str) -> Key {
    Key { forms, example, ..key }
}

const DENSITY: Key = key("density", Positive, OPTIONAL,
    "Number density of the region; that of the scene if left out.", "");
const COUNT: Key = key("count", Count, OPTIONAL, "Number of particles, instead of `density`.", "");
const COMPOSITION: Key = key("composition", Fractions, OPTIONAL,
    "Number fractions of the species, which add up to 1 and are mixed at random; equal shares if left out.", "");
const SPECIES: Key = key("species", Text, OPTIONAL,
    "The only species of the region, instead of a composition.", "");
const LATTICE: Key = key("lattice", Choice(lattices), OPTIONAL,
    "The lattice of the initial positions: `sc`, `bcc`, `fcc`, or in two dimensions `square`, `hexagonal`. \
     In a block the lattice is stretched to fit with whole cells. Surplus sites are vacancies, spread \
     evenly. Positions are random if left out; `sc` or `square` for `kind = \"lattice\"`.", "");
const MIN_DISTANCE: Key = key("min_distance", Positive, OPTIONAL,
    "The minimum distance of random particles from each other and from earlier parts: closer positions are \
     redrawn. A scene without room for its particles is refused; distances up to about 0.75 density^(-1/3) \
     are possible, in two dimensions 0.7 density^(-1/2).", "");
const AXIS: Key = key("axis", Choice(|| names(&AXES)), OPTIONAL,
    "Direction of the normal of a slab or of the axis of a cylinder; the last direction if left out.", "");
const THICKNESS: Key = key("thickness", Positive, REQUIRED, "The thickness.", "");
const AT: Key = key("at", Number, OPTIONAL,
    "Position of the middle of the slab along its normal; the middle of the box if left out.", "");
const RADIUS: Key = key("radius", Positive, REQUIRED, "The radius.", "");
const CENTER: Key = key("center", Point, OPTIONAL, "The centre; that of the box if left out.", "");
const LENGTH: Key = key("length", Positive, OPTIONAL, "The length; that of the box if left out.", "");
const VELOCITY: Key = key("velocity", Point, OPTIONAL,
    "A velocity that is added to the velocities of all particles of the region.", "");
