//! The direction of profiles, with its bins.

use super::{Deserialize, FileError, Options, PeriodicBox, Serialize};
use crate::frame::{Frame, View};
use crate::options::Centre;
use crate::profile::centre;
use std::borrow::Cow;

/// Bins along one direction of the box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Across {
    pub axis: usize,
    pub bins: usize,
    centre: Centre,
    /// The lower end of the box along the axis.
    origin: f64,
    /// The distance of the two faces normal to the profile.
    pub height: f64,
    pub volume: f64,
    periodic: bool,
}

impl Across {
    /// Reads the bins of an observable; `centred` is true if its samples are always recentred.
    pub fn read(options: &Options, centred: bool) -> Result<Across, FileError> {
        let mut across = Across::read_along(options, options.axis("axis")?)?;
        let slab = options.place.slab.filter(|slab| across.periodic && slab.axis == across.axis);
        let preset = slab.map_or(Centre::Box, |slab| slab.centre);
        across.centre = if centred {
            Centre::All
        } else if let Some(species) = options.as_species("recentre")? {
            Centre::Species(species as i32)
        } else {
            match options.flag("recentre")? {
                None => preset,
                Some(true) => Centre::All,
                Some(false) => Centre::Box,
            }
        };
        if across.centre != Centre::Box && !across.periodic {
            return Err(options.error("recentre", "the box is not periodic along the axis"));
        }
        Ok(across)
    }

    /// Reads bins that are never recentred. They lie along `axis`, else along the normal of the initial slab, else along the
    /// last direction.
    pub fn read_along(options: &Options, axis: Option<usize>) -> Result<Across, FileError> {
        let axis =
            axis.or(options.place.slab.map(|slab| slab.axis)).unwrap_or(options.place.fluid.dimensions - 1);
        let across = Across::at(options, axis);
        Ok(Across { bins: options.bins(across.height, 0.1)?, ..across })
    }

    /// One bin over the whole direction.
    pub fn at(options: &Options, axis: usize) -> Across {
        let domain = options.place.domain;
        Across {
            axis,
            bins: 1,
            centre: Centre::Box,
            origin: domain.origin()[axis],
            height: domain.height(axis),
            volume: domain.volume(options.place.fluid.dimensions),
            periodic: domain.periodic()[axis],
        }
    }

    pub fn is_periodic(&self) -> bool {
        self.periodic
    }

    pub fn bin_height(&self) -> f64 {
        self.height / self.bins as f64
    }

    pub fn bin_volume(&self) -> f64 {
        self.volume / self.bins as f64
    }

    pub fn area(&self) -> f64 {
        self.volume / self.height
    }

    pub fn name(&self) -> &'static str {
        ["x", "y", "z"][self.axis]
    }

    /// The middles of the bins, measured from the centre if samples are centred.
    pub fn middles(&self) -> Vec<f64> {
        let low = if self.centre == Centre::Box { self.origin } else { -0.5 * self.height };
        (0..self.bins).map(|k| low + (k as f64 + 0.5) * self.bin_height()).collect()
    }

    /// A remark on the coordinate for readers.
    pub fn note(&self) -> &'static str {
        match self.centre {
            Centre::Box => "",
            Centre::All => "Samples are centred.",
            Centre::Species(_) => "Samples are centred on one species.",
        }
    }

    /// The unit normal of the faces.
    pub fn normal(&self, domain: &PeriodicBox) -> [f64; 3] {
        let (a, b) = (domain.edge((self.axis + 1) % 3), domain.edge((self.axis + 2) % 3));
        let n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        n.map(|c| c / length)
    }

    /// Positions of the particles as fractions of the height; `None` if the particles have no centre that could be moved to ½.
    pub fn fractions<'a>(&self, frame: &'a Frame) -> Option<Cow<'a, [f64]>> {
        let (axis, about, found) =
            frame.fractions.get_or_init(|| (self.axis, self.centre, self.find(&frame.view)));
        match (*axis, *about) == (self.axis, self.centre) {
            true => found.as_deref().map(Cow::Borrowed),
            false => self.find(&frame.view).map(Cow::Owned),
        }
    }

    fn find(&self, view: &View) -> Option<Vec<f64>> {
        let domain = view.domain;
        let mut s: Vec<f64> = view.x.iter().map(|x| domain.fraction(*x)[self.axis]).collect();
        let counts = |k: usize| match self.centre {
            Centre::Box => false,
            Centre::All => true,
            Centre::Species(one) => view.species[k] == one,
        };
        (self.centre == Centre::Box || centre(&mut s, counts)).then_some(s)
    }

    /// The bin of a fraction; `None` outside a box that is not periodic.
    pub fn bin(&self, fraction: f64) -> Option<usize> {
        let s = if self.periodic { fraction.rem_euclid(1.0) } else { fraction };
        if !(0.0..=1.0).contains(&s) {
            return None;
        }
        Some(((s * self.bins as f64) as usize).min(self.bins - 1))
    }
}
