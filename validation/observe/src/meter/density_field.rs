use super::*;

/// The number of rows of fields that are kept for error bars.
const ROWS: usize = 64;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DensityField {
    axes: [usize; 2],
    bins: [usize; 2],
    origin: [f64; 2],
    width: [f64; 2],
    volume: f64,
    species: Vec<String>,
    series: Series,
}

impl Meter for DensityField {
    const TABLE: Table = Table {
        path: "density_field",
        title: "density on a plane",
        about: "Number density in columns of the box, averaged over `axis`, of all particles and of each of several \
                species: a map of drops, films and domains that stay where they are. The first two columns are the \
                middles of the cells, the later of the two directions running fastest. The box must have right \
                angles.",
        keys: keys! {
            "axis": ValueKind::Choice(|| names(&AXES)), Need::Default("y; none in two dimensions"),
                "The direction that is averaged over."
                => "\"x\"";
            "bins": ValueKind::Wholes(1, 2000), Need::Default("as many as make them 0.25 wide, or a little less"),
                "Cells along the other two directions, in their order."
                => "[10, 20]";
        },
        ..PLAIN
    };

    fn read(options: &Options) -> Result<DensityField, FileError> {
        let (domain, fluid) = (options.place.domain, options.place.fluid);
        let d = fluid.dimensions;
        options.require_right_angles("")?;
        let lengths = domain.lengths();
        let depth = match options.axis("axis")? {
            Some(_) if d == 2 => return Err(options.error("axis", "two dimensions have one plane only")),
            Some(axis) => axis,
            None if d == 2 => 2,
            None => 1,
        };
        let axes = match depth {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let bins = options.bins_of_plane(axes.map(|k| lengths[k]))?;
        let kinds = if fluid.species.len() > 1 { fluid.species.len() } else { 1 };
        Ok(DensityField {
            axes,
            bins,
            origin: axes.map(|k| domain.origin()[k]),
            width: std::array::from_fn(|k| lengths[axes[k]] / bins[k] as f64),
            volume: domain.volume(d) / (bins[0] * bins[1]) as f64,
            species: fluid.species.clone(),
            series: Series::with_rows(bins[0] * bins[1] * kinds, ROWS),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let cells = self.bins[0] * self.bins[1];
        let mut field = vec![0.0; self.series.width()];
        for (x, s) in view.x.iter().zip(view.species) {
            let [a, b] = std::array::from_fn(|k| {
                let place = (x[self.axes[k]] - self.origin[k]) / self.width[k];
                (place.max(0.0) as usize).min(self.bins[k] - 1)
            });
            field[*s as usize * cells + a * self.bins[1] + b] += 1.0 / self.volume;
        }
        self.series.push(&field)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let cells = self.bins[0] * self.bins[1];
        let middle = |k: usize, bin: usize| self.origin[k] + (bin as f64 + 0.5) * self.width[k];
        let names = self.axes.map(|k| ["x", "y", "z"][k]);
        let kinds = self.series.width() / cells;
        let total =
            (0..cells).map(|c| self.series.linear(|row| (0..kinds).map(|s| row[s * cells + c]).sum()));
        let mut out = Observation::new("density_field", "Density on a plane", Kind::Field, &self.series)
            .exact(names[0], "length", (0..cells).map(|c| middle(0, c / self.bins[1])))
            .exact(names[1], "length", (0..cells).map(|c| middle(1, c % self.bins[1])))
            .column("density", "1/volume", total);
        if kinds > 1 {
            for (s, name) in self.species.iter().enumerate() {
                let own = (0..cells).map(|c| self.series.mean(s * cells + c));
                out = out.column(&format!("density_{name}"), "1/volume", own);
            }
        }
        vec![out]
    }
}
