//! Limits to the size of formulas.

/// The longest text that is parsed, in bytes.
pub const MAX_LENGTH: usize = 4096;

/// The deepest nesting of parentheses, signs and powers that is parsed.
pub const MAX_DEPTH: usize = 64;

/// The most operations a formula may have, and a derivative may need on the way.
pub const MAX_NODES: usize = 50_000;
