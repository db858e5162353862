use super::peak::peak;
use super::species_pairs::SpeciesPairs;
use super::waves::waves;
use super::*;
use std::f64::consts::TAU;

/// The largest number of candidate wave vectors.
const MOST_CANDIDATES: f64 = 2e7;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StructureFactor {
    pairs: SpeciesPairs,
    /// Wave vectors in units of the reciprocal lattice, in shells of nearly equal length.
    pub vectors: Vec<[i32; 3]>,
    /// The index of the first vector of each shell, and one past the last vector.
    pub starts: Vec<usize>,
    /// The mean length of the vectors of each shell.
    pub lengths: Vec<f64>,
    series: Series,
}

/// The reciprocal lattice: 2π times the rows of the inverse of the edges.
fn reciprocal(domain: &PeriodicBox) -> [[f64; 3]; 3] {
    std::array::from_fn(|k| {
        let (a, b, c) = (domain.edge(k), domain.edge((k + 1) % 3), domain.edge((k + 2) % 3));
        let n = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        let volume = a[0] * n[0] + a[1] * n[1] + a[2] * n[2];
        n.map(|x| TAU * x / volume)
    })
}

impl Meter for StructureFactor {
    const TABLE: Table = Table {
        path: "structure_factor",
        title: "structure factors",
        about: "Direct sums over the wave vectors of the periodic box, averaged over shells of about equal |k|: `s` \
                = ⟨|Σ exp(ik·r)|²⟩/N of all particles, and of each two of several species `s_A_B` = \
                ⟨Re ρ_A(k) ρ_B(−k)⟩/√(N_A N_B) (Ashcroft and Langreth). Shells with many vectors keep an even \
                choice of them, one of each ±k. The box must be periodic. `structure_factor_peak` is the highest point of \
                `s`, by a parabola: its `height`, and the |k| that it is `at`.",
        keys: keys! {
            "range": ValueKind::Positive, Need::Default("20, or less in a large box"),
                "The largest |k|."
                => "9.0";
            "bins": ValueKind::Whole(1, 1000), Need::Default("as many as make shells as wide as the shortest wave vector is long, at most 100"),
                "Shells up to the largest |k|."
                => "10";
            "vectors": ValueKind::Whole(1, 10_000), Need::Default("24"),
                "The most wave vectors in a shell."
                => "6";
        },
        ..PLAIN
    };

    fn read(options: &Options) -> Result<StructureFactor, FileError> {
        let (domain, d) = (options.place.domain, options.place.fluid.dimensions);
        options.require_periodic()?;
        let basis = reciprocal(domain);
        let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        let shortest = basis[..d].iter().map(|b| length(*b)).fold(f64::INFINITY, f64::min);
        // |h_k| ≤ k_max |e_k|/2π, as e_k·k = 2π h_k.
        let lengths = domain.lengths();
        let candidates = |range: f64| (0..d).map(|k| 2.0 * range * lengths[k] / TAU + 1.0).product::<f64>();
        let mut preset = 20.0;
        while candidates(preset) > MOST_CANDIDATES && preset > shortest {
            preset *= 0.8;
        }
        let range = options.positive("range")?.unwrap_or(preset.max(shortest));
        if candidates(range) > MOST_CANDIDATES {
            return Err(options.error("range", "asks for too many wave vectors in a box of this size"));
        }
        if range < shortest {
            let message =
                format!("is less than {shortest}, the length of the shortest wave vector of the box");
            return Err(options.error("range", message));
        }
        let bins = options.given_count("bins")?;
        let bins = bins.unwrap_or(((range / shortest).floor() as usize).clamp(1, 100));
        let most = options.count("vectors")?;
        let top: [i32; 3] =
            std::array::from_fn(|k| if k < d { (range * lengths[k] / TAU).floor() as i32 } else { 0 });
        let mut shells: Vec<Vec<(f64, [i32; 3])>> = vec![Vec::new(); bins];
        for x in 0..=top[0] {
            for y in -top[1]..=top[1] {
                for z in -top[2]..=top[2] {
                    let h = [x, y, z];
                    // Only one of k and −k is used.
                    if h <= [0, 0, 0] {
                        continue;
                    }
                    let k = std::array::from_fn(|c| (0..3).map(|b| f64::from(h[b]) * basis[b][c]).sum());
                    let k = length(k);
                    if k <= range {
                        shells[((k / range * bins as f64) as usize).min(bins - 1)].push((k, h));
                    }
                }
            }
        }
        let pairs = SpeciesPairs::new(&options.place.fluid.species);
        let (mut vectors, mut starts, mut means) = (Vec::new(), vec![0], Vec::new());
        for mut shell in shells {
            if shell.is_empty() {
                continue;
            }
            shell.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let kept = shell.len().min(most);
            let chosen: Vec<_> = (0..kept).map(|k| shell[(2 * k + 1) * shell.len() / (2 * kept)]).collect();
            means.push(chosen.iter().map(|c| c.0).sum::<f64>() / kept as f64);
            vectors.extend(chosen.iter().map(|c| c.1));
            starts.push(vectors.len());
        }
        let series = Series::new(means.len() * pairs.len());
        Ok(StructureFactor { pairs, vectors, starts, lengths: means, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let (species, domain) = (view.species, view.domain);
        let numbers = self.pairs.numbers(species);
        let count = numbers.len();
        let waves: Vec<Vec<[f64; 2]>> = (0..count as i32)
            .map(|kind| {
                let of_kind = view.x.iter().zip(species).filter(|(_, s)| **s == kind);
                waves(view.pool, of_kind.map(|(x, _)| domain.fraction(*x)), &self.vectors)
            })
            .collect();
        let shells = self.lengths.len();
        let mut sums = vec![0.0; shells * self.pairs.len()];
        for shell in 0..shells {
            let range = self.starts[shell]..self.starts[shell + 1];
            let share = range.len() as f64;
            for k in range {
                let of = |a: usize| waves[a][k];
                let all = (0..count).map(of).fold([0.0; 2], |s, w| [s[0] + w[0], s[1] + w[1]]);
                sums[shell] += (all[0] * all[0] + all[1] * all[1]) / species.len() as f64 / share;
                for (p, (a, b)) in self.pairs.each().enumerate() {
                    let norm = (numbers[a] * numbers[b]).sqrt();
                    let product = of(a)[0] * of(b)[0] + of(a)[1] * of(b)[1];
                    // A species without particles has no structure factor.
                    sums[(1 + p) * shells + shell] += if norm > 0.0 { product / norm / share } else { 0.0 };
                }
            }
        }
        self.series.push(&sums)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let shells = self.lengths.len();
        let mut out = Observation::new("structure_factor", "Structure factor", Kind::Curve, &self.series)
            .against("k", "1/r_c", self.lengths.clone());
        for (p, name) in self.pairs.names("s").iter().enumerate() {
            out = out.column(name, "1", (0..shells).map(|b| self.series.mean(p * shells + b)));
        }
        let peak = peak("structure_factor_peak", "Highest point of S", "1/r_c", &self.lengths, &self.series);
        [out].into_iter().chain(peak).collect()
    }
}
