//! Numbers of a model file, which may be formulas.

use crate::document::{FileError, FileErrorKind, Located, Section, Source, Value};
use crate::expression::{Ast, ExpressionError, Formula, Variables};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

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
            return Ok(Number::Value(Located {
                value: number?,
                span: value.span(),
                key: value.key().to_owned(),
            }));
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
    pub fn evaluate(
        &self,
        constants: &BTreeMap<String, f64>,
        source: &Arc<Source>,
    ) -> Result<Located<f64>, FileError> {
        match self {
            Number::Value(value) => Ok(value.clone()),
            Number::Formula(ast) => {
                let formula = Formula::compile(&ast.value, constants, &Variables::default())
                    .map_err(|e| formula_error(source, ast, e))?;
                // A formula without variables always folds to a number.
                let value = formula.value(&[]);
                if !value.is_finite() {
                    return Err(
                        ast.error(source, FileErrorKind::Value(format!("is {value}, not a finite number")))
                    );
                }
                Ok(Located { value, span: ast.span.clone(), key: ast.key.clone() })
            }
        }
    }

    /// The value, which must be positive.
    pub fn positive(
        &self,
        constants: &BTreeMap<String, f64>,
        source: &Arc<Source>,
    ) -> Result<f64, FileError> {
        let number = self.evaluate(constants, source)?;
        if number.value > 0.0 {
            Ok(number.value)
        } else {
            Err(number.error(source, FileErrorKind::Value(format!("must be positive, is {}", number.value))))
        }
    }
}

/// Parses the formula in a string value.
pub fn read_formula(value: &Value) -> Result<Located<Ast>, FileError> {
    let (text, source) = (value.string()?, value.source());
    match Ast::parse(&text.value) {
        Ok(ast) => Ok(text.map(|_| ast)),
        Err(error) => Err(FileError::new(
            source,
            span_in_string(source, &text.span, &error),
            &text.key,
            FileErrorKind::Expression(error),
        )),
    }
}

/// The error of a formula that parsed but does not compile, at the offending name.
pub fn formula_error(source: &Arc<Source>, at: &Located<Ast>, error: ExpressionError) -> FileError {
    FileError::new(
        source,
        span_in_string(source, &at.span, &error),
        &at.key,
        FileErrorKind::Expression(error),
    )
}

/// The place in the file of an error in a quoted formula; exact if the string has no escapes.
fn span_in_string(source: &Source, string: &Range<usize>, error: &ExpressionError) -> Range<usize> {
    let text = source.text();
    let quoted = text.get(string.clone()).unwrap_or("");
    let mut quotes = if quoted.starts_with("\"\"\"") || quoted.starts_with("'''") { 3 } else { 1 };
    // A newline directly after the opening triple quote is not part of the string.
    if quotes == 3 && quoted[3..].starts_with('\n') {
        quotes += 1;
    }
    let mut start = (string.start + quotes + error.offset).min(string.end);
    let mut end = (start + error.length).min(string.end);
    while !text.is_char_boundary(start) {
        start -= 1;
    }
    while !text.is_char_boundary(end) {
        end += 1;
    }
    start..end
}
