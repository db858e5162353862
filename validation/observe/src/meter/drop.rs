use super::linked::{DISTANCE, Distance, Linked};
use super::rdf::shell_volume;
use super::spheres::{Around, Seen, Spheres};
use super::*;
use crate::profile::flank_interface;
use std::f64::consts::TAU;

/// The numbers in a shell: particles, then normal and tangential pressures of momenta and of forces.
const WIDTH: usize = 5;

/// The number of innermost shells that are averaged before a fit, because they hold few particles.
const CORE: usize = 5;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Drop {
    distance: Distance,
    range: f64,
    bins: usize,
    dimensions: usize,
    /// The sums in all shells.
    shells: Series,
    /// Time, particles in the drop, square of its radius of gyration, and 1 if the drop meets its own image.
    size: Series,
}

/// The centre of some particles of a periodic box, as the circular mean of each fractional coordinate.
pub(super) fn circular_centre(
    x: &[[f64; 3]],
    domain: &PeriodicBox,
    members: impl Fn(usize) -> bool,
) -> Option<[f64; 3]> {
    let mut sums = [[0.0f64; 2]; 3];
    let (mut plain, mut count) = ([0.0; 3], 0.0);
    for (_, x) in x.iter().enumerate().filter(|(k, _)| members(*k)) {
        let s = domain.fraction(*x);
        count += 1.0;
        for c in 0..3 {
            let (sine, cosine) = (TAU * s[c]).sin_cos();
            sums[c] = [sums[c][0] + sine, sums[c][1] + cosine];
            plain[c] += s[c];
        }
    }
    let periodic = domain.periodic();
    let fraction =
        std::array::from_fn(
            |c| {
                if periodic[c] { sums[c][0].atan2(sums[c][1]) / TAU } else { plain[c] / count }
            },
        );
    (count > 0.0).then(|| domain.point(fraction))
}

/// Properties of a drop from its mean profile.
struct Shape {
    radius: f64,
    width: f64,
    liquid: f64,
    vapour: f64,
    inside: f64,
    outside: f64,
}

impl Drop {
    fn thickness(&self) -> f64 {
        self.range / self.bins as f64
    }

    fn volume(&self, shell: usize) -> f64 {
        shell_volume(self.dimensions, shell as f64 * self.thickness(), (shell + 1) as f64 * self.thickness())
    }

    /// The mean over the shells with middles from `low` to `high`, weighted by volume.
    fn mean(&self, low: f64, high: f64, value: impl Fn(usize) -> f64) -> f64 {
        let (mut sum, mut volume) = (0.0, 0.0);
        for k in 0..self.bins {
            let middle = (k as f64 + 0.5) * self.thickness();
            if (low..=high).contains(&middle) {
                sum += self.volume(k) * value(k);
                volume += self.volume(k);
            }
        }
        sum / volume
    }

    fn doubts(&self, no_drop: bool) -> String {
        let mut doubts = Vec::new();
        let percolated = self.size.mean(3).value;
        if percolated > 0.0 {
            let distance = self.distance.value().unwrap_or(f64::NAN);
            doubts.push(format!(
                "In {:.0} % of the samples the largest cluster percolates: it meets its own image through the box, and is not a drop. Give a smaller `distance` than {distance:.3}, or a larger box.",
                100.0 * percolated
            ));
        }
        if no_drop {
            doubts.push("The profile is not that of a drop in vapour.".into());
        }
        doubts.join(" ")
    }

