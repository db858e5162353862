//! Applies a temperature: turns the entries of the file into a [`Fluid`].

use super::Model;
use super::density::DensityEntry;
use super::excess::ExcessEntry;
use super::interaction::{PairTable, ThermostatEntry};
use super::wall::{NoWall, bind_wall};
use crate::continuation::Bounds;
use crate::curve::pressure_table;
use crate::curve::{Curve, CurveForm, Pressure};
use crate::document::{FileError, Located};
use crate::expression::{Ast, Expansion, Formula, Variables};
use crate::fluid::{
    ExcessFreeEnergy, Fluid, PairTerm, Polynomial, StatedSlopes, Thermostat, WeightedDensity,
};
use crate::kernel::Kernel;
use crate::number::{Number, formula_error};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The parameters of a model and `kT`, which formulas may refer to.
type Constants = BTreeMap<String, f64>;

pub fn bind(model: &Model, kt: f64) -> Result<Fluid, FileError> {
    let source = &model.source;
    if !(kt > 0.0 && kt.is_finite()) {
        let message = format!("the temperature must be a positive number, is {kt}");
        return Err(FileError::new(source, 0..0, "kT", message));
    }
    let mut constants = model.parameters.clone();
    constants.insert("kT".into(), kt);
    let densities = model
        .densities
        .iter()
        .map(|entry| bind_density(entry, &constants, model.dimensions))
        .collect::<Result<Vec<_>, _>>()?;
    let variables = variables(model);
    let excess = model
        .excess
        .iter()
        .map(|entry| bind_excess(entry, &constants, &variables, &densities))
        .collect::<Result<Vec<_>, _>>()?;
    check_bounded(model, &densities, &excess)?;
    let bind_pair =
        |table: &PairTable| Ok(PairTerm { between: table.between, potential: table.form.bind(&constants)? });
    let pairs = model.pairs.iter().map(bind_pair).collect::<Result<Vec<_>, _>>()?;
    let mut fluid = Fluid {
        title: model.title.clone(),
        reference: model.reference.clone(),
        dimensions: model.dimensions,
        kt,
        species: model.species.clone(),
        densities,
        excess,
        pairs,
        thermostats: bind_thermostats(&model.thermostats, &constants, model.species.len())?,
        walls: Vec::new(),
    };
    let no_wall = |reason: NoWall| FileError::new(source, 0..0, "wall", reason.to_string());
    let walls = model.walls.iter().map(|wall| bind_wall(wall, &fluid).map_err(no_wall));
    fluid.walls = walls.collect::<Result<_, _>>()?;
    Ok(fluid)
}

fn bind_excess(
    entry: &ExcessEntry,
    constants: &Constants,
    variables: &Variables,
    densities: &[WeightedDensity],
) -> Result<ExcessFreeEnergy, FileError> {
    let kt = constants["kT"];
    match entry {
        ExcessEntry::None => Ok(ExcessFreeEnergy::Formula(Formula::constant(0.0))),
        ExcessEntry::Formula(ast) => Formula::compile(&ast.value, constants, variables)
            .map(ExcessFreeEnergy::Formula)
            .map_err(|e| formula_error(ast, e)),
        ExcessEntry::Table { spline, density } => {
            // A straight line is a formula, which needs no pass of its own.
            let line = spline.straight().and_then(|[intercept, slope]| {
                let count = variables.count / densities.len();
                Formula::linear(intercept, (0..count).map(|s| (density * count + s, slope))).ok()
            });
            Ok(match line {
                Some(formula) => ExcessFreeEnergy::Formula(formula),
                None => ExcessFreeEnergy::Curve(Curve {
                    density: *density,
                    form: CurveForm::Table(Arc::clone(spline)),
                }),
            })
        }
        ExcessEntry::Slopes { slopes, energy } => {
            bind_slopes(slopes, energy.as_ref(), constants, variables).map(ExcessFreeEnergy::Slopes)
        }
        ExcessEntry::PressureTable { spline, density, place } => {
            let psi = pressure_table::psi(spline, kt).map_err(|message| place.error(message))?;
            Ok(ExcessFreeEnergy::Curve(Curve { density: *density, form: CurveForm::Table(Arc::new(psi)) }))
        }
        ExcessEntry::Pressure { formula: ast, density } => {
            let variables = Variables { count: 1, names: BTreeMap::from([("rho".to_owned(), vec![0])]) };
            // The integration of ψ starts within the bounds, if there are any.
            let start = match densities[*density].bounds {
                Some(Bounds { low, high, .. }) if low > 0.0 => (low * high).sqrt(),
                Some(Bounds { high, .. }) if high > 0.0 => 0.5 * high,
                _ => 1.0,
            };
            let pressure = Formula::compile(&ast.value, constants, &variables)
                .and_then(|p| Ok(Pressure::new(&p, kt, start)?))
                .map_err(|e| formula_error(ast, e))?;
            let form = CurveForm::Pressure(Arc::new(pressure));
            Ok(ExcessFreeEnergy::Curve(Curve { density: *density, form }))
        }
    }
}

