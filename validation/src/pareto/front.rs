//! The settings that nothing beats, and the cheapest within tolerances.

use super::outcome::Point;
use super::quantity::Class;
use super::setting::Host;
use super::tolerance::Tolerance;

/// Notes at each point for which kinds of error nothing is cheaper and better. Points of LAMMPS's own law are not on it: they
/// are another fluid, with another reference.
pub fn mark(points: &mut [Point]) {
    for (_, class) in Class::ALL {
        let places: Vec<Option<[f64; 2]>> = points
            .iter()
            .map(|p| {
                let ours = p.host != Host::Lammps && p.unstable.is_none();
                Some([p.cost.as_ref().filter(|_| ours)?.median, p.error(class)?.shown()])
            })
            .collect();
        for (point, place) in points.iter_mut().zip(&places) {
            let Some([cost, error]) = *place else { continue };
            let beaten = places
                .iter()
                .flatten()
                .any(|[c, e]| (*c < cost && *e <= error) || (*c <= cost && *e < error));
            if !beaten {
                point.front.push(class);
            }
        }
    }
}

/// The cheapest point of `hosts` all of whose errors are within the tolerances.
pub fn cheapest(points: &[Point], tolerances: &[Tolerance], hosts: &[Host]) -> Option<usize> {
    let good = |p: &Point| {
        hosts.contains(&p.host)
            && p.unstable.is_none()
            && tolerances.iter().all(|tolerance| p.is_within(tolerance) == Some(true))
    };
    let cost = |k: &usize| points[*k].cost.as_ref().map_or(f64::INFINITY, |cost| cost.median);
    (0..points.len())
        .filter(|k| good(&points[*k]) && cost(k).is_finite())
        .min_by(|a, b| cost(a).total_cmp(&cost(b)))
}

/// A kind of tolerance that no point has errors of.
pub fn unmeasured(points: &[Point], tolerances: &[Tolerance]) -> Option<&'static str> {
    let measured = |class: Class| points.iter().any(|p| p.error(class).is_some());
    tolerances.iter().find(|t| !measured(t.class)).map(|t| t.class.name())
}
