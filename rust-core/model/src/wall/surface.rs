//! The surfaces of walls.

/// The surface in front of a wall's matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surface {
    /// A face of the box, with a half-space of matter behind it.
    Face {
        /// The direction across the face.
        axis: usize,
        /// Whether it is the upper face.
        high: bool,
    },
    /// A cylinder or a sphere.
    Round(Round),
}

/// A cylinder or a sphere; in two dimensions a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round {
    /// The directions across it: two of a cylinder and of a circle, three of a sphere.
    pub across: [bool; 3],
    /// Its centre, of which the coordinates across it count.
    pub center: [f64; 3],
    /// Its radius.
    pub radius: f64,
    /// Whether the fluid is inside, and the matter outside.
    pub inside: bool,
}

impl Surface {
    /// The face of a plane wall.
    pub fn face(&self) -> Option<(usize, bool)> {
        match self {
            Surface::Face { axis, high } => Some((*axis, *high)),
            Surface::Round(_) => None,
        }
    }

    /// The cylinder or the sphere of a wall.
    pub fn round(&self) -> Option<&Round> {
        match self {
            Surface::Face { .. } => None,
            Surface::Round(round) => Some(round),
        }
    }

    /// Its name in a model of so many dimensions.
    pub fn name(&self, dimensions: usize) -> String {
        match self {
            Surface::Face { axis, high } => {
                format!("{}{}", ["x", "y", "z"][*axis], ["lo", "hi"][usize::from(*high)])
            }
            Surface::Round(round) => {
                ["cylinder", "sphere"][usize::from(round.directions() == dimensions)].to_owned()
            }
        }
    }

    /// The divergence of its normal at the distance `z`: the normal, which points into the fluid, is the gradient of the distance.
    pub fn divergence(&self, z: f64) -> f64 {
        self.round().map_or(0.0, |round| {
            let side = round.side();
            -side * (round.directions() - 1) as f64 / (round.radius - side * z)
        })
    }
}

impl Round {
    /// The number of directions across it.
    pub fn directions(&self) -> usize {
        self.across.iter().filter(|across| **across).count()
    }

    /// The direction along a cylinder.
    pub fn axis(&self, dimensions: usize) -> Option<usize> {
        (0..dimensions).find(|c| !self.across[*c])
    }

    /// 1 if the fluid is inside, −1 if it is outside.
    pub fn side(&self) -> f64 {
        if self.inside { 1.0 } else { -1.0 }
    }
}
