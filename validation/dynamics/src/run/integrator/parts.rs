//! Loops over particles, each thread its part of them: a particle's coordinates depend on nothing but its own
//! arrays, so that the results are the same for any number of parts.

use super::reflection::{Before, Beyond, Bounce, Faces, Hit, Leg};
use crate::run::bounds::Bounds;
use psidpd_core::engine::vectors::{self, Loop};
use psidpd_core::engine::{PeriodicBox, Pool, part};

/// Particles whose coordinates are done together, in whole vectors.
const GROUP: usize = 4;
const LANES: usize = 3 * GROUP;
const WIDTH: usize = 4;

/// Fewest particles for which another thread pays off.
const WORTH: usize = 1024;

/// Velocities below this have finite squares.
const FINITE: f64 = 1e150;

/// The particles that an integrator moves, without ghosts.
pub struct Moving<'a> {
    pub x: &'a mut [[f64; 3]],
    pub v: &'a mut [[f64; 3]],
    pub f: &'a [[f64; 3]],
    pub species: &'a [i32],
    pub image: &'a mut [[i32; 3]],
    pub mass: &'a [f64],
    pub kept: &'a mut Kept,
}

#[derive(Debug, Clone, Default)]
pub struct Kept {
    /// Velocities of the beginning of the step, or positions that are put aside.
    pub v: Vec<[f64; 3]>,
    /// Forces of the beginning of the step.
    f: Vec<[f64; 3]>,
    /// A number by species.
    over_mass: Vec<f64>,
}

/// What a moved particle is checked against.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    pub domain: &'a PeriodicBox,
    pub faces: Faces<'a>,
    /// The square of the highest velocity that leads nowhere beyond the box.
    pub limit: f64,
}

/// The first particles that went too far, by what is wrong with them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Faults {
    pub fast: Option<usize>,
    /// A particle is beyond a wall even after reflection.
    pub escaped: Option<usize>,
    /// A particle is more boxes away than can be counted.
    pub uncounted: Option<usize>,
}

/// The particles of one thread.
pub struct Part<'a> {
    first: usize,
    pub x: &'a mut [[f64; 3]],
    pub v: &'a mut [[f64; 3]],
    pub f: &'a [[f64; 3]],
    pub species: &'a [i32],
    image: &'a mut [[i32; 3]],
    pub kept: [&'a mut [[f64; 3]]; 2],
    faults: Faults,
    /// The ways of particles that met faces, if ways are recorded.
    legs: Vec<Leg>,
    hits: Vec<Hit>,
    beyond: Vec<Beyond>,
}

/// What a loop over particles has found.
#[derive(Debug, Default)]
pub struct Moved {
    pub faults: Faults,
    /// The ways of particles that met faces, in the order of particles.
    pub legs: Vec<Leg>,
    /// What faces gave to them, if ways are recorded.
    pub hits: Vec<Hit>,
    pub beyond: Vec<Beyond>,
}

/// Does `work` with all particles of `moving`, and `factor` over the mass of each species; with as many arrays of
/// what is kept as the step `keeps`.
pub fn share<'a>(
    moving: Moving<'a>,
    factor: f64,
    keeps: usize,
    pool: &Pool,
    work: impl Fn(&mut Part, &[f64]) + Sync,
) -> Moved {
    let Moving { mut x, mut v, mut f, mut species, mut image, mass, kept } = moving;
    // A division for each species, not for each particle.
    kept.over_mass.clear();
    kept.over_mass.extend(mass.iter().map(|mass| factor / mass));
    let count = x.len();
    let mut of_before = [&mut [][..], &mut []];
    for (slice, array) in of_before.iter_mut().zip([&mut kept.v, &mut kept.f]).take(keeps) {
        array.resize(count, [0.0; 3]);
        *slice = array;
    }
    let parts = pool.threads().min(count / WORTH).max(1);
    let mut shares = Vec::with_capacity(parts);
    for number in 0..parts {
        let range = part(count, number, parts);
        let length = range.len();
        shares.push(Part {
            first: range.start,
            x: x.split_off_mut(..length).unwrap_or_default(),
            v: v.split_off_mut(..length).unwrap_or_default(),
            f: f.split_off(..length).unwrap_or_default(),
            species: species.split_off(..length).unwrap_or_default(),
            image: image.split_off_mut(..length).unwrap_or_default(),
            kept: of_before.each_mut().map(|kept| kept.split_off_mut(..length).unwrap_or_default()),
            faults: Faults::default(),
            legs: Vec::new(),
            hits: Vec::new(),
            beyond: Vec::new(),
        });
    }
    let over_mass = &kept.over_mass[..];
    pool.each(&mut shares, |share| work(share, over_mass));
    // Parts are in the order of particles: the first fault is that of the first part which has one.
    let Moved { mut faults, mut legs, mut hits, mut beyond } = Moved::default();
    for share in &mut shares {
        legs.append(&mut share.legs);
        hits.append(&mut share.hits);
        beyond.append(&mut share.beyond);
        faults.fast = faults.fast.or(share.faults.fast);
        faults.escaped = faults.escaped.or(share.faults.escaped);
        faults.uncounted = faults.uncounted.or(share.faults.uncounted);
    }
    Moved { faults, legs, hits, beyond }
}

