//! Tests of boxes, wrapping and images.

use nalgebra::Matrix3;
use psidpd_passes::domain::*;

#[test]
fn wrap_and_fraction_agree_in_a_skew_box() {
    let edges = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 6.0);
    let domain = PeriodicBox::new([1.0, 2.0, 3.0], edges, [true; 3]).unwrap();
    assert!((domain.volume(3) - 120.0).abs() < 1e-12);
    assert!((domain.height(2) - 6.0).abs() < 1e-12);
    let start = [17.0, -9.0, 30.0];
    let (mut x, mut image) = (start, [0; 3]);
    domain.wrap(&mut x, &mut image);
    assert!(domain.fraction(x).iter().all(|s| (0.0..1.0).contains(s)));
    for c in 0..3 {
        let back: f64 = x[c] + (0..3).map(|k| image[k] as f64 * domain.edge(k)[c]).sum::<f64>();
        assert!((back - start[c]).abs() < 1e-12);
    }
    let d = domain.minimum_image(start, x);
    assert!(d.iter().all(|c| c.abs() < 1e-12));
}

#[test]
fn flat_and_infinite_boxes_are_refused() {
    assert_eq!(PeriodicBox::orthogonal([0.0; 3], [1.0, 0.0, 1.0], [true; 3]), Err(DomainError::Degenerate));
    assert_eq!(
        PeriodicBox::orthogonal([0.0; 3], [1.0, f64::INFINITY, 1.0], [true; 3]),
        Err(DomainError::Degenerate)
    );
    assert_eq!(PeriodicBox::orthogonal([f64::NAN; 3], [1.0; 3], [true; 3]), Err(DomainError::Degenerate));
}
