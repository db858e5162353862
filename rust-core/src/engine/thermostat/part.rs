use super::pass::Wide;

/// Vectors of the particles of one plane.
#[derive(Debug, Clone, Default)]
pub struct Part {
    /// Product `(M + K) p`.
    pub image: Vec<Wide>,
    pub residual: Vec<Wide>,
    pub solution: Vec<Wide>,
    /// Sum of a scalar product over the plane.
    pub sum: f64,
}
