use psidpd_core::engine::PeriodicBox;

/// The direction of view. Two-dimensional boxes are always seen along z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum View {
    /// The view from the front, the right and above: all three directions show, z is up.
    #[default]
    Oblique,
    /// The view along x: y to the right, z up.
    X,
    /// The view along y: x to the right, z up.
    Y,
    /// The view along z: x to the right, y up.
    Z,
}

impl View {
    /// Unit vectors to the right, up and towards the viewer: an orthonormal right-handed set.
    pub(super) fn axes(self) -> [[f64; 3]; 3] {
        match self {
            View::X => [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            View::Y => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
            View::Z => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            View::Oblique => {
                let (azimuth, elevation) = (28f64.to_radians(), 18f64.to_radians());
                let (sa, ca) = azimuth.sin_cos();
                let (se, ce) = elevation.sin_cos();
                [[ca, sa, 0.0], [-sa * se, ca * se, ce], [sa * ce, -ca * ce, se]]
            }
        }
    }

    /// The components of x, y and z in the picture, to the right and up.
    pub fn directions(self) -> [[f64; 2]; 3] {
        let [right, up, _] = self.axes();
        [0, 1, 2].map(|k| [right[k], up[k]])
    }

    /// The names of the directions to the right and up; none in the oblique view.
    pub fn names(self) -> Option<[&'static str; 2]> {
        match self {
            View::Oblique => None,
            View::X => Some(["y", "z"]),
            View::Y => Some(["x", "z"]),
            View::Z => Some(["x", "y"]),
        }
    }
}

/// The mapping from points of a box to pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    axes: [[f64; 3]; 3],
    /// The left and lower end of the picture, as lengths along the first two axes.
    low: [f64; 2],
    /// The number of pixels in a unit of length.
    pub scale: f64,
    /// The number of pixels in a row, and the number of rows.
    pub size: [usize; 2],
    /// The range of the box along the third axis, from back to front.
    depth: [f64; 2],
}

impl Projection {
    /// A picture of the whole box, within `size` pixels in width and height (0 means 720 by 640), with `margin` (a length) around it.
    pub fn fit(
        domain: &PeriodicBox,
        dimensions: usize,
        view: View,
        size: [usize; 2],
        margin: f64,
    ) -> Projection {
        let view = if dimensions == 2 { View::Z } else { view };
        let size = if size == [0, 0] { [720, 640] } else { size };
        let axes = view.axes();
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for corner in corners(domain, dimensions) {
            for (range, axis) in range.iter_mut().zip(&axes) {
                let c = dot(*axis, corner);
                *range = [range[0].min(c), range[1].max(c)];
            }
        }
        let span = [0, 1].map(|k| range[k][1] - range[k][0] + 2.0 * margin);
        let scale = (size[0] as f64 / span[0]).min(size[1] as f64 / span[1]);
        let pixels = span.map(|s| ((s * scale).round() as usize).max(1));
        let low = [0, 1].map(|k| range[k][0] - margin);
        Projection { axes, low, scale, size: pixels, depth: range[2] }
    }

    /// The position of a point in pixels from the upper left corner, and its depth: 0 at the back of the box, 1 at its
    /// front.
    pub fn place(&self, x: [f64; 3]) -> ([f64; 2], f64) {
        let [right, up, toward] = self.axes.map(|axis| dot(axis, x));
        let span = self.depth[1] - self.depth[0];
        let near = if span > 0.0 { (toward - self.depth[0]) / span } else { 1.0 };
        let across = (right - self.low[0]) * self.scale;
        ([across, self.size[1] as f64 - (up - self.low[1]) * self.scale], near)
    }

    /// The point of the middle plane at a position in pixels.
    pub(super) fn back(&self, at: [f64; 2]) -> [f64; 3] {
        let right = self.low[0] + at[0] / self.scale;
        let up = self.low[1] + (self.size[1] as f64 - at[1]) / self.scale;
        let toward = self.middle();
        std::array::from_fn(|k| right * self.axes[0][k] + up * self.axes[1][k] + toward * self.axes[2][k])
    }

    /// The coordinate of the middle of the box along the line of sight.
    pub(super) fn middle(&self) -> f64 {
        0.5 * (self.depth[0] + self.depth[1])
    }

    /// The coordinate of a point along the line of sight.
    pub(super) fn toward(&self, x: [f64; 3]) -> f64 {
        dot(self.axes[2], x)
    }

    /// The ends of the visible range along the horizontal and the vertical.
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        let span = self.size.map(|n| n as f64 / self.scale);
        [0, 1].map(|k| [self.low[k], self.low[k] + span[k]])
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The corners of a box; in two dimensions four.
pub(super) fn corners(domain: &PeriodicBox, dimensions: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
    (0..1usize << dimensions).map(|c| domain.point([0, 1, 2].map(|k| ((c >> k) & 1) as f64)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_right_handed() {
        for view in [View::Oblique, View::X, View::Y, View::Z] {
            let [r, u, t] = view.axes();
            let cross = [r[1] * u[2] - r[2] * u[1], r[2] * u[0] - r[0] * u[2], r[0] * u[1] - r[1] * u[0]];
            assert!((0..3).all(|k| (cross[k] - t[k]).abs() < 1e-15), "{view:?}");
            assert!((dot(r, r) - 1.0).abs() < 1e-15 && (dot(u, u) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_box_fills_the_picture_and_places_go_back() {
        let domain = PeriodicBox::orthogonal([-1.0, 0.0, 2.0], [4.0, 2.0, 8.0], [true; 3]).unwrap();
        let p = Projection::fit(&domain, 3, View::Y, [400, 800], 0.0);
        assert_eq!((p.size, p.scale), ([400, 800], 100.0));
        assert_eq!(p.place([-1.0, 0.0, 2.0]), ([0.0, 800.0], 1.0));
        assert_eq!(p.place([3.0, 2.0, 10.0]), ([400.0, 0.0], 0.0));
        assert_eq!(p.back([100.0, 700.0]), [0.0, 1.0, 3.0]);
        assert_eq!(p.ranges(), [[-1.0, 3.0], [2.0, 10.0]]);
        let oblique = Projection::fit(&domain, 3, View::Oblique, [300, 300], 0.1);
        for corner in corners(&domain, 3) {
            let ([x, y], near) = oblique.place(corner);
            let [w, h] = oblique.size.map(|s| s as f64);
            assert!((0.0..=w).contains(&x) && (0.0..=h).contains(&y) && (-1e-9..=1.0 + 1e-9).contains(&near));
        }
    }
}
