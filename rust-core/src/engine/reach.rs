//! Ranges longer than the box, for which particles interact with periodic images.

use psidpd_passes::domain::PeriodicBox;

/// Largest ratio of a range to the box's width: 729 images of each particle in three dimensions.
const MOST_WIDTHS: f64 = 4.0;

/// Most bytes of images and pairs.
const MOST_BYTES: f64 = 7.5e9;

/// Bytes of an image: position, velocity, force, densities, slopes, and indices of the search.
const BYTES_OF_IMAGE: f64 = 150.0;

/// Bytes of a pair in a list.
const BYTES_OF_PAIR: f64 = 60.0;

/// A range is so much longer than the box that images would fill the memory.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the range {range} is {:.1} times the width {height} of the box between two faces: particles would meet \
     {images:.1e} images of each other, which take about {gigabytes:.1} GB; use a larger box or a shorter range",
    range / height
)]
pub struct ReachError {
    range: f64,
    height: f64,
    images: f64,
    gigabytes: f64,
}

/// Refuses ranges that are many times the box, before memory is allocated for the images of `particles`
/// particles and for their pairs.
///
/// # Errors
/// Fails with [`ReachError`] for such a range.
pub fn check_reach(
    domain: &PeriodicBox,
    dimensions: usize,
    range: f64,
    particles: usize,
) -> Result<(), ReachError> {
    let heights = (0..dimensions).filter(|k| domain.periodic()[*k]).map(|k| domain.height(k));
    let mut copies = 1.0;
    let mut within_range = 1.0;
    let mut height = f64::INFINITY;
    for h in heights {
        let widths = 2.0 * range / h;
        // Directions at least as wide as the range need no images.
        copies *= if widths < 1.0 { 1.0 } else { 1.0 + widths };
        within_range *= widths;
        height = height.min(h);
    }
    if copies == 1.0 {
        return Ok(());
    }
    let particles = particles as f64;
    let images = (copies - 1.0) * particles;
    // Each pair is listed once; of the cube around a particle only the sphere is in range.
    let pairs = 0.5 * particles * particles * within_range * std::f64::consts::FRAC_PI_6;
    let bytes = BYTES_OF_IMAGE * images + BYTES_OF_PAIR * pairs;
    if range <= MOST_WIDTHS * height && bytes <= MOST_BYTES {
        return Ok(());
    }
    Err(ReachError { range, height, images, gigabytes: 1e-9 * bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_beyond_the_box_are_bounded() {
        let cube = |edge: f64, periodic: bool| {
            let edges = nalgebra::Matrix3::from_diagonal_element(edge);
            PeriodicBox::new([0.0; 3], edges, [periodic; 3]).unwrap()
        };
        assert!(check_reach(&cube(4.0, true), 3, 16.0, 400).is_ok());
        let refused = check_reach(&cube(4.0, true), 3, 20.0, 400).unwrap_err().to_string();
        assert!(refused.contains("range 20") && refused.contains("5.0 times"), "{refused}");
        // A few shells of images of very many particles exceed the limit.
        assert!(check_reach(&cube(4.0, true), 3, 12.0, 1_000_000).is_err());
        // A few images of many particles make too many pairs.
        assert!(check_reach(&cube(4.0, true), 3, 12.0, 10_000).is_err());
        assert!(check_reach(&cube(1e-9, true), 2, 1.0, 1).is_err());
        assert!(check_reach(&cube(400.0, true), 3, 1.0, 100_000_000).is_ok());
        assert!(check_reach(&cube(4.0, false), 3, 1e6, 400).is_ok());
    }
}
