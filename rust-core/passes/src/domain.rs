use nalgebra::{Matrix3, Vector3};

/// A box with its three edge vectors, each direction periodic or open.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicBox {
    origin: Vector3<f64>,
    edges: Matrix3<f64>,
    inverse: Matrix3<f64>,
    periodic: [bool; 3],
    /// Directions that are periodic, of which this is a part.
    divided: [bool; 3],
}

/// The error of an invalid box.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DomainError {
    /// An edge, the origin or the volume is not finite, or the edges span no volume.
    #[error("the box has edges that span no volume, or are not finite")]
    Degenerate,
}

impl PeriodicBox {
    /// Space without periods, where the edges do not matter.
    pub const OPEN: PeriodicBox = PeriodicBox {
        origin: Vector3::new(0.0, 0.0, 0.0),
        edges: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        inverse: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        periodic: [false; 3],
        divided: [false; 3],
    };

    /// Builds a box at `origin` with the columns of `edges` as edge vectors.
    ///
    /// # Errors
    /// Fails for edges that are not finite, or span no positive and finite volume.
    pub fn new(
        origin: [f64; 3],
        edges: Matrix3<f64>,
        periodic: [bool; 3],
    ) -> Result<PeriodicBox, DomainError> {
        let origin = Vector3::from(origin);
        let finite = origin.iter().chain(edges.iter()).all(|x| x.is_finite());
        let inverse = edges.try_inverse().filter(|m| m.iter().all(|x| x.is_finite()));
        match inverse {
            Some(inverse) if finite && edges.determinant() > 0.0 && edges.determinant().is_finite() => {
                Ok(PeriodicBox { origin, edges, inverse, periodic, divided: [false; 3] })
            }
            _ => Err(DomainError::Degenerate),
        }
    }

    /// Builds a box with edges along the axes.
    ///
    /// # Errors
    /// Fails for a length that is not positive and finite.
    pub fn orthogonal(
        origin: [f64; 3],
        lengths: [f64; 3],
        periodic: [bool; 3],
    ) -> Result<PeriodicBox, DomainError> {
        if lengths.iter().any(|l| *l <= 0.0) {
            return Err(DomainError::Degenerate);
        }
        PeriodicBox::new(origin, Matrix3::from_diagonal(&Vector3::from(lengths)), periodic)
    }

    /// The corner where fractional coordinates are zero.
    pub fn origin(&self) -> [f64; 3] {
        self.origin.into()
    }

    pub fn edge(&self, k: usize) -> [f64; 3] {
        self.edges.column(k).into_owned().into()
    }

    /// The rows that turn a vector into fractional coordinates.
    pub fn inverse(&self) -> [[f64; 3]; 3] {
        [0, 1, 2].map(|k| self.inverse.row(k).transpose().into())
    }

    pub fn lengths(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.edges.column(k).norm())
    }

    pub fn periodic(&self) -> [bool; 3] {
        self.periodic
    }

    /// The box, with more directions that repeat than are periodic here: ranks divide these, and have ghosts for images.
    pub fn divided(self, divided: [bool; 3]) -> PeriodicBox {
        PeriodicBox { divided, ..self }
    }

    /// The directions along which the system repeats: periodic ones, and those that ranks divide.
    pub fn repeats(&self) -> [bool; 3] {
        [0, 1, 2].map(|k| self.periodic[k] || self.divided[k])
    }

    /// The volume; in two dimensions the area, with the third edge taken as a unit.
    pub fn volume(&self, dimensions: usize) -> f64 {
        match dimensions {
            2 => self.edges.column(0).cross(&self.edges.column(1)).norm(),
            _ => self.edges.determinant(),
        }
    }

    /// Distance between the two faces that edge `k` connects.
    pub fn height(&self, k: usize) -> f64 {
        1.0 / self.inverse.row(k).norm()
    }

    pub fn fraction(&self, x: [f64; 3]) -> [f64; 3] {
        (self.inverse * (Vector3::from(x) - self.origin)).into()
    }

    /// The point of fractional coordinates `s`.
    pub fn point(&self, s: [f64; 3]) -> [f64; 3] {
        (self.origin + self.edges * Vector3::from(s)).into()
    }

    /// Moves `x` into the box along its periodic directions and counts the crossed boxes in `image`.
    pub fn wrap(&self, x: &mut [f64; 3], image: &mut [i32; 3]) {
        let s = self.fraction(*x);
        for k in 0..3 {
            if self.periodic[k] && !(0.0..1.0).contains(&s[k]) {
                let boxes = s[k].floor();
                for (x, e) in x.iter_mut().zip(self.edge(k)) {
                    *x -= boxes * e;
                }
                image[k] = image[k].saturating_add(boxes as i32);
            }
        }
    }

    /// The shortest vector from `b` to `a` among images, for boxes that are not too skew.
    pub fn minimum_image(&self, a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        let mut s = self.inverse * (Vector3::from(a) - Vector3::from(b));
        for k in 0..3 {
            if self.periodic[k] {
                s[k] -= s[k].round();
            }
        }
        (self.edges * s).into()
    }
}
