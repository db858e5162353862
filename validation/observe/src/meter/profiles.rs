//! Profiles of densities, composition, temperature and velocity along an axis.

use super::across::Across;
use super::*;
use crate::keys::RECENTRE;
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
        let Some(fractions) = self.across.fractions(&view) else { return false };
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
        vec![Q::columns(self)]
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
        about: "`fraction_SPECIES`: the mean number of particles of a species in a slice over that of all.",
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
}

#[derive(Debug, Clone, PartialEq)]
pub struct Temperature;

impl Quantity for Temperature {
    const TABLE: Table = Table {
        path: "temperature_profile",
        title: "temperature along an axis",
        about: "Kinetic kT in slices of the box, about the mean flow of the slice: \
                (⟨Σ m v²⟩ − ⟨Σ m v⟩²/⟨Σ m⟩)/(d ⟨n⟩). Jackknife errors.",
        keys: KEYS,
        ..PLAIN
    };

    const MOMENTS: bool = true;

    fn columns(Profile(bins, _): &Profile<Self>) -> Observation {
        let (width, count, d) = (bins.width(), bins.species.len(), bins.dimensions);
        let temperature = bins.series.jackknife(|means| {
            let of = |at: &[f64]| {
                let flow: f64 = at[count + 1..count + 1 + d].iter().map(|p| p * p).sum::<f64>() / at[count];
                (at[count + 1 + d] - flow) / (d as f64 * at[count + 2 + d])
            };
            Some(means.chunks_exact(width).map(of).collect())
        });
        let out = bins.observation("temperature_profile", "Temperature profile");
        out.column("temperature", "energy", temperature)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Velocity;

impl Quantity for Velocity {
    const TABLE: Table = Table {
        path: "velocity_profile",
        title: "flow velocity along an axis",
        about: "Momentum over mass of a slice, ⟨Σ m v⟩/⟨Σ m⟩: `velocity_x` and so on.",
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
}
