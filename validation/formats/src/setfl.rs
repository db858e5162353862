//! Tables for LAMMPS's `pair_style eam/alloy`, in the format called setfl.
//!
//! The energy of that style is Σ_i F_i(ρ_i) + ½ Σ_i≠j φ_ij(r), with ρ_i = Σ_j f_j(r). This is a many-body model with
//! one density and no w(0) term, in which the density does not depend on the species of particle i.

use std::io::{self, Write};
use std::path::Path;

use super::files::{Existing, PathError, write_result};

#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// The name for `pair_coeff`, which must be one word.
    pub name: String,
    /// LAMMPS takes this mass over.
    pub mass: f64,
}

/// A function of (element, argument).
pub type OfOne<'a> = &'a dyn Fn(usize, f64) -> f64;
/// A function of (element, element, distance).
pub type OfTwo<'a> = &'a dyn Fn(usize, usize, f64) -> f64;

/// The functions of a setfl file, in the units of the simulation.
pub struct Setfl<'a> {
    /// The remark in the first line.
    pub title: &'a str,
    /// The arguments of the functions are indices into these elements.
    pub elements: &'a [Element],
    /// The number of densities in the table; the first density is 0.
    pub nrho: usize,
    pub drho: f64,
    /// The number of distances in the table; the first distance is 0.
    pub nr: usize,
    pub dr: f64,
    /// The force is zero beyond this distance.
    pub cutoff: f64,
    pub embedding: OfOne<'a>,
    /// The function f_b(r): the contribution of an element to the density around it.
    pub density: OfOne<'a>,
    /// The function φ_ab(r), symmetric in a and b.
    pub pair: OfTwo<'a>,
}

impl Setfl<'_> {
    pub fn write(&self, path: &Path, existing: Existing) -> Result<(), PathError> {
        write_result(path, existing, |mut out| self.write_to(&mut out))
    }

    /// Writes the table with 17 significant digits. Values that LAMMPS cannot use are an error of kind `InvalidInput`.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let invalid = |text: String| Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        let names: Vec<&str> = self.elements.iter().map(|e| e.name.as_str()).collect();
        if names.is_empty() {
            return invalid("a table needs an element".into());
        }
        for (i, name) in names.iter().enumerate() {
            if name.is_empty() || name.contains(|c: char| c.is_whitespace() || c == '#') {
                return invalid(format!("'{name}' is not a valid element name: it must be one word"));
            }
            if names[..i].contains(name) {
                return invalid(format!("element {name} is given twice"));
            }
        }
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if self.elements.iter().any(|e| !positive(e.mass)) {
            return invalid("masses must be positive".into());
        }
        if self.nrho < 5 || self.nr < 5 {
            return invalid("a table needs at least five densities and five distances".into());
        }
        if !positive(self.drho) || !positive(self.dr) || !positive(self.cutoff) {
            return invalid("steps and cut-off must be positive".into());
        }
        let reach = (self.nr - 1) as f64 * self.dr;
        if reach < self.cutoff * (1.0 - 1e-12) {
            return invalid(format!("the table ends at {reach}, before the cut-off {}", self.cutoff));
        }

        writeln!(out, "{}", self.title.replace(['\n', '\r'], " "))?;
        writeln!(out, "F(rho), f(r) and r phi(r) for pair_style eam/alloy")?;
        writeln!(out, "written by psidpd; units of the simulation")?;
        writeln!(out, "{} {}", names.len(), names.join(" "))?;
        writeln!(out, "{} {:.16e} {} {:.16e} {:.16e}", self.nrho, self.drho, self.nr, self.dr, self.cutoff)?;
        for (a, element) in self.elements.iter().enumerate() {
            writeln!(out, "{} {:.16e} 0.0 none", a + 1, element.mass)?;
            let name = &element.name;
            table(out, self.nrho, self.drho, &format!("F of {name}"), |rho| (self.embedding)(a, rho))?;
            table(out, self.nr, self.dr, &format!("f of {name}"), |r| (self.density)(a, r))?;
        }
        for a in 0..names.len() {
            for b in 0..=a {
                let what = format!("r phi of {} and {}", names[a], names[b]);
                table(out, self.nr, self.dr, &what, |r| r * (self.pair)(a, b, r))?;
            }
        }
        Ok(())
    }
}