/// Binds slopes, each with respect to one partial density or to all densities of a total.
fn bind_slopes(
    slopes: &[(Located<String>, Located<Ast>)],
    energy: Option<&Located<Ast>>,
    constants: &Constants,
    variables: &Variables,
) -> Result<StatedSlopes, FileError> {
    let compile = |ast: &Located<Ast>| {
        Formula::compile(&ast.value, constants, variables).map_err(|e| formula_error(ast, e))
    };
    let mut stated: Vec<Option<Formula>> = vec![None; variables.count];
    for (name, ast) in slopes {
        let members = name.among("density variable", &variables.names)?;
        let formula = compile(ast)?;
        for v in members {
            if stated[*v].replace(formula.clone()).is_some() {
                return Err(name.error("the slope of one of its partial densities is stated twice"));
            }
        }
    }
    let energy = energy.map(compile).transpose()?.unwrap_or_else(|| Formula::constant(0.0));
    let slopes = stated.into_iter().map(|s| s.unwrap_or_else(|| Formula::constant(0.0))).collect();
    Ok(StatedSlopes { energy, slopes })
}

/// Fails for a species whose ψ depends on more bounded variables than its continuation can have, and for bounds of a density
/// that stated slopes depend on.
fn check_bounded(
    model: &Model,
    densities: &[WeightedDensity],
    excess: &[ExcessFreeEnergy],
) -> Result<(), FileError> {
    let count = model.species.len();
    let all = (0..densities.len() * count).filter(|v| densities[v / count].bounds.is_some());
    for (entry, excess) in model.excess.iter().zip(excess) {
        match (entry, excess) {
            (ExcessEntry::Formula(ast), ExcessFreeEnergy::Formula(psi)) => {
                // With n bounded variables the continuation of ψ has 3^n terms.
                let (bounded, most) = (all.clone().filter(|v| psi.depends_on(*v)).count(), Expansion::MOST);
                if bounded > most {
                    let message =
                        format!("depends on {bounded} partial densities with bounds, at most {most}");
                    return Err(ast.error(message).with_help(
                        "leave the bounds out, or limit the densities in the formula with min and max",
                    ));
                }
            }
            (_, ExcessFreeEnergy::Slopes(law)) => {
                if let Some(v) = all.clone().find(|v| law.depends_on(*v)) {
                    let name = &densities[v / count].name;
                    let message = format!(
                        "density {name} has bounds, beyond which psi is continued; stated slopes have no psi"
                    );
                    return Err(FileError::new(&model.source, 0..0, "excess_free_energy", message)
                        .with_help(
                            "leave the bounds out, or limit the density in the formula with min and max",
                        ));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// The variables of ψ: a density `n` of species A and B has the names n_A, n_B and n = n_A + n_B.
fn variables(model: &Model) -> Variables {
    let count = model.species.len();
    let mut names = BTreeMap::new();
    for (d, density) in model.densities.iter().enumerate() {
        names.insert(density.name.clone(), (0..count).map(|s| d * count + s).collect());
        for (s, species) in model.species.iter().enumerate() {
            names.insert(format!("{}_{species}", density.name), vec![d * count + s]);
        }
    }
    Variables { count: model.densities.len() * count, names }
}

fn bind_density(
    entry: &DensityEntry,
    constants: &Constants,
    dimensions: usize,
) -> Result<WeightedDensity, FileError> {
    let range = entry.range.positive(constants)?;
    let polynomial = |coefficients: &Vec<Number>| {
        if coefficients.is_empty() {
            return Ok(Polynomial::identity());
        }
        let values = coefficients.iter().map(|c| c.evaluate(constants).map(|x| x.value));
        values.collect::<Result<_, _>>().map(Polynomial)
    };
    let bounds = match &entry.bounds {
        None => None,
        Some([low, high]) => {
            let (low, high) = (low.evaluate(constants)?, high.evaluate(constants)?.value);
            if low.value >= high {
                return Err(low.error(format!("the lower bound {} is not below the upper {high}", low.value)));
            }
            Some(Bounds { low: low.value, high, below: entry.below })
        }
    };
    Ok(WeightedDensity {
        name: entry.name.clone(),
        kernel: Kernel::new(entry.kernel, range, dimensions),
        force_kernel: Kernel::new(entry.force_kernel, range, dimensions),
        includes_self: entry.includes_self,
        correction: entry.correction.iter().map(polynomial).collect::<Result<_, FileError>>()?,
        bounds,
    })
}

fn bind_thermostats(
    entries: &[ThermostatEntry],
    constants: &Constants,
    count: usize,
) -> Result<Vec<Option<Thermostat>>, FileError> {
    let mut all = vec![None; count * count];
    // The entry for all pairs comes first, so that entries for single pairs replace it.
    let ordered =
        entries.iter().filter(|e| e.between.is_none()).chain(entries.iter().filter(|e| e.between.is_some()));
    for entry in ordered {
        let gamma = entry.gamma.evaluate(constants)?;
        if gamma.value < 0.0 {
            return Err(gamma.error(format!("must not be negative, is {}", gamma.value)));
        }
        let exponent = entry.exponent.as_ref().map_or(Ok(1.0), |number| number.positive(constants))?;
        let thermostat = Thermostat { gamma: gamma.value, range: entry.range.positive(constants)?, exponent };
        match entry.between {
            None => all.fill(Some(thermostat)),
            Some([a, b]) => {
                all[a * count + b] = Some(thermostat);
                all[b * count + a] = Some(thermostat);
            }
        }
    }
    Ok(all)
}