/// Moves particles by `rule`, which makes position and velocity of position, velocity, force, and a number of
/// the species, and wraps those that left the bounds; particles that meet a face of the box are reflected.
pub fn drift<R>(part: &mut Part, over_mass: &[f64], around: Surroundings, rule: R)
where
    R: Fn(f64, f64, f64, f64) -> (f64, f64) + Copy,
{
    let before = Before {
        first: part.first,
        x: part.x,
        v: part.v,
        f: part.f,
        species: part.species,
        image: part.image,
    };
    let bounces = around.faces.met(before, over_mass, rule);
    vectors::run_best(Drift { part, over_mass, around, rule });
    if !bounces.is_empty() {
        reflect(part, around, &bounces);
    }
}

fn reflect(part: &mut Part, around: Surroundings, bounces: &[Bounce]) {
    let faces = around.faces;
    part.beyond = faces.left(bounces, part.first);
    for bounces in bounces.chunk_by(|a, b| a.particle == b.particle) {
        let k = bounces[0].particle;
        for bounce in bounces {
            let c = bounce.direction;
            let Some([x, v, u]) = bounce.end else {
                let first = part.first + k;
                part.faults.escaped = Some(part.faults.escaped.map_or(first, |other| other.min(first)));
                continue;
            };
            (part.x[k][c], part.v[k][c]) = (x, v);
            // What the step ends with is the velocity of the path and the new force.
            if let [kept_v, kept_f] = &mut part.kept
                && let (Some(kept_v), Some(kept_f)) = (kept_v.get_mut(k), kept_f.get_mut(k))
            {
                (kept_v[c], kept_f[c]) = (u, -kept_f[c]);
            }
        }
        if faces.records {
            let mass = faces.mass[part.species[k] as usize];
            let mut legs = faces.legs(bounces, part.x[k], part.v[k], part.f[k].map(|f| f / mass));
            let is_round = bounces.iter().any(|bounce| bounce.wall.is_some());
            for leg in &mut legs {
                leg.particle += part.first;
                if is_round {
                    around.domain.wrap(&mut leg.to, &mut [0; 3]);
                }
            }
            part.legs.append(&mut legs);
            part.hits.extend(bounces.iter().map(|b| b.hit(mass)));
        }
        for bounce in bounces.iter().filter(|bounce| bounce.wall.is_some()) {
            part.image[k][bounce.direction] = bounce.image;
        }
        if !faces.bounds.rounds.is_empty() {
            around.domain.wrap(&mut part.x[k], &mut part.image[k]);
            // It met two surfaces, which are a range apart, or more.
            if faces.bounds.rounds.is_in_matter(&part.x[k]) {
                let first = part.first + k;
                part.faults.escaped = Some(part.faults.escaped.map_or(first, |other| other.min(first)));
            }
        }
    }
}

