use super::PairForm;
use crate::curve::Spline;
use std::sync::Arc;

/// A potential given by a table of `r` and `φ`: the cubic spline through its rows, not shifted, so that
/// the table should end at zero. Below the first row φ′ continues linearly.
#[derive(Debug, Clone)]
pub struct TablePair {
    spline: Arc<Spline>,
    range: f64,
}

impl TablePair {
    /// Takes the spline, and cuts it at `range`.
    pub fn new(spline: Arc<Spline>, range: f64) -> TablePair {
        TablePair { spline, range }
    }
}

impl PairForm for TablePair {
    fn range(&self) -> f64 {
        self.range
    }

    #[inline(always)]
    fn at(&self, r: f64) -> (f64, f64) {
        let [phi, slope, _] = self.spline.at(r);
        (phi, slope)
    }
}
