//! Compares the box geometry of the sweep with the periodic box.

use nalgebra::Matrix3;
use psidpd_passes::domain::*;
use psidpd_passes::ground::box_geometry::*;

#[test]
fn agrees_with_the_box() {
    let edges = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 6.0);
    let domain = PeriodicBox::new([1.0, 2.0, 3.0], edges, [true; 3]).unwrap();
    let geometry = BoxGeometry::of_box(&domain, 3).unwrap();
    let inverse = geometry.length.map(|l| 1.0 / l);
    for x in [[1.5, 2.5, 3.5], [4.0, 6.0, 8.5]] {
        let (a, b) = (domain.fraction(x), geometry.fraction(&x, &inverse));
        let back = geometry.point(&b);
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() < 1e-14 && (back[c] + geometry.origin[c] - x[c]).abs() < 1e-13);
        }
    }
    for k in 0..3 {
        assert!((geometry.height(k) - domain.height(k)).abs() < 1e-13, "{k}");
        assert_eq!(geometry.edge(k), domain.edge(k));
    }
    let turned = PeriodicBox::new([0.0; 3], edges.transpose(), [true; 3]).unwrap();
    assert!(BoxGeometry::of_box(&turned, 3).is_none());
}
