//! Walls of matter, of fix dpd/wall.

use crate::bridge::{Atoms, Extent, OnWall, Rub, Shape, WallOfFix};
use crate::converted::triples;
use crate::error::StyleError;
use crate::style::{Style, guard};
use psidpd_core::document::FileError;
use psidpd_core::engine::pair_sums::COMPONENTS;
use psidpd_core::engine::{Step, WallBath, faces};
use psidpd_core::model::Model;
use psidpd_core::model::wall::{Round, Surface, Wall};
use psidpd_core::theory::{drag_without_slip, local_densities_of_matter};

impl Style {
    /// Puts walls around the fluid, in place of those before. `mass` is the mean mass of atoms, in energy over squared velocity.
    pub fn set_walls(&mut self, walls: &[WallOfFix], mass: f64) -> Result<(), StyleError> {
        guard(|| {
            let model = self.model.clone().with_walls(Vec::new());
            let walls = walls.iter().map(|wall| self.wall(wall, &model, mass));
            let walls = walls.collect::<Result<Vec<Wall>, StyleError>>()?;
            let before = std::mem::replace(&mut self.model, model.with_walls(walls));
            let rebuilt = self.rebuild(self.engine.plan().kt(), self.engine.settings());
            self.engine.always_sum_walls();
            if rebuilt.is_err() {
                self.model = before;
            }
            rebuilt
        })
    }

    /// A wall in units of the model.
    fn wall(&self, wall: &WallOfFix, model: &Model, mass: f64) -> Result<Wall, StyleError> {
        let (scale, kt) = (&self.scale, self.engine.plan().kt());
        let volume = scale.length.powi(model.dimensions() as i32);
        let given = |value: f64, unit: f64| (value >= 0.0).then_some(value / unit);
        let mut made = Wall {
            surface: self.surface(wall),
            species: self.species_of_matter(wall)?,
            density: wall.density * volume,
            local_densities: Vec::new(),
            strength: wall.strength,
            velocity: wall.velocity.map(|v| v / scale.velocity()),
            drag: [given(wall.drag, scale.force() / scale.velocity()), given(wall.drag_range, scale.length)],
        };
        let bare = model.at(kt)?;
        let count = bare.densities.len();
        made.local_densities = match &wall.local_densities[..] {
            [] => local_densities_of_matter(&bare, made.density).unwrap_or_default(),
            [n] => vec![n * volume; count],
            all if all.len() == count => all.iter().map(|n| n * volume).collect(),
            all => {
                return Err(StyleError(format!(
                    "local/density has {} numbers: expected one, or one for each of the {count} densities of the model",
                    all.len()
                )));
            }
        };
        let reason = |error: FileError| StyleError(error.kind.to_string());
        if wall.viscosity > 0.0 {
            let viscosity = wall.viscosity * volume / (scale.energy * scale.time);
            let mass = mass * scale.velocity().powi(2) / scale.energy;
            let fluid = [wall.fluid_density * volume, mass];
            let drag = drag_without_slip(model, &made, kt, viscosity, fluid).map_err(reason)?;
            made.drag[0] = Some(drag.ok_or_else(|| {
                StyleError(
                    "viscosity needs the range of the drag, which the model does not have: add drag/range"
                        .to_owned(),
                )
            })?);
        }
        model.clone().with_walls(vec![made.clone()]).at(kt).map_err(reason)?;
        Ok(made)
    }

    fn surface(&self, wall: &WallOfFix) -> Surface {
        let (axis, dimensions) = (wall.axis, self.model.dimensions());
        if wall.shape == Shape::Face {
            return Surface::Face { axis, high: wall.high };
        }
        let along = (wall.shape == Shape::Cylinder).then_some(axis);
        let across = [0, 1, 2].map(|c| c < dimensions && along != Some(c));
        let center = wall.center.map(|x| x / self.scale.length);
        Surface::Round(Round { across, center, radius: wall.radius / self.scale.length, inside: wall.inside })
    }