    fn shape(&self, means: &[f64]) -> Option<Shape> {
        let h = self.thickness();
        let density = |k: usize| means[k * WIDTH] / self.volume(k);
        let core = self.mean(0.0, CORE as f64 * h, density);
        let points: Vec<(f64, f64)> = (0..self.bins)
            .map(|k| ((k as f64 + 0.5) * h, if k < CORE { core } else { density(k) }))
            .collect();
        let fit = flank_interface(&points, h)?;
        let rest = (self.dimensions - 1) as f64;
        let pressure = |k: usize| {
            let p = &means[k * WIDTH + 1..(k + 1) * WIDTH];
            (p[0] + p[2] + rest * (p[1] + p[3])) / (1.0 + rest)
        };
        let (inner, outer) = (0.5 * fit.place, fit.place + 2.0 * fit.width);
        let (liquid, vapour) = (self.mean(0.0, inner, density), self.mean(outer, self.range, density));
        // The sphere of liquid in vapour that holds as many particles.
        let volume = |r: f64| shell_volume(self.dimensions, 0.0, r);
        let particles: f64 = (0..self.bins).map(|k| means[k * WIDTH]).sum();
        let share = (particles - vapour * volume(self.range)) / (liquid - vapour) / volume(1.0);
        let shape = Shape {
            radius: share.powf(1.0 / self.dimensions as f64),
            width: fit.width,
            liquid,
            vapour,
            inside: self.mean(0.0, inner, pressure),
            outside: self.mean(outer, self.range, pressure),
        };
        (shape.radius.is_finite() && shape.inside.is_finite() && shape.outside.is_finite()).then_some(shape)
    }
}

impl Meter for Drop {
    const TABLE: Table = Table {
        path: "drop",
        title: "radius and Laplace pressure of a drop",
        about: "The drop is the largest cluster of particles closer than `distance`, its centre the circular mean of \
                them. `drop_profile`: `density`, and the spherical Irving–Kirkwood pressures `normal` P_N(r) and \
                `tangential` P_T(r) of the momentum that the integrator carries, as in `stress_profile`: they balance, \
                dP_N/dr = (d − 1)(P_T − P_N)/r, at any time step. `drop`: `radius` of the sphere of liquid in vapour that holds as many particles \
                (equimolar), `radius_gyration` = √((d + 2)/d ⟨R_g²⟩) of the cluster, `width` of the interface from a \
                tanh fit as for a slab, `liquid` and `vapour` densities, `inside` and `outside` pressures (within \
                half of the radius; beyond radius and two widths), `laplace` their difference, and `tension` = \
                Δp R/(d − 1). Jackknife errors. `distance` is the one that was used. A note says \
                in how many samples the cluster met its own image. `drop_series`: gyration radius and particles of the drop against \
                time.",
        keys: keys! {
            use DISTANCE;
            "range": ValueKind::HalfBox, Need::Default("half the box"),
                "Radius of the largest shell."
                => "2.0";
            "bins": ValueKind::Whole(12, 10_000), Need::Default("as many as make them 0.1 thick, or a little less"),
                "How many shells."
                => "30";
        },
        ..PLAIN
    };

    const FLUX: Recorded = Recorded::Lines;
    const OF_LIQUIDS: bool = true;
    const PAIRS: Pairs = Pairs::List;

