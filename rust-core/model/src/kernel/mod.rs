//! Weight functions `w(r)` of the weighted local density, normalised so that `[w] = 1`.
//!
//! A kernel is a shape `W(s)`, `s = r/R`, that vanishes at `s = 1`, times a factor that makes its
//! integral over the plane or over space equal to one:
//!
//! ```text
//! w(r) = c_d W(r/R) / R^d          w'(r) = c_d W'(r/R) / R^(d+1)
//! ```
//!
//! To add a kernel: write one file that implements [`Shape`] and name it once in `kernel_table!`.

mod bell;
mod cubic_spline;
mod linear;
mod lucy;
mod quadratic;
mod real;
mod wendland_c2;

pub use bell::Bell;
pub use cubic_spline::CubicSpline;
pub use linear::Linear;
pub use lucy::Lucy;
pub use quadratic::Quadratic;
pub use real::Real;
pub use wendland_c2::WendlandC2;

/// The shape of a weight function on `0 ≤ s < 1`; zero beyond.
///
/// Implementations are zero-sized, so that loops over pairs are compiled once per kernel.
pub trait Shape: Copy + Default + Send + Sync + 'static {
    /// The kernel's name in the model file.
    const NAME: &'static str;
    /// The normalising factors `c_2` and `c_3` in two and three dimensions.
    const FACTORS: [f64; 2];
    /// Whether its Fourier transform is nowhere negative, in two and in three dimensions. With others a strong repulsion makes
    /// particles cluster.
    const POSITIVE_DEFINITE: bool;
    /// The shape `W(s)`.
    fn value<R: Real>(s: R) -> R;
    /// The slope `W'(s)`.
    fn slope<R: Real>(s: R) -> R;
    /// The curvature `W''(s)`, which only measurements of changing forces need.
    fn curvature<R: Real>(s: R) -> R;
}

/// The one list of kernels, which defines the enum, the names and the dispatch.
macro_rules! kernel_table {
    ($($shape:ident),+ $(,)?) => {
        /// A weight function by its shape.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum KernelKind {
            $(#[doc = concat!("The shape [`", stringify!($shape), "`].")] $shape),+
        }

        impl KernelKind {
            /// Every kernel, in the order of the documentation.
            pub const ALL: &'static [KernelKind] = &[$(KernelKind::$shape),+];

            /// The kernel's name in the model file.
            pub fn name(self) -> &'static str {
                match self { $(KernelKind::$shape => $shape::NAME),+ }
            }

            /// Whether its Fourier transform is nowhere negative, [`Shape::POSITIVE_DEFINITE`].
            pub fn is_positive_definite(self) -> bool {
                match self { $(KernelKind::$shape => $shape::POSITIVE_DEFINITE),+ }
            }

            /// Calls `visitor` with the shape as a type, so that the visitor is compiled for each shape.
            #[inline(always)]
            pub fn visit<V: ShapeVisitor>(self, visitor: V) -> V::Output {
                match self { $(KernelKind::$shape => visitor.visit::<$shape>()),+ }
            }
        }
    };
}

kernel_table!(Linear, Quadratic, Bell, Lucy, CubicSpline, WendlandC2);

/// Work that is compiled once for each kernel shape.
pub trait ShapeVisitor {
    /// Result of the work.
    type Output;
    /// Does the work for one shape.
    fn visit<S: Shape>(self) -> Self::Output;
}

impl KernelKind {
    /// The kernel with this name in the model file.
    pub fn from_name(name: &str) -> Option<KernelKind> {
        KernelKind::ALL.iter().copied().find(|k| k.name() == name)
    }
}

/// A weight function with its range, normalised in `dimensions` = 2 or 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    kind: KernelKind,
    range: f64,
    value_factor: f64,
    slope_factor: f64,
}

impl Kernel {
    /// Builds the kernel `kind` of range `R > 0` in two or three dimensions.
    pub fn new(kind: KernelKind, range: f64, dimensions: usize) -> Kernel {
        struct Factor(usize);
        impl ShapeVisitor for Factor {
            type Output = f64;
            fn visit<S: Shape>(self) -> f64 {
                S::FACTORS[self.0 - 2]
            }
        }
        debug_assert!(dimensions == 2 || dimensions == 3);
        let factor = kind.visit(Factor(dimensions)) / range.powi(dimensions as i32);
        Kernel { kind, range, value_factor: factor, slope_factor: factor / range }
    }

    /// The shape of the kernel.
    pub fn kind(&self) -> KernelKind {
        self.kind
    }

    /// The range `R`, beyond which the kernel vanishes.
    pub fn range(&self) -> f64 {
        self.range
    }

    /// The factor `c_d / R^d` of `W(s)` in `w`.
    pub fn value_factor(&self) -> f64 {
        self.value_factor
    }

    /// The factor `c_d / R^(d+1)` of `W'(s)` in `w'`.
    pub fn slope_factor(&self) -> f64 {
        self.slope_factor
    }

    /// The weight `w(r)`.
    #[inline]
    pub fn value(&self, r: f64) -> f64 {
        self.derivative::<0>(self.value_factor, r)
    }

    /// The slope `w'(r)`; no kernel of this list has a positive slope.
    #[inline]
    pub fn slope(&self, r: f64) -> f64 {
        self.derivative::<1>(self.slope_factor, r)
    }

    /// The curvature `w''(r)` within the range, 0 beyond; a jump of `w'` at the range does not contribute.
    #[inline]
    pub fn curvature(&self, r: f64) -> f64 {
        self.derivative::<2>(self.slope_factor / self.range, r)
    }

