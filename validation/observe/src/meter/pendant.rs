use super::drop::circular_centre;
use super::linked::{DISTANCE, Distance, Linked};
use super::*;
use crate::keys::Key;
use crate::young_laplace::fit;

/// The number of rows of density fields that are kept for error bars.
const ROWS: usize = 256;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pendant {
    axis: usize,
    /// True if the apex is at the low end of the axis.
    hangs_down: bool,
    distance: Distance,
    dimensions: usize,
    /// The numbers of bins in the radial direction and along the axis.
    bins: [usize; 2],
    /// The widths of the bins in the radial direction and along the axis.
    width: [f64; 2],
    /// The lower end of the box along the axis.
    origin: f64,
    /// The density on the isosurface.
    isodensity: Option<f64>,
    /// The fraction of the drop's height that is fitted, from the apex.
    part: f64,
    /// The weight of a particle.
    weight: Option<f64>,
    series: Series,
}

/// The density of the liquid in a field: half of the particles are in denser bins. Unlike the mean of a chosen region this
/// does not depend on the shape, and unlike a maximum it does not follow the noise.
pub(super) fn median_density(field: &[f64], volume: impl Fn(usize) -> f64) -> f64 {
    let particles = |k: usize| field[k] * volume(k);
    let mut cells: Vec<usize> = (0..field.len()).collect();
    cells.sort_by(|a, b| field[*b].total_cmp(&field[*a]).then(a.cmp(b)));
    let mut left = 0.5 * (0..field.len()).map(particles).sum::<f64>();
    let median = cells.into_iter().find(|k| {
        left -= particles(*k);
        left <= 0.0
    });
    median.map_or(f64::NAN, |k| field[k])
}

impl Pendant {
    fn volume(&self, outwards: usize) -> f64 {
        let (a, b) = (outwards as f64 * self.width[0], (outwards + 1) as f64 * self.width[0]);
        let across = match self.dimensions {
            2 => 2.0 * (b - a),
            _ => std::f64::consts::PI * (b * b - a * a),
        };
        across * self.width[1]
    }

    fn liquid(&self, field: &[f64]) -> f64 {
        median_density(field, |k| self.volume(k % self.bins[0]))
    }

    /// The points (r, z) of the isosurface, with z measured along the axis from the origin of the box, up from the apex.
    fn surface(&self, field: &[f64], level: f64) -> Vec<(f64, f64)> {
        let mut points = Vec::new();
        for k in 0..self.bins[1] {
            let row = &field[k * self.bins[0]..(k + 1) * self.bins[0]];
            // The search goes inwards to the first bin of liquid. Noise of the vapour can end it early.
            let Some(j) = row.iter().rposition(|d| *d >= level) else { continue };
            if j + 1 == self.bins[0] {
                continue;
            }
            let (a, b) = (row[j], row[j + 1]);
            let r = (j as f64 + 0.5 + (a - level) / (a - b)) * self.width[0];
            let z = (k as f64 + 0.5) * self.width[1];
            points.push((r, if self.hangs_down { z } else { self.bins[1] as f64 * self.width[1] - z }));
        }
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        points
    }

    /// The Bond number, apex radius, apex, Bo/R₀², liquid density, residual, and the tension if the weight is known.
    fn shape(&self, field: &[f64]) -> Option<Vec<f64>> {
        let liquid = self.liquid(field);
        let points = self.surface(field, self.isodensity.unwrap_or(0.5 * liquid));
        let (low, high) = (points.first()?.1, points.last()?.1);
        let fitted: Vec<(f64, f64)> =
            points.into_iter().filter(|p| p.1 <= low + self.part * (high - low)).collect();
        let found = fit(&fitted, self.dimensions)?;
        let top = self.bins[1] as f64 * self.width[1];
        let apex = self.origin + if self.hangs_down { found.apex } else { top - found.apex };
        let capillary = found.bond / (found.radius * found.radius);
        let tension = self.weight.map(|w| liquid * w / capillary);
        let mut all = vec![found.bond, found.radius, apex, capillary, liquid, found.residual];
        all.extend(tension);
        all.iter().all(|x| x.is_finite()).then_some(all)
    }
}

/// The ends of the axis, and whether each is the low one.
const APICES: [(&str, bool); 2] = [("low", true), ("high", false)];

const ALONG: Key = Key {
    about: "The vertical, along an edge of the box at right angles to the others.",
    need: Need::Default("the last direction"),
    ..AXIS
};