/// Changes velocities by `rule`, which makes one of velocity, force, kept velocity, kept force, and a number of
/// the species.
pub fn kick<const KEEPS: bool, R>(part: &mut Part, over_mass: &[f64], rule: R)
where
    R: Fn(f64, f64, [f64; 2], f64) -> f64,
{
    vectors::run_best(Kick::<KEEPS, R> { part, over_mass, rule });
}

struct Drift<'a, 'b, R> {
    part: &'a mut Part<'b>,
    over_mass: &'a [f64],
    around: Surroundings<'a>,
    rule: R,
}

impl<R: Fn(f64, f64, f64, f64) -> (f64, f64)> Loop for Drift<'_, '_, R> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Drift { part, over_mass, around, rule } = self;
        match over_mass {
            [_] => drift_in_groups::<true, R>(part, over_mass, around, rule),
            _ => drift_in_groups::<false, R>(part, over_mass, around, rule),
        }
    }
}

struct Kick<'a, 'b, const KEEPS: bool, R> {
    part: &'a mut Part<'b>,
    over_mass: &'a [f64],
    rule: R,
}

impl<const KEEPS: bool, R: Fn(f64, f64, [f64; 2], f64) -> f64> Loop for Kick<'_, '_, KEEPS, R> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Kick { part, over_mass, rule } = self;
        match over_mass {
            [_] => kick_in_groups::<KEEPS, true, R>(part, over_mass, rule),
            _ => kick_in_groups::<KEEPS, false, R>(part, over_mass, rule),
        }
    }
}

/// A number of each species for each coordinate of a group.
#[inline(always)]
fn spread(over_mass: &[f64], species: &[i32; GROUP]) -> [f64; LANES] {
    let mut lanes = [0.0; LANES];
    for k in 0..GROUP {
        lanes[3 * k..3 * k + 3].fill(over_mass[species[k] as usize]);
    }
    lanes
}

#[inline(always)]
fn drift_in_groups<const ONE: bool, R>(part: &mut Part, over_mass: &[f64], around: Surroundings, rule: R)
where
    R: Fn(f64, f64, f64, f64) -> (f64, f64),
{
    let Bounds { low, high, .. } = around.faces.bounds;
    let (low, high): ([f64; LANES], [f64; LANES]) =
        (std::array::from_fn(|c| low[c % 3]), std::array::from_fn(|c| high[c % 3]));
    // Faster than this is one component of whatever is too fast.
    let most = (around.limit / 3.0).sqrt() * (1.0 - 1e-9);
    let one = [over_mass[0]; LANES];
    let (x, x_rest) = part.x.as_chunks_mut::<GROUP>();
    let (v, v_rest) = part.v.as_chunks_mut::<GROUP>();
    let (f, f_rest) = part.f.as_chunks::<GROUP>();
    let (species, species_rest) = part.species.as_chunks::<GROUP>();
    let (image, image_rest) = part.image.as_chunks_mut::<GROUP>();
    for (g, ((((x, v), f), species), image)) in x.iter_mut().zip(v).zip(f).zip(species).zip(image).enumerate()
    {
        let m = if ONE { one } else { spread(over_mass, species) };
        let (mut to_x, mut to_v) = ([0.0; LANES], [0.0; LANES]);
        let (from_x, from_v, f): ([f64; LANES], [f64; LANES], [f64; LANES]) = (lanes(x), lanes(v), lanes(f));
        for c in 0..LANES {
            (to_x[c], to_v[c]) = rule(from_x[c], from_v[c], f[c], m[c]);
        }
        // As many at a time as a vector has.
        let mut out = [0; WIDTH];
        for from in (0..LANES).step_by(WIDTH) {
            for c in 0..WIDTH {
                let (x, v) = (to_x[from + c], to_v[from + c]);
                let inside = (x >= low[from + c]) & (x <= high[from + c]) & (v.abs() <= most);
                out[c] |= u64::from(!inside);
            }
        }
        x.as_flattened_mut().copy_from_slice(&to_x);
        v.as_flattened_mut().copy_from_slice(&to_v);
        if out != [0; WIDTH] {
            let from = GROUP * g;
            settle(&around, part.first + from, x, v, image, &mut part.faults);
        }
    }
    let from = part.species.len() - species_rest.len();
    for (((x, v), f), s) in x_rest.iter_mut().zip(&mut *v_rest).zip(f_rest).zip(species_rest) {
        for c in 0..3 {
            (x[c], v[c]) = rule(x[c], v[c], f[c], over_mass[*s as usize]);
        }
    }
    settle(&around, part.first + from, x_rest, v_rest, image_rest, &mut part.faults);
}

