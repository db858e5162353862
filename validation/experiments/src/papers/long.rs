//! Values that agree at quick size and disagree at full size: the quick run is too short to tell. `docs/reproduction.md` has the runs.

use super::case::{AtFullSize, Compared};

/// Case, value, what the long run found, and why it disagrees.
pub const DISAGREE: [(&str, &str, [f64; 2], &str); 2] = [
    (
        "pagonabarraga-fig8",
        "density of the liquid beside mean field",
        [63.205, 0.018],
        "mean field leaves out the correlations of particles",
    ),
    (
        "wang-fig11",
        "tension by Laplace's law",
        [3.66, 0.02],
        "the radius of eq. (17) is that of the particles, and the pressure acts on a smaller surface",
    ),
];

/// Notes at the values of a case that they disagree at full size.
pub fn mark(case: &str, values: &mut [Compared]) {
    for value in values {
        let known = DISAGREE.iter().find(|(of, name, ..)| *of == case && *name == value.name);
        value.at_full_size = known.map(|(_, _, measured, why)| AtFullSize { measured: *measured, why });
    }
}
