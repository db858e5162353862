//! Walls: what matter behind faces of the box adds to densities, energies and forces of particles.
//!
//! Each particle is by itself, so that results do not depend on threads.

use super::particles::Particles;
use super::plan::Plan;
use crate::model::wall::{Field, WallField};
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::Tally;
use psidpd_threads::Pool;

/// What a wall takes in an evaluation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OnWall {
    /// The force on it, away from the fluid.
    pub force: f64,
    /// The energy of the particles near it, besides that of their ψ.
    pub energy: f64,
    /// The component of its virial across the face, along the line from the particle to the face.
    pub virial: f64,
}

/// A wall in a box: its place.
#[derive(Debug, Clone, Copy)]
pub struct Face<'a> {
    /// The wall.
    pub wall: &'a WallField,
    /// Its index among the walls of the fluid.
    pub index: usize,
    /// The coordinate of the face across it.
    pub at: f64,
    /// 1 if the fluid is above the face, −1 if it is below.
    pub inwards: f64,
}

impl Face<'_> {
    /// The distance of a place from the face.
    #[inline(always)]
    pub fn distance(&self, x: &[f64; 3]) -> f64 {
        self.inwards * (x[self.wall.wall.axis] - self.at)
    }
}

/// The walls that a box has: those at faces of directions that are not periodic.
pub fn faces<'a>(walls: &'a [WallField], domain: &PeriodicBox, dimensions: usize) -> Vec<Face<'a>> {
    let (origin, lengths, periodic) = (domain.origin(), domain.lengths(), domain.periodic());
    let all = walls.iter().enumerate();
    let has = |wall: &&WallField| wall.wall.axis < dimensions && !periodic[wall.wall.axis];
    let face = |(index, wall): (usize, &'a WallField)| {
        let (axis, high) = (wall.wall.axis, wall.wall.high);
        let (at, inwards) = if high { (origin[axis] + lengths[axis], -1.0) } else { (origin[axis], 1.0) };
        Face { wall, index, at, inwards }
    };
    all.filter(|(_, wall)| has(wall)).map(face).collect()
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
        let z = face.distance(x);
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
                sum[face.wall.wall.axis] += face.inwards * of(k, face, field, z)[0];
            });
        }
    });
    let mut tally = Tally::default();
    on_walls.fill(OnWall::default());
    if sums {
        for (k, x) in x.iter().enumerate() {
            for_each_near(faces, x, species(k), |face, field, z| {
                let [force, energy] = of(k, face, field, z);
                tally.pair += energy;
                tally.virial[face.wall.wall.axis] += z * force;
                let on_wall = &mut on_walls[face.index];
                on_wall.force += force;
                on_wall.energy += energy;
                on_wall.virial += z * force;
            });
        }
    }
    tally
}
