//! Walls: what matter behind faces of the box, and behind cylinders and spheres, adds to densities, energies and forces of particles.
//!
//! Each particle is by itself, so that results do not depend on threads.

use super::components::COMPONENTS;
use super::particles::Particles;
use super::plan::Plan;
use crate::model::wall::{Field, Round, Surface, WallField};
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::Tally;
use psidpd_threads::Pool;

/// What a wall takes in an evaluation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OnWall {
    /// The force on it, away from the fluid, added up over its surface.
    pub force: f64,
    /// The force on it as a vector.
    pub vector: [f64; 3],
    /// The energy of the particles near it, besides that of their ψ.
    pub energy: f64,
    /// The virial of its forces, along the lines from the particles to the surface.
    pub virial: [f64; 6],
}

/// The surface of a wall in a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// A face.
    Face {
        /// The direction across it.
        axis: usize,
        /// Its coordinate in this direction.
        at: f64,
        /// 1 if the fluid is above the face, −1 if it is below.
        inwards: f64,
    },
    /// A cylinder or a sphere, of which a particle sees the nearest image.
    Round {
        /// The surface.
        round: Round,
        /// The lengths of the box, infinite along directions without images.
        periods: [f64; 3],
    },
}

impl Place {
    /// The surface in a box; `None` if the box has no such face.
    pub fn of(surface: &Surface, domain: &PeriodicBox, dimensions: usize) -> Option<Place> {
        let (origin, lengths, periodic) = (domain.origin(), domain.lengths(), domain.periodic());
        let repeats = domain.repeats();
        match *surface {
            Surface::Face { axis, .. } if axis >= dimensions || periodic[axis] => None,
            Surface::Face { axis, high: true } => {
                Some(Place::Face { axis, at: origin[axis] + lengths[axis], inwards: -1.0 })
            }
            Surface::Face { axis, .. } => Some(Place::Face { axis, at: origin[axis], inwards: 1.0 }),
            Surface::Round(round) => {
                let period = |c: usize| if repeats[c] { lengths[c] } else { f64::INFINITY };
                Some(Place::Round { round, periods: [0, 1, 2].map(period) })
            }
        }
    }

    /// The distance of a place from the surface, negative behind it.
    #[inline(always)]
    pub fn distance(&self, x: &[f64; 3]) -> f64 {
        match self {
            Place::Face { axis, at, inwards } => inwards * (x[*axis] - at),
            Place::Round { round, periods } => {
                round.side() * (round.radius - length(from_center(round, periods, x)))
            }
        }
    }

    /// A round surface, and the vector from its axis or centre to a place.
    pub fn arm(&self, x: &[f64; 3]) -> Option<(&Round, [f64; 3])> {
        match self {
            Place::Face { .. } => None,
            Place::Round { round, periods } => Some((round, from_center(round, periods, x))),
        }
    }

    /// Whether a place is in the matter of a round wall, further behind its surface than rounding leads.
    pub fn is_in_matter(&self, x: &[f64; 3]) -> bool {
        let radius = self.arm(x).map(|(round, _)| round.radius);
        radius.is_some_and(|radius| self.distance(x) < -ON_SURFACE * radius)
    }

    /// Mirrors a place in the matter of a round wall at its surface.
    pub fn mirror(&self, x: &mut [f64; 3]) {
        let z = self.distance(x);
        if z < 0.0 && matches!(self, Place::Round { .. }) {
            let n = self.normal(x);
            (0..3).for_each(|c| x[c] -= 2.0 * z * n[c]);
        }
    }

    /// The direction into the fluid at the point of the surface that is nearest to a place.
    pub fn normal(&self, x: &[f64; 3]) -> [f64; 3] {
        match self {
            Place::Face { axis, inwards, .. } => {
                std::array::from_fn(|c| if c == *axis { *inwards } else { 0.0 })
            }
            Place::Round { round, periods } => {
                let d = from_center(round, periods, x);
                let c = -round.side() * length(d);
                d.map(|d| d / c)
            }
        }
    }
}

/// How far behind a round surface a place still counts as on it, in radii: rounding leaves it there.
const ON_SURFACE: f64 = 1e-9;

/// The vector to `x` from the nearest image of the centre, across the surface.
#[inline(always)]
fn from_center(round: &Round, periods: &[f64; 3], x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        let (d, period) = (x[c] - round.center[c], periods[c]);
        match round.across[c] {
            false => 0.0,
            true if d.abs() < 0.5 * period => d,
            true => d - (d / period).round() * period,
        }
    })
}

fn length(d: [f64; 3]) -> f64 {
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// A wall in a box: its place.
#[derive(Debug, Clone, Copy)]
pub struct Face<'a> {
    /// The wall.
    pub wall: &'a WallField,
    /// Its index among the walls of the fluid.
    pub index: usize,
    /// Its surface.
    pub place: Place,
}

