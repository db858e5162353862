//! Settings of an engine: precision, instruction set and threads.

use crate::status::{Failure, Status};
use psidpd_core::engine;

/// For psidpd_settings: pairs in double precision.
pub const PSIDPD_PRECISION_DOUBLE: i32 = 0;
/// For psidpd_settings: pairs in single precision, with positions to 2^-32 of the box; sums, psi and totals in double.
pub const PSIDPD_PRECISION_MIXED: i32 = 1;

/// For psidpd_settings: the best instruction set that the processor has.
pub const PSIDPD_INSTRUCTIONS_BEST: i32 = 0;
/// For psidpd_settings: the instruction set that the library was compiled for.
pub const PSIDPD_INSTRUCTIONS_PORTABLE: i32 = 1;
/// For psidpd_settings: AVX2 and FMA.
pub const PSIDPD_INSTRUCTIONS_AVX2: i32 = 2;
/// For psidpd_settings: AVX-512 F, BW, DQ and VL.
pub const PSIDPD_INSTRUCTIONS_AVX512: i32 = 3;
/// For psidpd_settings: AVX-512 with VBMI2.
pub const PSIDPD_INSTRUCTIONS_AVX512_VBMI2: i32 = 4;

/// The settings of an engine. Results depend on the precision; instruction sets change them by rounding
/// errors only, and the number of threads does not change a bit. All bytes zero and one thread are the
/// settings that NULL stands for.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// PSIDPD_PRECISION_...
    pub precision: i32,
    /// PSIDPD_INSTRUCTIONS_...; the best set of the processor replaces one that it lacks.
    pub instructions: i32,
    /// Number of threads, from 1.
    pub threads: usize,
}

/// The path that an evaluation took.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// The sweep over cells, with vector instructions and threads.
    Sweep = 0,
    /// The reference, over a list of pairs, in double precision and on one thread.
    Reference = 1,
}

impl Settings {
    pub(super) const DEFAULT: Settings =
        Settings { precision: PSIDPD_PRECISION_DOUBLE, instructions: PSIDPD_INSTRUCTIONS_BEST, threads: 1 };

    pub(super) fn checked(self) -> Result<engine::Settings, Failure> {
        let wrong = |what: &str, value: i32| {
            Failure::new(
                Status::InvalidArgument,
                format!("settings.{what} is {value}, which is not a valid value"),
            )
        };
        let precision = match self.precision {
            PSIDPD_PRECISION_DOUBLE => engine::Precision::Double,
            PSIDPD_PRECISION_MIXED => engine::Precision::Mixed,
            other => return Err(wrong("precision", other)),
        };
        let instructions = match self.instructions {
            PSIDPD_INSTRUCTIONS_BEST => engine::Instructions::best(),
            PSIDPD_INSTRUCTIONS_PORTABLE => engine::Instructions::Portable,
            PSIDPD_INSTRUCTIONS_AVX2 => engine::Instructions::Avx2,
            PSIDPD_INSTRUCTIONS_AVX512 => engine::Instructions::Avx512,
            PSIDPD_INSTRUCTIONS_AVX512_VBMI2 => engine::Instructions::Avx512Vbmi2,
            other => return Err(wrong("instructions", other)),
        };
        let threads = engine::Pool::count(self.threads)
            .map_err(|e| Failure::new(Status::InvalidArgument, format!("settings: {e}")))?;
        Ok(engine::Settings { precision, instructions, threads })
    }

    pub(super) fn of(settings: engine::Settings) -> Settings {
        Settings {
            precision: match settings.precision {
                engine::Precision::Double => PSIDPD_PRECISION_DOUBLE,
                engine::Precision::Mixed => PSIDPD_PRECISION_MIXED,
            },
            instructions: match settings.instructions {
                engine::Instructions::Portable => PSIDPD_INSTRUCTIONS_PORTABLE,
                engine::Instructions::Avx2 => PSIDPD_INSTRUCTIONS_AVX2,
                engine::Instructions::Avx512 => PSIDPD_INSTRUCTIONS_AVX512,
                engine::Instructions::Avx512Vbmi2 => PSIDPD_INSTRUCTIONS_AVX512_VBMI2,
            },
            threads: settings.threads.get(),
        }
    }
}
