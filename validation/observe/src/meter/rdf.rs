use super::peak::peak;
use super::species_pairs::SpeciesPairs;
use super::*;
use psidpd_core::engine::pair_sums::count_in_shells;
use std::f64::consts::PI;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rdf {
    range: f64,
    bins: usize,
    dimensions: usize,
    pairs: SpeciesPairs,
    series: Series,
}

/// The volume of the shell from `a` to `b`; in two dimensions the area.
pub(super) fn shell_volume(dimensions: usize, a: f64, b: f64) -> f64 {
    match dimensions {
        2 => PI * (b * b - a * a),
        _ => 4.0 / 3.0 * PI * (b * b * b - a * a * a),
    }
}

impl Meter for Rdf {
    const TABLE: Table = Table {
        path: "rdf",
        title: "radial distribution functions",
        about: "Pairs in spherical shells (in two dimensions rings) over their number in an ideal gas of as many \
                particles in the same box, N_A (N_A − 1)/2 or N_A N_B pairs in V: exactly 1 on average in an ideal \
                gas. `g` of all particles, and `g_A_B` of each two of several species. `rdf_peak` is the highest point \
                of `g`, by a parabola: its `height`, and the distance that it is `at`.",
        keys: keys! {
            "range": ValueKind::HalfBox, Need::Default("twice the range of the model, or half the box"),
                "Up to which distance."
                => "2.0";
            "bins": ValueKind::Whole(1, 10_000), Need::Default("as many as make them 0.02 wide, or a little less"),
                "How many shells."
                => "40";
        },
        ..PLAIN
    };

    fn read(options: &Options) -> Result<Rdf, FileError> {
        let fluid = options.place.fluid;
        let half = options.half_box();
        let preset = if fluid.cutoff() > 0.0 { half.min(2.0 * fluid.cutoff()) } else { half };
        let range = options.within_half_box("range")?.unwrap_or(preset);
        let bins = options.bins(range, 0.02)?;
        let pairs = SpeciesPairs::new(&fluid.species);
        let series = Series::new(bins * pairs.len());
        Ok(Rdf { range, bins, dimensions: fluid.dimensions, pairs, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let species = view.species;
        let kinds = view.model.species().len();
        let place = (view.domain, self.dimensions);
        let by_species = count_in_shells(view.pool, view.x, species, kinds, place, self.range, self.bins);
        let all = (0..self.bins).map(|bin| by_species.iter().skip(bin).step_by(self.bins).sum::<u64>());
        let of_species = if kinds > 1 { &by_species[..] } else { &[] };
        let mut counts: Vec<f64> = all.chain(of_species.iter().copied()).map(|count| count as f64).collect();
        // The number of pairs of an ideal gas in a shell.
        let volume = frame.volume();
        let ideal = self.pairs.ideal_pairs(species);
        for (k, counts) in counts.chunks_exact_mut(self.bins).enumerate() {
            for (bin, count) in counts.iter_mut().enumerate() {
                let edge = |b: usize| self.range * b as f64 / self.bins as f64;
                let expected = ideal[k] * shell_volume(self.dimensions, edge(bin), edge(bin + 1)) / volume;
                // Kinds without pairs have no expected number to divide by.
                *count = if expected > 0.0 { *count / expected } else { 0.0 };
            }
        }
        self.series.push(&counts)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let width = self.range / self.bins as f64;
        let middles: Vec<f64> = (0..self.bins).map(|b| (b as f64 + 0.5) * width).collect();
        let peak = peak("rdf_peak", "Highest point of g", "length", &middles, &self.series);
        let mut out = Observation::new("rdf", "Radial distribution function", Kind::Curve, &self.series)
            .against("r", "length", middles);
        for (k, name) in self.pairs.names("g").iter().enumerate() {
            out = out.column(name, "1", (0..self.bins).map(|b| self.series.mean(k * self.bins + b)));
        }
        [out].into_iter().chain(peak).collect()
    }
}
