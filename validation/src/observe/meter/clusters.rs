use super::Meter;
use crate::observe::frame::Frame;
use crate::observe::keys::{Key, Need, Table, ValueKind, key};
use crate::observe::observation::{Kind, Observation};
use crate::observe::request::Options;
use crate::observe::series::{Measured, Series};
use psidpd_core::document::FileError;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::reference::for_each_pair;
use serde::{Deserialize, Serialize};

/// Sets that are joined pair by pair.
struct Union(Vec<usize>);

impl Union {
    fn root(&mut self, mut k: usize) -> usize {
        while self.0[k] != k {
            self.0[k] = self.0[self.0[k]];
            k = self.0[k];
        }
        k
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        // The smaller index is the name, so that names do not depend on the order of pairs.
        self.0[a.max(b)] = a.min(b);
    }
}

/// The cluster of each particle, named by its first member; `None` for particles that do not take part.
/// Particles closer than `distance` are of one cluster.
pub(super) fn label(
    x: &[[f64; 3]],
    domain: &PeriodicBox,
    dimensions: usize,
    distance: f64,
    takes_part: impl Fn(usize) -> bool,
) -> Vec<Option<usize>> {
    let mut union = Union((0..x.len()).collect());
    for_each_pair(x, domain, dimensions, distance, |p| {
        if takes_part(p.i) && takes_part(p.j) {
            union.join(p.i, p.j);
        }
    });
    (0..x.len()).map(|k| takes_part(k).then(|| union.root(k))).collect()
}

/// Sizes of clusters by name.
pub(super) fn sizes(labels: &[Option<usize>]) -> Vec<usize> {
    let mut sizes = vec![0; labels.len()];
    labels.iter().flatten().for_each(|k| sizes[*k] += 1);
    sizes
}

pub(super) const DISTANCE: Key = key(
    "distance",
    ValueKind::Words("positive number, at most half the box"),
    Need::Default("the longest range of a conservative interaction"),
    "Particles closer than this are of one cluster.",
    "0.8",
);

/// The distance that makes clusters.
pub(super) fn read_distance(options: &Options) -> Result<f64, FileError> {
    let fluid = options.place.fluid;
    let longest = fluid.conservative_range();
    let half = options.half_box();
    let preset = if longest > 0.0 { longest } else { fluid.cutoff() };
    let distance = options.positive("distance")?.unwrap_or(if preset > 0.0 { preset } else { 1.0 }.min(half));
    if distance > half * (1.0 + 1e-12) {
        return Err(options.error("distance", format!("must not exceed half the box, {half}, is {distance}")));
    }
    Ok(distance)
}

/// Clusters by distance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Clusters {
    distance: f64,
    species: Option<usize>,
    smallest: usize,
    dimensions: usize,
    /// Time, number, size of the largest, mean size.
    series: Series,
}

impl Meter for Clusters {
    const TABLE: Table = Table {
        path: "clusters",
        title: "clusters by distance",
        array: false,
        forms: ("", &[]),
        about: "Particles closer than `distance` are of one cluster, and so are their clusters (union-find). `count` of \
                the clusters of at least `smallest` particles, `largest` and `mean_size` (the mean of the sizes in a \
                sample, 0 if there are none). `clusters_series` has them against time, in means over blocks of \
                samples when there are more than 511.",
        keys: &[
            DISTANCE,
            key(
                "species",
                ValueKind::Words("name of a species"),
                Need::Default("all"),
                "Which particles take part.",
                "\"A\"",
            ),
            key(
                "smallest",
                ValueKind::Words("whole number from 1"),
                Need::Default("1"),
                "Particles in the smallest cluster that counts.",
                "10",
            ),
        ],
    };

    fn read(options: &Options) -> Result<Clusters, FileError> {
        Ok(Clusters {
            distance: read_distance(options)?,
            species: options.species("species")?,
            smallest: options.count("smallest", 1, 1 << 40)?.unwrap_or(1),
            dimensions: options.place.fluid.dimensions,
            series: Series::new(4),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let species = view.species;
        let takes_part = |k: usize| self.species.is_none_or(|s| species[k] as usize == s);
        let labels = label(view.x, view.domain, self.dimensions, self.distance, takes_part);
        let sizes: Vec<usize> = sizes(&labels).into_iter().filter(|n| *n >= self.smallest).collect();
        let (count, largest) = (sizes.len() as f64, sizes.iter().max().copied().unwrap_or(0) as f64);
        let mean = sizes.iter().sum::<usize>() as f64 / count.max(1.0);
        self.series.push(&[frame.view.time, count, largest, mean])
    }

    fn forget(&mut self) {
        self.series.clear();
    }

    fn finish(&self) -> Vec<Observation> {
        let names = ["count", "largest", "mean_size"];
        let mut scalar =
            Observation::new("clusters", "Clusters", Kind::Scalar).samples(self.series.samples());
        let mut series = Observation::new("clusters_series", "Clusters", Kind::Series)
            .against("time", "time", self.series.channel(0))
            .samples(self.series.samples());
        for (k, name) in names.into_iter().enumerate() {
            scalar = scalar.column(name, "1", [self.series.mean(1 + k)]);
            let values = self.series.channel(1 + k).into_iter();
            series = series.column(name, "1", values.map(|value| Measured { value, error: f64::NAN }));
        }
        vec![scalar, series]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::StdRng, seq::SliceRandom};

    /// A chain through the boundary, a ring and single particles, in any order.
    #[test]
    fn constructed_clusters() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [10.0; 3], [true; 3]).unwrap();
        let chain = (0..12).map(|k| [(6.0 + 0.5 * f64::from(k)).rem_euclid(10.0), 1.0, 1.0]);
        let ring = (0..8).map(|k| {
            let a = f64::from(k) * std::f64::consts::TAU / 8.0;
            [5.0 + 0.7 * a.cos(), 5.0 + 0.7 * a.sin(), 5.0]
        });
        let single = (0..3).map(|k| [2.0, 8.0, 2.0 + 2.0 * f64::from(k)]);
        let mut all: Vec<([f64; 3], usize)> = chain.map(|x| (x, 0)).collect();
        all.extend(ring.map(|x| (x, 1)));
        all.extend(single.enumerate().map(|(k, x)| (x, 2 + k)));
        let mut rng = StdRng::seed_from_u64(2);
        for _ in 0..20 {
            all.shuffle(&mut rng);
            let x: Vec<[f64; 3]> = all.iter().map(|a| a.0).collect();
            let labels = label(&x, &domain, 3, 0.6, |_| true);
            for (i, a) in all.iter().enumerate() {
                for (j, b) in all.iter().enumerate() {
                    assert_eq!(labels[i] == labels[j], a.1 == b.1);
                }
            }
            let mut found: Vec<usize> = sizes(&labels).into_iter().filter(|n| *n > 0).collect();
            found.sort_unstable();
            assert_eq!(found, [1, 1, 1, 8, 12]);
            // Without the seventh of the chain's particles it falls in two, and that one has no cluster.
            let cut = all.iter().position(|a| (a.0[0] - 8.0).abs() < 1e-9 && a.1 == 0).unwrap();
            let labels = label(&x, &domain, 3, 0.6, |k| k != cut);
            assert_eq!(labels[cut], None);
            assert_eq!(sizes(&labels).into_iter().filter(|n| *n > 3).count(), 3);
        }
    }
}
