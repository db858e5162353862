use psidpd_core::engine::PeriodicBox;

/// Points sorted into cells, for fast searches of neighbours.
#[derive(Debug, Clone)]
pub struct Near<'a> {
    domain: &'a PeriodicBox,
    dimensions: usize,
    distance: f64,
    cells: [usize; 3],
    points: Vec<Vec<[f64; 3]>>,
}

impl<'a> Near<'a> {
    /// Creates an empty set with cells for about `count` points; points closer than `distance` count as close.
    pub fn new(domain: &'a PeriodicBox, dimensions: usize, distance: f64, count: usize) -> Near<'a> {
        let volume = domain.volume(dimensions);
        let edge = distance.max((volume / count.max(1) as f64).powf(1.0 / dimensions as f64));
        let along = |k: usize| match k < dimensions {
            true => ((domain.height(k) / edge) as usize).max(1),
            false => 1,
        };
        let cells: [usize; 3] = std::array::from_fn(along);
        let points = vec![Vec::new(); cells.iter().product()];
        Near { domain, dimensions, distance, cells, points }
    }

    /// The cell of a point, which lies in the box or in one of its images.
    fn cell(&self, x: [f64; 3]) -> [i64; 3] {
        let s = self.domain.fraction(x);
        std::array::from_fn(|k| match k < self.dimensions {
            true => ((s[k] - s[k].floor()) * self.cells[k] as f64) as i64,
            false => 0,
        })
    }

    fn index(&self, cell: [i64; 3]) -> usize {
        let at: [usize; 3] = std::array::from_fn(|k| cell[k].rem_euclid(self.cells[k] as i64) as usize);
        at[0] + self.cells[0] * (at[1] + self.cells[1] * at[2])
    }

    pub fn push(&mut self, x: [f64; 3]) {
        let index = self.index(self.cell(x));
        self.points[index].push(x);
    }

    /// Whether a point or one of its images is close to `x`.
    pub fn is_close(&self, x: [f64; 3]) -> bool {
        let here = self.cell(x);
        let reach = |k: usize| if k < self.dimensions { -1..=1 } else { 0..=0 };
        reach(0).any(|a| {
            reach(1).any(|b| {
                reach(2).any(|c| {
                    let cell = [here[0] + a, here[1] + b, here[2] + c];
                    self.points[self.index(cell)].iter().any(|y| {
                        let d = self.domain.minimum_image(x, *y);
                        let square: f64 = d[..self.dimensions].iter().map(|d| d * d).sum();
                        square < self.distance * self.distance
                    })
                })
            })
        })
    }
}
