use super::*;
use psidpd_core::engine::pair_sums::count_in_shells;
use psidpd_core::model::WeightedDensity;

/// The number of shells in the integral `[w g]` over the pair distribution.
const SHELLS: usize = 200;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocalDensity {
    name: String,
    density: usize,
    species: Vec<String>,
    dimensions: usize,
    bins: usize,
    /// The highest density of the histogram, if the scene gives it.
    range: Option<f64>,
    /// The highest density of the histogram, as given or as found at the first sample.
    found: Option<f64>,
    /// The means of `w` and `−r w′` over each shell of the kernel's range.
    shells: Vec<[f64; 2]>,
    /// For each species the fraction of its particles in each bin and beyond the last; then for each (α, β) ⟨n_β⟩ at α,
    /// ⟨n⟩/ρ, [w g], −[r w′ g]/d.
    series: Series,
}

/// The longer one of the ranges of the weight function and of its force law.
fn longest(density: &WeightedDensity) -> f64 {
    density.kernel.range().max(density.force_kernel.range())
}

/// The means of w and −r w′ over each of `SHELLS` shells up to the range, by Simpson's rule.
fn means_in_shells(density: &WeightedDensity, dimensions: usize) -> Vec<[f64; 2]> {
    let range = longest(density);
    let h = range / SHELLS as f64;
    let f = |r: f64| {
        let surface = match dimensions {
            2 => std::f64::consts::TAU * r,
            _ => 2.0 * std::f64::consts::TAU * r * r,
        };
        // The range is approached from below, because the slope of the linear kernel jumps there.
        let r = r.min(range * (1.0 - 1e-15));
        [density.kernel.value(r), -r * density.force_kernel.slope(r)].map(|of| surface * of)
    };
    (0..SHELLS)
        .map(|k| {
            let a = k as f64 * h;
            let per_volume = h / 6.0 / super::rdf::shell_volume(dimensions, a, a + h);
            std::array::from_fn(|c| per_volume * (f(a)[c] + 4.0 * f(a + 0.5 * h)[c] + f(a + h)[c]))
        })
        .collect()
}

impl Meter for LocalDensity {
    const TABLE: Table = Table {
        path: "local_density",
        title: "distribution of a weighted local density",
        about: "P(n) of n = Σ_j w(r_ij), of all species, at the particles of each species: `p_SPECIES` (`p` with one), \
                normalised to 1. `local_density_means`: for species B at A, `mean_A_B` = ⟨n_B⟩; `relative_A_B` = \
                ⟨n_B⟩/ρ_B with ρ_B the mean density of the box, N_B − 1 of V for A = B; `wg_A_B` = [w g] = ∫ w g \
                over the sampled g(r) in 200 shells; `rwg_A_B` = −[r w′ g]/d with the force kernel, over the same shells. Without self term \
                ⟨n⟩/ρ = [w g] (Trofimov et al., J. Chem. Phys. 117, 9383 (2002)), the two differ by the width of the \
                shells; −[r w′ g]/d multiplies ψ′ in the virial, and all are 1 if g = 1.",
        keys: keys! {
            "density": ValueKind::Name("a density of the model"), Need::Default("the first"),
                "Which density."
                => "\"n\"";
            "bins": ValueKind::Whole(1, 10_000), Need::Default("200"),
                "Bins of the histogram."
                => "50";
            "range": ValueKind::Positive, Need::Default("twice the largest n of the first sample"),
                "Where the histogram ends; it begins at 0."
                => "20.0";
        },
        ..PLAIN
    };

    const PAIRS: Pairs = Pairs::Sums;

