use psidpd_core::engine::PeriodicBox;

/// Particles at one step, borrowed from whoever has them.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// Number of the step.
    pub step: u64,
    /// Time since the start of the run, in units of the model.
    pub time: f64,
    /// 2 or 3.
    pub dimensions: usize,
    /// The box.
    pub domain: &'a PeriodicBox,
    /// Names of the species.
    pub names: &'a [String],
    /// Positions, in the box.
    pub x: &'a [[f64; 3]],
    /// Velocities; none where the source has none.
    pub v: Option<&'a [[f64; 3]]>,
    /// Species, from 0.
    pub species: &'a [i32],
    /// Tags, from 1.
    pub tag: &'a [i32],
}

impl Frame<'_> {
    /// Which directions repeat: never z in two dimensions.
    pub fn periodic(&self) -> [bool; 3] {
        let [x, y, z] = self.domain.periodic();
        [x, y, z && self.dimensions == 3]
    }

    /// How many particles there are.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// How many particles each species has, in the order of `names`.
    pub fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.names.len()];
        for species in self.species {
            if let Some(count) = counts.get_mut(*species as usize) {
                *count += 1;
            }
        }
        counts
    }
}
