//! The table of all keys of the scene file: the JSON schema for editors and the reference
//! `docs/scene-file.md` are written from it, and a file with other keys is refused.

// This layout takes a few lines for a key; rustfmt would take eight.
#[rustfmt::skip]
mod particles;
#[rustfmt::skip]
mod run;
#[rustfmt::skip]
mod scene;

pub use particles::{INITIAL, PART};
pub use run::{BODY_FORCE, OUTPUT, STAGE, WALL};
pub use scene::{BOX, MASSES, TOP};

pub use psidpd_core::document::keys::{Key, OPTIONAL, REQUIRED, Table, ValueKind};
use psidpd_core::document::keys::{form_key, key, names};

/// All tables in the order of the documentation, except those of `[observe]`.
pub const TABLES: &[Table] = &[TOP, BOX, MASSES, INITIAL, PART, WALL, BODY_FORCE, STAGE, OUTPUT];
