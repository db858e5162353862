//! Where fluids of an attraction and a repulsion that grows with density are crystals.
//!
//! ```text
//! F_ij = A (1 − r/r_c) + B (n_i + n_j) (1 − r/r_d)        A < 0 < B
//! ```
//!
//! Vanya, Crout, Sharman and Elliott, Phys. Rev. E 98, 033310 (2018), found that this fluid of Warren's has besides gas and liquid
//! a stable bcc solid. [`MELTING`] is the line for r_d = 0.75 r_c, measured here: bcc films between vacuum, 12 and 16 layers thick
//! and so at zero pressure, were heated in steps of 4 to 7 % of kT, each 20 times r_c √(m/kT) long, until their order was lost. Their
//! surfaces let them melt without superheating, and thin films somewhat early. Nothing is known here of other r_d, of mixtures, of
//! two dimensions, and of fluids under pressure.

use psidpd_core::model::kernel::KernelKind;
use psidpd_core::model::pair::{PairForm, PairPotential};
use psidpd_core::model::{ExcessFreeEnergy, Fluid};
use std::f64::consts::PI;

/// A point of the melting line.
struct Point {
    /// −A r_c³/B.
    ratio: f64,
    /// −A r_c/kT where the crystal melts.
    attraction: f64,
    /// ρ r_c³ of the crystal at zero pressure, from the lattice sum.
    density: f64,
}

const MELTING: [Point; 6] = [
    Point { ratio: 0.8, attraction: 54.0, density: 5.27 },
    Point { ratio: 1.25, attraction: 69.0, density: 5.73 },
    Point { ratio: 1.6, attraction: 90.0, density: 6.14 },
    Point { ratio: 2.0, attraction: 92.0, density: 6.58 },
    Point { ratio: 2.5, attraction: 86.0, density: 7.11 },
    Point { ratio: 3.0, attraction: 69.0, density: 7.64 },
];

/// The relative uncertainty of the line: that of the steps, the thickness of the films, and between the points.
const UNCERTAIN: f64 = 0.15;

/// The ratio r_d/r_c of the line, and how far another may be off.
const RATIO: f64 = 0.75;
const SAME: f64 = 0.003;

/// A density above that of the crystal by this share is a fluid under pressure.
const COMPRESSED: f64 = 0.1;

/// What the melting line says of a fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Freezing {
    /// −A r_c/kT of the fluid, and where the crystal of the same −A r_c³/B melts.
    pub attraction: f64,
    pub melts: f64,
}

impl Freezing {
    /// True if the fluid is a crystal; false near the line, where it may be one.
    pub fn is_certain(&self) -> bool {
        self.attraction > self.melts * (1.0 + UNCERTAIN)
    }

    pub fn message(&self) -> String {
        let Freezing { attraction, melts } = self;
        let verdict = match self.is_certain() {
            true => "at low pressure this fluid is a bcc crystal, and what assumes a liquid means nothing",
            false => "this fluid is near its freezing line, and may be a bcc crystal",
        };
        format!(
            "{verdict}: -A/kT is {attraction:.0}, and for this A/B crystals melt at {melts:.0} +- {:.0} % (measured for r_d = 0.75 \
             r_c; stable solid: Vanya et al., Phys. Rev. E 98, 033310)",
            100.0 * UNCERTAIN
        )
    }
}

/// The verdict of the melting line on a fluid at a number density; `None` where the line says nothing or the fluid is a liquid.
pub fn freezing(fluid: &Fluid, density: Option<f64>) -> Option<Freezing> {
    let [a, b, range] = warren(fluid)?;
    let ratio = -a * range.powi(3) / b;
    let pair = MELTING.windows(2).find(|pair| (pair[0].ratio..=pair[1].ratio).contains(&ratio))?;
    let share = (ratio - pair[0].ratio) / (pair[1].ratio - pair[0].ratio);
    let between = |of: fn(&Point) -> f64| of(&pair[0]) + share * (of(&pair[1]) - of(&pair[0]));
    let most = (1.0 + COMPRESSED) * between(|p| p.density) / range.powi(3);
    let found = Freezing { attraction: -a * range / fluid.kt, melts: between(|p| p.attraction) };
    (density.is_none_or(|rho| rho <= most) && found.attraction * (1.0 + UNCERTAIN) > found.melts)
        .then_some(found)
}

