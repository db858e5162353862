//! What error is accepted, as `u=0.2%` says it.

use super::quantity::{self, Class, Deviation};
use serde::{Serialize, Serializer};
use std::str::FromStr;

/// A bound for the errors of one quantity, or of all of a kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerance {
    /// The name of a quantity or of a kind.
    pub name: String,
    /// The bound, in the unit of the kind; 0.01 is one percent of it.
    pub bound: f64,
}

fn expected() -> String {
    let kinds = Class::ALL.map(|(name, _)| name);
    let quantities: Vec<&str> = quantity::names().filter(|name| !kinds.contains(name)).collect();
    format!(
        "expected NAME=BOUND, such as u=0.2% or rho_L=0.001; NAME is a kind ({}) or a quantity ({})",
        kinds.join(", "),
        quantities.join(", ")
    )
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Tolerance, String> {
        let (name, bound) = text.split_once('=').ok_or_else(expected)?;
        let name = name.trim();
        let kinds = Class::ALL.into_iter().map(|(kind, _)| kind);
        if !kinds.chain(quantity::names()).any(|known| known == name) {
            return Err(expected());
        }
        let (number, unit) = match bound.trim().strip_suffix('%') {
            Some(number) => (number, 0.01),
            None => (bound.trim(), 1.0),
        };
        let bound = unit * number.trim().parse::<f64>().map_err(|_| expected())?;
        let good = bound > 0.0 && bound.is_finite();
        if good { Ok(Tolerance { name: name.to_owned(), bound }) } else { Err(expected()) }
    }
}

impl Tolerance {
    /// Whether it bounds an error; `D` bounds that of each species too, `p` not that of the total pressure, whose random part no run of
    /// minutes averages out.
    pub fn applies(&self, to: &Deviation) -> bool {
        self.name == to.name || self.name == to.class.name() && to.name != "p_total"
    }
}

impl std::fmt::Display for Tolerance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} within {} %", self.name, (1e6 * self.bound).round() / 1e4)
    }
}

pub fn by_name<S: Serializer>(tolerances: &[Tolerance], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(tolerances.iter().map(|t| (&t.name, t.bound)))
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    pub quantity: String,
    /// The error over its bound, as it is shown.
    pub ratio: f64,
}

/// The worst of errors, by what they are of their bounds; `None` if nothing is bound.
pub fn worst(errors: &[Deviation], tolerances: &[Tolerance]) -> Option<Worst> {
    let ratios = tolerances.iter().flat_map(|t| {
        let bound = errors.iter().filter(|d| t.applies(d));
        bound.map(|d| Worst { quantity: d.name.clone(), ratio: d.shown() / t.bound })
    });
    ratios.max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_observe::Measured;

    #[test]
    fn tolerances_are_read_or_refused() {
        let of = |name: &str, bound: f64| Ok(Tolerance { name: name.into(), bound });
        assert_eq!("T=0.5%".parse(), of("T", 0.005));
        assert_eq!("rho_L = 0.02".parse(), of("rho_L", 0.02));
        assert_eq!("p_carried=1".parse(), of("p_carried", 1.0));
        for bad in ["", "T", "x=1%", "T=-1", "T=%", "T=nan", "T=0", "u=0.2%,p=2%"] {
            assert_eq!(bad.parse::<Tolerance>(), Err(expected()), "{bad}");
        }
        assert_eq!("sigma=1.5%".parse::<Tolerance>().unwrap().to_string(), "sigma within 1.5 %");
        assert!(expected().contains("p_carried"));
    }

    #[test]
    fn the_worst_is_the_largest_part_of_its_bound() {
        let error = |class, name: &str, value, error| Deviation {
            class,
            name: name.into(),
            measured: Measured { value: 0.0, error: 0.0 },
            value,
            error,
            resolved: value > 2.0 * error,
        };
        let errors = [
            error(Class::Pressure, "p_conservative", 0.004, 0.001),
            error(Class::Pressure, "p_carried", 0.02, 0.001),
            error(Class::Energy, "u", 0.0, 0.001),
        ];
        let read = |text: &str| text.parse::<Tolerance>().unwrap();
        let of = |texts: &[&str]| worst(&errors, &texts.iter().map(|t| read(t)).collect::<Vec<_>>());
        assert_eq!(of(&["p=2%"]).unwrap().quantity, "p_carried");
        assert!((of(&["p=2%"]).unwrap().ratio - 1.0).abs() < 1e-12);
        assert_eq!(of(&["p_conservative=2%", "u=0.1%"]), Some(Worst { quantity: "u".into(), ratio: 2.0 }));
        assert_eq!(of(&["sigma=1%"]), None);
        // The total pressure counts by its own name only.
        let total = error(Class::Pressure, "p_total", 0.5, 0.001);
        assert!(!read("p=2%").applies(&total) && read("p_total=2%").applies(&total));
        assert!(read("D=2%").applies(&error(Class::Diffusion, "D_B", 0.5, 0.001)));
    }
}