    fn read(options: &Options) -> Result<LocalDensity, FileError> {
        let fluid = options.place.fluid;
        let names: Vec<(&str, usize)> =
            fluid.densities.iter().enumerate().map(|(k, d)| (d.name.as_str(), k)).collect();
        if names.is_empty() {
            return Err(options.error("", "the model has no density"));
        }
        let density = options.choice("density", &names)?.unwrap_or(0);
        let bins = options.count("bins")?;
        let kinds = fluid.species.len();
        Ok(LocalDensity {
            name: fluid.densities[density].name.clone(),
            density,
            species: fluid.species.clone(),
            dimensions: fluid.dimensions,
            bins,
            range: options.positive("range")?,
            found: None,
            shells: means_in_shells(&fluid.densities[density], fluid.dimensions),
            series: Series::new(kinds * (bins + 1) + 4 * kinds * kinds),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let (species, fluid) = (view.species, &frame.evaluator.fluid);
        let (kinds, densities) = (self.species.len(), frame.densities());
        let at = |i: usize, beta: usize| densities[i * fluid.variables() + self.density * kinds + beta];
        let totals: Vec<f64> =
            (0..species.len()).map(|i| (0..kinds).map(|b| at(i, b)).sum::<f64>()).collect();
        let largest = totals.iter().copied().fold(0.0, f64::max);
        let range = self.range.unwrap_or(if largest > 0.0 { 2.0 * largest } else { 1.0 });
        let range = *self.found.get_or_insert(range);
        let mut numbers = vec![0.0f64; kinds];
        species.iter().for_each(|s| numbers[*s as usize] += 1.0);
        let mut row = vec![0.0; self.series.width()];
        let (histogram, rest) = row.split_at_mut(kinds * (self.bins + 1));
        for (total, s) in totals.iter().zip(species) {
            let bin = ((total / range * self.bins as f64) as usize).min(self.bins);
            histogram[*s as usize * (self.bins + 1) + bin] += 1.0 / numbers[*s as usize];
        }
        let volume = frame.volume();
        // The number density of partners of a particle of α.
        let partners = |a: usize, b: usize| if a == b { numbers[b] - 1.0 } else { numbers[b] } / volume;
        for (i, s) in species.iter().enumerate() {
            for b in 0..kinds {
                rest[4 * (*s as usize * kinds + b)] += at(i, b) / numbers[*s as usize];
            }
        }
        let (range, space) = (longest(&fluid.densities[self.density]), (view.domain, view.dimensions));
        let numbers_of_pairs = count_in_shells(view.pool, view.x, species, kinds, space, range, SHELLS);
        let kinds_of_pairs = (0..kinds).flat_map(|a| (a..kinds).map(move |b| (a, b)));
        for ((a, b), counts) in kinds_of_pairs.zip(numbers_of_pairs.chunks_exact(SHELLS)) {
            let mut sums = [0.0; 2];
            for (count, means) in counts.iter().zip(&self.shells) {
                (0..2).for_each(|c| sums[c] += *count as f64 * means[c]);
            }
            // Two particles of one species make a pair with either of them first.
            for k in [a * kinds + b, b * kinds + a] {
                rest[4 * k + 2] += sums[0];
                rest[4 * k + 3] += sums[1] / self.dimensions as f64;
            }
        }
        for a in 0..kinds {
            for b in 0..kinds {
                let mean = &mut rest[4 * (a * kinds + b)..4 * (a * kinds + b) + 4];
                if partners(a, b) > 0.0 {
                    mean[1] = mean[0] / partners(a, b);
                }
                (2..4).for_each(|k| mean[k] /= numbers[a] * partners(a, b));
            }
        }
        // A species without particles has no distribution.
        row.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
        self.series.push(&row)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn restart(&mut self) {
        self.found = None;
    }

    fn finish(&self) -> Vec<Observation> {
        let kinds = self.species.len();
        let range = self.found.unwrap_or(1.0);
        let width = range / self.bins as f64;
        let middles = (0..self.bins).map(|k| (k as f64 + 0.5) * width).collect();
        let title = format!("Distribution of the local density {}", self.name);
        let mut curve = Observation::new("local_density", &title, Kind::Curve, &self.series)
            .against(&self.name, "1/volume", middles);
        let title = "Local densities and kernel integrals";
        let mut means = Observation::new("local_density_means", title, Kind::Scalar, &self.series);
        let mut beyond: f64 = 0.0;
        for (s, species) in self.species.iter().enumerate() {
            let first = s * (self.bins + 1);
            let name = if kinds == 1 { "p".to_owned() } else { format!("p_{species}") };
            let share = (0..self.bins).map(|k| self.series.mean(first + k).times(1.0 / width));
            curve = curve.column(&name, "volume", share);
            beyond = beyond.max(self.series.mean(first + self.bins).value);
        }
        if beyond > 0.0 {
            curve = curve.note(format!("A share of {beyond:.2e} is beyond the histogram."));
        }
        for (a, at) in self.species.iter().enumerate() {
            for (b, of) in self.species.iter().enumerate() {
                let first = kinds * (self.bins + 1) + 4 * (a * kinds + b);
                for (k, (what, unit)) in [("mean", "1/volume"), ("relative", "1"), ("wg", "1"), ("rwg", "1")]
                    .into_iter()
                    .enumerate()
                {
                    means = means.column(&format!("{what}_{at}_{of}"), unit, [self.series.mean(first + k)]);
                }
            }
        }
        vec![curve, means]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::model::kernel::{Kernel, KernelKind};

    /// The integrals `[w]` and `−[r w′]` over all shells are 1 and d.
    #[test]
    fn shells_add_up_to_the_norm_of_the_kernel() {
        for &kind in KernelKind::ALL {
            for dimensions in [2, 3] {
                let kernel = Kernel::new(kind, 0.75, dimensions);
                let (name, correction) = ("n".into(), Vec::new());
                let density = WeightedDensity {
                    name,
                    kernel,
                    force_kernel: kernel,
                    includes_self: false,
                    correction,
                    bounds: None,
                };
                let means = means_in_shells(&density, dimensions);
                let h = 0.75 / SHELLS as f64;
                let volume =
                    |k: usize| crate::meter::rdf::shell_volume(dimensions, k as f64 * h, (k + 1) as f64 * h);
                let sum = |c: usize| (0..SHELLS).map(|k| volume(k) * means[k][c]).sum::<f64>();
                let [norm, virial] = [sum(0), sum(1)];
                assert!((norm - 1.0).abs() < 1e-8, "{} {dimensions}: {norm}", kind.name());
                assert!((virial - dimensions as f64).abs() < 1e-7, "{} {dimensions}: {virial}", kind.name());
            }
        }
    }
}