fn table(out: &mut impl Write, n: usize, step: f64, what: &str, f: impl Fn(f64) -> f64) -> io::Result<()> {
    for i in 0..n {
        let at = i as f64 * step;
        let value = f(at);
        if !value.is_finite() {
            return Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                format!("{what} is {value} at {at}: a table needs finite values, also at 0"),
            ));
        }
        let end = if i % 5 == 4 || i + 1 == n { '\n' } else { ' ' };
        write!(out, "{value:.16e}{end}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> [Element; 2] {
        [("A", 1.0), ("B", 2.0)].map(|(name, mass)| Element { name: name.into(), mass })
    }

    fn example(elements: &[Element]) -> Setfl<'_> {
        Setfl {
            title: "two\nelements",
            elements,
            nrho: 7,
            drho: 0.5,
            nr: 6,
            dr: 0.25,
            cutoff: 1.25,
            embedding: &|a, rho| (a + 1) as f64 * rho * rho,
            density: &|a, r| (a + 10) as f64 * (1.25 - r),
            pair: &|a, b, r| (10 * a + b) as f64 + r,
        }
    }

    #[test]
    fn blocks_in_the_order_of_the_format() {
        let elements = two();
        let mut text = Vec::new();
        example(&elements).write_to(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!((lines[0], lines[3]), ("two elements", "2 A B"));
        let numbers = |l: &[&str]| -> Vec<f64> {
            let words = l.iter().flat_map(|l| l.split_whitespace());
            words.map(|w| w.parse().unwrap()).collect()
        };
        assert_eq!(numbers(&lines[4..5]), [7.0, 0.5, 6.0, 0.25, 1.25]);
        assert_eq!(lines[5], "1 1.0000000000000000e0 0.0 none");
        assert_eq!(numbers(&lines[6..8])[6], 9.0);
        assert_eq!(numbers(&lines[8..10]).len(), 6);
        assert_eq!(numbers(&lines[8..10])[5], 0.0);
        assert!(lines[10].starts_with("2 2.0"));
        assert_eq!(numbers(&lines[11..13])[1], 0.5);
        // The pairs are AA, BA, BB.
        let pairs = numbers(&lines[15..]);
        assert_eq!(pairs.len(), 18);
        assert_eq!((pairs[0], pairs[4]), (0.0, 1.0));
        assert_eq!((pairs[6 + 4], pairs[12 + 4]), (11.0, 12.0));
    }

    #[test]
    fn useless_tables_are_refused() {
        let good = two();
        let refuse = |change: &dyn Fn(&mut Setfl)| {
            let mut t = example(&good);
            change(&mut t);
            let e = t.write_to(&mut Vec::new()).unwrap_err();
            assert_eq!(e.kind(), io::ErrorKind::InvalidInput);
        };
        refuse(&|t| t.nr = 4);
        refuse(&|t| t.nr = 5);
        refuse(&|t| t.drho = 0.0);
        refuse(&|t| t.cutoff = f64::NAN);
        refuse(&|t| t.elements = &[]);
        refuse(&|t| t.embedding = &|_, rho| rho.ln());
        refuse(&|t| t.pair = &|_, _, r| 1.0 / r);
        for names in [["A", "A"], ["A", "B C"], ["A", ""]] {
            let mut bad = two();
            bad[0].name = names[0].into();
            bad[1].name = names[1].into();
            let e = example(&bad).write_to(&mut Vec::new()).unwrap_err();
            assert_eq!(e.kind(), io::ErrorKind::InvalidInput);
        }
    }
}
