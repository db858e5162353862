//! The observables. Each file has the settings, samples and results of one.
//!
//! A new observable needs a file with a type that implements [`Meter`], its table of keys, and a line in `meters!`.

mod across;
mod clusters;
mod contact_angle;
mod density_field;
mod drop;
mod energy;
mod interface_width;
pub(crate) mod linked;
mod local_density;
mod msd;
mod peak;
mod pendant;
mod poiseuille;
mod pressure;
mod profiles;
mod rdf;
mod species_pairs;
mod spheres;
mod stress_profile;
mod strips;
mod structure_factor;
pub mod surface_tension;
mod temperature;
mod viscosity;
mod wall_force;
mod waves;

// Every observable uses these.
use super::flux::Recorded;
use super::frame::Frame;
use super::keys::{AXIS, BINS, Need, PLAIN, Table, ValueKind, keys, names};
use super::observation::{Kind, Observation};
use super::options::{AXES, Options};
use super::series::{Measured, Series};
use psidpd_core::document::FileError;
use psidpd_core::engine::{PeriodicBox, Want};
use serde::{Deserialize, Serialize};

/// A measurement during a run. It is written to checkpoints, so it must not hold NaN or infinity.
pub trait Meter: Sized {
    const TABLE: Table;
    /// The default number of steps between samples; `None` takes that of `[observe]`.
    const EVERY: Option<u64> = None;
    /// True if the observable must see every step.
    const EVERY_STEP: bool = false;

    /// The quantities that the forces of a sampled step must provide.
    const NEEDS: Want = Want::FORCES;

    /// What a sample needs of the momentum transport of its step.
    const FLUX: Recorded = Recorded::Nothing;

    /// True if the observable needs motion in time, which Monte Carlo does not have.
    const OF_MOTION: bool = false;

    /// Whether it reads [`View::pressure`](crate::frame::View::pressure), which has the virial of drag and noise.
    const PRESSURE: bool = Self::NEEDS.virial;

    /// True if the results mean nothing for a crystal.
    const OF_LIQUIDS: bool = false;

    /// What its samples may need of the pairs of a configuration.
    const PAIRS: Pairs = Pairs::Nothing;

    fn read(options: &Options) -> Result<Self, FileError>;

    /// Takes a sample; returns false if the configuration allows none.
    fn sample(&mut self, frame: &Frame) -> bool;

    /// The series that hold its samples.
    fn series(&mut self) -> Vec<&mut Series>;

    /// Forgets what it keeps of samples apart from [`Meter::series`]; settings stay.
    fn restart(&mut self) {}

    /// About how many bytes so many samples of so many particles take.
    fn bytes(&mut self, _particles: f64, samples: f64) -> f64 {
        self.series().iter().map(|series| series.bytes(samples)).sum()
    }

    fn finish(&self) -> Vec<Observation>;
}

/// What samples need of the pairs of a configuration, which takes memory; the most last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Pairs {
    #[default]
    Nothing,
    /// Sums over the pairs of each particle, [`Frame::sums`], or a list where there are none.
    Sums,
    /// These, and the conservative forces, [`View::forces`](crate::frame::View::forces).
    SumsAndForces,
    List,
}

/// A kind of observable, for the reader.
#[derive(Debug)]
pub struct MeterKind {
    pub table: &'static Table,
    pub every: Option<u64>,
    pub every_step: bool,
    pub of_motion: bool,
    pub read: fn(&Options) -> Result<AnyMeter, FileError>,
}

/// The only list of observables, in the order of the reference.
macro_rules! meters {
    ($($variant:ident($meter:ty)),+ $(,)?) => {
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub enum AnyMeter {
            $(#[doc = concat!("See `", stringify!($meter), "`.")] $variant(Box<$meter>)),+
        }

        impl AnyMeter {
            pub fn needs(&self) -> Want {
                match self { $(AnyMeter::$variant(_) => <$meter as Meter>::NEEDS),+ }
            }

            pub fn flux(&self) -> Recorded {
                match self { $(AnyMeter::$variant(_) => <$meter as Meter>::FLUX),+ }
            }

            pub fn reads_pressure(&self) -> bool {
                match self { $(AnyMeter::$variant(_) => <$meter as Meter>::PRESSURE),+ }
            }

            pub fn of_liquids(&self) -> bool {
                match self { $(AnyMeter::$variant(_) => <$meter as Meter>::OF_LIQUIDS),+ }
            }

            pub fn pairs(&self) -> Pairs {
                match self { $(AnyMeter::$variant(_) => <$meter as Meter>::PAIRS),+ }
            }

            pub fn sample(&mut self, frame: &Frame) -> bool {
                match self { $(AnyMeter::$variant(meter) => meter.sample(frame)),+ }
            }

            /// Forgets every sample and keeps the settings.
            pub fn forget(&mut self) {
                match self { $(AnyMeter::$variant(meter) => {
                    meter.series().into_iter().for_each(Series::clear);
                    meter.restart();
                }),+ }
            }

            pub fn bytes(&mut self, particles: f64, samples: f64) -> f64 {
                match self { $(AnyMeter::$variant(meter) => meter.bytes(particles, samples)),+ }
            }

            pub fn finish(&self) -> Vec<Observation> {
                match self { $(AnyMeter::$variant(meter) => meter.finish()),+ }
            }
        }

        pub const KINDS: &[MeterKind] = &[$(MeterKind {
            table: &<$meter as Meter>::TABLE,
            every: <$meter as Meter>::EVERY,
            every_step: <$meter as Meter>::EVERY_STEP,
            of_motion: <$meter as Meter>::OF_MOTION,
            read: |options| Ok(AnyMeter::$variant(Box::new(<$meter as Meter>::read(options)?))),
        }),+];
    };
}

meters!(
    Temperature(temperature::Temperature),
    Pressure(pressure::Pressure),
    Energy(energy::Energy),
    DensityProfile(profiles::Profile<profiles::Density>),
    CompositionProfile(profiles::Profile<profiles::Composition>),
    TemperatureProfile(profiles::Profile<profiles::Temperature>),
    VelocityProfile(profiles::Profile<profiles::Velocity>),
    DensityField(density_field::DensityField),
    StressProfile(stress_profile::StressProfile),
    SurfaceTension(surface_tension::SurfaceTension),
    InterfaceWidth(interface_width::InterfaceWidth),
    Rdf(rdf::Rdf),
    StructureFactor(structure_factor::StructureFactor),
    Msd(msd::Msd),
    Viscosity(viscosity::Viscosity),
    Poiseuille(poiseuille::Poiseuille),
    Drop(drop::Drop),
    Pendant(pendant::Pendant),
    ContactAngle(contact_angle::ContactAngle),
    Clusters(clusters::Clusters),
    LocalDensity(local_density::LocalDensity),
    WallForce(wall_force::WallForce),
);
