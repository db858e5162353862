//! The settings that nothing beats, and the cheapest within tolerances.

use super::outcome::Point;
use super::quantity::Deviation;
use super::tolerance::{Tolerance, worst};
use crate::code::Host;
use psidpd_report::distinct;

/// Bounds of quantities where none is given: the first that can be told from nothing.
const USUAL: [f64; 4] = [0.01, 0.02, 0.05, 0.1];
/// The widest that they become where no setting keeps them.
const WIDEST: f64 = 0.2;

/// Notes at each point its worst error, and whether nothing is cheaper with a smaller one. Points of LAMMPS's own law are not
/// on the front: they are another fluid, with another reference.
pub fn mark(points: &mut [Point], tolerances: &[Tolerance]) {
    for point in &mut *points {
        point.worst = worst(&point.errors, tolerances);
    }
    let places: Vec<Option<[f64; 2]>> = points
        .iter()
        .map(|p| {
            let ours = p.code != Host::Lammps && p.stable;
            Some([p.cost.as_ref().filter(|_| ours)?.value, p.worst.as_ref()?.ratio])
        })
        .collect();
    for (point, place) in points.iter_mut().zip(&places) {
        let Some([cost, error]) = *place else { continue };
        let beats = |[c, e]: &[f64; 2]| (*c < cost && *e <= error) || (*c <= cost && *e < error);
        point.front = !places.iter().flatten().any(beats);
    }
}

/// The cheapest point of `hosts` all of whose errors are within the tolerances.
pub fn cheapest(points: &[Point], tolerances: &[Tolerance], hosts: &[Host]) -> Option<usize> {
    let good = |p: &Point| hosts.contains(&p.code) && p.stable && p.is_within(tolerances);
    let cost = |k: &usize| points[*k].cost.as_ref().map_or(f64::INFINITY, |cost| cost.value);
    (0..points.len())
        .filter(|k| good(&points[*k]) && cost(k).is_finite())
        .min_by(|a, b| cost(a).total_cmp(&cost(b)))
}

/// A tolerance that no point has errors of.
pub fn unmeasured<'a>(points: &[Point], tolerances: &'a [Tolerance]) -> Option<&'a Tolerance> {
    let measured = |t: &Tolerance| points.iter().flat_map(|p| &p.errors).any(|d| t.applies(d));
    tolerances.iter().find(|t| !measured(t))
}

/// For every quantity the smallest usual bound of which most points will use half if they have no error at all, and the names of
/// quantities that are too vague for any. Errors fall to `forecast` of what they are, and count `margin` times.
pub fn usual(points: &[Point], forecast: f64, margin: f64) -> (Vec<Tolerance>, Vec<String>) {
    let native = || points.iter().filter(|p| p.code == Host::Native && p.stable);
    let (mut good, mut others) = (Vec::new(), Vec::new());
    for name in distinct(native().flat_map(|p| &p.errors).map(|d| &d.name)) {
        let of: Vec<&Deviation> = native().flat_map(|p| &p.errors).filter(|d| d.name == *name).collect();
        let is_kept = |d: &&&Deviation, bound: f64| margin * d.error * forecast <= 0.5 * bound;
        let mostly = |bound: &f64| 2 * of.iter().filter(|d| is_kept(d, *bound)).count() > of.len();
        match USUAL.into_iter().find(mostly) {
            Some(bound) => good.push(Tolerance { name: name.clone(), bound }),
            None => others.push(name.clone()),
        }
    }
    (good, others)
}

/// Usual tolerances, doubled until a native point is within them, up to [`WIDEST`]. This may be done after a race: the margin of
/// its rule holds for all errors of all points at once, whatever they are compared with.
pub fn widened(points: &[Point], tolerances: &[Tolerance]) -> Vec<Tolerance> {
    let mut wide = tolerances.to_vec();
    while cheapest(points, &wide, &[Host::Native]).is_none() && wide.iter().any(|t| t.bound < WIDEST) {
        wide.iter_mut().for_each(|t| t.bound = (2.0 * t.bound).min(WIDEST));
    }
    wide
}