    /// A derivative of the shape, times `factor`.
    #[inline]
    fn derivative<const ORDER: usize>(&self, factor: f64, r: f64) -> f64 {
        struct At<const ORDER: usize>(f64);
        impl<const ORDER: usize> ShapeVisitor for At<ORDER> {
            type Output = f64;
            #[inline]
            fn visit<S: Shape>(self) -> f64 {
                match ORDER {
                    0 => S::value(self.0),
                    1 => S::slope(self.0),
                    _ => S::curvature(self.0),
                }
            }
        }
        if r < self.range { factor * self.kind.visit(At::<ORDER>(r / self.range)) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Composite Simpson rule on panels that end at the spline's knot, s = 1/2.
    fn integrate(f: impl Fn(f64) -> f64, range: f64) -> f64 {
        let n = 2000;
        let h = range / n as f64;
        (0..n / 2)
            .map(|k| {
                let a = 2.0 * k as f64 * h;
                h / 3.0 * (f(a) + 4.0 * f(a + h) + f(a + 2.0 * h))
            })
            .sum()
    }

    #[test]
    fn every_kernel_integrates_to_one_in_two_and_three_dimensions() {
        for &kind in KernelKind::ALL {
            for range in [0.75, 1.0, 2.5] {
                let w2 = Kernel::new(kind, range, 2);
                let w3 = Kernel::new(kind, range, 3);
                let plane = integrate(|r| 2.0 * PI * r * w2.value(r), range);
                let space = integrate(|r| 4.0 * PI * r * r * w3.value(r), range);
                assert!((plane - 1.0).abs() < 1e-10, "{} 2-D: {plane}", kind.name());
                assert!((space - 1.0).abs() < 1e-10, "{} 3-D: {space}", kind.name());
            }
        }
    }

    /// The identity `[r w'] = −d [w]` makes the virial pressure equal the thermodynamic one
    /// (Pagonabarraga–Frenkel eq. 10).
    #[test]
    fn virial_of_every_kernel_is_minus_d() {
        for &kind in KernelKind::ALL {
            let w2 = Kernel::new(kind, 1.3, 2);
            let w3 = Kernel::new(kind, 1.3, 3);
            let plane = integrate(|r| 2.0 * PI * r * r * w2.slope(r), 1.3);
            let space = integrate(|r| 4.0 * PI * r.powi(3) * w3.slope(r), 1.3);
            // Simpson's last point is the jump of w' of the linear kernel.
            assert!((plane + 2.0).abs() < 5e-3, "{} 2-D: {plane}", kind.name());
            assert!((space + 3.0).abs() < 5e-3, "{} 3-D: {space}", kind.name());
        }
    }

    /// The transform in space is (4π/k) ∫ s sin(ks) W(s) ds; one that is nowhere negative there is so in the plane too. Up to k = 60
    /// it is computed to 1e-9; those that become negative reach −6e-4 or less, where that at k = 0 is 1.
    #[test]
    fn positive_definite_kernels_have_a_transform_without_negative_values() {
        for &kind in KernelKind::ALL {
            let w = Kernel::new(kind, 1.0, 3);
            let transform = |k: f64| 4.0 * PI / k * integrate(|s| s * (k * s).sin() * w.value(s), 1.0);
            let least = (1..600).map(|k| transform(0.1 * f64::from(k))).fold(f64::INFINITY, f64::min);
            let name = kind.name();
            match kind.is_positive_definite() {
                true => assert!(least > -1e-9, "{name}: {least}"),
                false => assert!(least < -3e-4, "{name}: {least}"),
            }
        }
    }

    #[test]
    fn slope_is_the_derivative_of_value() {
        for &kind in KernelKind::ALL {
            let w = Kernel::new(kind, 0.8, 3);
            for k in 1..80 {
                let r = 0.01 * k as f64;
                if (r - 0.4).abs() < 1e-9 {
                    continue;
                }
                let h = 1e-6;
                let numeric = (w.value(r + h) - w.value(r - h)) / (2.0 * h);
                assert!((numeric - w.slope(r)).abs() < 1e-7 * w.slope_factor(), "{} at {r}", kind.name());
            }
        }
    }

    #[test]
    fn curvature_is_the_derivative_of_slope() {
        for &kind in KernelKind::ALL {
            let w = Kernel::new(kind, 0.8, 3);
            for k in 1..80 {
                let r = 0.01 * f64::from(k) + 0.003;
                // A kernel may have a kink in its curvature half way.
                if (r - 0.4).abs() < 0.004 || r > 0.795 {
                    continue;
                }
                let h = 1e-5;
                let numeric = (w.slope(r + h) - w.slope(r - h)) / (2.0 * h);
                let scale = w.slope_factor() / 0.8;
                assert!((numeric - w.curvature(r)).abs() < 1e-6 * scale, "{} {r}", kind.name());
            }
            assert_eq!(w.curvature(0.8), 0.0);
        }
    }

    #[test]
    fn kernels_vanish_at_and_beyond_their_range_and_names_round_trip() {
        for &kind in KernelKind::ALL {
            let w = Kernel::new(kind, 0.75, 3);
            assert_eq!(w.value(0.75), 0.0);
            assert_eq!(w.slope(0.8), 0.0);
            assert!(w.value(0.75 - 1e-9) < 1e-7);
            assert_eq!(KernelKind::from_name(kind.name()), Some(kind));
        }
        assert_eq!(KernelKind::from_name("gauss"), None);
    }
}
