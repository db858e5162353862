//! Particles that meet the round surface of a wall in a drift.
//!
//! A drift moves particles with the velocity of the step, which has a share of the kick by the present forces in it and lacks the
//! rest. To mirror what is beyond a surface and to reverse its velocity would be a leapfrog over the kink of the potential, which
//! heats: each bounce would change the energy by up to `F |v| Δt`. So a particle that meets a surface moves on the exact path under the
//! force held, `x + ut + ½Ft²/m`, with its bounces. Velocity and position of the path differ from those of the step by what
//! the step has given already, or has still to give, of the held force's kick; where no surface is met both end at the same place.

pub use super::round_flight::Arc;
use super::round_flight::{NEAR, clamp, fly_beside, square};
use super::walls::Place;
use crate::model::wall::Round;

/// The drift of a step, in which the present forces are held.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Path {
    /// How long it takes.
    pub time: f64,
    /// The velocity of the step at the start less that of the path, in units of force over mass.
    pub kicked: f64,
    /// The position of the step at the start less that of the path, in units of force over mass.
    pub shift: f64,
    /// The velocity that moves the particles less that of the step, in the same units.
    pub ahead: f64,
}

impl Path {
    /// A drift of a whole step, whose velocity has `kicked` of the kick; the particles move with half of it.
    pub fn whole(dt: f64, kicked: f64) -> Path {
        Path { time: dt, kicked, shift: 0.0, ahead: 0.5 * dt - kicked }
    }

    /// The first drift of half a step.
    pub fn first_half(dt: f64, kicked: f64) -> Path {
        Path { time: 0.5 * dt, kicked, ..Path::default() }
    }

    /// The drift of half a step behind it.
    pub fn second_half(dt: f64, kicked: f64) -> Path {
        let first = Path::first_half(dt, kicked);
        Path { shift: -first.shift_at_end(), ..first }
    }

    /// The position of the step at the end less that of the path.
    pub fn shift_at_end(&self) -> f64 {
        self.shift + (self.kicked + self.ahead - 0.5 * self.time) * self.time
    }

    /// What becomes of a particle at `x` with the acceleration `a`, which the step moves to a place and a velocity, at a round surface.
    /// `beyond` is what the drift before has left of one that waits on the surface; every arc is shown. Vectors count across the surface.
    #[inline]
    pub fn meet(
        &self,
        place: &Place,
        x: &[f64; 3],
        [to, v]: [[f64; 3]; 2],
        a: [f64; 3],
        beyond: impl FnOnce() -> [f64; 3],
        show: impl FnMut(Arc),
    ) -> Way {
        let &Path { time, kicked, shift, .. } = self;
        let Some((surface, arm)) = place.arm(x) else { return Way::Free };
        let distance = surface.side() * (surface.radius - square(arm).sqrt());
        let across =
            |of: &dyn Fn(usize) -> f64| [0, 1, 2].map(|c| if surface.across[c] { of(c) } else { 0.0 });
        let a = across(&|c| a[c]);
        let waits = distance <= NEAR * surface.radius;
        let beyond = if waits { beyond() } else { [0.0; 3] };
        let beyond = across(&|c| beyond[c]);
        let u = across(&|c| v[c] - kicked * a[c]);
        // All from the place of the step at the start.
        let from = across(&|c| beyond[c] - shift * a[c]);
        let to = across(&|c| to[c] - x[c]);
        // A parabola is within the triangle of its ends and of the point where their tangents meet.
        let middle = across(&|c| from[c] + 0.5 * time * u[c]);
        let end = across(&|c| from[c] + time * (u[c] + 0.5 * time * a[c]));
        let reach = [from, to, middle, end].map(square).into_iter().fold(0.0, f64::max).sqrt();
        if distance > reach && beyond == [0.0; 3] {
            return Way::Free;
        }
        let flown = fly_beside(surface, across(&|c| arm[c] + from[c]), u, a, time, show);
        let is_inside = is_in_fluid(surface, across(&|c| arm[c] + to[c]));
        if is_inside && beyond == [0.0; 3] && flown.is_some_and(|end| end.push == 0.0) {
            return Way::Free;
        }
        let Some(end) = flown else { return Way::Lost };
        let placed = across(&|c| end.arm[c] + self.shift_at_end() * a[c]);
        let inside = clamp(surface, placed);
        Way::Met(Met {
            x: [0, 1, 2].map(|c| if surface.across[c] { x[c] + (inside[c] - arm[c]) } else { x[c] }),
            v: across(&|c| v[c] + end.given[c]),
            u: end.u,
            given: end.given,
            push: end.push,
            beyond: across(&|c| placed[c] - inside[c]),
        })
    }
}

/// Whether a round surface is met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// It is not: the step is right.
    Free,
    /// It is, with numbers that are not finite.
    Lost,
    /// It is.
    Met(Met),
}

/// The end of a drift in which a round surface is met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// Place of the step.
    pub x: [f64; 3],
    /// Velocity of the step, across the surface.
    pub v: [f64; 3],
    /// Velocity of the path, across the surface.
    pub u: [f64; 3],
    /// The velocity that the surface has given.
    pub given: [f64; 3],
    /// Its part into the fluid.
    pub push: f64,
    /// How far the place of the step would lie in the matter, which the drift behind this one needs if the path has a shift at its end.
    pub beyond: [f64; 3],
}

fn is_in_fluid(surface: &Round, arm: [f64; 3]) -> bool {
    surface.side() * (surface.radius.powi(2) - square(arm)) >= 0.0
}
