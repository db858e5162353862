//! The fields of walls in a fluid.

use crate::expression::TooLarge;
use crate::fluid::{ExcessFreeEnergy, Fluid};
use crate::pair::PairForm;
use crate::wall::{Field, Friction, MatterIntegral, Surface, Wall, WallField};

/// Why a fluid can have no such wall.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoWall {
    /// There is no potential.
    #[error(
        "the model states forces that have no potential, and a wall's force is the gradient of an energy"
    )]
    NotConservative,
    /// An integral over the matter is not finite.
    #[error("the potential between {0} and {1} has no finite integral over the matter of a wall")]
    HardCore(String, String),
    /// The surface is too round.
    #[error("a radius of {radius} is smaller than the range {range} of the forces between fluid and wall")]
    TooRound {
        /// The radius of the surface.
        radius: f64,
        /// The longest range.
        range: f64,
    },
    /// ψ of the matter has no finite slope.
    #[error("psi of {species} has no finite slope at the local density {density} of the wall")]
    Response {
        /// The species of the matter.
        species: String,
        /// The local density.
        density: f64,
    },
    /// A derivative grows beyond the limits of the formula engine.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

/// The fields of a wall in a fluid.
pub fn bind_wall(wall: &Wall, fluid: &Fluid) -> Result<WallField, NoWall> {
    if !fluid.is_conservative() {
        return Err(NoWall::NotConservative);
    }
    let response = response(wall, fluid)?;
    let field = |species: usize| field(wall, fluid, species, &response);
    let fields = (0..fluid.species.len()).map(field).collect::<Result<_, _>>()?;
    Ok(WallField { wall: wall.clone(), fields })
}

/// `∂ψ_w/∂n` of the matter by all its uncorrected densities.
fn response(wall: &Wall, fluid: &Fluid) -> Result<Vec<f64>, NoWall> {
    let (count, own) = (fluid.species.len(), wall.species);
    let corrected: Vec<[f64; 2]> = (0..fluid.variables())
        .map(|v| {
            let density = &fluid.densities[v / count];
            let self_weight = if density.includes_self { density.kernel.value(0.0) } else { 0.0 };
            let local = wall.local_densities.get(v / count).copied().unwrap_or(wall.density + self_weight);
            let n = if v % count == own { local } else { 0.0 };
            let (value, slope) = density.correction[own * count + v % count].at(n);
            [density.bounds.map_or(value, |bounds| bounds.clamp(value)), slope]
        })
        .collect();
    let at: Vec<f64> = corrected.iter().map(|[value, _]| *value).collect();
    let slope = |v: usize| -> Result<f64, NoWall> {
        Ok(match &fluid.excess[own] {
            ExcessFreeEnergy::Formula(psi) => psi.derivative(v)?.value(&at),
            ExcessFreeEnergy::Curve(curve) if v / count == curve.density => {
                let total: f64 = (0..count).map(|s| at[curve.density * count + s]).sum();
                let bounds = fluid.densities[curve.density].bounds;
                curve.at(bounds.map_or(total, |bounds| bounds.clamp(total)))[1]
            }
            ExcessFreeEnergy::Curve(_) | ExcessFreeEnergy::Slopes(_) => 0.0,
        })
    };
    let slopes = (0..fluid.variables()).map(|v| slope(v).map(|s| s * corrected[v][1]));
    let slopes = slopes.collect::<Result<Vec<f64>, NoWall>>()?;
    match slopes.iter().all(|s| s.is_finite()) {
        true => Ok(slopes),
        false => Err(NoWall::Response {
            species: fluid.species[own].clone(),
            density: wall.local_densities.first().copied().unwrap_or(wall.density),
        }),
    }
}

fn field(wall: &Wall, fluid: &Fluid, species: usize, response: &[f64]) -> Result<Field, NoWall> {
    let (count, dimensions, surface) = (fluid.species.len(), fluid.dimensions, &wall.surface);
    let finite = |field: Option<MatterIntegral>| {
        let hard = || NoWall::HardCore(fluid.species[species].clone(), fluid.species[wall.species].clone());
        field.ok_or_else(hard)
    };
    let (mut densities, mut energies) = (Vec::new(), Vec::new());
    for (d, density) in fluid.densities.iter().enumerate() {
        let w = &density.kernel;
        check_radius(surface, w.range())?;
        let of = |factor| {
            let weight = |r: f64| (w.value(r), w.slope(r));
            finite(MatterIntegral::behind(surface, dimensions, w.range(), factor, weight))
        };
        densities.push((d, of(wall.density)?));
        let slope = response[d * count + species];
        if slope != 0.0 {
            energies.push(of(wall.density * slope)?);
        }
    }
    for term in fluid.pairs.iter().filter(|term| term.acts(species, wall.species, 0.0)) {
        let phi = &term.potential;
        let amount = wall.density * wall.strength;
        check_radius(surface, phi.range())?;
        energies
            .push(finite(MatterIntegral::behind(surface, dimensions, phi.range(), amount, |r| phi.at(r)))?);
    }
    let ranges =
        densities.iter().map(|(_, field)| field.range()).chain(energies.iter().map(MatterIntegral::range));
    let range = ranges.fold(0.0, f64::max);
    let drag = match (fluid.thermostats[species * count + wall.species], wall.drag) {
        (Some(own), [gamma, range]) => {
            Some([gamma.unwrap_or(own.gamma), range.unwrap_or(own.range), own.exponent])
        }
        (None, [Some(gamma), range]) => Some([gamma, range.unwrap_or(fluid.cutoff()), 1.0]),
        (None, [None, _]) => None,
    };
    let drag = drag.filter(|[gamma, range, _]| *gamma > 0.0 && *range > 0.0);
    if let Some([_, range, _]) = drag {
        check_radius(surface, range)?;
    }
    let friction = drag.map(|drag| Friction::of(surface, dimensions, wall.density, drag));
    Ok(Field { range, densities, energies, friction })
}

