use super::msd::Clock;
use super::*;
use std::collections::VecDeque;

/// The number of rows of correlation functions that are kept for error bars.
const ROWS: usize = 128;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Viscosity {
    dimensions: usize,
    length: usize,
    volume: f64,
    clock: Clock,
    /// The latest traceless stresses: xx, yy, zz, xy, xz, yz.
    recent: VecDeque<[f64; 6]>,
    /// The correlation at every lag, then the kinetic temperature.
    series: Series,
}

impl Viscosity {
    fn new(dimensions: usize, length: usize, volume: f64) -> Viscosity {
        let series = Series::with_rows(length + 2, ROWS);
        Viscosity { dimensions, length, volume, clock: Clock::default(), recent: VecDeque::new(), series }
    }

    fn record(&mut self, time: f64, pressure: [f64; 6], temperature: f64) -> bool {
        if !(pressure.iter().all(|p| p.is_finite()) && temperature.is_finite()) {
            return false;
        }
        let d = self.dimensions;
        let mean = pressure[..d].iter().sum::<f64>() / d as f64;
        let mut stress = pressure;
        stress[..d].iter_mut().for_each(|p| *p -= mean);
        self.clock.tick(time);
        self.recent.push_back(stress);
        if self.recent.len() <= self.length {
            return true;
        }
        // P:P is `shears` times the mean square of one off-diagonal component.
        let shears = ((d - 1) * (d + 2)) as f64;
        let first = self.recent.front().copied().unwrap_or_default();
        let mut row: Vec<f64> = self.recent.iter().map(|p| contraction(&first, p, d) / shears).collect();
        row.push(temperature);
        self.recent.pop_front();
        self.series.push(&row)
    }

    /// `∫₀^t C` by the trapezoid rule, without the factor V/kT.
    fn integral(row: &[f64], lag: usize, dt: f64) -> f64 {
        if lag == 0 { 0.0 } else { dt * (0.5 * (row[0] + row[lag]) + row[1..lag].iter().sum::<f64>()) }
    }
}

fn contraction(a: &[f64; 6], b: &[f64; 6], dimensions: usize) -> f64 {
    match dimensions {
        2 => a[0] * b[0] + a[1] * b[1] + 2.0 * a[3] * b[3],
        _ => {
            let diagonal = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            diagonal + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
        }
    }
}

impl Meter for Viscosity {
    const TABLE: Table = Table {
        path: "viscosity",
        title: "shear viscosity (Green–Kubo)",
        about: "η(t) = V/kT ∫₀ᵗ C(t′) dt′ with the autocorrelation C of the shear stress of all forces, drag and noise \
                included, averaged over all shears: C = ⟨P:P(t)⟩/((d − 1)(d + 2)) of the traceless tensor. Sampled \
                at every step and summed by the trapezoid rule, this is Einstein and Helfand's slope of the square \
                of the momentum carried, to which the noise of a step, uncorrelated with any other, adds half its \
                square: the instantaneous viscosity of drag and noise (Ernst and Brito, Europhys. Lett. 73, 183 \
                (2006)). kT is the mean kinetic one. `viscosity` is η at the longest time, which must be past the \
                decay of C: look at the curve `stress_correlation`, with C in `correlation` and η(t) in `viscosity`. \
                For a fluid at rest in a periodic box, without interfaces.",
        keys: keys! {
            "length": ValueKind::Whole(2, 100_000), Need::Default("400"),
                "The longest time, in steps. A checkpoint holds 128 times as many numbers."
                => "100";
        },
        ..PLAIN
    };
    const EVERY: Option<u64> = Some(1);
    const EVERY_STEP: bool = true;

    const NEEDS: Want = Want { virial: true, ..Want::FORCES };

    const OF_MOTION: bool = true;
    const OF_LIQUIDS: bool = true;

