use super::*;
use crate::options::FACES;

/// The force on walls of matter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WallForce {
    dimensions: usize,
    /// The name of each wall's face, and its direction.
    faces: Vec<(String, usize)>,
    /// The components of the force per area on each wall.
    series: Series,
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Meter for WallForce {
    const TABLE: Table = Table {
        path: "wall_force",
        title: "force on walls of matter",
        about: "The force per area on each wall of the scene (`[[wall]]`), component by component: all momentum that the wall has \
                taken in the step over its length, by conservative forces, drag, noise and reflection at its face. Across the \
                wall it is the pressure of the fluid, along it the stress of the flow; all walls together take what body forces \
                give to a steady flow.",
        ..PLAIN
    };

    const FLUX: Recorded = Recorded::Sum;
    const OF_MOTION: bool = true;

    fn read(options: &Options) -> Result<WallForce, FileError> {
        let walls = &options.place.fluid.walls;
        if walls.is_empty() {
            return Err(options.value.error("the scene has no [[wall]]"));
        }
        let name = |axis: usize, high: bool| {
            let name = FACES.iter().find(|(_, face)| *face == (axis, high)).map_or("", |(name, _)| name);
            (name.to_owned(), axis)
        };
        let dimensions = options.place.fluid.dimensions;
        let faces: Vec<_> = walls.iter().map(|wall| name(wall.wall.axis, wall.wall.high)).collect();
        let series = Series::new(3 * faces.len());
        Ok(WallForce { dimensions, faces, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let Some(flux) = frame.view.flux else { return false };
        let domain = frame.view.domain;
        let forces = flux.on_walls(self.faces.len());
        let pressures = forces.iter().zip(&self.faces).flat_map(|(force, (_, axis))| {
            let area = frame.volume() / domain.height(*axis);
            force.map(|f| f / area)
        });
        self.series.push(&pressures.collect::<Vec<f64>>())
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let mut out = Observation::new("wall_force", "Force on walls per area", Kind::Scalar, &self.series);
        for (k, (face, _)) in self.faces.iter().enumerate() {
            for c in 0..self.dimensions {
                out = out.column(
                    &format!("{face}_{}", AXES[c]),
                    "energy/volume",
                    [self.series.mean(3 * k + c)],
                );
            }
        }
        vec![out]
    }
}