    fn read(options: &Options) -> Result<Drop, FileError> {
        let range = options.within_half_box("range")?.unwrap_or(options.half_box());
        let bins = options.bins(range, 0.1)?;
        Ok(Drop {
            distance: Distance::read(options)?,
            range,
            bins,
            dimensions: options.place.fluid.dimensions,
            shells: Series::new(bins * WIDTH),
            size: Series::new(4),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let (x, domain) = (view.x, view.domain);
        let distance = self.distance.at(x, domain, self.dimensions, |_| true);
        let linked = Linked::of(frame, distance, |_| true);
        let Some(largest) = linked.largest() else { return false };
        let member = |k: usize| linked.is_in(k, largest);
        let Some(centre) = circular_centre(x, domain, member) else { return false };
        let mut at: Vec<[f64; 3]> = x.iter().map(|x| domain.minimum_image(*x, centre)).collect();
        if self.dimensions == 2 {
            at.iter_mut().for_each(|x| x[2] = 0.0);
        }
        let count = linked.sizes[largest] as f64;
        let members = || at.iter().enumerate().filter(|(k, _)| member(*k)).map(|(_, x)| x);
        let mean: [f64; 3] = std::array::from_fn(|c| members().map(|x| x[c]).sum::<f64>() / count);
        let squares =
            members().map(|x| (0..3).map(|c| (x[c] - mean[c]).powi(2)).sum::<f64>()).sum::<f64>() / count;
        // Move the origin from the circular mean to the centre of mass of the nearest images of the members.
        at.iter_mut().for_each(|x| (0..3).for_each(|c| x[c] -= mean[c]));

        let rest = (self.dimensions - 1) as f64;
        let mut row = vec![0.0; self.bins * WIDTH];
        for x in &at {
            let r = (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt();
            let shell = (r / self.thickness()) as usize;
            if shell >= self.bins {
                continue;
            }
            row[shell * WIDTH] += 1.0;
        }
        let spheres = Spheres::new(self.bins, self.thickness(), self.dimensions);
        let around = Around::new(domain, centre, mean);
        let carried = frame.sum_lines(spheres.width(), |lines, seen: &mut Seen, sums| {
            spheres.add(&around, lines, seen, sums);
        });
        let Some(carried) = carried else { return false };
        for (carrier, sums) in carried.iter().enumerate() {
            for (shell, [normal, whole]) in spheres.shells(sums).enumerate() {
                let (at, volume) = (shell * WIDTH + 1 + 2 * carrier, self.volume(shell));
                row[at] = normal / volume;
                row[at + 1] = (whole - normal) / rest / volume;
            }
        }
        let percolates = f64::from(u8::from(linked.percolates[largest]));
        self.shells.push(&row) && self.size.push(&[frame.view.time, count, squares, percolates])
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.shells, &mut self.size]
    }

    fn restart(&mut self) {
        self.distance.forget();
    }

    fn finish(&self) -> Vec<Observation> {
        let rest = (self.dimensions - 1) as f64;
        let found = self.shells.jackknife(|means| {
            let s = self.shape(means)?;
            let laplace = s.inside - s.outside;
            let tension = laplace * s.radius / rest;
            Some(vec![s.radius, s.width, s.liquid, s.vapour, s.inside, s.outside, laplace, tension])
        });
        let at = |k: usize| [found.get(k).copied().unwrap_or(Measured::NONE)];
        let d = self.dimensions as f64;
        let squares = self.size.mean(2);
        let radius = ((d + 2.0) / d * squares.value).sqrt();
        let gyration = Measured { value: radius, error: 0.5 * radius * squares.error / squares.value };
        let scalar = Observation::new("drop", "Drop", Kind::Scalar, &self.shells)
            .column("radius", "length", at(0))
            .column("radius_gyration", "length", [gyration])
            .column("width", "length", at(1))
            .column("liquid", "1/volume", at(2))
            .column("vapour", "1/volume", at(3))
            .column("inside", "energy/volume", at(4))
            .column("outside", "energy/volume", at(5))
            .column("laplace", "energy/volume", at(6))
            .column("tension", "energy/area", at(7))
            .column("particles", "1", [self.size.mean(1)])
            .column(
                "distance",
                "length",
                self.distance.value().map(|value| Measured { value, error: f64::NAN }),
            )
            .note(self.doubts(found.is_empty()));
        let middles = (0..self.bins).map(|k| (k as f64 + 0.5) * self.thickness()).collect();
        let column = |f: &dyn Fn(&[f64], f64) -> f64| -> Vec<Measured> {
            (0..self.bins)
                .map(|k| self.shells.linear(|row| f(&row[k * WIDTH..(k + 1) * WIDTH], self.volume(k))))
                .collect()
        };
        let profile =
            Observation::new("drop_profile", "Radial profile of a drop", Kind::Profile, &self.shells)
                .against("r", "length", middles)
                .column("density", "1/volume", column(&|p, volume| p[0] / volume))
                .column("normal", "energy/volume", column(&|p, _| p[1] + p[3]))
                .column("tangential", "energy/volume", column(&|p, _| p[2] + p[4]));
        let radius = self.size.channel(2).into_iter().map(|r| ((d + 2.0) / d * r).sqrt());
        let unknown = |value| Measured { value, error: f64::NAN };
        let series = Observation::new("drop_series", "Size of the drop", Kind::Series, &self.size)
            .against("time", "time", self.size.channel(0))
            .column("radius_gyration", "length", radius.map(unknown))
            .column("particles", "1", self.size.channel(1).into_iter().map(unknown));
        vec![scalar, profile, series]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drop of known profile and pressures gives all its known properties.
    #[test]
    fn a_constructed_drop() {
        for dimensions in [2, 3] {
            let mut drop = Drop {
                distance: Distance::given(1.0),
                range: 8.0,
                bins: 80,
                dimensions,
                shells: Series::new(80 * WIDTH),
                size: Series::new(4),
            };
            let (radius, d) = (4.0, 0.3);
            let rho = |r: f64| 3.1 - 2.9 * ((r - radius) / d).tanh();
            let mut row = vec![0.0; 80 * WIDTH];
            for k in 0..80 {
                let r = (k as f64 + 0.5) * 0.1;
                row[k * WIDTH] = rho(r) * drop.volume(k);
                // The pressure is isotropic, 2.5 inside and 0.5 outside, in two contributions.
                let p = 1.5 - ((r - radius) / d).tanh();
                row[k * WIDTH + 1..(k + 1) * WIDTH].copy_from_slice(&[0.2, 0.2, p - 0.2, p - 0.2]);
            }
            for k in 0..10 {
                assert!(drop.shells.push(&row) && drop.size.push(&[f64::from(k), 100.0, 9.0, 0.0]));
            }
            // No shape without a radius, or without a pressure on either side.
            assert!(drop.shape(&row).is_some());
            for shells in [0..20, 60..80] {
                let mut unknown = row.clone();
                shells.for_each(|k| unknown[k * WIDTH + 3] = f64::NAN);
                assert!(drop.shape(&unknown).is_none());
            }
            // A square that is known to 2 % is that of a radius that is known to 1 %.
            let mut shaking = drop.clone();
            let squares: Vec<f64> = (0..500).map(|k| 9.0 * (1.0 + 0.3 * f64::from(k * k).sin())).collect();
            shaking.size = Series::new(4);
            squares.iter().for_each(|square| assert!(shaking.size.push(&[0.0, 100.0, *square, 0.0])));
            let (square, found) =
                (Measured::mean(&squares), shaking.finish()[0].scalar("radius_gyration").unwrap());
            assert!(
                (found.error / found.value - 0.5 * square.error / square.value).abs() < 1e-9,
                "{found:?}"
            );
            let out = drop.finish();
            let get = |name: &str| out[0].scalar(name).unwrap().value;
            // The equimolar radius of a tanh profile is R up to terms of second order in d/R.
            let rest = (dimensions - 1) as f64;
            let second = rest * std::f64::consts::PI.powi(2) / 24.0 * d * d / radius;
            assert!((get("radius") - radius - second).abs() < 3e-3, "{}", get("radius"));
            assert!((get("width") - 0.6).abs() < 1e-2 && (get("liquid") - 6.0).abs() < 1e-4);
            assert!((get("laplace") - 2.0).abs() < 1e-3 && (get("vapour") - 0.2).abs() < 1e-3);
            assert!((get("tension") - 2.0 * get("radius") / rest).abs() < 1e-2);
            let expected = 3.0 * ((dimensions as f64 + 2.0) / dimensions as f64).sqrt();
            assert!((get("radius_gyration") - expected).abs() < 1e-12);
            let along = &out[2].get("radius_gyration").unwrap().values;
            assert!(along.len() == 10 && along.iter().all(|r| (r - expected).abs() < 1e-12), "{along:?}");
            assert_eq!(out[0].note, "");
            for k in 10..20 {
                assert!(drop.shells.push(&row) && drop.size.push(&[f64::from(k), 100.0, 9.0, 1.0]));
            }
            let note = &drop.finish()[0].note;
            assert!(note.contains("In 50 % of the samples the largest cluster percolates"), "{note}");
        }
    }
}
