use super::across::Across;
use super::*;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Poiseuille {
    across: Across,
    flow: usize,
    acceleration: f64,
    /// Mass and momentum in each bin.
    pub series: Series,
}

/// The mean of z (D − z) over the bin from `a` to `b`, negated in the upper half, in a box from 0 to 2 D; `half` is D.
fn parabola(a: f64, b: f64, half: f64) -> f64 {
    // The integral from 0 of the parabola that is antisymmetric about D.
    let integral = |z: f64| {
        let of = |z: f64| half * z * z / 2.0 - z * z * z / 3.0;
        if z <= half { of(z) } else { of(half) - of(z - half) }
    };
    (integral(b) - integral(a)) / (b - a)
}

impl Poiseuille {
    pub fn parabolas(&self) -> Vec<f64> {
        let h = self.across.bin_height();
        (0..self.across.bins)
            .map(|k| parabola(k as f64 * h, (k + 1) as f64 * h, 0.5 * self.across.height))
            .collect()
    }

    /// The viscosity, and the root mean square deviation from the parabola over its maximum.
    fn fit(&self, means: &[f64]) -> Option<Vec<f64>> {
        let shape = self.parabolas();
        let (mut vf, mut ff) = (0.0, 0.0);
        let velocity = |k: usize| means[2 * k + 1] / means[2 * k];
        for (k, f) in shape.iter().enumerate().filter(|(k, _)| means[2 * k] > 0.0) {
            vf += velocity(k) * f;
            ff += f * f;
        }
        let steepness = vf / ff;
        let mass: f64 = (0..shape.len()).map(|k| means[2 * k]).sum();
        let viscosity = mass / self.across.volume * self.acceleration / (2.0 * steepness);
        let filled = || (0..shape.len()).filter(|k| means[2 * k] > 0.0);
        let squares: f64 = filled().map(|k| (velocity(k) - steepness * shape[k]).powi(2)).sum();
        let top = steepness * self.across.height * self.across.height / 16.0;
        let deviation = (squares / filled().count() as f64).sqrt() / top.abs();
        (viscosity.is_finite() && deviation.is_finite()).then_some(vec![viscosity, deviation, steepness])
    }
}

impl Meter for Poiseuille {
    const TABLE: Table = Table {
        path: "poiseuille",
        title: "shear viscosity (periodic Poiseuille flow)",
        about: "For a scene with a body force along `flow` that is reversed in the upper half of the box along `axis` \
                (Backer et al., J. Chem. Phys. 122, 154503 (2005)): v = ρ a z (D − z)/2η in each half of width D, \
                fitted to the mean velocity in bins by least squares. `viscosity`, and `deviation`, the root mean \
                square distance of the velocities from the fit in units of the highest: noise, or a flow that is not \
                steady or not Newtonian. `poiseuille_profile`: `velocity` and `fit`. Jackknife errors. Skip the time \
                ρD²/(π²η), several times over, in which the flow sets in.",
        keys: keys! {
            "axis": ValueKind::Choice(|| names(&AXES)), Need::Default("the direction in which the body force of the scene is reversed"),
                "The direction across the flow."
                => "\"z\"";
            "flow": ValueKind::Choice(|| names(&AXES)), Need::Default("the direction of the body force of the scene"),
                "The direction of the flow."
                => "\"x\"";
            "acceleration": ValueKind::Positive, Need::Default("that of the body force of the scene"),
                "Force over mass in the lower half of the box."
                => "0.05";
            then BINS;
        },
        ..PLAIN
    };

    const OF_MOTION: bool = true;
    const OF_LIQUIDS: bool = true;

    fn read(options: &Options) -> Result<Poiseuille, FileError> {
        let drive = options.place.drive;
        let missing = |key: &str| {
            options.error(
                key,
                format!("{key} is missing: the scene has no body force that is reversed in half of the box"),
            )
        };
        let across = Across::read_along(options, options.axis("axis")?.or(drive.map(|d| d.across)))?;
        let axis = options.axis("axis")?.or(drive.map(|d| d.across)).ok_or_else(|| missing("axis"))?;
        let flow = options.axis("flow")?.or(drive.map(|d| d.along)).ok_or_else(|| missing("flow"))?;
        let acceleration = options.positive("acceleration")?.or(drive.map(|d| d.acceleration));
        let acceleration = acceleration.ok_or_else(|| missing("acceleration"))?;
        if flow == axis {
            return Err(options.error("flow", "must be another direction than axis"));
        }
        if !options.place.domain.periodic()[axis] {
            return Err(options.error("axis", "the box is not periodic along the axis"));
        }
        let series = Series::new(2 * across.bins);
        Ok(Poiseuille { across, flow, acceleration, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let Some(fractions) = self.across.fractions(frame) else { return false };
        let mut sums = vec![0.0; 2 * self.across.bins];
        for (k, s) in fractions.iter().enumerate() {
            if let Some(bin) = self.across.bin(*s) {
                let m = frame.mass(k);
                sums[2 * bin] += m;
                sums[2 * bin + 1] += m * frame.view.v[k][self.flow];
            }
        }
        self.series.push(&sums)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let found = self.series.jackknife(|means| self.fit(means));
        let at = |k: usize| found.get(k).copied().unwrap_or(Measured::NONE);
        let velocity = (0..self.across.bins).map(|k| self.series.ratio(|s| s[2 * k + 1], |s| s[2 * k]));
        let fit = self.parabolas().into_iter().map(|f| at(2).times(f));
        let title = "Shear viscosity from Poiseuille flow";
        vec![
            Observation::new("poiseuille", title, Kind::Scalar, &self.series)
                .column("viscosity", "mass/(r_c time)", [at(0)])
                .column("deviation", "1", [at(1)]),
            Observation::new("poiseuille_profile", "Poiseuille flow", Kind::Profile, &self.series)
                .against(self.across.name(), "length", self.across.middles())
                .column("velocity", "r_c/time", velocity)
                .column("fit", "r_c/time", fit),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::parabola;

    #[test]
    fn parabolas_are_averaged() {
        assert!((parabola(0.0, 2.0, 2.0) - 4.0 / 6.0).abs() < 1e-12);
        assert!((parabola(1.999, 2.001, 2.0)).abs() < 1e-9);
        assert!((parabola(2.0, 4.0, 2.0) + 4.0 / 6.0).abs() < 1e-12);
    }
}
