//! Ranges longer than the box, for which particles interact with periodic images.

use super::RunError;
use psidpd_core::engine::PeriodicBox;

/// The most widths of a box that a range may have: 729 images of each particle in three dimensions.
const MOST_WIDTHS: f64 = 4.0;

/// The most images of all particles together.
const MOST_IMAGES: f64 = 5e7;

/// Bytes of an image: position, velocity, force, densities and slopes, its places in the search.
const BYTES: f64 = 150.0;

/// Refuses ranges that are many times the box, before memory is taken for the images of `particles` particles.
///
/// # Errors
/// [`RunError::Reach`].
pub fn check(domain: &PeriodicBox, dimensions: usize, range: f64, particles: usize) -> Result<(), RunError> {
    let heights = (0..dimensions).filter(|k| domain.periodic()[*k]).map(|k| domain.height(k));
    let mut copies = 1.0;
    let mut height = f64::INFINITY;
    for h in heights {
        // Directions wide enough for the range need no images.
        copies *= if 2.0 * range < h { 1.0 } else { 1.0 + 2.0 * range / h };
        height = height.min(h);
    }
    let images = (copies - 1.0) * particles as f64;
    if range <= MOST_WIDTHS * height && images <= MOST_IMAGES {
        return Ok(());
    }
    Err(RunError::Reach { range, height, images, gigabytes: 1e-9 * BYTES * images })
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
        assert!(check(&cube(4.0, true), 3, 16.0, 400).is_ok());
        let refused = check(&cube(4.0, true), 3, 20.0, 400).unwrap_err().to_string();
        assert!(refused.contains("range 20") && refused.contains("5.0 times"), "{refused}");
        // A few shells around very many particles.
        assert!(check(&cube(4.0, true), 3, 12.0, 1_000_000).is_err());
        assert!(check(&cube(400.0, true), 3, 1.0, 100_000_000).is_ok());
        assert!(check(&cube(4.0, false), 3, 1e6, 400).is_ok());
    }
}
