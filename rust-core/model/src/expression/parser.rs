//! Orders tokens in postfix, by operator precedence with an explicit stack.

use std::f64::consts::PI;

use super::ast::{Action, Ast, Binary, Step};
use super::error::{ErrorKind, ExpressionError, Span};
use super::function::Function;
use super::lexer::{Lexer, Token};
use super::suggest::closest;
use super::{MAX_DEPTH, MAX_LENGTH};

impl Ast {
    /// Parses an expression.
    ///
    /// The text may be anything: a text longer than [`MAX_LENGTH`] or nested deeper than
    /// [`MAX_DEPTH`] is an error like any other.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        if text.len() > MAX_LENGTH {
            let offset = text.floor_char_boundary(MAX_LENGTH);
            return Err(Span::new(offset, text.len() - offset).error(ErrorKind::TooLong));
        }
        let mut parser =
            Parser { text, steps: Vec::new(), operands: Vec::new(), waiting: Vec::new(), callee: None };
        let mut lexer = Lexer::new(text);
        // An operand (after signs and openings) and an operator alternate.
        let mut wants_operand = true;
        while let Some((token, span)) = lexer.next()? {
            wants_operand =
                if wants_operand { parser.operand(token, span)? } else { parser.operator(token, span)? };
        }
        if wants_operand {
            return Err(Span::new(text.len(), 0).error(ErrorKind::UnexpectedEnd));
        }
        parser.finish().map(|steps| Self { steps })
    }
}

/// An operator or an opening that was read and is not in the output yet.
#[derive(Debug, Clone, Copy)]
enum Waiting {
    Sign(Span),
    Binary(Binary),
    /// An open `(`, and for a call the function, its name's place and the number of commas so far.
    Open {
        at: Span,
        call: Option<(Function, Span, usize)>,
    },
}

impl Waiting {
    /// Precedence of the operator; an opening has none.
    fn strength(self) -> u8 {
        match self {
            Waiting::Open { .. } => 0,
            Waiting::Binary(binary) => strength(binary),
            Waiting::Sign(_) => 3,
        }
    }

    /// Whether it adds a level of nesting; other operators are written out before those of equal precedence.
    fn nests(self) -> bool {
        !matches!(self.strength(), 1 | 2)
    }
}

fn strength(binary: Binary) -> u8 {
    match binary {
        Binary::Add | Binary::Subtract => 1,
        Binary::Multiply | Binary::Divide => 2,
        Binary::Power => 4,
    }
}

struct Parser<'a> {
    text: &'a str,
    steps: Vec<Step>,
    /// Places of the operands that wait for their operator.
    operands: Vec<Span>,
    waiting: Vec<Waiting>,
    /// A function and the place of its name, until its `(` is read.
    callee: Option<(Function, Span)>,
}

