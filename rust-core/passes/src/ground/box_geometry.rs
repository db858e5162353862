//! The region of the sweep, and its fractional coordinates.

use crate::domain::PeriodicBox;

/// A parallelepiped with its first edge along x and its second in the xy plane, as in LAMMPS.
#[derive(Debug, Clone, Copy, Default)]
pub struct BoxGeometry {
    pub dimensions: usize,
    pub origin: [f64; 3],
    /// Edge components xx, yy, zz.
    pub length: [f64; 3],
    /// Edge components xy, xz, yz: the tilt of the second and the third edge.
    pub tilt: [f64; 3],
    pub periodic: [bool; 3],
}

impl BoxGeometry {
    /// The geometry of a box; `None` if its edges are rotated.
    pub fn of_box(domain: &PeriodicBox, dimensions: usize) -> Option<BoxGeometry> {
        let [a, b, c] = [0, 1, 2].map(|k| domain.edge(k));
        if a[1] != 0.0 || a[2] != 0.0 || b[2] != 0.0 {
            return None;
        }
        let mut periodic = domain.periodic();
        let mut geometry = BoxGeometry {
            dimensions,
            origin: domain.origin(),
            length: [a[0], b[1], c[2]],
            tilt: [b[0], c[0], c[1]],
            periodic,
        };
        if dimensions == 2 {
            periodic[2] = false;
            geometry.tilt = [b[0], 0.0, 0.0];
            geometry.length[2] = 1.0;
            geometry.periodic = periodic;
        }
        Some(geometry)
    }

    /// Open space that contains all points between `low` and `high`.
    pub fn enclosing(low: [f64; 3], high: [f64; 3], dimensions: usize, cutoff: f64) -> BoxGeometry {
        let geometry =
            BoxGeometry { dimensions, origin: low, length: [1.0; 3], tilt: [0.0; 3], periodic: [false; 3] };
        geometry.stretched(low, high, cutoff)
    }

    /// The same box with its open directions stretched to reach from `low` to `high`.
    pub fn stretched(mut self, low: [f64; 3], high: [f64; 3], cutoff: f64) -> BoxGeometry {
        for c in 0..self.dimensions {
            if !self.periodic[c] {
                self.origin[c] = low[c];
                // Differences of fractions are signed: within the cutoff they must stay below one half.
                self.length[c] = ((high[c] - low[c]) * (1.0 + 1e-9)).max(4.0 * cutoff);
            }
        }
        self
    }

    pub fn is_fully_periodic(&self) -> bool {
        self.periodic[..self.dimensions].iter().all(|p| *p)
    }

    pub fn is_tilted(&self) -> bool {
        self.tilt != [0.0; 3]
    }

    /// The largest number that can occur where a point is computed from its fractions, or its fractions from it: errors of
    /// rounding are fractions of this. Without tilt it is the longest edge.
    pub fn extent(&self) -> f64 {
        let [xy, xz, yz] = self.tilt.map(f64::abs);
        let [x, y, z] = self.length;
        let along = [x + xy + xz + xy * (yz / y), y + yz, z];
        along[..self.dimensions].iter().fold(0.0, |a: f64, b| a.max(*b))
    }

    /// Distance between opposite faces.
    pub fn height(&self, k: usize) -> f64 {
        let [xy, xz, yz] = self.tilt;
        let [lx, ly, lz] = self.length;
        match k {
            // The heights are the reciprocal lengths of the rows of the inverse matrix of edges.
            0 => lx / (1.0 + (xy / ly).powi(2) + ((xy * yz - xz * ly) / (ly * lz)).powi(2)).sqrt(),
            1 => ly / (1.0 + (yz / lz).powi(2)).sqrt(),
            _ => lz,
        }
    }

    /// Fractional coordinates, in [0, 1) along periodic directions.
    #[inline(always)]
    pub fn fraction(&self, x: &[f64; 3], inverse: &[f64; 3]) -> [f64; 3] {
        let mut s = [0.0; 3];
        let d = [x[0] - self.origin[0], x[1] - self.origin[1], x[2] - self.origin[2]];
        if self.dimensions == 3 {
            s[2] = d[2] * inverse[2];
        }
        s[1] = (d[1] - self.tilt[2] * s[2]) * inverse[1];
        s[0] = (d[0] - self.tilt[0] * s[1] - self.tilt[1] * s[2]) * inverse[0];
        s
    }

    /// The point at fractional coordinates, relative to the origin.
    #[inline(always)]
    pub fn point(&self, s: &[f64; 3]) -> [f64; 3] {
        let flat = if self.dimensions == 3 { s[2] * self.length[2] } else { 0.0 };
        [
            s[0] * self.length[0] + s[1] * self.tilt[0] + s[2] * self.tilt[1],
            s[1] * self.length[1] + s[2] * self.tilt[2],
            flat,
        ]
    }

    pub fn edge(&self, k: usize) -> [f64; 3] {
        match k {
            0 => [self.length[0], 0.0, 0.0],
            1 => [self.tilt[0], self.length[1], 0.0],
            _ => [self.tilt[1], self.tilt[2], self.length[2]],
        }
    }
}
