//! The motion beside a cylinder or a sphere under a constant acceleration, which is exact but for what hops many times.
//!
//! All vectors are those across the surface, and places are vectors from its axis or centre.

use crate::model::wall::Round;

/// Bounces that are met one by one. What hops more often in a step is pressed to the surface, and slides.
const MOST: usize = 128;

/// Parts of a slide.
const PARTS: u32 = 64;

/// How far from the surface rounding leaves what lies on it, in radii.
pub const NEAR: f64 = 1e-9;

/// A stretch of the motion between two bounces, or the slide of what hops many times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// When it begins.
    pub time: f64,
    /// Where it begins; a slide is a chord.
    pub arm: [f64; 3],
    /// With what velocity it begins.
    pub u: [f64; 3],
    /// Its acceleration.
    pub a: [f64; 3],
    /// The velocity that the surface has given until then; in a slide the mean.
    pub given: [f64; 3],
}

/// Place and velocity at the end, the velocity that the surface has given, and its part across the surface, which is not zero if the
/// surface was met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    pub arm: [f64; 3],
    pub u: [f64; 3],
    pub given: [f64; 3],
    pub push: f64,
}

/// Moves from `arm` with the velocity `u` and the acceleration `a` for `time`, reflected by the surface, and shows every arc. `None` if a
/// number is not finite.
pub fn fly_beside(
    surface: &Round,
    arm: [f64; 3],
    u: [f64; 3],
    a: [f64; 3],
    time: f64,
    mut show: impl FnMut(Arc),
) -> Option<End> {
    let (radius, side) = (surface.radius, surface.side());
    let mut arc = Arc { time: 0.0, arm: clamp(surface, arm), u, a, given: [0.0; 3] };
    let (mut push, mut is_on) = (0.0, height(surface, arm) <= 0.0);
    for _ in 0..MOST {
        let left = time - arc.time;
        // side (R² − |x|²), which is positive in the fluid, in powers of the time.
        let h = [
            height(surface, arc.arm),
            -2.0 * side * dot(arc.arm, arc.u),
            -side * (square(arc.u) + dot(arc.arm, a)),
            -side * dot(arc.u, a),
            -0.25 * side * square(a),
        ];
        let hit = match is_on {
            true if h[1] < 0.0 => Some(0.0),
            // It is on the surface now, and meets it again when the rest becomes zero.
            true => first_negative(&h[1..], left),
            false => first_negative(&h, left),
        };
        let t = hit.unwrap_or(left);
        show(arc);
        let (place, u) = ([0, 1, 2].map(|c| arc.arm[c] + t * (arc.u[c] + 0.5 * t * a[c])), add(arc.u, t, a));
        if hit.is_none() {
            let end = End { arm: place, u, given: arc.given, push };
            return end.arm.iter().all(|x| x.is_finite()).then_some(end);
        }
        let n = scaled(place, -side / square(place).sqrt());
        let away = -2.0 * dot(u, n).min(0.0);
        push += away;
        let (arm, u, given) = (scaled(n, -side * radius), add(u, away, n), add(arc.given, away, n));
        (arc, is_on) = (Arc { time: arc.time + t, arm, u, given, ..arc }, true);
    }
    let part = (time - arc.time) / f64::from(PARTS);
    for _ in 0..PARTS {
        let end = slide(surface, arc, push, part);
        let u = if part > 0.0 { scaled(add(end.arm, -1.0, arc.arm), 1.0 / part) } else { [0.0; 3] };
        let given = scaled(add(arc.given, 1.0, end.given), 0.5);
        show(Arc { u, a: [0.0; 3], given, ..arc });
        push = end.push;
        arc = Arc { time: arc.time + part, arm: end.arm, u: end.u, given: end.given, ..arc };
    }
    let end = End { arm: arc.arm, u: arc.u, given: arc.given, push };
    end.arm.iter().chain(&end.u).all(|x| x.is_finite()).then_some(end)
}

/// The end of many small hops, which the surface holds for a short time: along a great circle, with the acceleration along the surface and
/// the energy of the motion. The velocity across the surface is kept.
fn slide(surface: &Round, arc: Arc, push: f64, time: f64) -> End {
    let (radius, side) = (surface.radius, surface.side());
    let n = scaled(arc.arm, -side / radius);
    let across = dot(arc.u, n);
    let (u, a) = (add(arc.u, -across, n), add(arc.a, -dot(arc.a, n), n));
    let way = [0, 1, 2].map(|c| time * (u[c] + 0.5 * time * a[c]));
    let length = square(way).sqrt();
    let e = if length > 0.0 { scaled(way, 1.0 / length) } else { [0.0; 3] };
    let (sine, cosine) = (length / radius).sin_cos();
    let arm = [0, 1, 2].map(|c| cosine * arc.arm[c] + radius * sine * e[c]);
    let arm = scaled(arm, radius / square(arm).sqrt());
    // What moves along the circle turns with it.
    let fast = add(u, time, a);
    let along = dot(fast, e);
    let turned = [0, 1, 2].map(|c| fast[c] + along * ((cosine - 1.0) * e[c] - sine / radius * arc.arm[c]));
    let work = dot(arc.a, [0, 1, 2].map(|c| arm[c] - arc.arm[c]));
    let energy = (square(u) + 2.0 * work).max(0.0);
    let factor = if square(turned) > 0.0 { (energy / square(turned)).sqrt() } else { 0.0 };
    let after = scaled(arm, -side / radius);
    let u = add(scaled(turned, factor), across, after);
    let pushed = [0, 1, 2].map(|c| u[c] - arc.u[c] - time * arc.a[c]);
    let middle = [0, 1, 2].map(|c| n[c] + after[c]);
    let push = push + dot(pushed, middle) / square(middle).sqrt();
    End { arm, u, given: add(arc.given, 1.0, pushed), push }
}

