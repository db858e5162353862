//! The motion of one coordinate between two reflecting faces under a constant acceleration, which is exact.

/// Faces that are met one by one. More are met only by what moves many times across the box.
const MOST: usize = 64;

/// A stretch of the motion between two bounces, or many small hops on a face, taken together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// When it begins.
    pub time: f64,
    /// Where it begins, with what velocity and acceleration; hops stay on their face.
    pub x: f64,
    pub u: f64,
    pub a: f64,
    /// The velocity that the faces have given until then; for hops the mean.
    pub given: f64,
}

impl Arc {
    pub fn place(&self, time: f64) -> f64 {
        let t = time - self.time;
        self.x + t * (self.u + 0.5 * t * self.a)
    }
}

/// Place and velocity at the end, and the velocity that the faces have given, which is not zero if any was met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    pub x: f64,
    pub u: f64,
    pub given: f64,
}

/// Moves from `x` between `low` and `high` with the velocity `u` and the acceleration `a` for `time`, reflected by the faces, and
/// shows every arc. `None` if it is too fast for this box, or if a number is not finite.
pub fn fly(
    [x, u]: [f64; 2],
    a: f64,
    [low, high]: [f64; 2],
    time: f64,
    mut show: impl FnMut(Arc),
) -> Option<End> {
    let mut arc = Arc { time: 0.0, x, u, a, given: 0.0 };
    for _ in 0..MOST {
        show(arc);
        let below = meet(arc.x - low, -arc.u, a);
        let above = meet(high - arc.x, arc.u, -a);
        let left = time - arc.time;
        // The face, the direction away from it, how long it takes to get there, and with what speed.
        let met = match (below, above) {
            (Some([t, speed]), above) if above.is_none_or(|[later, _]| t <= later) => (low, 1.0, t, speed),
            (_, Some([t, speed])) => (high, -1.0, t, speed),
            _ => (low, 1.0, f64::INFINITY, 0.0),
        };
        let (face, away, t, speed) = met;
        if t >= left || t.is_nan() {
            let end = End { x: arc.place(time), u: arc.u + left * a, given: arc.given };
            return end.x.is_finite().then_some(end);
        }
        let given = arc.given + 2.0 * away * speed;
        arc = Arc { time: arc.time + t, x: face, u: away * speed, given, ..arc };
        let (left, presses) = (left - t, -away * a);
        if presses > 0.0 && speed * speed <= 2.0 * presses * (high - low) {
            // It comes back to this face again and again, always with this speed; or it rests there.
            let period = 2.0 * speed / presses;
            let hops = if period > 0.0 { (left / period).floor() } else { f64::INFINITY };
            if !hops.is_finite() {
                show(Arc { u: 0.0, a: 0.0, given: arc.given + 0.5 * away * presses * left, ..arc });
                return Some(End { x: face, u: 0.0, given: arc.given + away * presses * left });
            }
            if hops > 0.0 {
                // The means of the velocities between the bounces at the ends.
                show(Arc { u: 0.0, a: 0.0, given: arc.given + away * speed * (hops - 1.0), ..arc });
                arc.time += hops * period;
                arc.given += 2.0 * away * speed * hops;
            }
            show(arc);
            let left = (left - hops * period).clamp(0.0, period);
            let height = (left * (speed - 0.5 * presses * left)).max(0.0);
            return Some(End {
                x: face + away * height,
                u: away * (speed - presses * left),
                given: arc.given,
            });
        }
    }
    None
}

/// How long it takes to a face at a `distance`, and the speed there, with the speed `towards` it and the acceleration `away`
/// from it; `None` if it is never met.
fn meet(distance: f64, towards: f64, away: f64) -> Option<[f64; 2]> {
    let distance = distance.max(0.0);
    let square = towards * towards - 2.0 * away * distance;
    let speed = if square >= 0.0 { square.sqrt() } else { return None };
    if towards > 0.0 {
        Some([2.0 * distance / (towards + speed), speed])
    } else if away < 0.0 {
        Some([(speed - towards) / -away, speed])
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The energy ½u² − ax is kept, the place stays inside, the velocity is what acceleration and faces have given, and arcs join.
    /// The way back, with the velocity reversed, ends at the start.
    #[test]
    fn motion_keeps_its_energy_and_is_reversible() {
        let part = |k: usize, c: usize| (k as f64 * [2f64, 3.0, 5.0, 7.0][c].sqrt()).fract();
        let (mut bounced, mut hopped) = (0, 0);
        for k in 1..3000 {
            let faces = [-1.0, 0.5];
            let x = -1.0 + 1.5 * part(k, 0);
            let u = 20.0 * (part(k, 1) - 0.5);
            let a = 200.0 * (part(k, 2) - 0.5) * if k % 3 == 0 { 0.01 } else { 1.0 };
            let time = 0.3 * part(k, 3);
            let mut arcs = Vec::new();
            let end = fly([x, u], a, faces, time, |arc| arcs.push(arc)).unwrap();
            let energy = |x: f64, u: f64| 0.5 * u * u - a * x;
            assert!((energy(x, u) - energy(end.x, end.u)).abs() < 1e-9, "{k}: {end:?}");
            assert!((-1.0 - 1e-12..=0.5 + 1e-12).contains(&end.x), "{k}: {end:?}");
            assert!((end.u - u - a * time - end.given).abs() < 1e-10, "{k}: {end:?}");
            for pair in arcs.windows(2) {
                assert!((pair[0].place(pair[1].time) - pair[1].x).abs() < 1e-9, "{k}: {arcs:?}");
            }
            assert!((arcs.last().unwrap().place(time) - end.x).abs() < 1e-9, "{k}");
            let back = fly([end.x, -end.u], a, faces, time, |_| ()).unwrap();
            assert!((back.x - x).abs() < 1e-7 && (back.u + u).abs() < 1e-6, "{k}: {back:?} {x} {u}");
            bounced += u32::from(arcs.len() > 1);
            hopped += u32::from(arcs.iter().any(|arc| arc.a == 0.0 && arc.u == 0.0));
        }
        assert!(bounced > 1000 && hopped > 40, "{bounced} {hopped}");
    }

    /// A ball dropped from a height of 1/2 with an acceleration of 1 meets the floor after one, three, five … units of time.
    #[test]
    fn a_dropped_ball_comes_back() {
        let at = |time: f64| fly([0.5, 0.0], -1.0, [0.0, 10.0], time, |_| ()).unwrap();
        for hops in 0..50 {
            let top = at(2.0 * f64::from(hops));
            assert!((top.x - 0.5).abs() < 1e-12 && top.u.abs() < 1e-12 && top.given == 2.0 * f64::from(hops));
            let low = at(2.0 * f64::from(hops) + 0.75);
            assert!((low.x - 0.5 * (1.0 - 0.5625)).abs() < 1e-12 && (low.u + 0.75).abs() < 1e-12);
        }
        // What lies on the floor stays there, and the floor carries it.
        let rest = fly([0.0, 0.0], -2.0, [0.0, 1.0], 3.0, |_| ()).unwrap();
        assert_eq!(rest, End { x: 0.0, u: 0.0, given: 6.0 });
        assert_eq!(fly([0.1, f64::NAN], 1.0, [0.0, 1.0], 1.0, |_| ()), None);
        assert_eq!(fly([0.1, 1e9], 1.0, [0.0, 1.0], 1.0, |_| ()), None);
    }
}
