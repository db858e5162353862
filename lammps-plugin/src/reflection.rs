//! Reflection at cylinders and spheres of matter, of fix dpd/wall.

use crate::bridge::{Atoms, Drift, Extent};
use crate::converted::triples;
use crate::error::StyleError;
use crate::style::{Style, guard};
use psidpd_core::engine::reflection::{Path, Way};
use psidpd_core::engine::{Face, Place, check_apart, check_room, faces};

impl Style {
    /// The round walls in the box.
    fn rounds(&self, extent: &Extent) -> Result<Vec<Face<'_>>, StyleError> {
        let plan = self.engine.plan();
        let mut faces = faces(plan.walls(), &self.scale.domain(extent)?, plan.dimensions());
        faces.retain(|face| matches!(face.place, Place::Round { .. }));
        Ok(faces)
    }

    /// Refuses round walls that do not fit into the box, or stand too close to others.
    pub fn check_room(&self, extent: &Extent) -> Result<(), StyleError> {
        let (plan, domain) = (self.engine.plan(), self.scale.domain(extent)?);
        let (dimensions, range) = (plan.dimensions(), plan.cutoff());
        for (k, field) in plan.walls().iter().enumerate() {
            let wall = &field.wall;
            let room = wall.surface.round().map(|r| check_room(r, field, &domain, dimensions, range));
            let others = plan.walls()[..k].iter();
            let mut apart = others.map(|other| check_apart([wall, &other.wall], &domain, dimensions, range));
            room.into_iter().chain(&mut apart).collect::<Result<(), _>>().map_err(|cramped| {
                let help = cramped.help.map(|help| format!(": {help}")).unwrap_or_default();
                StyleError(format!(
                    "fix dpd/wall: {}: {}{help}",
                    wall.surface.name(dimensions),
                    cramped.message
                ))
            })?;
        }
        Ok(())
    }

    /// The first owned atom in the matter of a round wall; -1 if there is none.
    pub fn find_in_matter(&self, extent: &Extent, atoms: &Atoms) -> Result<i64, StyleError> {
        let (rounds, length) = (self.rounds(extent)?, self.scale.length);
        let species = self.engine.plan().species_of_type();
        let feels = |k: usize| species.get(atoms.kind[k] as usize).is_some_and(|species| *species >= 0);
        let is_in = |x: &[f64; 3]| rounds.iter().any(|r| r.place.is_in_matter(&x.map(|x| x / length)));
        let mut all = triples(atoms.x).iter().enumerate();
        Ok(all.find(|(k, x)| feels(*k) && is_in(x)).map_or(-1, |(k, _)| i64::from(atoms.tag[k])))
    }

    /// Lets round walls reflect atoms that a drift has led to their surfaces. `beyond` is kept for each atom from the first half of a timestep
    /// to the second; to `given` the mean force on each wall in the timestep is added, and what presses on its surface.
    pub fn bounce(
        &self,
        extent: &Extent,
        drift: &Drift,
        beyond: &mut [f64],
        given: &mut [f64],
        x: &mut [f64],
        v: &mut [f64],
    ) -> Result<(), StyleError> {
        guard(|| {
            let (scale, dt) = (&self.scale, drift.dt / self.scale.time);
            let kicked = drift.kicked / scale.time;
            let path = match drift.part {
                0 => Path::whole(dt, kicked),
                1 => Path::first_half(dt, kicked),
                _ => Path::second_half(dt, kicked),
            };
            let mut rounds = self.rounds(extent)?;
            rounds.retain(|face| (drift.first..drift.first + drift.count).contains(&face.index));
            let unit_of_mass = scale.velocity().powi(2) / scale.energy;
            let (beyond, given) = (beyond.as_chunks_mut::<3>().0, given.as_chunks_mut::<4>().0);
            let (x, v) = (x.as_chunks_mut::<3>().0, v.as_chunks_mut::<3>().0);
            for (k, f) in triples(drift.f).iter().enumerate().filter(|(k, _)| drift.mass[*k].is_finite()) {
                let mass = unit_of_mass * drift.mass[k];
                let a = f.map(|f| f / (scale.force() * mass));
                for face in &rounds {
                    let (to, moved) = (x[k].map(|x| x / scale.length), v[k].map(|v| v / scale.velocity()));
                    let from = std::array::from_fn(|c| to[c] - path.time * moved[c]);
                    let left = || beyond.get(k).copied().unwrap_or_default();
                    let Way::Met(met) = path.meet(&face.place, &from, [to, moved], a, left, |_| ()) else {
                        continue;
                    };
                    let Some((round, _)) = face.place.arm(&from) else { continue };
                    for c in (0..3).filter(|c| round.across[*c]) {
                        (x[k][c], v[k][c]) = (scale.length * met.x[c], scale.velocity() * met.v[c]);
                    }
                    if let Some(beyond) = beyond.get_mut(k) {
                        *beyond = if path.shift_at_end() == 0.0 { [0.0; 3] } else { met.beyond };
                    }
                    let force = scale.force() * mass / dt;
                    if let Some(sums) = given.get_mut(face.index - drift.first) {
                        (0..3).for_each(|c| sums[c] -= force * met.given[c]);
                        sums[3] += force * met.push;
                    }
                }
            }
            Ok(())
        })
    }

    /// Mirrors places in the matter of round walls at their surfaces.
    pub fn mirror(&self, extent: &Extent, x: &mut [f64]) -> Result<(), StyleError> {
        let (rounds, length) = (self.rounds(extent)?, self.scale.length);
        let x = if rounds.is_empty() { &mut [] } else { x };
        for x in x.as_chunks_mut::<3>().0 {
            for face in &rounds {
                let mut place = x.map(|x| x / length);
                if face.place.distance(&place) < 0.0 {
                    face.place.mirror(&mut place);
                    *x = place.map(|x| length * x);
                }
            }
        }
        Ok(())
    }
}
