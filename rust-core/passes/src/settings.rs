use std::fmt;
use std::num::NonZeroUsize;
use std::sync::LazyLock;

/// The precision of the arithmetic of pairs. Positions and velocities of the host, sums over pairs, ψ
/// and totals are always in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// Pairs in single precision. Positions are 32-bit fractions of the box, so that differences are
    /// exact to 2⁻³² of the box everywhere. In a liquid with interfaces, the largest error of a force
    /// on a particle is 1.7·10⁻⁶ of the rms force.
    #[default]
    Mixed,
    /// Pairs in double precision.
    Double,
}

impl Precision {
    /// All precisions, with their names.
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

/// The instructions that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Instructions {
    /// The instructions of the compiler's target.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, BW, DQ and VL: Intel's servers since Skylake-X, Cascade Lake among them.
    Avx512,
    /// AVX-512 as above, and VBMI2, which compresses bytes: Intel's since Ice Lake, AMD's since Zen 4.
    Avx512Vbmi2,
}

impl Instructions {
    /// All instruction sets, with their names, the slowest first.
    pub const ALL: [(&'static str, Instructions); 4] = [
        ("portable", Instructions::Portable),
        ("avx2", Instructions::Avx2),
        ("avx512", Instructions::Avx512),
        ("avx512-vbmi2", Instructions::Avx512Vbmi2),
    ];

    /// Whether this processor has these instructions.
    pub fn available(self) -> bool {
        self.missing().is_empty()
    }

    /// The features that these instructions need and this processor lacks.
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

    /// The best instruction set of this processor.
    pub fn best() -> Instructions {
        static BEST: LazyLock<Instructions> = LazyLock::new(|| {
            let mut available = Instructions::ALL.into_iter().map(|(_, i)| i).filter(|i| i.available());
            available.next_back().unwrap_or(Instructions::Portable)
        });
        *BEST
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

/// Settings of the computation of forces; only the precision changes results, and only by rounding errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Settings {
    /// Precision of pair arithmetic.
    pub precision: Precision,
    /// Instruction set; the best set of the processor replaces one that it lacks.
    pub instructions: Instructions,
    /// Number of threads. Results are bitwise the same for any number.
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
