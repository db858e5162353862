use super::drop::circular_centre;
use super::linked::{DISTANCE, Distance, Linked};
use super::pendant::median_density;
use super::*;
use crate::keys::Key;
use crate::least_squares::least_squares;
use crate::options::FACES;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// The number of rows of density fields that are kept for error bars.
const ROWS: usize = 256;
/// The fewest points of the contour that are fitted.
const FEWEST: usize = 4;

/// A wall: its direction, and whether it is at the upper end.
type Face = (usize, bool);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactAngle {
    wall: Face,
    /// The direction along which a ridge crosses the box.
    along: Option<usize>,
    distance: Distance,
    dimensions: usize,
    /// The numbers of bins outwards and away from the wall.
    bins: [usize; 2],
    /// The widths of the bins outwards and away from the wall.
    width: [f64; 2],
    /// The length of the box along a ridge.
    depth: f64,
    /// The ends of the box along the normal of the wall.
    ends: [f64; 2],
    /// The height at which the angle is measured, above the face of the box.
    given: Option<f64>,
    /// The height of the highest frozen particle in the half of the box next to the wall.
    found: Option<f64>,
    /// The least height of fitted points above that surface.
    above: f64,
    /// The density on the contour.
    isodensity: Option<f64>,
    series: Series,
}

/// A point of the contour: distance from the vertical, height above the face, volume of its bin.
type Point = [f64; 3];

impl ContactAngle {
    /// True if distances from the middle are measured along one direction only.
    fn flat(&self) -> bool {
        self.dimensions == 2 || self.along.is_some()
    }

    fn volume(&self, outwards: usize) -> f64 {
        let (a, b) = (outwards as f64 * self.width[0], (outwards + 1) as f64 * self.width[0]);
        let across = if self.flat() { 2.0 * (b - a) * self.depth } else { PI * (b * b - a * a) };
        across * self.width[1]
    }

    /// The height of a coordinate above the wall's face.
    fn height(&self, x: f64) -> f64 {
        if self.wall.1 { self.ends[1] - x } else { x - self.ends[0] }
    }

    /// The surface of the wall: the given height, that of the frozen particles, or the face of the box.
    fn surface(&self) -> f64 {
        self.given.or(self.found).unwrap_or(0.0)
    }

    /// Number densities in the bins, of particles at these distances from the vertical and heights.
    fn field(&self, places: impl Iterator<Item = [f64; 2]>) -> Vec<f64> {
        let mut field = vec![0.0; self.bins[0] * self.bins[1]];
        for [r, z] in places {
            let (j, k) = ((r / self.width[0]) as usize, (z / self.width[1]) as usize);
            if j < self.bins[0] && z >= 0.0 && k < self.bins[1] {
                field[k * self.bins[0] + j] += 1.0 / self.volume(j);
            }
        }
        field
    }

    fn liquid(&self, field: &[f64]) -> f64 {
        median_density(field, |k| self.volume(k % self.bins[0]))
    }

    /// The points where the density falls through `level` on the way outwards in each row and away from the wall in each
    /// column, from rows and columns at least `above` the surface.
    fn contour(&self, field: &[f64], level: f64) -> [Vec<Point>; 2] {
        let lowest = self.surface() + self.above;
        let [outwards, upwards] = self.bins;
        let at = |j: usize, k: usize| field[k * outwards + j];
        let share = |a: f64, b: f64| (a - level) / (a - b);
        let middle = |n: f64, side: usize| (n + 0.5) * self.width[side];
        let rows = (0..upwards).filter(|k| middle(*k as f64, 1) >= lowest).filter_map(|k| {
            let j = (0..outwards).rposition(|j| at(j, k) >= level)?;
            (j + 1 < outwards).then(|| {
                let r = middle(j as f64 + share(at(j, k), at(j + 1, k)), 0);
                [r, middle(k as f64, 1), self.volume(j)]
            })
        });
        let columns = (0..outwards).filter_map(|j| {
            let k = (0..upwards).rposition(|k| at(j, k) >= level)?;
            let z = middle(k as f64 + share(at(j, k), at(j, (k + 1).min(upwards - 1))), 1);
            (k + 1 < upwards && z >= lowest).then(|| [middle(j as f64, 0), z, self.volume(j)])
        });
        [rows.collect(), columns.collect()]
    }

