//! Settings of an engine: precision, instruction set and threads.

use crate::status::Failure;
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

    const PRECISIONS: [(i32, engine::Precision); 2] = [
        (PSIDPD_PRECISION_DOUBLE, engine::Precision::Double),
        (PSIDPD_PRECISION_MIXED, engine::Precision::Mixed),
    ];

    const INSTRUCTIONS: [(i32, engine::Instructions); 4] = [
        (PSIDPD_INSTRUCTIONS_PORTABLE, engine::Instructions::Portable),
        (PSIDPD_INSTRUCTIONS_AVX2, engine::Instructions::Avx2),
        (PSIDPD_INSTRUCTIONS_AVX512, engine::Instructions::Avx512),
        (PSIDPD_INSTRUCTIONS_AVX512_VBMI2, engine::Instructions::Avx512Vbmi2),
    ];

    pub(super) fn checked(self) -> Result<engine::Settings, Failure> {
        fn of<T: Copy>(table: &[(i32, T)], what: &str, value: i32) -> Result<T, Failure> {
            let found = table.iter().find(|(number, _)| *number == value).map(|(_, set)| *set);
            let wrong = || format!("settings.{what} is {value}, which is not a valid value");
            found.ok_or_else(|| Failure::argument(wrong()))
        }
        let instructions = match self.instructions {
            PSIDPD_INSTRUCTIONS_BEST => engine::Instructions::best(),
            other => of(&Settings::INSTRUCTIONS, "instructions", other)?,
        };
        let threads =
            engine::Pool::count(self.threads).map_err(|e| Failure::argument(format!("settings: {e}")))?;
        Ok(engine::Settings {
            precision: of(&Settings::PRECISIONS, "precision", self.precision)?,
            instructions,
            threads,
        })
    }

    pub(super) fn of(settings: engine::Settings) -> Settings {
        fn of<T: PartialEq>(table: &[(i32, T)], value: T) -> i32 {
            table.iter().find(|(_, set)| *set == value).map_or(0, |(number, _)| *number)
        }
        Settings {
            precision: of(&Settings::PRECISIONS, settings.precision),
            instructions: of(&Settings::INSTRUCTIONS, settings.instructions),
            threads: settings.threads.get(),
        }
    }
}
