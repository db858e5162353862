//! Numbers of a model file, which may be formulas.

use crate::document::{FileError, FileErrorKind, Located, Place, Section, Value};
use crate::expression::{Ast, ExpressionError, Formula, Variables};
use std::collections::BTreeMap;

/// A number, or a formula of the parameters and kT.
#[derive(Debug, Clone)]
pub enum Number {
    /// The file has a number.
    Value(Located<f64>),
    /// The file has a formula.
    Formula(Located<Ast>),
}

impl Number {
    /// Reads a number or a formula; names are looked up when it is evaluated.
    pub fn read(value: &Value) -> Result<Number, FileError> {
        if let Some(number) = value.as_number() {
            return Ok(Number::Value(Located { value: number?, place: value.place.clone() }));
        }
        match value.as_str() {
            Some(_) => Ok(Number::Formula(read_formula(value)?)),
            None => Err(value.error(FileErrorKind::WrongType {
                expected: "a number or a formula of the parameters",
                found: "something else",
            })),
        }
    }

    /// Reads a required key.
    pub fn require(table: &Section, key: &str) -> Result<Number, FileError> {
        Number::read(&table.require(key)?)
    }

    /// The value of the number or formula with these constants.
    pub fn evaluate(&self, constants: &BTreeMap<String, f64>) -> Result<Located<f64>, FileError> {
        match self {
            Number::Value(value) => Ok(value.clone()),
            Number::Formula(ast) => {
                let formula = Formula::compile(&ast.value, constants, &Variables::default())
                    .map_err(|e| formula_error(ast, e))?;
                // A formula without variables always folds to a number.
                let value = formula.value(&[]);
                if !value.is_finite() {
                    return Err(ast.error(format!("is {value}, not a finite number")));
                }
                Ok(Located { value, place: ast.place.clone() })
            }
        }
    }

    /// The value, which must be positive.
    pub fn positive(&self, constants: &BTreeMap<String, f64>) -> Result<f64, FileError> {
        let number = self.evaluate(constants)?;
        match number.value {
            x if x > 0.0 => Ok(x),
            x => Err(number.error(format!("must be positive, is {x}"))),
        }
    }
}

/// Parses the formula in a string value.
pub fn read_formula(value: &Value) -> Result<Located<Ast>, FileError> {
    let text = value.string()?;
    match Ast::parse(&text.value) {
        Ok(ast) => Ok(text.map(|_| ast)),
        Err(error) => Err(error_in_string(&text.place, error)),
    }
}

/// The error of a formula that parsed but does not compile, at the offending name.
pub fn formula_error(at: &Located<Ast>, error: ExpressionError) -> FileError {
    error_in_string(&at.place, error)
}

/// An error in a quoted formula, at its exact place if the string has no escapes.
fn error_in_string(string: &Place, error: ExpressionError) -> FileError {
    let (text, whole) = (string.source.text(), &string.span);
    let quoted = text.get(whole.clone()).unwrap_or("");
    let mut quotes = if quoted.starts_with("\"\"\"") || quoted.starts_with("'''") { 3 } else { 1 };
    // A newline directly after the opening triple quote is not part of the string.
    if quotes == 3 && quoted[3..].starts_with('\n') {
        quotes += 1;
    }
    let start = (whole.start + quotes + error.offset).min(whole.end);
    let end = (start + error.length).min(whole.end);
    let span = text.floor_char_boundary(start)..text.ceil_char_boundary(end);
    Place { span, ..string.clone() }.error(FileErrorKind::Expression(error))
}