    /// The contact angle in degrees, the radius of the circle, the radius of the base, the height of the cap, the density of the
    /// liquid, the root mean square distance of the contour from the circle, and the angle of the contour's tangent.
    fn cap(&self, field: &[f64]) -> Option<Vec<f64>> {
        let liquid = self.liquid(field);
        let points = self.contour(field, self.isodensity.unwrap_or(0.5 * liquid)).concat();
        if points.len() < FEWEST {
            return None;
        }
        // The noise of a density falls with the root of the volume of its bin.
        let total: f64 = points.iter().map(|p| p[2]).sum();
        let away = |circle: &[f64], p: &Point| p[0].hypot(p[1] - circle[0]) - circle[1];
        let residuals = |circle: &[f64]| -> Option<Vec<f64>> {
            Some(points.iter().map(|p| (p[2] / total).sqrt() * away(circle, p)).collect())
        };
        let start = linear_circle(&points)?;
        let (found, sum) = least_squares(&start, &[1e-5 * start[1]; 2], residuals)?;
        let (centre, radius) = (found[0], found[1]);
        let rise = centre - self.surface();
        // A circle that does not reach the surface has no base: a drop beside the wall, or a film that covers it.
        let cosine = (-rise / radius).clamp(-1.0, 1.0);
        let angle = cosine.acos().to_degrees();
        let tangent = if cosine.abs() < 1.0 { self.tangent(&points)? } else { angle };
        let all = vec![
            angle,
            radius,
            radius * (1.0 - cosine * cosine).sqrt(),
            radius + rise,
            liquid,
            sum.sqrt(),
            tangent,
        ];
        all.iter().all(|x| x.is_finite()).then_some(all)
    }

    /// The angle in degrees between the wall and the tangent of the contour at the surface, from the parabola `r² = a + b z + c z²`
    /// through it, z above the surface. That is exact for every ellipsoid with an axis along the vertical.
    fn tangent(&self, points: &[Point]) -> Option<f64> {
        let (mut sums, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for [r, z, _] in points {
            let z = z - self.surface();
            let powers = Vector3::new(1.0, z, z * z);
            sums += powers * powers.transpose();
            right += powers * (r * r);
        }
        let found = sums.try_inverse()? * right;
        // r dr/dz = b/2.
        (found[0] > 0.0).then(|| 1.0f64.atan2(-0.5 * found[1] / found[0].sqrt()).to_degrees())
    }
}

/// The height of the centre and the radius of the circle with the least sum of `(r² + (z − c)² − R²)²`, which is linear in `c`
/// and `R² − c²`.
fn linear_circle(points: &[Point]) -> Option<[f64; 2]> {
    let mut sums = [0.0; 5];
    for [r, z, volume] in points {
        let square = r * r + z * z;
        for (sum, term) in sums.iter_mut().zip([1.0, *z, z * z, square, square * z]) {
            *sum += volume * term;
        }
    }
    let [n, z, zz, s, sz] = sums;
    let centre = 0.5 * (n * sz - s * z) / (n * zz - z * z);
    let square = (s - 2.0 * centre * z) / n + centre * centre;
    (centre.is_finite() && square > 0.0).then(|| [centre, square.sqrt()])
}

const ALONG: Key = Key {
    about: "For a ridge of liquid that crosses the periodic box: its direction. A drop that is round needs none.",
    need: Need::Default("none"),
    example: "\"y\"",
    ..crate::keys::AXIS
};

impl Meter for ContactAngle {
    const TABLE: Table = Table {
        path: "contact_angle",
        title: "contact angle of a drop on a wall",
        about: "Density of the moving particles against the distance from the vertical through the largest cluster's centre of \
                mass and the height above the wall, and the circle that fits the contour where the density is \
                `isodensity` (`contact_angle`): `angle` θ in degrees between the wall and the circle, through the \
                liquid, cos θ = (z − c)/R with the wall's surface at z, the centre at c and the radius R; `radius` R; \
                `base` radius of the circle at the surface, 0 where it does not reach it (then θ is 180 or 0); `height` of the cap; `liquid` density (the median over the \
                particles); `residual` the root mean square distance of the contour from the circle; `contour` the angle of \
                the contour's own tangent at the surface, from r² as a parabola of the height, which is exact for ellipsoids. The \
                contour itself is `contact_angle_profile`, the field `contact_angle_field`. A drop is a cap only if its \
                weight is small, Δρ g R² ≪ γ; where it is not, `angle` and `contour` differ. Layers of liquid next to the wall are left out of the fit (`above`). Jackknife errors; the \
                choice of the surface is not in them: dθ = dz/(R sin θ).",
        keys: keys! {
            "wall": ValueKind::Choice(|| names(&FACES)), Need::Default("the low end of the last direction"),
                "The end of the box where the wall is: below a drop that sits, above one that hangs."
                => "\"zhi\"";
            use ALONG;
            "surface": ValueKind::Within(0.0, f64::INFINITY), Need::Default("where the frozen particles of the wall's half of the box end; without these the end of the box"),
                "Height of the wall's surface above the end of the box."
                => "1.0";
            "above": ValueKind::Within(0.0, f64::INFINITY), Need::Default("the longest range of a conservative interaction"),
                "Height above the surface from which the contour is fitted."
                => "0.5";
            use DISTANCE;
            "bins": ValueKind::Wholes(4, 2000), Need::Default("as many as make them 0.25 wide, or a little less"),
                "Bins outwards, up to half the box, and away from the wall."
                => "[20, 40]";
            "isodensity": ValueKind::Positive, Need::Default("half the density of the liquid"),
                "The density on the contour."
                => "3.0";
        },
        ..PLAIN
    };

