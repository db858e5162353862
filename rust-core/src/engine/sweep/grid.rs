//! Rows of bins: the cells that particles are sorted into.

use super::frame::Frame;

/// Rows along x with a cross-section no narrower than the cut-off, each divided into bins, rows in layers.
///
/// In three dimensions a layer is a sheet of rows that differ in y, and layers follow each other along z;
/// in two dimensions a layer is one row, and layers follow along y. A particle meets the rest of its
/// row, the next row of its layer, and three rows of the next layer: half of its neighbourhood.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    pub bins: usize,
    pub rows: usize,
    pub layers: usize,
    /// The direction that rows of a layer, and layers, follow each other in.
    pub row_axis: usize,
    pub layer_axis: usize,
    /// The distance up to which pairs are looked for: the cut-off, and room for rounding.
    pub reach: f64,
    /// Half the width, in fractions of the box, of the window of a row.
    pub window: f64,
    /// How many particles of a row look together, and how many bins they are apart at most.
    pub team: usize,
    pub joined: f64,
}

/// Bins per cut-off.
const FINENESS: f64 = 4.0;

/// In rows with fewer particles per cut-off eight look together, else four: windows of eight still are about sixteen
/// particles long then.
const SPARSE: f64 = 4.5;

impl Grid {
    /// The grid for `count` particles; `None` where the box is too narrow along a period for particles
    /// to meet one image only of each other.
    pub fn new(frame: &Frame, cutoff: f64, count: usize) -> Option<Grid> {
        let (row_axis, layer_axis) = if frame.dimensions == 3 { (1, 2) } else { (2, 1) };
        let longest = frame.length[..frame.dimensions].iter().fold(0.0, |a: f64, b| a.max(*b));
        // Coordinates in single precision, relative to the box.
        let reach = cutoff + 1e-6 * (cutoff + longest);
        for k in 0..frame.dimensions {
            if frame.periodic[k] && frame.height(k) < 2.0 * reach {
                return None;
            }
        }
        let most = (4 * count + 64) as f64;
        // No narrower than the cut-off, but for rounding: of pairs in the last part in 10⁹ of it some may be missed.
        let mut width = cutoff * (1.0 - 1e-9);
        loop {
            let along = |axis: usize, width: f64| {
                if axis < frame.dimensions { (frame.height(axis) / width).floor().max(1.0) } else { 1.0 }
            };
            let rows = along(row_axis, width);
            let layers = along(layer_axis, width);
            let bins = along(0, width / FINENESS);
            // A few runaways must not make a grid of empty bins.
            if rows * layers * bins <= most.max(64.0 * FINENESS) {
                let (bins, rows, layers) = (bins as usize, rows as usize, layers as usize);
                let window = reach / frame.height(0);
                let per_row = count as f64 / (rows * layers) as f64;
                let (team, joined) = match per_row * cutoff < SPARSE * frame.height(0) {
                    true => (8, 4.0 * FINENESS),
                    false => (4, FINENESS),
                };
                return Some(Grid { bins, rows, layers, row_axis, layer_axis, reach, window, team, joined });
            }
            width *= 1.5;
        }
    }

    /// Rows of a layer, or layers, along an axis.
    pub fn of(&self, axis: usize) -> usize {
        if axis == self.layer_axis { self.layers } else { self.rows }
    }

    pub fn cells(&self) -> usize {
        self.bins * self.rows * self.layers
    }

    /// Cells along each direction.
    pub fn along(&self) -> [u32; 3] {
        let mut along = [self.bins as u32; 3];
        (along[self.row_axis], along[self.layer_axis]) = (self.rows as u32, self.layers as u32);
        along
    }

    /// How far apart cells are that follow each other in each direction.
    pub fn steps(&self) -> [u32; 3] {
        let mut steps = [1; 3];
        let row = self.bins as u32;
        (steps[self.row_axis], steps[self.layer_axis]) = (row, row * self.rows as u32);
        steps
    }
}