/// A, B and r_c of a fluid of Warren's form with r_d = 0.75 r_c.
pub fn warren(fluid: &Fluid) -> Option<[f64; 3]> {
    let ([density], [pair], [ExcessFreeEnergy::Formula(psi)]) =
        (&fluid.densities[..], &fluid.pairs[..], &fluid.excess[..])
    else {
        return None;
    };
    let PairPotential::Soft(soft) = &pair.potential else { return None };
    let plain = density.kernel.kind() == KernelKind::Quadratic
        && density.force_kernel == density.kernel
        && !density.includes_self
        && density.correction.iter().all(psidpd_core::model::Polynomial::is_identity);
    let at = |n: f64| psi.value(&[n]);
    let (one, range) = (at(1.0), soft.range());
    // ψ = π r_d⁴ B n²/30, in any notation.
    let quadratic =
        [0.0, 0.5, 3.0, 8.0].iter().all(|n| (at(*n) - n * n * one).abs() <= 1e-9 * one.abs() * (1.0 + n * n));
    let in_space = fluid.dimensions == 3 && (density.kernel.range() / range / RATIO - 1.0).abs() < SAME;
    let b = 30.0 * one / (PI * density.kernel.range().powi(4));
    (plain && quadratic && in_space && soft.strength < 0.0 && b > 0.0).then_some([soft.strength, b, range])
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::model::Model;

    fn warrens(a: f64, b: f64, rc: f64, rd: f64, kt: f64, more: &str) -> Fluid {
        let text = format!(
            "title = \"w\"\nspecies = [\"F\"]\n{more}[density.n]\nkernel = \"quadratic\"\nrange = {}\n[excess_free_energy]\n\
             F = \"pi/30*{}^4*{b}*n^2\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = {a}\nrange = {rc}\n",
            rd * rc,
            rd * rc
        );
        Model::parse("m.toml", &text).unwrap_or_else(|e| panic!("{e}")).at(kt).unwrap()
    }

    /// Warren's liquids and a crystal that runs have shown, and the same crystal in other units: lengths doubled, energies tripled.
    #[test]
    fn known_fluids_are_on_their_sides_of_the_line() {
        let verdict = |fluid: &Fluid, rho| freezing(fluid, rho).map(|found| found.is_certain());
        let of = |a, b, kt| warrens(a, b, 1.0, 0.75, kt, "");
        assert_eq!(verdict(&of(-40.0, 25.0, 1.0), Some(6.05)), None);
        assert_eq!(verdict(&of(-100.0, 80.0, 1.0), Some(5.7)), Some(true));
        assert_eq!(verdict(&of(-100.0, 80.0, 1.0), None), Some(true));
        assert_eq!(verdict(&of(-100.0, 80.0, 1.45), Some(5.8)), Some(false));
        assert_eq!(verdict(&of(-100.0, 80.0, 2.0), Some(5.8)), None);
        // B is an energy times a square of lengths, A an energy over a length.
        let scaled = warrens(-150.0, 960.0, 2.0, 0.75, 3.0, "");
        let [one, other] = [(of(-100.0, 80.0, 1.0), 5.7), (scaled, 5.7 / 8.0)]
            .map(|(f, rho)| freezing(&f, Some(rho)).unwrap());
        assert!(
            (one.attraction - other.attraction).abs() < 1e-9 && (one.melts - other.melts).abs() < 1e-9,
            "{other:?}"
        );
    }

    /// Beyond what was measured nothing is said.
    #[test]
    fn other_fluids_are_not_judged() {
        let cold = |rd, a, b| freezing(&warrens(a, b, 1.0, rd, 0.1, ""), Some(5.0));
        assert!(cold(0.75, -100.0, 80.0).is_some());
        assert_eq!(cold(0.65, -100.0, 80.0), None);
        assert_eq!(cold(0.75, -100.0, 20.0), None);
        assert_eq!(cold(0.75, -10.0, 80.0), None);
        assert_eq!(cold(0.75, 100.0, 80.0), None);
        assert_eq!(freezing(&warrens(-100.0, 80.0, 1.0, 0.75, 1.0, ""), Some(8.0)), None);
        assert_eq!(freezing(&warrens(-100.0, 80.0, 1.0, 0.75, 1.0, "dimensions = 2\n"), Some(5.0)), None);
    }
}
