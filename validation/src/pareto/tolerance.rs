//! What error is accepted, as `T=0.5%` says it.

use super::quantity::Class;
use std::str::FromStr;

/// A bound for the relative errors of one kind of quantity.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// Of what.
    pub class: Class,
    /// The bound; 0.01 is one percent.
    pub bound: f64,
}

/// A tolerance that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected KIND=BOUND, such as T=0.5% or rho=0.01, with KIND one of {kinds}", kinds = Class::names())]
pub struct BadTolerance;

impl FromStr for Tolerance {
    type Err = BadTolerance;

    fn from_str(text: &str) -> Result<Tolerance, BadTolerance> {
        let (name, bound) = text.split_once('=').ok_or(BadTolerance)?;
        let (_, class) =
            Class::ALL.into_iter().find(|(known, _)| *known == name.trim()).ok_or(BadTolerance)?;
        let (number, unit) = match bound.trim().strip_suffix('%') {
            Some(number) => (number, 0.01),
            None => (bound.trim(), 1.0),
        };
        let bound = unit * number.trim().parse::<f64>().map_err(|_| BadTolerance)?;
        if bound > 0.0 && bound.is_finite() { Ok(Tolerance { class, bound }) } else { Err(BadTolerance) }
    }
}

impl std::fmt::Display for Tolerance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} within {} %", self.class.name(), (1e6 * self.bound).round() / 1e4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_read_or_refused() {
        assert_eq!("T=0.5%".parse(), Ok(Tolerance { class: Class::Temperature, bound: 0.005 }));
        assert_eq!("rho = 0.02".parse(), Ok(Tolerance { class: Class::Density, bound: 0.02 }));
        for bad in ["", "T", "x=1%", "T=-1", "T=%", "T=nan", "T=0"] {
            assert_eq!(bad.parse::<Tolerance>(), Err(BadTolerance), "{bad}");
        }
        assert_eq!("sigma=1.5%".parse::<Tolerance>().unwrap().to_string(), "sigma within 1.5 %");
    }
}
