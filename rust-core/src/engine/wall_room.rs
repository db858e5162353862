//! Whether cylinders and spheres of matter fit into a box.

use crate::model::wall::{Round, Wall, WallField};
use psidpd_passes::domain::PeriodicBox;

/// Why a round wall does not fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct Cramped {
    /// What is wrong.
    pub message: String,
    /// What would help, if it is known.
    pub help: Option<String>,
}

fn cramped(message: String) -> Cramped {
    Cramped { message, help: None }
}

/// Refuses a round surface that does not fit into a box: it lies in the box, and images of it and of the fluid see nothing of each
/// other, with forces up to `cutoff` and the ranges of `field`.
///
/// # Errors
/// Says why it does not fit.
pub fn check_room(
    round: &Round,
    field: &WallField,
    domain: &PeriodicBox,
    dimensions: usize,
    cutoff: f64,
) -> Result<(), Cramped> {
    let range_of = |friction: Option<f64>, range: f64| friction.unwrap_or(0.0).max(range);
    let ranges = field.fields.iter().map(|f| range_of(f.friction.as_ref().map(|f| f.range()), f.range));
    let range = ranges.fold(cutoff, f64::max);
    let tilted = (0..3).any(|k| (0..3).any(|c| c != k && domain.edge(k)[c] != 0.0));
    if tilted {
        return Err(cramped("a round wall needs a box without tilt".to_owned()));
    }
    for c in (0..dimensions).filter(|c| round.across[*c]) {
        let (low, length) = (domain.origin()[c], domain.lengths()[c]);
        let (periodic, name) = (domain.repeats()[c], ["x", "y", "z"][c]);
        // What is left of the box beside the surface, and how much is needed.
        let margin = if round.inside || periodic { 0.0 } else { range };
        let rest = match (periodic, round.inside) {
            (false, _) => 0.0,
            (true, true) => range,
            (true, false) => 2.0 * range,
        };
        let reach = round.radius + margin - 1e-9 * length;
        if round.center[c] - reach < low || round.center[c] + reach > low + length {
            let needs = if margin > 0.0 {
                format!(", and {margin} from the reflecting faces")
            } else {
                String::new()
            };
            return Err(cramped(format!("the surface does not lie in the box along {name}{needs}")));
        }
        if length < 2.0 * round.radius + rest {
            return Err(Cramped {
                message: "the box is so small that fluid beside the surface sees its own images, or those of the surface".to_owned(),
                help: Some(format!("a length of {:?} along {name}, or more", 2.0 * round.radius + rest)),
            });
        }
    }
    Ok(())
}

/// Refuses two walls that may have one particle between them in a step: round ones keep `range` from others.
///
/// # Errors
/// Says how close they are.
pub fn check_apart(
    walls: [&Wall; 2],
    domain: &PeriodicBox,
    dimensions: usize,
    range: f64,
) -> Result<(), Cramped> {
    let rounds: Vec<&Round> = walls.iter().filter_map(|wall| wall.surface.round()).collect();
    let face = walls.iter().find_map(|wall| wall.surface.face());
    let error = match (&rounds[..], face) {
        ([round], Some((axis, _))) if round.inside && round.across[axis] => {
            Some("a wall with the fluid inside has no other across it".to_owned())
        }
        ([a, b], _) if a.inside || b.inside => {
            Some("a wall with the fluid inside has no other round one beside it".to_owned())
        }
        ([a, b], _) => {
            let along = |c: usize| {
                let (d, period) = (a.center[c] - b.center[c], domain.lengths()[c]);
                let nearest = if domain.repeats()[c] { d - period * (d / period).round() } else { d };
                if a.across[c] && b.across[c] { nearest } else { 0.0 }
            };
            let apart = (0..dimensions).map(along).map(|d| d * d).sum::<f64>().sqrt() - a.radius - b.radius;
            (apart < range)
                .then(|| format!("two round walls are {apart:.4} apart, less than the range {range}"))
        }
        _ => None,
    };
    error.map_or(Ok(()), |message| Err(cramped(message)))
}
