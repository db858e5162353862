use super::*;
use psidpd_core::model::wall::Surface;

/// The force on walls of matter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WallForce {
    dimensions: usize,
    walls: Vec<Measured>,
    /// What is measured of each wall, wall by wall.
    series: Series,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Measured {
    name: String,
    area: f64,
    is_round: bool,
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Measured {
    fn of(surface: &Surface, domain: &PeriodicBox, dimensions: usize) -> Measured {
        use std::f64::consts::PI;
        let area = match surface {
            Surface::Face { axis, .. } => domain.volume(dimensions) / domain.height(*axis),
            Surface::Round(round) => match (round.directions(), round.axis(dimensions)) {
                (3, _) => 4.0 * PI * round.radius * round.radius,
                (_, Some(axis)) => 2.0 * PI * round.radius * domain.height(axis),
                _ => 2.0 * PI * round.radius,
            },
        };
        Measured { name: surface.name(dimensions), area, is_round: surface.round().is_some() }
    }

    /// What is measured: the names, the most important first, and their places among the components of [`crate::flux::OnWall`].
    fn columns(&self, dimensions: usize) -> impl Iterator<Item = (&'static str, usize)> + use<> {
        let normal = self.is_round.then_some(("normal", 3));
        normal.into_iter().chain(AXES.into_iter().zip(0..dimensions))
    }
}

impl Meter for WallForce {
    const TABLE: Table = Table {
        path: "wall_force",
        title: "force on walls of matter",
        about: "The force per area on each wall of the scene (`[[wall]]`), component by component: all momentum that the wall has \
                taken in the step over its length, by conservative forces, drag, noise and reflection at its surface. Across a \
                face it is the pressure of the fluid, along it the stress of the flow; all walls together take what body forces \
                give to a steady flow. A cylinder or a sphere has `normal` too, the mean of what presses on it across its surface: \
                the pressure of the fluid. Several cylinders are `cylinder_1`, `cylinder_2` …, in the order of the scene.",
        ..PLAIN
    };

    const FLUX: Recorded = Recorded::Sum;
    const OF_MOTION: bool = true;

    fn read(options: &Options) -> Result<WallForce, FileError> {
        let (walls, dimensions) = (&options.place.fluid.walls, options.place.fluid.dimensions);
        if walls.is_empty() {
            return Err(options.value.error("the scene has no [[wall]]"));
        }
        let of = |surface: &Surface| Measured::of(surface, options.place.domain, dimensions);
        let mut walls: Vec<Measured> = walls.iter().map(|wall| of(&wall.wall.surface)).collect();
        for name in ["cylinder", "sphere"] {
            let named: Vec<usize> = (0..walls.len()).filter(|k| walls[*k].name == name).collect();
            if named.len() > 1 {
                named.into_iter().zip(1..).for_each(|(k, number)| walls[k].name = format!("{name}_{number}"));
            }
        }
        let width = walls.iter().map(|wall| wall.columns(dimensions).count()).sum();
        Ok(WallForce { dimensions, walls, series: Series::new(width) })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let Some(flux) = frame.view.flux else { return false };
        let forces = flux.on_walls(self.walls.len());
        let of = |(force, wall): (&[f64; 4], &Measured)| {
            let per_area: Vec<f64> =
                wall.columns(self.dimensions).map(|(_, k)| force[k] / wall.area).collect();
            per_area
        };
        let all: Vec<f64> = forces.iter().zip(&self.walls).flat_map(of).collect();
        self.series.push(&all)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let mut out = Observation::new("wall_force", "Force on walls per area", Kind::Scalar, &self.series);
        let columns = self
            .walls
            .iter()
            .flat_map(|wall| wall.columns(self.dimensions).map(|(what, _)| format!("{}_{what}", wall.name)));
        for (k, name) in columns.enumerate() {
            out = out.column(&name, "energy/volume", [self.series.mean(k)]);
        }
        vec![out]
    }
}