/// Checks particles one by one, and wraps those outside.
#[cold]
#[inline(never)]
fn settle(
    around: &Surroundings,
    first: usize,
    x: &mut [[f64; 3]],
    v: &[[f64; 3]],
    image: &mut [[i32; 3]],
    faults: &mut Faults,
) {
    for (k, ((x, v), image)) in x.iter_mut().zip(v).zip(image).enumerate() {
        if is_too_fast(v, around.limit) {
            faults.fast.get_or_insert(first + k);
            continue;
        }
        around.domain.wrap(x, image);
        if has_stopped_counting(image) {
            faults.uncounted.get_or_insert(first + k);
        }
    }
}

#[inline(always)]
fn kick_in_groups<const KEEPS: bool, const ONE: bool, R>(part: &mut Part, over_mass: &[f64], rule: R)
where
    R: Fn(f64, f64, [f64; 2], f64) -> f64,
{
    let one = [over_mass[0]; LANES];
    let mut out = false;
    let (v, v_rest) = part.v.as_chunks_mut::<GROUP>();
    let (f, f_rest) = part.f.as_chunks::<GROUP>();
    let (species, species_rest) = part.species.as_chunks::<GROUP>();
    let [kept_v, kept_f] = &part.kept;
    for (g, ((v, f), species)) in v.iter_mut().zip(f).zip(species).enumerate() {
        let m = if ONE { one } else { spread(over_mass, species) };
        let [old_v, old_f] = match KEEPS {
            true => [group(kept_v, g), group(kept_f, g)],
            false => [[0.0; LANES]; 2],
        };
        let (from, f) = (lanes(v), lanes(f));
        let mut to = [0.0; LANES];
        for c in 0..LANES {
            to[c] = rule(from[c], f[c], [old_v[c], old_f[c]], m[c]);
        }
        let mut lost = [0; WIDTH];
        for from in (0..LANES).step_by(WIDTH) {
            for c in 0..WIDTH {
                let finite = to[from + c].abs() <= FINITE;
                lost[c] |= u64::from(!finite);
            }
        }
        out |= lost != [0; WIDTH];
        v.as_flattened_mut().copy_from_slice(&to);
    }
    let from = part.species.len() - species_rest.len();
    for (k, ((v, f), s)) in v_rest.iter_mut().zip(f_rest).zip(species_rest).enumerate() {
        for c in 0..3 {
            let old = if KEEPS { [kept_v[from + k][c], kept_f[from + k][c]] } else { [0.0; 2] };
            v[c] = rule(v[c], f[c], old, over_mass[*s as usize]);
            let finite = v[c].abs() <= FINITE;
            out |= !finite;
        }
    }
    if out {
        let first = part.first;
        part.faults.fast = part.v.iter().position(|v| is_too_fast(v, f64::MAX)).map(|k| first + k);
    }
}

/// The coordinates of a group, one after the other.
#[inline(always)]
fn lanes(vectors: &[[f64; 3]; GROUP]) -> [f64; LANES] {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(vectors.as_flattened());
    lanes
}

#[inline(always)]
fn group(vectors: &[[f64; 3]], g: usize) -> [f64; LANES] {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(vectors[GROUP * g..GROUP * (g + 1)].as_flattened());
    lanes
}

/// Whether counts of boxes have reached an end, where [`PeriodicBox::wrap`] stops counting.
pub fn has_stopped_counting(image: &[i32; 3]) -> bool {
    image.iter().any(|boxes| [i32::MIN, i32::MAX].contains(boxes))
}

/// Whether the square of a velocity is above `limit`, or no number.
fn is_too_fast(v: &[f64; 3], limit: f64) -> bool {
    let speed = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    speed.is_nan() || speed > limit
}