/// The walls that a box has: faces of directions that are not periodic, and all round ones.
pub fn faces<'a>(walls: &'a [WallField], domain: &PeriodicBox, dimensions: usize) -> Vec<Face<'a>> {
    let face = |(index, wall): (usize, &'a WallField)| {
        let place = Place::of(&wall.wall.surface, domain, dimensions)?;
        Some(Face { wall, index, place })
    };
    walls.iter().enumerate().filter_map(face).collect()
}

/// Calls `visit` with the field of every face in whose range a particle is, and its distance.
#[inline(always)]
pub fn for_each_near<'a>(
    faces: &[Face<'a>],
    x: &[f64; 3],
    species: i32,
    mut visit: impl FnMut(&Face<'a>, &'a Field, f64),
) {
    for face in faces {
        let z = face.place.distance(x);
        if let Some(field) = face.wall.fields.get(species as usize).filter(|field| z < field.range) {
            visit(face, field, z);
        }
    }
}

/// Adds the densities of walls to `rows`, a row of `width` numbers for each particle, where density `d` of species `s` has the
/// column `column(d) + s`; densities without a column are left out.
pub fn add_densities(
    faces: &[Face],
    x: &[[f64; 3]],
    species: impl Fn(usize) -> i32,
    column: impl Fn(usize) -> Option<usize>,
    width: usize,
    rows: &mut [f64],
) {
    for (k, (x, row)) in x.iter().zip(rows.chunks_exact_mut(width.max(1))).enumerate() {
        for_each_near(faces, x, species(k), |face, field, z| {
            for (d, density) in &field.densities {
                if let Some(column) = column(*d) {
                    row[column + face.wall.wall.species] += density.at(z)[0];
                }
            }
        });
    }
}

/// The force of a wall on a particle, away from its face, and the energy without ψ; `slope` is `∂ψ/∂n` by the density and the
/// species, if ψ depends on it.
pub fn force_and_energy(field: &Field, z: f64, slope: impl Fn(usize) -> Option<f64>) -> [f64; 2] {
    let (mut force, mut energy) = (0.0, 0.0);
    for (d, density) in &field.densities {
        if let Some(slope) = slope(*d) {
            force -= slope * density.at(z)[1];
        }
    }
    for part in &field.energies {
        let [value, slope, _] = part.at(z);
        energy += value;
        force -= slope;
    }
    [force, energy]
}

/// Adds the forces of walls after an evaluation with the `slopes` of ψ, [`Plan::slope_width`] for each particle, to `force`: on owned
/// particles alone, as a ghost has those of its owner. With `sums` it adds up what each wall takes, and returns energy and virial.
pub fn add_forces(
    pool: &Pool,
    plan: &Plan,
    (faces, particles): (&[Face], &Particles),
    slopes: &[f64],
    sums: bool,
    force: &mut [[f64; 3]],
    on_walls: &mut [OnWall],
) -> Tally {
    let Particles { kind, owned, .. } = *particles;
    let (x, force) = (&particles.x[..owned], &mut force[..owned]);
    let (width, count) = (plan.slope_width(), plan.species().len());
    let species = |k: usize| plan.species_of_type().get(kind[k] as usize).copied().unwrap_or(-1);
    let of = |k: usize, face: &Face, field: &Field, z: f64| {
        let slope = |d: usize| {
            let pass = plan.passes().iter().position(|p| *p == d)?;
            Some(slopes[k * width + pass * count + face.wall.wall.species])
        };
        force_and_energy(field, z, slope)
    };
    pool.parts(force, |first, force| {
        for (k, sum) in (first..x.len()).zip(force) {
            for_each_near(faces, &x[k], species(k), |face, field, z| {
                let force = of(k, face, field, z)[0];
                match face.place {
                    Place::Face { axis, inwards, .. } => sum[axis] += inwards * force,
                    round => {
                        let n = round.normal(&x[k]);
                        (0..3).for_each(|c| sum[c] += n[c] * force);
                    }
                }
            });
        }
    });
    let mut tally = Tally::default();
    on_walls.fill(OnWall::default());
    if sums {
        for (k, x) in x.iter().enumerate() {
            for_each_near(faces, x, species(k), |face, field, z| {
                let [force, energy] = of(k, face, field, z);
                let on_wall = &mut on_walls[face.index];
                match face.place {
                    Place::Face { axis, inwards, .. } => {
                        on_wall.virial[axis] += z * force;
                        on_wall.vector[axis] -= inwards * force;
                    }
                    round => {
                        let n = round.normal(x);
                        for (virial, (a, b)) in on_wall.virial.iter_mut().zip(COMPONENTS) {
                            *virial += z * force * n[a] * n[b];
                        }
                        (0..3).for_each(|c| on_wall.vector[c] -= n[c] * force);
                    }
                }
                on_wall.force += force;
                on_wall.energy += energy;
            });
        }
        for on_wall in &*on_walls {
            tally.pair += on_wall.energy;
            tally.virial.iter_mut().zip(on_wall.virial).for_each(|(sum, of_one)| *sum += of_one);
        }
    }
    tally
}
