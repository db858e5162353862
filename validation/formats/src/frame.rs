use psidpd_core::engine::PeriodicBox;

/// The particles at one step, borrowed from their owner.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    pub step: u64,
    /// The time since the start of the run, in units of the model.
    pub time: f64,
    pub dimensions: usize,
    pub domain: &'a PeriodicBox,
    pub names: &'a [String],
    /// Positions are wrapped into the box.
    pub x: &'a [[f64; 3]],
    pub v: Option<&'a [[f64; 3]]>,
    /// Species are counted from 0.
    pub species: &'a [i32],
    /// Tags are counted from 1.
    pub tag: &'a [i32],
}

impl Frame<'_> {
    /// The periodic directions. In two dimensions z is not one of them.
    pub fn periodic(&self) -> [bool; 3] {
        let [x, y, z] = self.domain.periodic();
        [x, y, z && self.dimensions == 3]
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The number of particles of each species, in the order of `names`.
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
