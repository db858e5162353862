//! Profiles of densities, composition, temperature and velocity along an axis.

use super::across::Across;
use super::*;
use crate::keys::RECENTRE;
use crate::profile::slab_edges;
use std::marker::PhantomData;

const KEYS: &[crate::keys::Key] = &[AXIS, BINS, RECENTRE];

/// The sums of all profiles: in each bin the particles of each species, their mass, and the first and second moments of
/// their velocities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Bins {
    across: Across,
    species: Vec<String>,
    dimensions: usize,
    moments: bool,
    series: Series,
}

impl Bins {
    fn read(options: &Options, moments: bool) -> Result<Bins, FileError> {
        let fluid = options.place.fluid;
        let across = Across::read(options, false)?;
        let mut this = Bins {
            across,
            species: fluid.species.clone(),
            dimensions: fluid.dimensions,
            moments,
            series: Series::new(0),
        };
        this.series = Series::new(this.across.bins * this.width());
        Ok(this)
    }

    /// The numbers in a bin: particles of each species, then m, m v, m v², and the number of mobile particles.
    fn width(&self) -> usize {
        self.species.len() + if self.moments { 3 + self.dimensions } else { 0 }
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let Some(fractions) = self.across.fractions(frame) else { return false };
        let (width, count) = (self.width(), self.species.len());
        let mut sums = vec![0.0; self.across.bins * width];
        for (k, s) in fractions.iter().enumerate() {
            let Some(bin) = self.across.bin(*s) else { continue };
            let at = &mut sums[bin * width..(bin + 1) * width];
            at[view.species[k] as usize] += 1.0;
            if self.moments && frame.moves(k) {
                let (m, v) = (frame.mass(k), view.v[k]);
                at[count] += m;
                at[count + 2 + self.dimensions] += 1.0;
                for c in 0..self.dimensions {
                    at[count + 1 + c] += m * v[c];
                    at[count + 1 + self.dimensions] += m * v[c] * v[c];
                }
            }
        }
        self.series.push(&sums)
    }

    /// An observation against the coordinate, without columns.
    fn observation(&self, name: &str, title: &str) -> Observation {
        Observation::new(name, title, Kind::Profile, &self.series)
            .against(self.across.name(), "length", self.across.middles())
            .note(self.across.note())
    }

    /// Evaluates a linear function of the sums for every bin.
    fn linear(&self, f: impl Fn(&[f64]) -> f64) -> Vec<Measured> {
        let width = self.width();
        (0..self.across.bins).map(|b| self.series.linear(|row| f(&row[b * width..(b + 1) * width]))).collect()
    }

    /// Evaluates a ratio of linear functions of the sums for every bin.
    fn ratio(&self, f: impl Fn(&[f64]) -> f64, g: impl Fn(&[f64]) -> f64) -> Vec<Measured> {
        let width = self.width();
        let of = |row: &[f64], b: usize| row[b * width..(b + 1) * width].to_vec();
        (0..self.across.bins).map(|b| self.series.ratio(|row| f(&of(row, b)), |row| g(&of(row, b)))).collect()
    }
}

/// A quantity by the sums in bins.
pub trait Quantity: Sized {
    const TABLE: Table;
    /// Whether the sums have the moments of velocities.
    const MOMENTS: bool;
    const OF_MOTION: bool = false;

    fn columns(profile: &Profile<Self>) -> Observation;

    /// Single numbers that the profile gives.
    fn scalars(_: &Profile<Self>) -> Vec<Observation> {
        Vec::new()
    }
}

/// The profile of a quantity along an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Profile<Q>(Bins, PhantomData<Q>);

impl<Q: Quantity> Meter for Profile<Q> {
    const TABLE: Table = Q::TABLE;
    const OF_MOTION: bool = Q::OF_MOTION;