/// `side (R² − |x|²)`.
fn height(surface: &Round, arm: [f64; 3]) -> f64 {
    surface.side() * (surface.radius * surface.radius - square(arm))
}

/// The place, or the nearest on the surface if it lies in the matter.
pub fn clamp(surface: &Round, arm: [f64; 3]) -> [f64; 3] {
    match height(surface, arm) < 0.0 {
        true => scaled(arm, surface.radius / square(arm).sqrt()),
        false => arm,
    }
}

/// The first time before `end` after which a polynomial, which is not negative at 0, is negative.
fn first_negative(p: &[f64], end: f64) -> Option<f64> {
    let mut from = 0.0;
    for to in roots(&derivative(p), end).into_iter().chain([end]) {
        if value(p, to) < 0.0 {
            return Some(between(p, from, to));
        }
        from = to;
    }
    None
}

/// The roots of a polynomial between 0 and `end` at which it changes its sign, in their order.
fn roots(p: &[f64], end: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut from = 0.0;
    let turns = if p.len() > 2 { roots(&derivative(p), end) } else { Vec::new() };
    for to in turns.into_iter().chain([end]) {
        if (value(p, from) < 0.0) != (value(p, to) < 0.0) {
            found.push(between(p, from, to));
        }
        from = to;
    }
    found
}

/// Where a polynomial changes its sign between two places, by halves: the last place with the sign of the first.
fn between(p: &[f64], mut from: f64, mut to: f64) -> f64 {
    let is_negative = value(p, to) < 0.0;
    loop {
        let middle = 0.5 * (from + to);
        if middle <= from || middle >= to {
            return from;
        }
        match (value(p, middle) < 0.0) == is_negative {
            true => to = middle,
            false => from = middle,
        }
    }
}

fn value(p: &[f64], t: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, a| sum * t + a)
}

fn derivative(p: &[f64]) -> Vec<f64> {
    p.iter().enumerate().skip(1).map(|(k, a)| k as f64 * a).collect()
}

