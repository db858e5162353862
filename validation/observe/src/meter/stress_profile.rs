use super::across::Across;
use super::*;
use crate::flux::Carrier;
use crate::keys::RECENTRE;

/// The numbers in a bin: normal and tangential pressure of momenta, then of forces.
const WIDTH: usize = 4;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StressProfile {
    across: Across,
    dimensions: usize,
    series: Series,
}

impl StressProfile {
    /// The pressures of one configuration in every bin.
    fn pressures(&self, frame: &Frame) -> Option<Vec<f64>> {
        let view = frame.view;
        let fractions = self.across.fractions(&view)?;
        let normal = self.across.normal(view.domain);
        let along = |v: [f64; 3]| v[0] * normal[0] + v[1] * normal[1] + v[2] * normal[2];
        let (volume, rest) = (self.across.bin_volume(), (self.dimensions - 1) as f64);
        let mut sums = vec![0.0; self.across.bins * WIDTH];
        // Lines begin at any position, so they are shifted by as much as the particles.
        let shift = fractions.first()? - view.domain.fraction(*view.x.first()?)[self.across.axis];
        let known = frame.lines(|carrier, line| {
            let n = along(line.d);
            let whole: f64 = line.d.iter().zip(line.f).map(|(d, f)| d * f).sum();
            let normal = n * along(line.f) / volume;
            let tangential = whole / rest / volume - normal / rest;
            let from = view.domain.fraction(line.from)[self.across.axis] + shift;
            let at = if carrier == Carrier::Particle { 0 } else { 2 };
            self.across.share(from, from - n / self.across.height, |bin, share| {
                sums[bin * WIDTH + at] += share * normal;
                sums[bin * WIDTH + at + 1] += share * tangential;
            });
        });
        if !known {
            return None;
        }
        Some(sums)
    }
}

impl Meter for StressProfile {
    const TABLE: Table = Table {
        path: "stress_profile",
        title: "pressure tensor along an axis (Irving–Kirkwood)",
        about: "P_N and P_T in slices of the box: momentum carried by each particle, with the velocity that moved it, along \
                its way in the step, and by the force of each pair, many-body part and drag included, along the \
                straight line from i to j (Irving and Kirkwood, J. Chem. Phys. 18, 817 (1950)). That is the flux of \
                momentum which the integrator makes, so that in equilibrium P_N is the same everywhere, at any time \
                step; with the velocities at the ends of steps, or without drag, it is not. The random force is left \
                out: its mean is 0. `normal`, `tangential` (the mean of the other directions), `ideal` (the share of \
                the particles in `normal`), `difference` P_N − P_T, and `integral` ∫(P_N − P_T) from the lower end of \
                the axis. `stress_profile_integral` is the whole of it: the surface tension of all interfaces together.",
        keys: &[AXIS, BINS, RECENTRE],
        ..PLAIN
    };

    const NEEDS_FLUX: bool = true;
    const OF_LIQUIDS: bool = true;

    fn read(options: &Options) -> Result<StressProfile, FileError> {
        let across = Across::read(options, false)?;
        let series = Series::new(across.bins * WIDTH);
        Ok(StressProfile { across, dimensions: options.place.fluid.dimensions, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        self.pressures(frame).is_some_and(|sums| self.series.push(&sums))
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let column = |f: &dyn Fn(&[f64]) -> f64| -> Vec<Measured> {
            (0..self.across.bins)
                .map(|bin| self.series.linear(|row| f(&row[bin * WIDTH..(bin + 1) * WIDTH])))
                .collect()
        };
        let height = self.across.bin_height();
        let upto = |row: &[f64], bins: usize| -> f64 {
            row.chunks_exact(WIDTH).take(bins).map(|p| height * (p[0] + p[2] - p[1] - p[3])).sum()
        };
        // The integral goes up to the middle of each bin.
        let integral = (0..self.across.bins)
            .map(|bin| self.series.linear(|row| 0.5 * (upto(row, bin) + upto(row, bin + 1))));
        let unit = "energy/volume";
        let profile =
            Observation::new("stress_profile", "Pressure tensor profile", Kind::Profile, &self.series)
                .against(self.across.name(), "length", self.across.middles())
                .column("normal", unit, column(&|p| p[0] + p[2]))
                .column("tangential", unit, column(&|p| p[1] + p[3]))
                .column("ideal", unit, column(&|p| p[0]))
                .column("difference", unit, column(&|p| p[0] + p[2] - p[1] - p[3]))
                .column("integral", "energy/area", integral)
                .note(self.across.note());
        let whole =
            Observation::new("stress_profile_integral", "Integral of P_N − P_T", Kind::Scalar, &self.series)
                .column("integral", "energy/area", [self.series.linear(|row| upto(row, self.across.bins))]);
        vec![profile, whole]
    }
}
