use super::linked::{DISTANCE, Distance, Linked};
use super::*;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Clusters {
    distance: Distance,
    species: Option<usize>,
    smallest: usize,
    dimensions: usize,
    /// Time, number of clusters, size of the largest, mean size.
    series: Series,
}

impl Meter for Clusters {
    const TABLE: Table = Table {
        path: "clusters",
        title: "clusters by distance",
        about: "Particles closer than `distance` are of one cluster, and so are their clusters (union-find). `count` of \
                the clusters of at least `smallest` particles, `largest` and `mean_size` (the mean of the sizes in a \
                sample, 0 if there are none), and the `distance`. `clusters_series` has them against time, in means over blocks of \
                samples when there are more than 511.",
        keys: keys! {
            use DISTANCE;
            "species": ValueKind::Name("a species"), Need::Default("all"),
                "Which particles take part."
                => "\"A\"";
            "smallest": ValueKind::Whole(1, u64::MAX), Need::Default("1"),
                "Particles in the smallest cluster that counts."
                => "10";
        },
        ..PLAIN
    };

    const PAIRS: Pairs = Pairs::List;

    fn read(options: &Options) -> Result<Clusters, FileError> {
        Ok(Clusters {
            distance: Distance::read(options)?,
            species: options.species("species")?,
            smallest: options.count("smallest")?,
            dimensions: options.place.fluid.dimensions,
            series: Series::new(4),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let species = view.species;
        let only = self.species;
        let takes_part = |k: usize| only.is_none_or(|s| species[k] as usize == s);
        let distance = self.distance.at(view.x, view.domain, self.dimensions, takes_part);
        let linked = Linked::of(frame, distance, takes_part);
        let sizes: Vec<usize> = linked.sizes.into_iter().filter(|n| *n >= self.smallest).collect();
        let (count, largest) = (sizes.len() as f64, sizes.iter().max().copied().unwrap_or(0) as f64);
        let mean = sizes.iter().sum::<usize>() as f64 / count.max(1.0);
        self.series.push(&[frame.view.time, count, largest, mean])
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn restart(&mut self) {
        self.distance.forget();
    }

    fn finish(&self) -> Vec<Observation> {
        let names = ["count", "largest", "mean_size"];
        let mut scalar = Observation::new("clusters", "Clusters", Kind::Scalar, &self.series);
        let mut series = Observation::new("clusters_series", "Clusters", Kind::Series, &self.series);
        series = series.against("time", "time", self.series.channel(0));
        for (k, name) in names.into_iter().enumerate() {
            scalar = scalar.column(name, "1", [self.series.mean(1 + k)]);
            let values = self.series.channel(1 + k).into_iter();
            series = series.column(name, "1", values.map(|value| Measured { value, error: f64::NAN }));
        }
        if let Some(distance) = self.distance.value() {
            scalar = scalar.column("distance", "length", [Measured { value: distance, error: f64::NAN }]);
        }
        vec![scalar, series]
    }
}