pub fn square(a: [f64; 3]) -> f64 {
    dot(a, a)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scaled(a: [f64; 3], factor: f64) -> [f64; 3] {
    a.map(|a| factor * a)
}

fn add(a: [f64; 3], factor: f64, b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + factor * b[c])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(k: usize, c: usize) -> f64 {
        (k as f64 * [2f64, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0][c].sqrt()).fract()
    }

    /// Surfaces, starts in the fluid, and motions of all kinds: free, fast, and pressed to the surface.
    fn flights() -> impl Iterator<Item = (usize, Round, [[f64; 3]; 3], f64)> {
        (1..4000).map(|k| {
            let across = [true, true, k % 2 == 0];
            let masked = |v: [f64; 3]| [v[0], v[1], if k % 2 == 0 { v[2] } else { 0.0 }];
            let inside = k % 4 < 2;
            let surface = Round { across, center: [0.0; 3], radius: 1.0 + part(k, 0), inside };
            let direction = masked([1, 2, 3].map(|c| part(k, c) - 0.5));
            let height = if k % 5 == 0 { 0.0 } else { 0.3 * part(k, 4) };
            let arm =
                scaled(direction, (surface.radius - surface.side() * height) / square(direction).sqrt());
            let u = masked([5, 6, 7].map(|c| 8.0 * (part(k, c) - 0.5)));
            let pressing = scaled(arm, surface.side() * 100.0 * part(k, 8) / surface.radius);
            let a = masked([1, 2, 5].map(|c| 30.0 * (part(k, c) - 0.5)));
            let a = if k % 3 == 0 { add(a, 1.0, pressing) } else { a };
            (k, surface, [arm, u, a], 0.3 * part(k, 9))
        })
    }

    /// The energy ½u² − a·x is kept, the place stays in the fluid, the velocity is what acceleration and surface have given, arcs join,
    /// and what is given across the surface is no pull. The way back, with the velocity reversed, ends at the start.
    #[test]
    fn motion_beside_a_round_surface_keeps_its_energy_and_is_reversible() {
        let (mut bounced, mut often, mut slid) = (0, 0, 0);
        for (k, surface, [arm, u, a], time) in flights() {
            let mut arcs = Vec::new();
            let end = fly_beside(&surface, arm, u, a, time, |arc| arcs.push(arc)).unwrap();
            let energy = |x: [f64; 3], u: [f64; 3]| 0.5 * square(u) - dot(a, x);
            let off = energy(arm, u) - energy(end.arm, end.u);
            let limit = if arcs.len() > MOST { 1e-3 } else { 1e-9 };
            assert!(off.abs() < limit, "{k}: {off} {end:?}");
            assert!(height(&surface, end.arm) > -1e-12, "{k}: {end:?}");
            for c in 0..3 {
                assert!((end.u[c] - u[c] - a[c] * time - end.given[c]).abs() < 1e-9, "{k}: {end:?}");
            }
            let place = |arc: &Arc, time: f64| {
                let t = time - arc.time;
                [0, 1, 2].map(|c| arc.arm[c] + t * (arc.u[c] + 0.5 * t * arc.a[c]))
            };
            let mut ends: Vec<(f64, [f64; 3])> = arcs.iter().skip(1).map(|arc| (arc.time, arc.arm)).collect();
            ends.push((time, end.arm));
            for (arc, (time, to)) in arcs.iter().zip(ends) {
                let off = square(add(place(arc, time), -1.0, to)).sqrt();
                assert!(off < 1e-7, "{k}: {off} {arc:?}");
                // Nowhere on the way is it in the matter; a slide is a chord.
                let middle = place(arc, 0.5 * (arc.time + time));
                assert!(height(&surface, middle) > -1e-12 || arc.a == [0.0; 3], "{k}: {arc:?}");
            }
            slid += usize::from(arcs.len() > MOST);
            // What starts on the surface may have met it just then.
            if arcs.len() < 20 && k % 5 != 0 {
                let back = fly_beside(&surface, end.arm, end.u.map(|u| -u), a, time, |_| ()).unwrap();
                let off = square(add(back.arm, -1.0, arm)).sqrt().max(square(add(back.u, 1.0, u)).sqrt());
                assert!(off < 2e-5, "{k}: {off} {} {back:?}", arcs.len());
                often += usize::from(arcs.len() > 4);
            }
            bounced += usize::from(arcs.len() > 1);
            assert!(end.push >= 0.0 && (end.push > 0.0) == (arcs.len() > 1), "{k}: {end:?}");
        }
        assert!(bounced > 1500 && often > 20 && slid > 3, "{bounced} {often} {slid}");
    }

    /// What is pressed to the surface with almost no velocity across it swings like a pendulum, by small hops: here against a pendulum of small steps.
    #[test]
    fn what_is_pressed_slides_like_a_pendulum() {
        let surface = Round { across: [true, true, false], center: [0.0; 3], radius: 2.0, inside: true };
        for (angle, rate, hop) in [(0.3f64, 0.0f64, 0.0), (0.3, 0.4, 1e-7), (-0.5, 0.2, 1e-5)] {
            let (a, time) = ([0.0, -50.0, 0.0], 0.02);
            let arm = [2.0 * angle.sin(), -2.0 * angle.cos(), 0.0];
            let [e, n] = [[angle.cos(), angle.sin(), 0.0], scaled(arm, -0.5)];
            let end = fly_beside(&surface, arm, add(scaled(e, 2.0 * rate), hop, n), a, time, |_| ()).unwrap();
            let (mut at, mut rate) = (angle, rate);
            for _ in 0..20_000 {
                rate -= 0.5e-6 * 25.0 * at.sin();
                at += 1e-6 * rate;
                rate -= 0.5e-6 * 25.0 * at.sin();
            }
            let expected = [2.0 * at.sin(), -2.0 * at.cos(), 0.0];
            let off = square(add(end.arm, -1.0, expected)).sqrt();
            let turned = add(end.u, -2.0 * rate, [at.cos(), at.sin(), 0.0]);
            assert!(off < 1e-6 && square(turned).sqrt() < 1e-4, "{angle}: {off} {turned:?}");
            // The surface holds it: what presses is weight and centrifugal force.
            let weight = time * 50.0 * angle.cos();
            assert!((end.push / weight - 1.0).abs() < 0.02, "{} {weight}", end.push);
        }
    }

    #[test]
    fn the_first_negative_value_is_found() {
        // (t − 1)² has no negative value, (t − 1)² − 10⁻⁸ has one at 1 − 10⁻⁴, and t(t − 1)(t − 2)(t − 3) begins with one.
        assert_eq!(first_negative(&[1.0, -2.0, 1.0, 0.0, 0.0], 5.0), None);
        let found = first_negative(&[1.0 - 1e-8, -2.0, 1.0, 0.0, 0.0], 5.0).unwrap();
        assert!((found - (1.0 - 1e-4)).abs() < 1e-9, "{found}");
        let found = first_negative(&[0.0, -6.0, 11.0, -6.0, 1.0], 5.0).unwrap();
        assert!(found < 1e-12, "{found}");
        // −(t − 1)(t − 2)(t − 4) is negative beyond 4, and (t − 1)(t − 2)(t − 4) + 8 nowhere before.
        assert!((first_negative(&[8.0, -14.0, 7.0, -1.0], 9.0).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(first_negative(&[8.0, -14.0, 7.0, -1.0], 0.9), None);
        assert_eq!(first_negative(&[0.0, 14.0, -7.0, 1.0], 9.0), None);
    }
}