    const OF_LIQUIDS: bool = true;
    const PAIRS: Pairs = Pairs::List;

    fn read(options: &Options) -> Result<ContactAngle, FileError> {
        let (domain, fluid) = (options.place.domain, options.place.fluid);
        let d = fluid.dimensions;
        let wall = options.choice("wall", &FACES[..2 * d])?.unwrap_or((d - 1, false));
        let along = options.axis("axis")?;
        if along == Some(wall.0) {
            return Err(options.error("axis", "a ridge lies along the wall, not along its normal"));
        }
        if d == 2 && along.is_some() {
            return Err(
                options.error("axis", "in two dimensions a drop has no further direction; leave axis out")
            );
        }
        options.require_right_angles("")?;
        let lengths = domain.lengths();
        let outwards = (0..d)
            .filter(|k| *k != wall.0 && Some(*k) != along)
            .map(|k| 0.5 * lengths[k])
            .fold(f64::INFINITY, f64::min);
        let upwards = lengths[wall.0];
        let bins = options.bins_of_plane([outwards, upwards])?;
        let low = domain.origin()[wall.0];
        Ok(ContactAngle {
            wall,
            along,
            distance: Distance::read(options)?,
            dimensions: d,
            bins,
            width: [outwards / bins[0] as f64, upwards / bins[1] as f64],
            depth: along.map_or(1.0, |k| lengths[k]),
            ends: [low, low + upwards],
            given: options.number_up_to("surface", upwards)?,
            found: None,
            above: options.number_up_to("above", upwards)?.unwrap_or(fluid.conservative_range()),
            isodensity: options.positive("isodensity")?,
            series: Series::with_rows(bins[0] * bins[1], ROWS),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let (x, domain) = (view.x, view.domain);
        let moves = |k: usize| frame.moves(k);
        if self.given.is_none() && self.found.is_none() && !view.frozen.is_empty() {
            let heights = (0..x.len()).filter(|k| !moves(*k)).map(|k| self.height(x[k][self.wall.0]));
            let half = 0.5 * (self.ends[1] - self.ends[0]);
            self.found = heights.filter(|z| *z < half).reduce(f64::max);
        }
        let distance = self.distance.at(x, domain, self.dimensions, moves);
        let linked = Linked::of(frame, distance, moves);
        let Some(largest) = linked.largest() else { return false };
        let Some(centre) = circular_centre(x, domain, |k| linked.is_in(k, largest)) else { return false };
        let outwards = |c: &usize| *c != self.wall.0 && Some(*c) != self.along;
        let places = (0..x.len()).filter(|k| moves(*k)).map(|k| {
            let away = domain.minimum_image(x[k], centre);
            let square: f64 = (0..self.dimensions).filter(outwards).map(|c| away[c] * away[c]).sum();
            [square.sqrt(), self.height(x[k][self.wall.0])]
        });
        let field = self.field(places);
        self.series.push(&field)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn restart(&mut self) {
        self.distance.forget();
        self.found = None;
    }

    fn finish(&self) -> Vec<Observation> {
        let new = |name, title, kind| Observation::new(name, title, kind, &self.series);
        let found = self.series.jackknife(|field| self.cap(field));
        let at = |k: usize| [found.get(k).copied().unwrap_or(Measured::NONE)];
        let surface = self.surface();
        let note = match found.is_empty() {
            true => "No circle fits the contour.".to_owned(),
            false => format!("The wall's surface is {surface:.4} above the end of the box."),
        };
        let mut out = vec![
            new("contact_angle", "Drop on a wall", Kind::Scalar)
                .column("angle", "degree", at(0))
                .column("radius", "length", at(1))
                .column("base", "length", at(2))
                .column("height", "length", at(3))
                .column("liquid", "1/volume", at(4))
                .column("residual", "length", at(5))
                .column("contour", "degree", at(6))
                .note(note),
        ];
        if self.series.is_empty() {
            return out;
        }
        let field = self.series.means();
        let level = |field: &[f64]| self.isodensity.unwrap_or(0.5 * self.liquid(field));
        let [rows, _] = self.contour(&field, level(&field));
        let heights: Vec<f64> = rows.iter().map(|p| p[1]).collect();
        let radii = self.series.jackknife(|field| {
            let [rows, _] = self.contour(field, level(field));
            let near = |z: f64| rows.iter().find(|p| (p[1] - z).abs() < 0.5 * self.width[1]);
            Some(heights.iter().map(|z| near(*z).map_or(f64::NAN, |p| p[0])).collect())
        });
        out.push(
            new("contact_angle_profile", "Contour of a drop on a wall", Kind::Profile)
                .against("height", "length", heights.iter().map(|z| z - surface).collect())
                .column("radius", "length", radii)
                .note(format!(
                    "Where the density is {:.4}; heights are above the wall's surface.",
                    level(&field)
                )),
        );
        let cells = || (0..self.bins[1]).flat_map(|k| (0..self.bins[0]).map(move |j| (k, j)));
        out.push(
            new("contact_angle_field", "Density field of a drop on a wall", Kind::Field)
                .exact("r", "length", cells().map(|(_, j)| (j as f64 + 0.5) * self.width[0]))
                .exact("height", "length", cells().map(|(k, _)| (k as f64 + 0.5) * self.width[1] - surface))
                .column("density", "1/volume", (0..field.len()).map(|k| self.series.mean(k))),
        );
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::StandardNormal;

    fn meter(dimensions: usize, along: Option<usize>, hangs: bool) -> ContactAngle {
        ContactAngle {
            wall: (dimensions - 1, hangs),
            along,
            distance: Distance::given(1.0),
            dimensions,
            bins: [40, 60],
            width: [0.25, 0.25],
            depth: if along.is_some() { 6.0 } else { 1.0 },
            ends: [-3.0, 12.0],
            given: Some(1.0),
            found: None,
            above: 0.5,
            isodensity: None,
            series: Series::with_rows(2400, ROWS),
        }
    }

    /// The results of particles thrown into 30 ellipsoids of density 6 on the wall, `stretch` times as high as wide, with the
    /// middle at the height `rise` and an interface of finite width.
    fn thrown(
        mut m: ContactAngle,
        radius: f64,
        rise: f64,
        stretch: f64,
        rng: &mut StdRng,
    ) -> Vec<Observation> {
        let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let count = 6.0 * if m.flat() { m.depth * 2.0 * 9.0 * 12.0 } else { 18.0 * 18.0 * 12.0 };
        for _ in 0..30 {
            let mut places = Vec::new();
            for _ in 0..count as usize {
                let x = uniform(-9.0, 9.0);
                let y = if m.flat() { 0.0 } else { uniform(-9.0, 9.0) };
                let z = uniform(0.0, 12.0);
                let away = (x * x + y * y + ((z - rise) / stretch).powi(2)).sqrt() + uniform(-0.3, 0.3);
                if away < radius {
                    let height = if m.wall.1 { m.ends[1] - (z + 1.0) } else { m.ends[0] + (z + 1.0) };
                    places.push([x.hypot(y), m.height(height)]);
                }
            }
            let field = m.field(places.into_iter());
            assert!(m.series.push(&field));
        }
        m.finish()
    }

    /// Caps of known angles, round, on a wall below and above, as ridges and in two dimensions. Both angles are right within 1.5 degrees, the effect of bins
    /// a twentieth of the radius wide, and four errors.
    #[test]
    fn caps_of_known_angles() {
        let mut rng = StdRng::seed_from_u64(7);
        for (dimensions, along, hangs) in
            [(3, None, true), (3, Some(1), true), (2, None, true), (3, None, false)]
        {
            for angle in [40.0f64, 60.0, 90.0, 120.0, 150.0] {
                let radius = if angle < 60.0 { 7.0 } else { 5.0 };
                let rise = -radius * angle.to_radians().cos();
                let out = thrown(meter(dimensions, along, hangs), radius, rise, 1.0, &mut rng);
                for name in ["angle", "contour"] {
                    let Measured { value, error } = out[0].scalar(name).unwrap();
                    // Few particles and few rows do not determine a tangent, as its error says.
                    let most = if name == "angle" { 3.0 } else { 30.0 };
                    assert!(
                        (value - angle).abs() < 1.5 + 4.0 * error && error > 0.0 && error < most,
                        "{dimensions} {along:?} {hangs}: {angle} {name} {value} {error}"
                    );
                }
                assert!((out[0].scalar("radius").unwrap().value / radius - 1.0).abs() < 0.04);
                assert!((out[0].scalar("height").unwrap().value - radius - rise).abs() < 0.15);
            }
        }
    }
    /// A drop that its weight has flattened: the tangent has the angle of the ellipsoid, the circle has not.
    #[test]
    fn a_flat_drop_has_the_angle_of_its_tangent() {
        let (radius, rise, stretch) = (6.0f64, 2.0f64, 0.7);
        // r² = R² − (z − c)²/s², so that r dr/dz = c/s² at the wall.
        let base = (radius * radius - (rise / stretch).powi(2)).sqrt();
        let angle = 1.0f64.atan2(-rise / stretch.powi(2) / base).to_degrees();
        let out = thrown(meter(3, None, true), radius, rise, stretch, &mut StdRng::seed_from_u64(8));
        let [circle, tangent] = ["angle", "contour"].map(|name| out[0].scalar(name).unwrap());
        assert!((tangent.value - angle).abs() < 1.5 + 4.0 * tangent.error, "{angle} {tangent:?}");
        assert!(tangent.error < 2.0, "{tangent:?}");
        assert!((circle.value - angle).abs() > 5.0, "{angle} {circle:?}");
    }

    /// Two-dimensional caps whose middle moves up and down slowly, with a correlation time of a fortieth of the run: 200 runs, so that
    /// spread over error is known to 5 %; for true ratios of 1 it is outside by chance for one set of seeds in 300.
    #[test]
    fn errors_of_slow_caps_are_their_spread() {
        let mut rng = StdRng::seed_from_u64(9);
        let (runs, frames, decay) = (200, 320, (-1.0f64 / 8.0).exp());
        let found: Vec<Vec<Measured>> = (0..runs)
            .map(|_| {
                let mut m = ContactAngle { bins: [18, 24], width: [0.5, 0.5], ..meter(2, None, false) };
                m.series = Series::with_rows(18 * 24, ROWS);
                let mut slow = 0.0;
                for _ in 0..frames {
                    slow = decay * slow + (1.0 - decay * decay).sqrt() * rng.sample::<f64, _>(StandardNormal);
                    let rise = 0.5 + 0.4 * slow;
                    let places: Vec<[f64; 2]> = (0..300)
                        .map(|_| [9.0 * rng.random::<f64>(), 12.0 * rng.random::<f64>()])
                        .filter(|[x, z]| x.hypot(*z - rise) < 5.0)
                        .map(|[x, z]| [x, z + 1.0])
                        .collect();
                    let field = m.field(places.into_iter());
                    assert!(m.series.push(&field));
                }
                let out = m.finish();
                ["angle", "radius", "height"].map(|name| out[0].scalar(name).unwrap()).to_vec()
            })
            .collect();
        for k in 0..3 {
            let count = runs as f64;
            let mean = found.iter().map(|m| m[k].value).sum::<f64>() / count;
            let spread = found.iter().map(|m| (m[k].value - mean).powi(2)).sum::<f64>() / (count - 1.0);
            let ratio = (spread / (found.iter().map(|m| m[k].error.powi(2)).sum::<f64>() / count)).sqrt();
            assert!((0.85..1.15).contains(&ratio), "{k}: {ratio}");
        }
    }
}