    fn read(options: &Options) -> Result<Viscosity, FileError> {
        let place = options.place;
        let dimensions = place.fluid.dimensions;
        options.require_periodic()?;
        let length = options.count("length")?;
        Ok(Viscosity::new(dimensions, length, place.domain.volume(dimensions)))
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        self.record(frame.view.time, view.pressure, view.temperature)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn restart(&mut self) {
        self.clock = Clock::default();
        self.recent.clear();
    }

    fn finish(&self) -> Vec<Observation> {
        let dt = self.clock.spacing();
        let kt = self.series.mean(self.length + 1).value;
        let viscosity =
            |lag: usize| self.series.linear(|row| Self::integral(row, lag, dt)).times(self.volume / kt);
        let lags = if self.series.is_empty() { 0 } else { self.length + 1 };
        let last = if lags == 0 { Measured::NONE } else { viscosity(self.length) };
        let times = (0..lags).map(|k| k as f64 * dt).collect();
        let title = "Stress autocorrelation and its integral";
        let curve = Observation::new("stress_correlation", title, Kind::Curve, &self.series)
            .against("time", "time", times)
            .column("correlation", "(energy/volume)^2", (0..lags).map(|k| self.series.mean(k)))
            .column("viscosity", "mass/(r_c time)", (0..lags).map(viscosity));
        let scalar = Observation::new("viscosity", "Shear viscosity", Kind::Scalar, &self.series)
            .column("viscosity", "mass/(r_c time)", [last])
            .column("kT", "energy", [self.series.mean(self.length + 1)]);
        vec![scalar, curve]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::StdRng};
    use rand_distr::{Distribution, StandardNormal};

    /// Both ends of the trapezoid rule have half the weight.
    #[test]
    fn ends_of_integrals_have_half_the_weight() {
        let row = [1.0, 2.0, 3.0, 4.0, 9.0];
        for (lag, expected) in [(0, 0.0), (1, 1.5), (2, 4.0), (3, 7.5)] {
            assert_eq!(Viscosity::integral(&row, lag, 0.5), 0.5 * expected, "{lag}");
        }
    }

    /// Isotropic traceless stresses with the correlation s² a^t plus white noise of variance q² give
    /// η = V dt/kT [½ (s² + q²) + s² a/(1 − a)], less the tail beyond the longest lag. The result must agree within five
    /// errors, one false alarm in 10^6; the seed is fixed.
    #[test]
    fn synthetic_stresses() {
        for dimensions in [2, 3] {
            let mut rng = StdRng::seed_from_u64(33);
            let (a, s, q, dt, volume, kt) = (0.8f64, 0.7, 0.5, 0.02, 40.0, 1.5);
            let mut m = Viscosity::new(dimensions, 40, volume);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let mut draw = || -> [f64; 6] {
                // A random symmetric matrix with off-diagonal variance 1 and diagonal variance 2 is isotropic.
                let mut p: [f64; 6] =
                    std::array::from_fn(|k| if k < 3 { 2f64.sqrt() } else { 1.0 } * normal());
                if dimensions == 2 {
                    (p[2], p[4], p[5]) = (0.0, 0.0, 0.0);
                }
                p
            };
            let mut slow = draw();
            for k in 0..60_000 {
                let (step, noise) = (draw(), draw());
                let pressure: [f64; 6] = std::array::from_fn(|c| {
                    slow[c] = a * slow[c] + (1.0 - a * a).sqrt() * step[c];
                    s * slow[c] + q * noise[c] + if c < dimensions { 12.0 } else { 0.0 }
                });
                assert!(m.record(dt * f64::from(k), pressure, kt));
            }
            let out = m.finish();
            let eta = out[0].scalar("viscosity").unwrap();
            let truth = volume * dt / kt * (0.5 * (s * s + q * q) + s * s * a / (1.0 - a));
            assert!(
                (eta.value - truth).abs() < 5.0 * eta.error && eta.error < 0.05 * truth,
                "{eta:?} {truth}"
            );
            let c = out[1].get("correlation").unwrap();
            for lag in 1..40 {
                let truth = s * s * a.powi(lag as i32);
                assert!((c.values[lag] - truth).abs() < 5.0 * c.errors[lag], "{lag}");
            }
            assert!((c.values[0] - s * s - q * q).abs() < 5.0 * c.errors[0]);
            // The factor of the integral has no error of its own.
            let integral = dt * (0.5 * (c.values[0] + c.values[40]) + c.values[1..40].iter().sum::<f64>());
            assert!((eta.value / (volume / kt * integral) - 1.0).abs() < 1e-9, "{eta:?}");
        }
    }
}
