//! Splits text into tokens.

use super::error::{ErrorKind, ExpressionError, Span};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// A symbol, one of `+ - * / ^ ( ) ,`.
    Symbol(char),
}

/// Returns the tokens of a text one by one.
pub(super) struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    pub fn new(text: &'a str) -> Self {
        Self { text, at: 0 }
    }

    /// The next token and its place, or `None` at the end.
    pub fn next(&mut self) -> Result<Option<(Token<'a>, Span)>, ExpressionError> {
        self.at += leading(self.rest(), |c| c.is_ascii_whitespace());
        let rest = self.rest();
        let Some(first) = rest.chars().next() else { return Ok(None) };
        let (token, length) = match first {
            // `**` is a power, as in Fortran and Python.
            '*' if rest.starts_with("**") => (Token::Symbol('^'), 2),
            '+' | '-' | '*' | '/' | '^' | '(' | ')' | ',' => (Token::Symbol(first), 1),
            'a'..='z' | 'A'..='Z' | '_' => {
                let length = leading(rest, |c| c.is_ascii_alphanumeric() || c == '_');
                (Token::Name(&rest[..length]), length)
            }
            '0'..='9' | '.' => {
                let length = number_length(rest);
                match rest[..length].parse::<f64>() {
                    Ok(value) if value.is_finite() => (Token::Number(value), length),
                    Ok(_) => return Err(Span::new(self.at, length).error(ErrorKind::NonFinite)),
                    Err(_) => return Err(self.unexpected(first)),
                }
            }
            _ => return Err(self.unexpected(first)),
        };
        let span = Span::new(self.at, length);
        self.at += length;
        Ok(Some((token, span)))
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn unexpected(&self, found: char) -> ExpressionError {
        Span::new(self.at, found.len_utf8()).error(ErrorKind::UnexpectedCharacter(found))
    }
}

/// Number of bytes at the start of `text` that satisfy `belongs`.
fn leading(text: &str, belongs: impl Fn(char) -> bool) -> usize {
    text.find(|c| !belongs(c)).unwrap_or(text.len())
}

/// The length of a number such as `12`, `1.5`, `.5`, `2.` or `1.5e-3`; an `e` without digits is not part of it.
fn number_length(text: &str) -> usize {
    let digits = |at: usize| leading(&text[at..], |c| c.is_ascii_digit());
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end += 1;
        end += digits(end);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
        let exponent = digits(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(text: &str) -> Vec<Token<'_>> {
        let mut lexer = Lexer::new(text);
        std::iter::from_fn(|| lexer.next().unwrap().map(|(token, _)| token)).collect()
    }

    #[test]
    fn numbers_in_every_spelling() {
        for (text, value) in [
            ("12", 12.0),
            ("1.5", 1.5),
            (".5", 0.5),
            ("2.", 2.0),
            ("1e3", 1e3),
            ("2.5E-3", 2.5e-3),
            ("1e+2", 100.0),
        ] {
            assert_eq!(tokens(text), [Token::Number(value)], "{text}");
        }
    }

    #[test]
    fn an_exponent_needs_digits() {
        assert_eq!(tokens("2e"), [Token::Number(2.0), Token::Name("e")]);
    }

    #[test]
    fn errors_point_at_the_byte() {
        let mut lexer = Lexer::new("n· 2");
        lexer.next().unwrap();
        let error = lexer.next().unwrap_err();
        assert_eq!(error.kind, ErrorKind::UnexpectedCharacter('·'));
        assert_eq!((error.offset, error.length), (1, 2));

        let error = Lexer::new("  1e999").next().unwrap_err();
        assert_eq!(error.kind, ErrorKind::NonFinite);
        assert_eq!((error.offset, error.length), (2, 5));
    }
}
