//! Walls, frozen particles and body forces of a deck.

use psidpd_core::model::wall::{Round, Surface};
use psidpd_dynamics::run::{BodyForce, Tags};
use psidpd_dynamics::scene::{Scene, Stage};
use std::fmt::{Result, Write};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Writes the commands for walls, frozen particles and body forces of a scene.
pub struct Physics<'a> {
    scene: &'a Scene,
    dimensions: usize,
    /// Whether each direction has walls.
    walls: [bool; 3],
    /// The group of mobile particles: `all` if none is frozen.
    pub mobile: &'static str,
}

impl<'a> Physics<'a> {
    pub fn of(scene: &'a Scene) -> Physics<'a> {
        let dimensions = scene.model.dimensions();
        let walls = std::array::from_fn(|k| k < dimensions && !scene.domain.periodic()[k]);
        let mobile = if scene.frozen.is_empty() { "all" } else { "mobile" };
        Physics { scene, dimensions, walls, mobile }
    }

    pub fn boundary(&self) -> String {
        self.walls.map(|wall| if wall { "f" } else { "p" }).join(" ")
    }

    /// Writes the groups, the walls, and the fix of two dimensions.
    pub fn write_surroundings(&self, s: &mut impl Write) -> Result {
        if self.mobile == "mobile" {
            writeln!(
                s,
                "# frozen particles are not integrated: they keep their places, and velocities of zero"
            )?;
            writeln!(s, "group         frozen id {}", ids(&self.scene.frozen))?;
            writeln!(s, "group         mobile subtract all frozen")?;
            writeln!(s, "velocity      frozen set 0 0 0")?;
        }
        if self.walls != [false; 3] {
            let faces = (0..3).filter(|k| self.walls[*k]).map(|k| format!("{0}lo EDGE {0}hi EDGE", AXES[k]));
            writeln!(
                s,
                "# wall/reflect mirrors what is outside, which heats fluid that presses on the faces; psidpd bounces on the exact path"
            )?;
            writeln!(
                s,
                "fix           walls {} wall/reflect {}",
                self.mobile,
                faces.collect::<Vec<_>>().join(" ")
            )?;
        }
        if self.dimensions == 2 {
            writeln!(s, "fix           plane all enforce2d")?;
        }
        Ok(())
    }

    /// Writes the temperature of the mobile particles, with their degrees of freedom.
    pub fn write_temperature(&self, s: &mut impl Write) -> Result {
        let rounds = || self.scene.model.walls().iter().filter_map(|wall| wall.surface.round());
        if self.mobile == "all" && self.walls == [false; 3] && rounds().next().is_none() {
            return Ok(());
        }
        let is_free = |k: &usize| !self.walls[*k] && !rounds().any(|round| round.across[*k]);
        let conserved = match self.mobile {
            "all" if !self.rubs() => (0..self.dimensions).filter(is_free).count(),
            _ => 0,
        };
        writeln!(s, "# momentum is conserved along {conserved} directions only")?;
        writeln!(s, "compute       warmth {} temp", self.mobile)?;
        writeln!(s, "compute_modify warmth extra/dof {conserved}")?;
        writeln!(s, "thermo_modify temp warmth")
    }

    /// Whether walls of matter have friction, which conserves no momentum.
    fn rubs(&self) -> bool {
        let stages = self.scene.stages.iter().filter_map(|stage| self.scene.model.at(stage.kt).ok());
        let mut fields = stages.flat_map(|fluid| fluid.walls).flat_map(|wall| wall.fields);
        fields.any(|field| field.friction.is_some())
    }

    /// Writes the walls of matter for a stage, in place of those of the stage before if there is one.
    pub fn write_matter(&self, s: &mut impl Write, stage: &Stage, again: bool) -> Result {
        let model = &self.scene.model;
        let names = model.species();
        for (k, wall) in model.walls().iter().enumerate() {
            let name = format!("matter{}", k + 1);
            if again {
                writeln!(s, "unfix         {name}")?;
            }
            let surface = match &wall.surface {
                Surface::Round(round) => self.round(round),
                face => face.name(self.dimensions),
            };
            write!(
                s,
                "fix           {name} {} dpd/wall {surface} density {:?} species {} strength {:?}",
                self.mobile, wall.density, names[wall.species], wall.strength
            )?;
            let local = match (&wall.local_densities[..], model.at(stage.kt)) {
                ([], Ok(fluid)) => {
                    let own = |includes: bool, w: f64| wall.density + if includes { w } else { 0.0 };
                    fluid.densities.iter().map(|d| own(d.includes_self, d.kernel.value(0.0))).collect()
                }
                (given, _) => given.to_vec(),
            };
            if !local.is_empty() {
                write!(s, " local/density")?;
                local.iter().try_for_each(|n| write!(s, " {n:?}"))?;
            }
            if wall.velocity != [0.0; 3] {
                let [x, y, z] = wall.velocity;
                write!(s, " velocity {x:?} {y:?} {z:?}")?;
            }
            // Without a thermostat walls have no drag either.
            let [drag, range] = if stage.thermostat { wall.drag } else { [Some(0.0), None] };
            for (key, value) in [("drag", drag), ("drag/range", range)] {
                value.map_or(Ok(()), |value| write!(s, " {key} {value:?}"))?;
            }
            writeln!(s, "\nfix_modify    {name} energy yes virial yes")?;
        }
        Ok(())
    }

    /// A cylinder or a sphere in the words of the fix.
    fn round(&self, round: &Round) -> String {
        let [x, y, z] = round.center;
        let place = match round.axis(self.dimensions) {
            Some(0) => format!("cylinder x {y:?} {z:?}"),
            Some(1) => format!("cylinder y {x:?} {z:?}"),
            Some(_) => format!("cylinder z {x:?} {y:?}"),
            None => format!("sphere {x:?} {y:?} {z:?}"),
        };
        format!("{place} {:?} {}", round.radius, if round.inside { "inside" } else { "outside" })
    }

    pub fn write_body_forces(&self, s: &mut impl Write) -> Result {
        for (k, force) in self.scene.body_forces.iter().enumerate() {
            let name = format!("body{}", k + 1);
            let group = self.write_group(s, &name, force)?;
            let value = self.value(force);
            for c in 0..self.dimensions {
                writeln!(s, "variable      {name}{} atom {}", AXES[c], value(force.acceleration[c]))?;
            }
            let components = (0..3).map(|c| match c < self.dimensions {
                true => format!("v_{name}{}", AXES[c]),
                false => "0.0".to_owned(),
            });
            let components = components.collect::<Vec<_>>().join(" ");
            writeln!(s, "fix           {name} {group} addforce {components}")?;
        }
        Ok(())
    }

    /// Returns the formula of a force component for its acceleration.
    fn value(&self, force: &BodyForce) -> impl Fn(f64) -> String {
        let half = force.reversed_along.map(|k| {
            let (origin, length) = (self.scene.domain.origin()[k], self.scene.domain.lengths()[k]);
            // Particles may be slightly outside the box until LAMMPS wraps them.
            let place = format!("({}-({origin:?}))/{length:?}", AXES[k]);
            format!("*(1-2*({place}-floor({place})>=0.5))")
        });
        move |a| format!("mass*({a:?}){}", half.as_deref().unwrap_or_default())
    }

    fn write_group(
        &self,
        s: &mut impl Write,
        name: &str,
        force: &BodyForce,
    ) -> std::result::Result<String, std::fmt::Error> {
        let mut group = self.mobile.to_owned();
        if let Tags::Ranges(_) = &force.tags {
            writeln!(s, "group         {name}ids id {}", ids(&force.tags))?;
            group = format!("{name}ids");
        }
        if !force.species.is_empty() {
            let types: Vec<String> = force.species.iter().map(|s| (s + 1).to_string()).collect();
            writeln!(s, "group         {name}types type {}", types.join(" "))?;
            writeln!(s, "group         {name}group intersect {group} {name}types")?;
            group = format!("{name}group");
        }
        Ok(group)
    }

    pub fn write_end_of_body_forces(&self, s: &mut impl Write) -> Result {
        for k in 1..=self.scene.body_forces.len() {
            writeln!(s, "unfix         body{k}")?;
        }
        Ok(())
    }
}

fn ids(tags: &Tags) -> String {
    match tags {
        Tags::All => "> 0".to_owned(),
        Tags::Ranges(ranges) => {
            ranges.iter().map(|r| format!("{}:{}", r.start(), r.end())).collect::<Vec<_>>().join(" ")
        }
    }
}
