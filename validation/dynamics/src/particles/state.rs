use super::box_by_edges;
use super::tags::order_of_tags;
use psidpd_core::engine::PeriodicBox;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The particles in their box: all that a trajectory starts from and ends with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// The box. In two dimensions its third edge has length 1, and nothing depends on it.
    #[serde(with = "box_by_edges")]
    pub domain: PeriodicBox,
    pub mass: Vec<f64>,
    pub x: Vec<[f64; 3]>,
    pub v: Vec<[f64; 3]>,
    /// Species indices from 0, in the order of the model.
    pub species: Vec<i32>,
    /// Unique numbers from 1 that stay with the particles.
    pub tag: Vec<i32>,
    /// Number of box edges that a particle has travelled in each direction.
    pub image: Vec<[i32; 3]>,
}

impl State {
    /// Particles of the first species at rest at `x`, with tags from 1; `mass` has one entry per species.
    pub fn at_rest(domain: PeriodicBox, mass: Vec<f64>, x: Vec<[f64; 3]>) -> State {
        let count = x.len();
        State {
            domain,
            mass,
            x,
            v: vec![[0.0; 3]; count],
            species: vec![0; count],
            tag: (1..).take(count).collect(),
            image: vec![[0; 3]; count],
        }
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The particles in the order of their tags: a copy, unless they are in it.
    pub fn by_tag(&self) -> Cow<'_, State> {
        if self.tag.is_sorted() {
            return Cow::Borrowed(self);
        }
        let order = order_of_tags(&self.tag);
        Cow::Owned(State {
            domain: self.domain.clone(),
            mass: self.mass.clone(),
            x: order.iter().map(|k| self.x[*k]).collect(),
            v: order.iter().map(|k| self.v[*k]).collect(),
            species: order.iter().map(|k| self.species[*k]).collect(),
            tag: order.iter().map(|k| self.tag[*k]).collect(),
            image: order.iter().map(|k| self.image[*k]).collect(),
        })
    }

    /// Copies all particles of `other`, which has the same box and masses, and reuses the memory.
    pub fn copy_particles(&mut self, other: &State) {
        self.x.clone_from(&other.x);
        self.v.clone_from(&other.v);
        self.species.clone_from(&other.species);
        self.tag.clone_from(&other.tag);
        self.image.clone_from(&other.image);
    }

    /// Describes the first fault that makes this an invalid state of a model with `species` species.
    pub fn fault(&self, species: usize, dimensions: usize) -> Option<String> {
        let count = self.x.len();
        if count == 0 {
            return Some("there are no particles".into());
        }
        if count > i32::MAX as usize {
            return Some(format!("{count} particles are more than the largest tag, 2147483647"));
        }
        if [self.v.len(), self.species.len(), self.tag.len(), self.image.len()].iter().any(|n| *n != count) {
            return Some("particle arrays have different lengths".into());
        }
        if self.mass.len() != species {
            return Some(format!("{} masses for {species} species", self.mass.len()));
        }
        if let Some(m) = self.mass.iter().find(|m| !(m.is_finite() && **m > 0.0)) {
            return Some(format!("a mass of {m}: masses must be positive"));
        }
        let finite = |a: &[[f64; 3]]| a.iter().position(|p| !p.iter().all(|c| c.is_finite()));
        if let Some(k) = finite(&self.x).or_else(|| finite(&self.v)) {
            return Some(format!("position or velocity of particle {} is not finite", self.tag[k]));
        }
        if dimensions == 2 && self.v.iter().any(|v| v[2] != 0.0) {
            return Some("a particle of a two-dimensional model moves along z".into());
        }
        if let Some(k) = self.species.iter().position(|s| *s < 0 || *s as usize >= species) {
            return Some(format!("particle {} has species {}, out of range", self.tag[k], self.species[k]));
        }
        if let Some(k) = (0..count).find(|k| !self.is_between_walls(self.x[*k], dimensions)) {
            return Some(format!("particle {} is beyond a wall", self.tag[k]));
        }
        let mut tags = self.tag.clone();
        tags.sort_unstable();
        if tags[0] < 1 {
            return Some(format!("tags must be positive, found {}", tags[0]));
        }
        tags.windows(2).find(|w| w[0] == w[1]).map(|w| format!("tag {} is given twice", w[0]))
    }

    /// Whether a point lies between the walls of all directions that are not periodic.
    fn is_between_walls(&self, x: [f64; 3], dimensions: usize) -> bool {
        let (origin, lengths) = (self.domain.origin(), self.domain.lengths());
        (0..dimensions)
            .all(|k| self.domain.periodic()[k] || (origin[k]..=origin[k] + lengths[k]).contains(&x[k]))
    }
}