    fn read(options: &Options) -> Result<Profile<Q>, FileError> {
        Ok(Profile(Bins::read(options, Q::MOMENTS)?, PhantomData))
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        self.0.sample(frame)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.0.series]
    }

    fn finish(&self) -> Vec<Observation> {
        [vec![Q::columns(self)], Q::scalars(self)].concat()
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Density;

impl Quantity for Density {
    const TABLE: Table = Table {
        path: "density_profile",
        title: "density along an axis",
        about: "Number density in slices of the box: `density`, and `density_SPECIES` of each of several species.",
        keys: KEYS,
        ..PLAIN
    };

    const MOMENTS: bool = false;

    fn columns(Profile(bins, _): &Profile<Self>) -> Observation {
        let volume = bins.across.bin_volume();
        let total = bins.linear(|n| n.iter().sum::<f64>() / volume);
        let mut out =
            bins.observation("density_profile", "Density profile").column("density", "1/volume", total);
        if bins.species.len() > 1 {
            for (s, name) in bins.species.iter().enumerate() {
                out = out.column(&format!("density_{name}"), "1/volume", bins.linear(|n| n[s] / volume));
            }
        }
        out
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Composition;

impl Quantity for Composition {
    const TABLE: Table = Table {
        path: "composition_profile",
        title: "composition along an axis",
        about: "`fraction_SPECIES`: the mean number of particles of a species in a slice over that of all. Where two \
                phases lie one above the other in a periodic box, `coexistence` has their compositions: `rich_SPECIES` \
                and `poor_SPECIES`, the mean fractions on the two plateaus, as `interface_width` takes them; of two \
                species those of the first. Jackknife errors. It is left out where the plateaus differ by less than \
                five standard errors or by less than 0.02: one phase.",
        keys: KEYS,
        ..PLAIN
    };

    const MOMENTS: bool = false;

    fn columns(Profile(bins, _): &Profile<Self>) -> Observation {
        let mut out = bins.observation("composition_profile", "Composition profile");
        for (s, name) in bins.species.iter().enumerate() {
            let fraction = bins.ratio(|n| n[s], |n| n.iter().sum());
            out = out.column(&format!("fraction_{name}"), "1", fraction);
        }
        out
    }

    fn scalars(Profile(bins, _): &Profile<Self>) -> Vec<Observation> {
        let count = bins.species.len();
        // The fraction of the second of two species follows from that of the first.
        let names = &bins.species[..if count == 2 { 1 } else { count }];
        if count < 2 || !bins.across.is_periodic() {
            return Vec::new();
        }
        let mut out = Observation::new("coexistence", "Coexisting phases", Kind::Scalar, &bins.series);
        for (s, name) in names.iter().enumerate() {
            let plateaus = bins.series.jackknife(|means| {
                let fraction = |at: &[f64]| at[s] / at.iter().sum::<f64>();
                let fractions: Vec<f64> = means.chunks_exact(count).map(fraction).collect();
                plateaus(&fractions, bins.across.height).map(Vec::from)
            });
            let [rich, poor] = plateaus[..] else { continue };
            let doubt = 5.0 * rich.error.hypot(poor.error);
            if doubt.is_finite() && rich.value - poor.value > doubt.max(0.02) {
                out = out.column(&format!("rich_{name}"), "1", [rich]);
                out = out.column(&format!("poor_{name}"), "1", [poor]);
            }
        }
        if out.columns.is_empty() { Vec::new() } else { vec![out] }
    }
}

/// The values of the two plateaus of a periodic profile with one step up and one step down, the higher first.
fn plateaus(values: &[f64], length: f64) -> Option<[f64; 2]> {
    let count = values.len() as f64;
    let angle = |k: usize| std::f64::consts::TAU * (k as f64 + 0.5) / count;
    let sum = |f: fn(f64) -> f64| values.iter().enumerate().map(|(k, x)| x * f(angle(k))).sum::<f64>();
    let (sine, cosine) = (sum(f64::sin), sum(f64::cos));
    // A bin that is empty has no fraction.
    if !sine.is_finite() || !cosine.is_finite() {
        return None;
    }
    let middle = (sine.atan2(cosine) / std::f64::consts::TAU).rem_euclid(1.0);
    // By whole bins, so that the distances from the middle stay even.
    let shift = (middle * count).round() as usize + values.len().div_ceil(2);
    let half = (values.len() / 2) as f64;
    let moved = |k: usize| {
        let z = (k as f64 + 0.5 - half) * length / count;
        (z, values[(k + shift) % values.len()])
    };
    let profile: Vec<(f64, f64)> = (0..values.len()).map(moved).collect();
    let found = slab_edges(&profile)?;
    Some([found.liquid, found.vapour])
}

#[derive(Debug, Clone, PartialEq)]
pub struct Temperature;

impl Quantity for Temperature {
    const TABLE: Table = Table {
        path: "temperature_profile",
        title: "temperature along an axis",
        about: "Kinetic kT in slices of the box, about the mean flow of the slice: \
                (⟨Σ m v²⟩ − ⟨Σ m v⟩²/⟨Σ m⟩)/(d ⟨n⟩), and their `temperature_profile_mean` over all particles that move. \
                Jackknife errors.",
        keys: KEYS,
        ..PLAIN
    };

    const MOMENTS: bool = true;

    fn columns(Profile(bins, _): &Profile<Self>) -> Observation {
        let temperature = bins
            .series
            .jackknife(|means| Some(heat(bins, means).map(|[heat, freedom]| heat / freedom).collect()));
        let out = bins.observation("temperature_profile", "Temperature profile");
        out.column("temperature", "energy", temperature)
    }

    fn scalars(Profile(bins, _): &Profile<Self>) -> Vec<Observation> {
        let mean = bins.series.jackknife(|means| {
            let [heat, freedom] = heat(bins, means)
                // A bin that is empty has neither.
                .filter(|of| of[1] > 0.0)
                .fold([0.0; 2], |[a, b], of| [a + of[0], b + of[1]]);
            Some(vec![heat / freedom])
        });
        let out = Observation::new(
            "temperature_profile_mean",
            "Temperature without flow",
            Kind::Scalar,
            &bins.series,
        );
        vec![out.column("mean", "energy", mean)]
    }
}

/// Twice the kinetic energy of each bin about its mean flow, and its degrees of freedom.
fn heat<'a>(bins: &Bins, means: &'a [f64]) -> impl Iterator<Item = [f64; 2]> + 'a {
    let (width, count, d) = (bins.width(), bins.species.len(), bins.dimensions);
    means.chunks_exact(width).map(move |at| {
        let flow: f64 = at[count + 1..count + 1 + d].iter().map(|p| p * p).sum::<f64>() / at[count];
        [at[count + 1 + d] - flow, d as f64 * at[count + 2 + d]]
    })
}

#[derive(Debug, Clone, PartialEq)]
pub struct Velocity;

impl Quantity for Velocity {
    const TABLE: Table = Table {
        path: "velocity_profile",
        title: "flow velocity along an axis",
        about: "Momentum over mass of a slice, ⟨Σ m v⟩/⟨Σ m⟩: `velocity_x` and so on. Between walls `velocity_profile_mean` is that of \
                all particles that move: `x` and so on.",
        keys: KEYS,
        ..PLAIN
    };

    const OF_MOTION: bool = true;

    const MOMENTS: bool = true;

    fn columns(Profile(bins, _): &Profile<Self>) -> Observation {
        let count = bins.species.len();
        let mut out = bins.observation("velocity_profile", "Velocity profile");
        for (c, name) in ["x", "y", "z"].iter().enumerate().take(bins.dimensions) {
            let velocity = bins.ratio(|at| at[count + 1 + c], |at| at[count]);
            out = out.column(&format!("velocity_{name}"), "r_c/time", velocity);
        }
        out
    }

    fn scalars(Profile(bins, _): &Profile<Self>) -> Vec<Observation> {
        let (width, count) = (bins.width(), bins.species.len());
        let is_held = |at: &[f64]| at[..count].iter().sum::<f64>() > at[count + 2 + bins.dimensions];
        // Without walls the momentum of all particles is conserved.
        if bins.across.is_periodic() && !bins.series.means().chunks_exact(width).any(is_held) {
            return Vec::new();
        }
        let sum = |row: &[f64], k: usize| row.chunks_exact(width).map(|at| at[k]).sum::<f64>();
        let mut out =
            Observation::new("velocity_profile_mean", "Mean flow velocity", Kind::Scalar, &bins.series);
        for (c, name) in ["x", "y", "z"].iter().enumerate().take(bins.dimensions) {
            let mean = bins.series.ratio(|row| sum(row, count + 1 + c), |row| sum(row, count));
            out = out.column(name, "r_c/time", [mean]);
        }
        vec![out]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The plateaus of a layer are found wherever it lies, also across the end of the box; a flat profile has no step, and
    /// one with an empty bin no fractions.
    #[test]
    fn the_plateaus_of_a_layer_are_found_wherever_it_lies() {
        let layer = |bins: usize, middle: f64| -> Vec<f64> {
            let value = |k: usize| {
                let from_middle = ((k as f64 + 0.5) / bins as f64 - middle + 0.5).rem_euclid(1.0) - 0.5;
                0.5 - 0.4 * ((from_middle.abs() - 0.2) / 0.02).tanh()
            };
            (0..bins).map(value).collect()
        };
        for bins in [100, 121] {
            for middle in [0.0, 0.01, 0.3, 0.5, 0.77, 0.99] {
                let [rich, poor] = plateaus(&layer(bins, middle), 12.0).unwrap();
                assert!((rich - 0.9).abs() < 0.005 && (poor - 0.1).abs() < 0.005, "{middle}: {rich} {poor}");
            }
        }
        assert!(plateaus(&[0.5; 100], 12.0).is_none_or(|[rich, poor]| (rich - poor).abs() < 1e-9));
        let mut hollow = layer(100, 0.5);
        hollow[3] = f64::NAN;
        assert_eq!(plateaus(&hollow, 12.0), None);
    }
}
