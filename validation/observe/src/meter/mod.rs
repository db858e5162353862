//! The observables, one file each: settings, samples, results.
//!
//! To add one: a file with a type that implements [`Meter`] and its table of keys, and a line in
//! `meters!`.

mod across;
mod clusters;
mod density_field;
mod distances;
mod drop;
mod energy;
mod interface_width;
mod linked;
mod local_density;
mod msd;
mod pendant;
mod poiseuille;
mod pressure;
mod profiles;
mod rdf;
mod species_pairs;
mod stress_profile;
mod structure_factor;
pub mod surface_tension;
mod temperature;
mod viscosity;
mod waves;

use super::frame::Frame;
use super::keys::Table;
use super::observation::Observation;
use super::options::Options;
use psidpd_core::document::FileError;
use psidpd_core::engine::Want;
use serde::{Deserialize, Serialize};

/// Something that is measured as a run goes. It is written to checkpoints, so it holds no number that is
/// not finite.
pub trait Meter: Sized {
    /// Its keys.
    const TABLE: Table;
    /// Steps between samples if the observable itself does not say; `None` leaves that to `[observe]`.
    const EVERY: Option<u64> = None;
    /// Whether it must see every step.
    const EVERY_STEP: bool = false;

    /// Whether a sample needs what carried momentum in its step.
    const NEEDS_FLUX: bool = false;

    /// Whether it is of motion in time, which trial moves have none of.
    const OF_MOTION: bool = false;

    /// Reads its settings.
    ///
    /// # Errors
    /// Values out of their domain, or a model or a box that cannot have the observable.
    fn read(options: &Options) -> Result<Self, FileError>;

    /// What the forces of a sampled step must bring with them.
    fn needs(&self) -> Want {
        Want::FORCES
    }

    /// Takes a sample; whether it could.
    fn sample(&mut self, frame: &Frame) -> bool;

    /// Forgets every sample; what was read stays.
    fn forget(&mut self);

    /// What came out.
    fn finish(&self) -> Vec<Observation>;
}

/// A kind of meter, for the reader.
#[derive(Debug)]
pub struct MeterKind {
    /// Its keys.
    pub table: &'static Table,
    /// As [`Meter::EVERY`].
    pub every: Option<u64>,
    /// As [`Meter::EVERY_STEP`].
    pub every_step: bool,
    /// As [`Meter::OF_MOTION`].
    pub of_motion: bool,
    /// As [`Meter::read`].
    pub read: fn(&Options) -> Result<AnyMeter, FileError>,
}

/// The one list of observables, in the order of the reference.
macro_rules! meters {
    ($($variant:ident($meter:ty)),+ $(,)?) => {
        /// An observable of any kind.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub enum AnyMeter {
            $(#[doc = concat!("See `", stringify!($meter), "`.")] $variant(Box<$meter>)),+
        }

        impl AnyMeter {
            /// As [`Meter::needs`].
            pub fn needs(&self) -> Want {
                match self { $(AnyMeter::$variant(meter) => meter.needs()),+ }
            }

            /// As [`Meter::NEEDS_FLUX`].
            pub fn needs_flux(&self) -> bool {
                match self { $(AnyMeter::$variant(_) => <$meter as Meter>::NEEDS_FLUX),+ }
            }

            /// As [`Meter::sample`].
            pub fn sample(&mut self, frame: &Frame) -> bool {
                match self { $(AnyMeter::$variant(meter) => meter.sample(frame)),+ }
            }

            /// As [`Meter::forget`].
            pub fn forget(&mut self) {
                match self { $(AnyMeter::$variant(meter) => meter.forget()),+ }
            }

            /// As [`Meter::finish`].
            pub fn finish(&self) -> Vec<Observation> {
                match self { $(AnyMeter::$variant(meter) => meter.finish()),+ }
            }
        }

        /// Every kind of observable.
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
    DensityProfile(profiles::DensityProfile),
    CompositionProfile(profiles::CompositionProfile),
    TemperatureProfile(profiles::TemperatureProfile),
    VelocityProfile(profiles::VelocityProfile),
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
    Clusters(clusters::Clusters),
    LocalDensity(local_density::LocalDensity),
);