impl Meter for Pendant {
    const TABLE: Table = Table {
        path: "pendant",
        title: "isosurface and Bond number of a hanging drop",
        about: "Density of the largest cluster's surroundings against the distance from the vertical through its centre \
                of mass and the height (`pendant_field`: columns `r`, `z`, `density`), the surface where it is \
                `isodensity` (`pendant_profile`: `radius` against the height), and the solution of Young and Laplace's \
                equation that fits it best (`pendant`): `bond` = Δρ g R₀²/γ with the radius of curvature `apex_radius` \
                R₀ at the apex, `apex` its height, `capillary` = Bo/R₀² = Δρ g/γ for any other length, `liquid` density (the median over the particles), \
                `residual` the root mean square distance of the surface from the fit, and with `weight` the `tension` \
                ρ_L g m/capillary. The part of the surface next to the support is left out of the fit. Jackknife \
                errors.",
        keys: keys! {
            use ALONG;
            "apex": ValueKind::Choice(|| names(&APICES)), Need::Default("`\"low\"`"),
                "At which end of the axis the drop ends; it hangs from the other."
                => "\"high\"";
            use DISTANCE;
            "bins": ValueKind::Wholes(4, 2000), Need::Default("as many as make them 0.25 wide, or a little less"),
                "Bins outwards, up to half the box, and along the axis."
                => "[20, 40]";
            "isodensity": ValueKind::Positive, Need::Default("half the density of the liquid"),
                "The density of the surface."
                => "3.0";
            "part": ValueKind::Within(0.1, 1.0), Need::Default("0.8"),
                "The part of the height of the surface, from the apex, that is fitted."
                => "0.7";
            "weight": ValueKind::Positive, Need::Default("none"),
                "The force g m on a particle along the axis."
                => "0.02";
        },
        ..PLAIN
    };

    const OF_LIQUIDS: bool = true;
    const PAIRS: Pairs = Pairs::List;

