use psidpd_passes::domain::PeriodicBox;

/// The periodic images of particles, as ghosts behind the owned particles in every array: a search for pairs in boxes narrower
/// than the cut-off, and hosts in tests, compute with them in open space.
#[derive(Debug, Clone, Default)]
pub struct Images {
    owned: usize,
    /// Owned particle of each ghost.
    owner: Vec<u32>,
}

impl Images {
    /// Appends to `x`, which holds the `owned` particles, their images within `cutoff` of the box.
    ///
    /// Positions must lie in the box along its periodic directions ([`PeriodicBox::wrap`]). Boxes
    /// narrower than the cut-off get as many shells of images as they need. In two dimensions the
    /// third direction has none.
    pub fn build(
        &mut self,
        domain: &PeriodicBox,
        dimensions: usize,
        cutoff: f64,
        owned: usize,
        x: &mut Vec<[f64; 3]>,
    ) {
        x.truncate(owned);
        self.owned = owned;
        self.owner.clear();
        for k in 0..dimensions {
            if !domain.periodic()[k] {
                continue;
            }
            let margin = cutoff / domain.height(k);
            let shells = margin.ceil() as i32;
            let edge = domain.edge(k);
            // Images in one direction have images in the next direction, so that corners are filled too.
            for index in 0..x.len() {
                let here = x[index];
                let s = domain.fraction(here)[k];
                for shell in (-shells..=shells).filter(|m| *m != 0) {
                    let image = s + shell as f64;
                    if image >= -margin && image <= 1.0 + margin {
                        x.push(std::array::from_fn(|c| here[c] + shell as f64 * edge[c]));
                        self.owner.push(self.owner_of(index) as u32);
                    }
                }
            }
        }
    }

    /// The owned particle whose index or image's index is `index`.
    pub(super) fn owner_of(&self, index: usize) -> usize {
        if index < self.owned { index } else { self.owner[index - self.owned] as usize }
    }

    /// The number of ghosts.
    pub fn ghosts(&self) -> usize {
        self.owner.len()
    }

    /// Copies `width` numbers per particle from owners to their ghosts; `values` contains owned
    /// particles and grows by the ghosts.
    pub fn forward<T: Copy + Default>(&self, width: usize, values: &mut Vec<T>) {
        values.resize((self.owned + self.owner.len()) * width, T::default());
        self.copy_to_ghosts(width, values);
    }

    /// Copies `width` numbers per particle from owners to their ghosts, which follow them in `values`.
    pub fn copy_to_ghosts<T: Copy>(&self, width: usize, values: &mut [T]) {
        let (own, ghosts) = values.split_at_mut(self.owned * width);
        if width == 0 {
            return;
        }
        for (ghost, owner) in ghosts.chunks_exact_mut(width).zip(&self.owner) {
            let from = *owner as usize * width;
            ghost.copy_from_slice(&own[from..from + width]);
        }
    }

    /// Adds the forces on ghosts to their owners.
    pub fn reverse(&self, forces: &mut [[f64; 3]]) {
        let (own, ghosts) = forces.split_at_mut(self.owned);
        for (ghost, owner) in ghosts.iter().zip(&self.owner) {
            let force = &mut own[*owner as usize];
            (0..3).for_each(|k| force[k] += ghost[k]);
        }
    }
}