impl Parser<'_> {
    /// Reads a token where an operand may start; returns whether one is still expected.
    fn operand(&mut self, token: Token, span: Span) -> Result<bool, ExpressionError> {
        match token {
            Token::Number(value) => self.leaf(Action::Number(value), span),
            Token::Name(name) if self.is_called(span) => {
                let function = Function::named(name).ok_or_else(|| unknown(name, span))?;
                self.callee = Some((function, span));
                return Ok(true);
            }
            Token::Name("pi") => self.leaf(Action::Number(PI), span),
            Token::Name(name) if Function::named(name).is_some() => {
                return Err(self.unexpected(span, "`(` and arguments after a function"));
            }
            Token::Name(name) => self.leaf(Action::Name(name.to_owned()), span),
            Token::Symbol('(') => {
                let call = self.callee.take().map(|(function, name)| (function, name, 0));
                self.wait(Waiting::Open { at: span, call }, span)?;
                return Ok(true);
            }
            Token::Symbol('-') => {
                self.wait(Waiting::Sign(span), span)?;
                return Ok(true);
            }
            Token::Symbol('+') => return Ok(true),
            Token::Symbol(')') => {
                if let Some(&Waiting::Open { call, .. }) = self.waiting.last()
                    && let Some((function, name, 0)) = call
                {
                    return Err(wrong_count(function, 0, name.to(span)));
                }
                return Err(self.unexpected(span, "a number, a name or `(`"));
            }
            Token::Symbol(_) => return Err(self.unexpected(span, "a number, a name or `(`")),
        }
        Ok(false)
    }

    /// Reads a token after an operand; returns whether an operand is expected next.
    fn operator(&mut self, token: Token, span: Span) -> Result<bool, ExpressionError> {
        let binary = match token {
            Token::Symbol('+') => Binary::Add,
            Token::Symbol('-') => Binary::Subtract,
            Token::Symbol('*') => Binary::Multiply,
            Token::Symbol('/') => Binary::Divide,
            Token::Symbol('^') => Binary::Power,
            Token::Symbol(')') => {
                self.close(span)?;
                return Ok(false);
            }
            Token::Symbol(',') => {
                self.settle(1);
                match self.waiting.last_mut() {
                    Some(Waiting::Open { call: Some((_, _, commas)), .. }) => *commas += 1,
                    _ => return Err(self.unexpected(span, "an operator")),
                }
                return Ok(true);
            }
            _ => return Err(self.unexpected(span, "an operator")),
        };
        // Operators of equal precedence group to the left, powers to the right.
        self.settle(match binary {
            Binary::Power => strength(binary) + 1,
            _ => strength(binary),
        });
        self.wait(Waiting::Binary(binary), span)?;
        Ok(true)
    }

    fn close(&mut self, span: Span) -> Result<(), ExpressionError> {
        self.settle(1);
        let Some(Waiting::Open { at, call }) = self.waiting.pop() else {
            return Err(self.unexpected(span, "an operator: there is no `(` to close"));
        };
        match call {
            None => {
                // An error message about the operand shows its parentheses too.
                if let Some(operand) = self.operands.last_mut() {
                    *operand = at.to(span);
                }
            }
            Some((function, name, commas)) => {
                let span = name.to(span);
                if commas + 1 != function.arguments() {
                    return Err(wrong_count(function, commas + 1, span));
                }
                self.operands.truncate(self.operands.len() - function.arguments());
                self.leaf(Action::Call(function), span);
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Vec<Step>, ExpressionError> {
        self.settle(1);
        match self.waiting.last() {
            Some(Waiting::Open { at, .. }) => Err(at.error(ErrorKind::Unclosed)),
            _ => Ok(self.steps),
        }
    }

    /// Writes out the waiting operators of at least this precedence.
    fn settle(&mut self, at_least: u8) {
        while let Some(&waiting) = self.waiting.last()
            && waiting.strength() >= at_least
        {
            self.waiting.pop();
            let Some(right) = self.operands.pop() else { return };
            match waiting {
                Waiting::Sign(sign) => self.leaf(Action::Negate, sign.to(right)),
                Waiting::Binary(binary) => {
                    let left = self.operands.pop().unwrap_or(right);
                    self.leaf(Action::Binary(binary), left.to(right));
                }
                Waiting::Open { .. } => {}
            }
        }
    }

    /// Writes out a step whose result is the next operand.
    fn leaf(&mut self, action: Action, span: Span) {
        self.steps.push(Step { action, span });
        self.operands.push(span);
    }

    fn wait(&mut self, waiting: Waiting, span: Span) -> Result<(), ExpressionError> {
        self.waiting.push(waiting);
        match self.waiting.iter().filter(|waiting| waiting.nests()).count() > MAX_DEPTH {
            true => Err(span.error(ErrorKind::TooDeep)),
            false => Ok(()),
        }
    }

    fn is_called(&self, name: Span) -> bool {
        let rest = &self.text[name.offset + name.length..];
        rest.trim_ascii_start().starts_with('(')
    }

    fn unexpected(&self, span: Span, expected: &'static str) -> ExpressionError {
        let found = self.text[span.offset..span.offset + span.length].to_owned();
        span.error(ErrorKind::Unexpected { found, expected })
    }
}

fn unknown(name: &str, span: Span) -> ExpressionError {
    let known = Function::ALL.map(|entry| entry.0);
    span.error(ErrorKind::Unknown {
        what: "function",
        name: name.to_owned(),
        suggestion: in_other_words(name).or_else(|| closest(name, known)),
        known: known.map(str::to_owned).to_vec(),
    })
}

/// The notation for operations that are functions in other languages.
fn in_other_words(name: &str) -> Option<String> {
    let words = match name.to_ascii_lowercase().as_str() {
        "pow" | "power" => "a^b",
        "log2" => "ln(x)/ln(2)",
        "log1p" => "ln(1 + x)",
        "expm1" => "exp(x) - 1",
        "cbrt" => "x^(1/3)",
        "sqr" | "square" => "x^2",
        "tan" => "sin(x)/cos(x)",
        "sinh" => "(exp(x) - exp(-x))/2",
        "cosh" => "(exp(x) + exp(-x))/2",
        "fabs" => "abs(x)",
        "fmin" => "min(a, b)",
        "fmax" => "max(a, b)",
        _ => return None,
    };
    Some(words.to_owned())
}

fn wrong_count(function: Function, found: usize, span: Span) -> ExpressionError {
    span.error(ErrorKind::ArgumentCount { function: function.name(), expected: function.arguments(), found })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The postfix order of a text, as text.
    fn postfix(text: &str) -> String {
        let word = |step: &Step| match &step.action {
            Action::Number(value) => value.to_string(),
            Action::Name(name) => name.clone(),
            Action::Negate => "neg".into(),
            Action::Binary(Binary::Add) => "+".into(),
            Action::Binary(Binary::Subtract) => "-".into(),
            Action::Binary(Binary::Multiply) => "*".into(),
            Action::Binary(Binary::Divide) => "/".into(),
            Action::Binary(Binary::Power) => "^".into(),
            Action::Call(function) => function.name().into(),
        };
        let Ast { steps } = Ast::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        steps.iter().map(word).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn precedence() {
        for (text, expected) in [
            ("a + b * c", "a b c * +"),
            ("a * b + c", "a b * c +"),
            ("a - b - c", "a b - c -"),
            ("a - b + c", "a b - c +"),
            ("a / b / c", "a b / c /"),
            ("a / b * c", "a b / c *"),
            ("a ^ b ^ c", "a b c ^ ^"),
            ("a * b ^ c", "a b c ^ *"),
            ("a ^ b * c", "a b ^ c *"),
            ("-x^2", "x 2 ^ neg"),
            ("(-x)^2", "x neg 2 ^"),
            ("2^-1", "2 1 neg ^"),
            ("2^-x^2", "2 x 2 ^ neg ^"),
            ("2^-x*3", "2 x neg ^ 3 *"),
            ("-a * b", "a neg b *"),
            ("a * -b", "a b neg *"),
            ("a - -b", "a b neg -"),
            ("a + +b", "a b +"),
            ("--a", "a neg neg"),
            ("-a + b", "a neg b +"),
            ("(a + b) * c", "a b + c *"),
            ("a - (b - c)", "a b c - -"),
            ("ln(a)^2", "a ln 2 ^"),
            ("log(a)", "a ln"),
            ("a ** b", "a b ^"),
            ("-ln(1 - a*b)", "1 a b * - ln neg"),
            ("min(a, b + c) * 2", "a b c + min 2 *"),
            ("max((a), -b)", "a b neg max"),
            ("((((a))))", "a"),
        ] {
            assert_eq!(postfix(text), expected, "{text}");
        }
    }

    #[test]
    fn errors_point_at_the_byte() {
        for (text, offset, length, message) in [
            ("", 0, 0, "the expression ends"),
            ("  a +", 5, 0, "the expression ends"),
            ("-", 1, 0, "the expression ends"),
            ("a b", 2, 1, "unexpected `b`, expected an operator"),
            ("2 kT", 2, 2, "unexpected `kT`"),
            ("1.2.3", 3, 2, "unexpected `.3`"),
            ("a (b)", 0, 1, "unknown function `a`"),
            ("2 (b)", 2, 1, "unexpected `(`"),
            ("(a", 0, 1, "this `(` is never closed"),
            ("ln(a", 2, 1, "this `(` is never closed"),
            ("a)", 1, 1, "unexpected `)`"),
            ("a*()", 3, 1, "unexpected `)`"),
            ("ln + 1", 0, 2, "unexpected `ln`"),
            ("a + lm(b)", 4, 2, "unknown function `lm`, did you mean `ln`?"),
            ("a + pow(b, 2)", 4, 3, "unknown function `pow`, did you mean `a^b`?"),
            ("a *** b", 4, 1, "unexpected `*`, expected"),
            ("a, b", 1, 1, "unexpected `,`"),
            ("(a, b)", 2, 1, "unexpected `,`"),
            ("1 + ln()", 4, 4, "`ln` takes 1 argument(s), not 0"),
            ("min(a)", 0, 6, "`min` takes 2 argument(s), not 1"),
            ("exp(a, b, c)", 0, 12, "`exp` takes 1 argument(s), not 3"),
            ("min(a,)", 6, 1, "unexpected `)`"),
            ("a $ b", 2, 1, "unexpected character '$'"),
            ("a + ψ", 4, 2, "unexpected character 'ψ'"),
            ("2 * 1e999", 4, 5, "no finite value"),
        ] {
            let error = Ast::parse(text).expect_err(text);
            assert_eq!((error.offset, error.length), (offset, length), "{text}");
            let found = error.to_string();
            assert!(found.contains(message), "{text}: {found}");
        }
    }

    #[test]
    fn depth_is_limited() {
        let nested = |open: &str, close: &str, n| open.repeat(n) + "x" + &close.repeat(n);
        for (open, close) in [("(", ")"), ("-", ""), ("x^", ""), ("exp(", ")"), ("2*(1+", ")")] {
            assert!(Ast::parse(&nested(open, close, MAX_DEPTH)).is_ok(), "{open}");
            for n in [MAX_DEPTH + 1, 500] {
                let error = Ast::parse(&nested(open, close, n)).unwrap_err();
                assert_eq!(error.kind, ErrorKind::TooDeep, "{open}");
            }
        }
        let error = Ast::parse(&"(".repeat(MAX_LENGTH)).unwrap_err();
        assert_eq!((error.offset, error.length), (MAX_DEPTH, 1));
    }

    #[test]
    fn length_is_limited() {
        // A long sum does not nest.
        assert!(Ast::parse(&("1+".repeat(MAX_LENGTH / 2 - 1) + "1")).is_ok());
        assert!(Ast::parse(&"9".repeat(300)).is_ok());
        for text in ["1+".repeat(MAX_LENGTH), "ψ".repeat(MAX_LENGTH) + "x"] {
            let error = Ast::parse(&text).unwrap_err();
            assert_eq!(error.kind, ErrorKind::TooLong);
            assert_eq!(error.offset + error.length, text.len());
        }
    }
}
