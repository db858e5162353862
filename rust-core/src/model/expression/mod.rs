//! Formulas with exact derivatives.
