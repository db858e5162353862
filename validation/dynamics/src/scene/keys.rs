//! Every key of the scene file, in one table: the JSON schema for editors and the reference
//! `docs/scene-file.md` are written from it, and tests hold the reader to it.

// A key takes a few lines here, and eight in the format of others.
#[rustfmt::skip]
mod particles;
#[rustfmt::skip]
mod run;
#[rustfmt::skip]
mod scene;

pub use particles::{INITIAL, PART};
pub use run::{BODY_FORCE, OUTPUT, STAGE};
pub use scene::{BOX, MASSES, TOP};

pub use psidpd_core::document::keys::{Key, OPTIONAL, REQUIRED, Table, ValueKind};
use psidpd_core::document::keys::{form_key, key};

/// Every table, in the order of the documentation. What `[observe]` may have is described elsewhere.
pub const TABLES: &[Table] = &[TOP, BOX, MASSES, INITIAL, PART, BODY_FORCE, STAGE, OUTPUT];

/// The first of each pair.
fn names<T>(all: &[(&'static str, T)]) -> Vec<&'static str> {
    all.iter().map(|(name, _)| *name).collect()
}