    fn read(options: &Options) -> Result<Pendant, FileError> {
        let (domain, d) = (options.place.domain, options.place.fluid.dimensions);
        let axis = options.axis("axis")?.unwrap_or(d - 1);
        options.require_right_angles("axis")?;
        let lengths = domain.lengths();
        let outwards = (0..d).filter(|k| *k != axis).map(|k| 0.5 * lengths[k]).fold(f64::INFINITY, f64::min);
        let along = lengths[axis];
        let bins = options.bins_of_plane([outwards, along])?;
        let hangs_down = options.choice("apex", &APICES)?.unwrap_or(true);
        Ok(Pendant {
            axis,
            hangs_down,
            distance: Distance::read(options)?,
            dimensions: d,
            bins,
            width: [outwards / bins[0] as f64, along / bins[1] as f64],
            origin: domain.origin()[axis],
            isodensity: options.positive("isodensity")?,
            part: options.number("part")?,
            weight: options.positive("weight")?,
            series: Series::with_rows(bins[0] * bins[1], ROWS),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let (x, domain) = (view.x, view.domain);
        let distance = self.distance.at(x, domain, self.dimensions, |_| true);
        let linked = Linked::of(frame, distance, |_| true);
        let Some(largest) = linked.largest() else { return false };
        let Some(centre) = circular_centre(x, domain, |k| linked.is_in(k, largest)) else { return false };
        let mut counts = vec![0.0; self.bins[0] * self.bins[1]];
        for x in x {
            let away = domain.minimum_image(*x, centre);
            let r = (0..self.dimensions)
                .filter(|c| *c != self.axis)
                .map(|c| away[c] * away[c])
                .sum::<f64>()
                .sqrt();
            let (j, z) = ((r / self.width[0]) as usize, (x[self.axis] - self.origin) / self.width[1]);
            if j < self.bins[0] && z >= 0.0 {
                let k = (z as usize).min(self.bins[1] - 1);
                counts[k * self.bins[0] + j] += 1.0 / self.volume(j);
            }
        }
        self.series.push(&counts)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn restart(&mut self) {
        self.distance.forget();
    }

    fn finish(&self) -> Vec<Observation> {
        let new = |name, title, kind| Observation::new(name, title, kind, &self.series);
        let found = self.series.jackknife(|field| self.shape(field));
        let at = |k: usize| [found.get(k).copied().unwrap_or(Measured::NONE)];
        let mut scalar = new("pendant", "Hanging drop", Kind::Scalar)
            .column("bond", "1", at(0))
            .column("apex_radius", "length", at(1))
            .column("apex", "length", at(2))
            .column("capillary", "1/r_c^2", at(3))
            .column("liquid", "1/volume", at(4))
            .column("residual", "length", at(5))
            .note(if found.is_empty() { "No drop fits the surface." } else { "" });
        if self.weight.is_some() {
            scalar = scalar.column("tension", "energy/area", at(6));
        }
        let mut out = vec![scalar];
        if self.series.is_empty() {
            return out;
        }
        let field = self.series.means();
        let level = self.isodensity.unwrap_or(0.5 * self.liquid(&field));
        // The radius of the mean surface at each height. Its error comes from the jackknife.
        let top = self.bins[1] as f64 * self.width[1];
        let heights: Vec<f64> = self.surface(&field, level).iter().map(|p| p.1).collect();
        let radii = self.series.jackknife(|field| {
            let level = self.isodensity.unwrap_or(0.5 * self.liquid(field));
            let points = self.surface(field, level);
            let near = |z: f64| points.iter().find(|p| (p.1 - z).abs() < 0.5 * self.width[1]);
            Some(heights.iter().map(|z| near(*z).map_or(f64::NAN, |p| p.0)).collect())
        });
        let mut surface: Vec<(f64, Measured)> = heights
            .iter()
            .map(|z| self.origin + if self.hangs_down { *z } else { top - z })
            .zip(radii)
            .collect();
        surface.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (z, radii): (Vec<f64>, Vec<Measured>) = surface.into_iter().unzip();
        out.push(
            new("pendant_profile", "Surface of a hanging drop", Kind::Profile)
                .against("height", "length", z)
                .column("radius", "length", radii)
                .note(format!("The surface where the density is {level:.4}.")),
        );
        let cells = || (0..self.bins[1]).flat_map(|k| (0..self.bins[0]).map(move |j| (k, j)));
        out.push(
            new("pendant_field", "Density field of a hanging drop", Kind::Field)
                .exact("r", "length", cells().map(|(_, j)| (j as f64 + 0.5) * self.width[0]))
                .exact("z", "length", cells().map(|(k, _)| self.origin + (k as f64 + 0.5) * self.width[1]))
                .column("density", "1/volume", (0..field.len()).map(|k| self.series.mean(k))),
        );
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::young_laplace::contour;

    /// A drop of a known shape whose density is smoothed over a few bins. Bond number, apex and tension agree within 0.7 %, the
    /// resolution of bins of a twentieth of the radius, for both orientations. Its neck is wider than such a drop, as beside a
    /// support, in the fifth of the height that is left out of the fit.
    #[test]
    fn a_constructed_drop() {
        for hangs_down in [true, false] {
            let mut m = Pendant {
                axis: 2,
                hangs_down,
                distance: Distance::given(1.0),
                dimensions: 3,
                bins: [40, 80],
                width: [0.25, 0.25],
                origin: -3.0,
                isodensity: None,
                part: 0.8,
                weight: Some(0.02),
                series: Series::with_rows(3200, ROWS),
            };
            let (bond, radius, apex) = (0.3, 5.0, 4.0);
            let shape = contour(bond, 3, 2.6);
            let neck = shape.iter().fold(0.0, |top: f64, p| top.max(p.z)) - 0.15 * 2.6;
            let mut field = vec![0.0; 3200];
            for k in 0..80 {
                let z = (k as f64 + 0.5) * 0.25;
                let z = if hangs_down { z } else { 20.0 - z };
                let up = (z - apex) / radius;
                let here = shape.iter().find(|p| p.z >= up).filter(|_| up > 0.0);
                for j in 0..40 {
                    let r = (j as f64 + 0.5) * 0.25;
                    let wider = if up > neck { 1.0 } else { 0.0 };
                    let edge = here.map_or(-1.0, |p| p.r * radius + wider);
                    field[k * 40 + j] = 3.0 - 3.0 * ((r - edge) / 0.3).tanh();
                }
            }
            for _ in 0..5 {
                assert!(m.series.push(&field));
            }
            let out = m.finish();
            let get = |name: &str| out[0].scalar(name).unwrap().value;
            assert!((get("bond") / bond - 1.0).abs() < 0.015, "{} {:?}", get("bond"), out[0]);
            let height = if hangs_down { apex - 3.0 } else { 20.0 - apex - 3.0 };
            assert!((get("apex_radius") / radius - 1.0).abs() < 0.005 && (get("apex") - height).abs() < 0.05);
            let tension = 6.0 * 0.02 / (bond / radius.powi(2));
            assert!((get("tension") / tension - 1.0).abs() < 0.015, "{} {tension}", get("tension"));
            let profile = &out[1];
            let radii = &profile.get("radius").unwrap().values;
            assert!(radii.len() > 40);
            // Heights are those of the box, whichever way the drop points.
            for (height, r) in profile.x.as_ref().unwrap().values.iter().zip(radii) {
                let z = height + 3.0;
                let up = (if hangs_down { z } else { 20.0 - z } - apex) / radius;
                let there = shape.iter().find(|p| p.z >= up).filter(|_| up > 0.1 && up < neck);
                assert!(there.is_none_or(|p| (p.r * radius - r).abs() < 0.2), "{hangs_down} {height}: {r}");
            }
            assert_eq!(out[2].columns[2].values.len(), 3200);
        }
    }
}
