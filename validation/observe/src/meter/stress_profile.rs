use super::across::Across;
use super::strips::{Ends, Strips};
use super::*;
use crate::flux::{BLOCK, Lines};
use crate::keys::RECENTRE;
use psidpd_core::engine::vectors::{Loop, run_best};

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
        let fractions = self.across.fractions(frame)?;
        // Lines begin at any position, so they are shifted by as much as the particles.
        let shift = fractions.first()? - view.domain.fraction(*view.x.first()?)[self.across.axis];
        let stresses = Stresses {
            normal: self.across.normal(view.domain),
            along: view.domain.inverse()[self.across.axis],
            origin: view.domain.origin(),
            shift,
            across: &self.across,
            rest: (self.dimensions - 1) as f64,
        };
        let strips = Strips::of(&self.across);
        let sums = frame.sum_lines(strips.width(), |lines, ends: &mut Ends, sums| {
            run_best(Project { lines, stresses, ends });
            strips.add(ends, lines.count, sums);
        })?;
        let [momenta, forces] = sums.map(|sums| strips.bins(&sums));
        let bins = momenta.as_chunks::<2>().0.iter().zip(forces.as_chunks::<2>().0);
        Some(bins.flat_map(|([a, b], [c, d])| [*a, *b, *c, *d]).collect())
    }
}

/// What the pressures of lines depend on.
#[derive(Clone, Copy)]
struct Stresses<'a> {
    across: &'a Across,
    /// The unit normal of the faces, and the vector whose product with a position is its fraction of the height.
    normal: [f64; 3],
    along: [f64; 3],
    origin: [f64; 3],
    shift: f64,
    /// The number of tangential directions.
    rest: f64,
}

/// Computes where lines lie across the bins, and their normal and tangential pressures.
struct Project<'a> {
    lines: &'a Lines,
    stresses: Stresses<'a>,
    ends: &'a mut Ends,
}

impl Loop for Project<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Project { lines: Lines { from, d, f, .. }, stresses, ends } = self;
        let Stresses { across, normal: n, along, origin, shift, rest } = stresses;
        let (bins, volume) = (across.bins as f64, across.bin_volume());
        let per_length = bins / across.height;
        for k in 0..BLOCK {
            let x = [from[0][k] - origin[0], from[1][k] - origin[1], from[2][k] - origin[2]];
            let start = along[0] * x[0] + along[1] * x[1] + along[2] * x[2] + shift;
            let way = n[0] * d[0][k] + n[1] * d[1][k] + n[2] * d[2][k];
            let force = n[0] * f[0][k] + n[1] * f[1][k] + n[2] * f[2][k];
            let whole = (d[0][k] * f[0][k] + d[1][k] * f[1][k] + d[2][k] * f[2][k]) / volume;
            let normal = way * force / volume;
            ends.from[k] = start * bins;
            ends.to[k] = start * bins - way * per_length;
            ends.weights[0][k] = normal;
            ends.weights[1][k] = (whole - normal) / rest;
        }
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

    const FLUX: Recorded = Recorded::Lines;
    const OF_LIQUIDS: bool = true;
    const PAIRS: Pairs = Pairs::List;

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
        let of_bin = |p: &[f64]| height * (p[0] + p[2] - p[1] - p[3]);
        // The integral of each sample, which goes up to the middle of each bin.
        let mut below = vec![0.0; self.series.len()];
        let integral = (0..self.across.bins).map(|bin| {
            let middles = self.series.rows().zip(&mut below).map(|(row, below)| {
                let above = *below + of_bin(&row[bin * WIDTH..(bin + 1) * WIDTH]);
                0.5 * (std::mem::replace(below, above) + above)
            });
            Measured::mean(&middles.collect::<Vec<_>>())
        });
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
                .column(
                    "integral",
                    "energy/area",
                    [self.series.linear(|row| row.chunks_exact(WIDTH).map(of_bin).sum())],
                );
        vec![profile, whole]
    }
}
