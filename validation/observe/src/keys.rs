//! Tables of all keys of `[observe]`. They are the source of the reference `docs/observables.md`, and other
//! keys are refused.

use super::options::AXES;
pub use psidpd_core::document::keys::{Key, Need, Table, ValueKind, key, keys, names};

/// A table without keys, of which a file has one.
pub const PLAIN: Table = Table::new("", "", &[]);

/// The keys of `[observe]` for every observable, and the keys that each observable has in addition.
pub const COMMON: &[Key] = keys! {
    "every": ValueKind::Whole(1, u64::MAX), Need::Default("10"),
        "Steps between samples: those whose number is a multiple of it."
        => "5";
    "stages": ValueKind::Names, Need::Default("the last stage"),
        "In which stages to sample. Each has its own result."
        => "[\"produce\"]";
    "skip": ValueKind::Count, Need::Default("0"),
        "Steps at the beginning of a stage that are not sampled."
        => "20";
};

pub(super) const AXIS: Key = key(
    "axis",
    ValueKind::Choice(|| names(&AXES)),
    Need::Default("the normal of the initial slab, or else the last direction"),
    "The direction of the profile, normal to the faces of the box there.",
    "\"x\"",
);

pub(super) const BINS: Key = key(
    "bins",
    ValueKind::Whole(1, 10_000),
    Need::Default("as many as make them 0.1 wide, or a little less"),
    "Bins along the axis.",
    "50",
);

pub(super) const RECENTRE: Key = key(
    "recentre",
    ValueKind::FlagOrSpecies,
    Need::Default(
        "true if the scene starts from a slab normal to the axis, the species of the first layer if layers of several liquids fill the box, else false",
    ),
    "Whether each sample is shifted so that the centre of mass of all particles, or of those of one species, taken on \
            the circle, is at 0: a slab that drifts, or a layer in a mixture that fills the box, is not smeared then.",
    "true",
);
