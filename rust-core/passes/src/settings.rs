use std::fmt;
use std::num::NonZeroUsize;

/// In what the arithmetic of pairs is done. Positions and velocities of the host, sums over pairs, ψ and
/// totals are in double precision in either case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// Pairs in single precision: positions as 32-bit fractions of the box, so that differences are exact
    /// to 2⁻³² of it everywhere. In a liquid with interfaces, the largest error of a force on a particle
    /// is 1.7·10⁻⁶ of the rms force.
    #[default]
    Mixed,
    /// Pairs in double precision.
    Double,
}

impl Precision {
    /// All, with their names.
    pub const ALL: [(&'static str, Precision); 2] =
        [("mixed", Precision::Mixed), ("double", Precision::Double)];
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Precision::Mixed => "mixed",
            Precision::Double => "double",
        })
    }
}

/// Which instructions the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Instructions {
    /// Whatever the compiler's target has.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, BW, DQ and VL: Intel's servers since Skylake-X, Cascade Lake among them.
    Avx512,
    /// The same, and VBMI2, which compresses bytes: Intel's since Ice Lake, AMD's since Zen 4.
    Avx512Vbmi2,
}

impl Instructions {
    /// All, with their names, the slowest first.
    pub const ALL: [(&'static str, Instructions); 4] = [
        ("portable", Instructions::Portable),
        ("avx2", Instructions::Avx2),
        ("avx512", Instructions::Avx512),
        ("avx512-vbmi2", Instructions::Avx512Vbmi2),
    ];

    /// Whether this processor has them.
    pub fn available(self) -> bool {
        self.missing().is_empty()
    }

    /// What they need and this processor lacks.
    pub fn missing(self) -> Vec<&'static str> {
        #[cfg(target_arch = "x86_64")]
        {
            macro_rules! features {
                ($($feature:tt)*) => { [$(($feature, is_x86_feature_detected!($feature))),*] };
            }
            let avx2 = features!("avx2" "fma" "bmi1" "bmi2" "lzcnt" "popcnt");
            let avx512 = features!("avx512f" "avx512bw" "avx512dq" "avx512vl");
            let vbmi2 = features!("avx512vbmi2");
            let needed = match self {
                Instructions::Portable => vec![],
                Instructions::Avx2 => avx2.to_vec(),
                Instructions::Avx512 => [&avx2[..], &avx512].concat(),
                Instructions::Avx512Vbmi2 => [&avx2[..], &avx512, &vbmi2].concat(),
            };
            needed.into_iter().filter(|(_, has)| !has).map(|(feature, _)| feature).collect()
        }
        #[cfg(not(target_arch = "x86_64"))]
        match self {
            Instructions::Portable => vec![],
            _ => vec!["x86-64"],
        }
    }

    /// The best that this processor has.
    pub fn best() -> Instructions {
        let mut available = Instructions::ALL.into_iter().map(|(_, i)| i).filter(|i| i.available());
        available.next_back().unwrap_or(Instructions::Portable)
    }
}

impl fmt::Display for Instructions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Instructions::Portable => "portable",
            Instructions::Avx2 => "avx2",
            Instructions::Avx512 => "avx512",
            Instructions::Avx512Vbmi2 => "avx512-vbmi2",
        })
    }
}

/// How forces are computed; what they are depends on the precision alone, and not on it but for rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Settings {
    /// Precision of pair arithmetic.
    pub precision: Precision,
    /// Instruction set; one that the processor lacks falls back to the best it has.
    pub instructions: Instructions,
    /// Threads that share the work. Results are bitwise the same for any number of them.
    pub threads: NonZeroUsize,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            precision: Precision::default(),
            instructions: Instructions::best(),
            threads: NonZeroUsize::MIN,
        }
    }
}