    fn species_of_matter(&self, wall: &WallOfFix) -> Result<usize, StyleError> {
        let all = self.model.species();
        if !wall.species.is_empty() {
            return all.iter().position(|name| *name == wall.species).ok_or_else(|| {
                StyleError(format!("no species \"{}\"; the model has {}", wall.species, all.join(", ")))
            });
        }
        if wall.kind > 0 {
            let species = self.engine.plan().species_of_type().get(wall.kind as usize);
            return species.and_then(|species| usize::try_from(*species).ok()).ok_or_else(|| {
                StyleError(format!(
                    "type {} is none of the pair style's, and cannot be that of a wall",
                    wall.kind
                ))
            });
        }
        match all.len() {
            1 => Ok(0),
            _ => Err(StyleError(format!(
                "the model has several species, {}: name that of the wall's matter, with 'species' or 'type'",
                all.join(", ")
            ))),
        }
    }

    /// What walls take in the last evaluation from the atoms of this rank, in units of LAMMPS.
    pub fn on_walls(&self) -> Vec<OnWall> {
        let [force, energy] = [self.scale.force(), self.scale.energy];
        let all = self.engine.on_walls().iter();
        all.map(|wall| OnWall {
            force: force * wall.force,
            vector: wall.vector.map(|f| force * f),
            energy: energy * wall.energy,
            virial: wall.virial.map(|w| energy * w),
        })
        .collect()
    }

    /// Lets drag and noise of walls act on the velocities of owned atoms, at the end of a timestep. `mass` is in energy over squared
    /// velocity, and infinite for atoms that keep their velocities. Writes the mean force on each wall to `given`, and returns the
    /// virial of that on the atoms, along the line to the face.
    pub fn rub(
        &mut self,
        extent: &Extent,
        atoms: &Atoms,
        mass: &[f64],
        rub: &Rub,
        given: &mut [f64],
        v: &mut [f64],
    ) -> Result<[f64; 6], StyleError> {
        guard(|| {
            let Style { engine, scale, .. } = self;
            let plan = engine.plan();
            let (domain, dimensions) = (scale.domain(extent)?, plan.dimensions());
            let mut faces = faces(plan.walls(), &domain, dimensions);
            faces.retain(|face| (rub.first..rub.first + rub.count).contains(&face.index));
            let step = Step { seed: rub.seed, number: rub.step, dt: rub.time / scale.time };
            let bath = WallBath::new(step, plan.kt());
            let unit_of_mass = scale.velocity().powi(2) / scale.energy;
            let (mut virial, given) = ([0.0; 6], given.as_chunks_mut::<3>().0);
            given.fill([0.0; 3]);
            let all = triples(atoms.x).iter().zip(v.as_chunks_mut::<3>().0);
            for (k, (x, v)) in all.enumerate().filter(|(k, _)| mass[*k].is_finite()) {
                let Some(species) = plan.species_of_type().get(atoms.kind[k] as usize) else { continue };
                let (x, mass) = (x.map(|x| x / scale.length), unit_of_mass * mass[k]);
                let per_time = mass / step.dt;
                for face in &faces {
                    let before = v.map(|v| v / scale.velocity());
                    let of = (&x, *species, atoms.tag[k]);
                    let Some([after, _]) = bath.act(face, of, mass, dimensions, before) else { continue };
                    let force: [f64; 3] = std::array::from_fn(|c| per_time * (after[c] - before[c]));
                    let z = face.place.distance(&x);
                    let d = face.place.normal(&x).map(|n| z * n);
                    for (w, (a, b)) in virial.iter_mut().zip(COMPONENTS) {
                        *w += scale.energy * 0.5 * (d[a] * force[b] + d[b] * force[a]);
                    }
                    if let Some(given) = given.get_mut(face.index) {
                        (0..3).for_each(|c| given[c] -= scale.force() * force[c]);
                    }
                    *v = after.map(|v| v * scale.velocity());
                }
            }
            Ok(virial)
        })
    }
}
