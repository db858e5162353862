//! Formulas with exact derivatives.
//!
//! The excess free energies of a model file are text. An [`Ast`] is parsed text; with the values of its
//! constants and the places of its variables it becomes a [`Formula`]. A formula has symbolic derivatives of
//! any order, so that forces are gradients to rounding error. For evaluation, several formulas are compiled
//! into one [`Program`], which computes shared parts once and works on blocks of particles.
//!
//! ```
//! use psidpd_model::expression::{Ast, Formula, Program, Variables};
//!
//! // Warren's many-body term, ψ(n) = π r_d⁴ B n² / 30, and its slope.
//! let ast = Ast::parse("pi/30 * rd^4 * B * n^2")?;
//! let constants = [("rd".into(), 0.75), ("B".into(), 25.0)].into();
//! let variables = Variables { count: 1, names: [("n".into(), vec![0])].into() };
//! let psi = Formula::compile(&ast, &constants, &variables)?;
//! let slope = psi.derivative(0)?;
//!
//! let program = Program::new(&[&psi, &slope]);
//! let (mut out, mut work) = ([0.0; 2], Vec::new());
//! program.eval(&[6.0], &mut out, &mut work);
//! assert!((out[1] - 2.0 * out[0] / 6.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Nothing here recurses on the shape of a formula: neither a long text nor a deep one can
//! overflow the stack.

mod ast;
mod compile;
mod derivative;
mod display;
mod error;
mod expansion;
mod formula;
mod function;
mod graph;
mod lexer;
mod lower;
mod parser;
mod program;
mod simplify;
mod suggest;
mod wgsl;

pub(crate) use suggest::closest;

pub use ast::Ast;
pub use compile::Variables;
pub use display::Named;
pub use error::{ErrorKind, ExpressionError, TooLarge};
pub use expansion::Expansion;
pub use formula::Formula;
pub use program::Program;
pub use wgsl::Wgsl;

/// The longest text that is parsed, in bytes.
pub const MAX_LENGTH: usize = 4096;

/// The deepest nesting of parentheses, signs and powers that is parsed.
pub const MAX_DEPTH: usize = 64;

/// The most operations a formula may have, and a derivative may need on the way.
pub const MAX_NODES: usize = 50_000;
