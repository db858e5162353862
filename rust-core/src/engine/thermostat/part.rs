use super::pass::Wide;

/// Vectors of the particles of one plane.
#[derive(Debug, Clone, Default)]
pub struct Part {
    pub residual: Vec<Wide>,
    pub solution: Vec<Wide>,
    /// Sums of scalar products over the plane.
    pub sums: [f64; 2],
}