/// A particle must see one side of a round surface, not all of it.
fn check_radius(surface: &Surface, range: f64) -> Result<(), NoWall> {
    match surface.round() {
        Some(round) if round.radius < range => Err(NoWall::TooRound { radius: round.radius, range }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::wall::Round;

    const WARREN: &str = include_str!("../../../../validation/models/warren2003-set6.toml");

    fn wall(species: usize) -> Wall {
        Wall {
            surface: Surface::Face { axis: 2, high: false },
            species,
            density: 6.05,
            local_densities: Vec::new(),
            strength: 1.0,
            velocity: [0.0; 3],
            drag: [None; 2],
        }
    }

    /// Densities, response and pair forms are those of the model: φ = ½A r_c (1 − r/r_c)² has the integral A π r_c⁴/15 times that of the
    /// quadratic kernel, and the response is ψ′(n) = π r_d⁴ B n/15 at the local density.
    #[test]
    fn fields_are_those_of_the_model() {
        let fluid = Model::parse("m.toml", WARREN).unwrap().at(1.0).unwrap();
        let quadratic = |s: f64| {
            15.0 * ((1.0 - s) / 12.0 - (1.0 - s.powi(3)) / 6.0 + (1.0 - s.powi(4)) / 6.0
                - (1.0 - s.powi(5)) / 20.0)
        };
        for (local, strength) in [(None, 1.0), (Some(2.3), 1.0), (Some(2.3), 0.4)] {
            let wall = Wall { local_densities: local.into_iter().collect(), strength, ..wall(0) };
            let found = bind_wall(&wall, &fluid).unwrap();
            let field = &found.fields[0];
            for z in [0.0f64, 0.2, 0.6, 0.9] {
                let n = 6.05 * if z < 0.75 { quadratic(z / 0.75) } else { 0.0 };
                assert!((field.densities[0].1.at(z)[0] - n).abs() < 1e-8);
                let slope = std::f64::consts::PI / 15.0 * 0.75f64.powi(4) * 25.0 * local.unwrap_or(6.05);
                let pair = strength * -40.0 * std::f64::consts::PI / 15.0 * 6.05 * quadratic(z);
                let energy: f64 = field.energies.iter().map(|e| e.at(z)[0]).sum();
                assert!((energy - pair - slope * n).abs() < 1e-6, "{z}: {energy} {}", pair + slope * n);
            }
            assert_eq!(field.range, 1.0);
        }
    }

    /// The matter of B responds to a particle of A with ∂ψ_B/∂n_A, to one of B with ∂ψ_B/∂n_B at its local density; ψ of A is no part of it.
    #[test]
    fn matter_responds_to_each_species_by_its_own_slope() {
        let text = "title = \"m\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
                    [excess_free_energy]\nA = \"2*n_A + 3*n_B\"\nB = \"5*n_A + 0.5*n_B^2\"\n";
        let fluid = Model::parse("m.toml", text).unwrap().at(0.7).unwrap();
        let found = bind_wall(&Wall { local_densities: vec![2.3], ..wall(1) }, &fluid).unwrap();
        for z in [0.0, 0.5] {
            for (field, slope) in found.fields.iter().zip([5.0, 2.3]) {
                let n = field.densities[0].1.at(z)[0];
                let energy: f64 = field.energies.iter().map(|e| e.at(z)[0]).sum();
                assert!(n > 0.1 && (energy - slope * n).abs() < 1e-9, "{z}: {energy} {slope} {n}");
            }
        }
        assert!((found.fields[0].densities[0].1.at(0.0)[0] - 0.5 * 6.05).abs() < 1e-8);
    }

    #[test]
    fn what_has_no_wall_is_refused() {
        let stated = "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
                      [excess_free_energy]\nA = { slopes = { n = \"n\" }, energy = \"n^2\" }\n";
        let singular = "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
                        [excess_free_energy]\nA = \"-ln(1 - n/6.05)\"\n";
        let hard = "title = \"m\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\n\
                    phi = \"1/r^12 - 1\"\nrange = 1.0\n";
        let refused = |text: &str| {
            let fluid = Model::parse("m.toml", text).unwrap().at(1.0).unwrap();
            bind_wall(&wall(0), &fluid).unwrap_err()
        };
        assert_eq!(refused(stated), NoWall::NotConservative);
        let round = |radius: f64| {
            let round = Round { across: [true; 3], center: [0.0; 3], radius, inside: false };
            let surface = Surface::Round(round);
            bind_wall(&Wall { surface, ..wall(0) }, &Model::parse("m.toml", WARREN).unwrap().at(1.0).unwrap())
        };
        assert_eq!(round(0.99).unwrap_err(), NoWall::TooRound { radius: 0.99, range: 1.0 });
        assert!(round(1.0).is_ok());
        assert!(matches!(refused(singular), NoWall::Response { .. }));
        assert!(matches!(refused(hard), NoWall::HardCore(..)));
    }
}
