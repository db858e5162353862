//! Applies a temperature: turns the entries of the file into a [`Fluid`].

use super::Model;
use super::density::DensityEntry;
use super::excess::ExcessEntry;
use super::interaction::{PairTable, ThermostatEntry};
use crate::continuation::Bounds;
use crate::curve::pressure_table;
use crate::curve::{Curve, CurveForm, Pressure};
use crate::document::{FileError, FileErrorKind, Located, Source};
use crate::expression::{Ast, ErrorKind, Expansion, ExpressionError, Formula, Variables};
use crate::fluid::{
    ExcessFreeEnergy, Fluid, PairTerm, Polynomial, StatedSlopes, Thermostat, WeightedDensity,
};
use crate::kernel::Kernel;
use crate::number::formula_error;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Parameters and variables that formulas may refer to.
struct Context<'a> {
    source: &'a Arc<Source>,
    constants: BTreeMap<String, f64>,
    species: usize,
}

pub fn bind(model: &Model, kt: f64) -> Result<Fluid, FileError> {
    let source = &model.source;
    if !(kt > 0.0 && kt.is_finite()) {
        let message = format!("the temperature must be a positive number, is {kt}");
        return Err(FileError::new(source, 0..0, "kT", FileErrorKind::Value(message)));
    }
    let mut constants = model.parameters.clone();
    constants.insert("kT".into(), kt);
    let context = Context { source, constants, species: model.species.len() };
    let densities = model
        .densities
        .iter()
        .map(|entry| bind_density(entry, &context, model.dimensions))
        .collect::<Result<Vec<_>, _>>()?;
    let variables = variables(model);
    let excess = model
        .excess
        .iter()
        .map(|entry| bind_excess(entry, &context, &variables, &densities))
        .collect::<Result<Vec<_>, _>>()?;
    check_bounded(model, &densities, &excess)?;
    let bind_pair = |table: &PairTable| {
        let potential = table.form.bind(&context.constants, source)?;
        Ok(PairTerm { between: table.between, potential })
    };
    let pairs = model.pairs.iter().map(bind_pair).collect::<Result<Vec<_>, _>>()?;
    Ok(Fluid {
        title: model.title.clone(),
        reference: model.reference.clone(),
        dimensions: model.dimensions,
        kt,
        species: model.species.clone(),
        densities,
        excess,
        pairs,
        thermostats: bind_thermostats(&model.thermostats, &context)?,
    })
}

fn bind_excess(
    entry: &ExcessEntry,
    context: &Context,
    variables: &Variables,
    densities: &[WeightedDensity],
) -> Result<ExcessFreeEnergy, FileError> {
    let count = context.species;
    match entry {
        ExcessEntry::None => Ok(ExcessFreeEnergy::Formula(Formula::constant(0.0))),
        ExcessEntry::Formula(ast) => Formula::compile(&ast.value, &context.constants, variables)
            .map(ExcessFreeEnergy::Formula)
            .map_err(|e| formula_error(context.source, ast, e)),
        ExcessEntry::Table { spline, density } => {
            // A straight line is a formula, which needs no pass of its own.
            let line = spline.straight().and_then(|[intercept, slope]| {
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
            bind_slopes(slopes, energy.as_ref(), context, variables, densities).map(ExcessFreeEnergy::Slopes)
        }
        ExcessEntry::PressureTable { spline, density, key } => {
            let psi = pressure_table::psi(spline, context.constants["kT"])
                .map_err(|message| key.error(context.source, FileErrorKind::Value(message)))?;
            Ok(ExcessFreeEnergy::Curve(Curve { density: *density, form: CurveForm::Table(Arc::new(psi)) }))
        }
        ExcessEntry::Pressure { formula: ast, density } => {
            let variables = Variables { count: 1, names: BTreeMap::from([("rho".to_owned(), vec![0])]) };
            let kt = context.constants["kT"];
            // The integration of ψ starts within the bounds, if there are any.
            let start = match densities[*density].bounds {
                Some(Bounds { low, high, .. }) if low > 0.0 => (low * high).sqrt(),
                Some(Bounds { high, .. }) if high > 0.0 => 0.5 * high,
                _ => 1.0,
            };
            let too_large = |e| ExpressionError { kind: ErrorKind::TooLarge(e), offset: 0, length: 0 };
            Formula::compile(&ast.value, &context.constants, &variables)
                .and_then(|p| Pressure::new(&p, kt, start).map_err(too_large))
                .map(|p| {
                    ExcessFreeEnergy::Curve(Curve {
                        density: *density,
                        form: CurveForm::Pressure(Arc::new(p)),
                    })
                })
                .map_err(|e| formula_error(context.source, ast, e))
        }
    }
}

/// Binds slopes, each with respect to one partial density or to all densities of a total.
fn bind_slopes(
    slopes: &[(Located<String>, Located<Ast>)],
    energy: Option<&Located<Ast>>,
    context: &Context,
    variables: &Variables,
    densities: &[WeightedDensity],
) -> Result<StatedSlopes, FileError> {
    let source = context.source;
    let compile = |ast: &Located<Ast>| {
        Formula::compile(&ast.value, &context.constants, variables).map_err(|e| formula_error(source, ast, e))
    };
    let mut stated: Vec<Option<Formula>> = vec![None; variables.count];
    for (name, ast) in slopes {
        let Some(members) = variables.names.get(&name.value) else {
            let known = variables.names.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            let name_of = name.value.clone();
            let kind = FileErrorKind::UnknownName { what: "density variable", name: name_of, known };
            return Err(name.error(source, kind));
        };
        let formula = compile(ast)?;
        for v in members {
            if stated[*v].replace(formula.clone()).is_some() {
                let message = "the slope of one of its partial densities is stated twice".into();
                return Err(name.error(source, FileErrorKind::Value(message)));
            }
        }
    }
    let energy = energy.map(compile).transpose()?.unwrap_or_else(|| Formula::constant(0.0));
    let slopes = stated.into_iter().map(|s| s.unwrap_or_else(|| Formula::constant(0.0))).collect();
    let law = StatedSlopes { energy, slopes };
    let bounded = |v: &usize| densities[v / context.species].bounds.is_some() && law.depends_on(*v);
    if let Some(v) = (0..variables.count).find(bounded) {
        let name = &densities[v / context.species].name;
        let message =
            format!("density {name} has bounds, beyond which psi is continued; stated slopes have no psi");
        return Err(FileError::new(source, 0..0, "excess_free_energy", FileErrorKind::Value(message))
            .with_help("leave the bounds out, or limit the density in the formula with min and max"));
    }
    Ok(law)
}

/// With n bounded variables the continuation of ψ has 3^n terms.
fn check_bounded(
    model: &Model,
    densities: &[WeightedDensity],
    excess: &[ExcessFreeEnergy],
) -> Result<(), FileError> {
    let count = model.species.len();
    for (entry, excess) in model.excess.iter().zip(excess) {
        let (ExcessEntry::Formula(ast), ExcessFreeEnergy::Formula(psi)) = (entry, excess) else { continue };
        let bounded = (0..densities.len() * count)
            .filter(|v| densities[v / count].bounds.is_some() && psi.depends_on(*v))
            .count();
        if bounded > Expansion::MOST {
            let message =
                format!("depends on {bounded} partial densities with bounds, at most {}", Expansion::MOST);
            return Err(ast
                .error(&model.source, FileErrorKind::Value(message))
                .with_help("leave the bounds out, or limit the densities in the formula with min and max"));
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
    context: &Context,
    dimensions: usize,
) -> Result<WeightedDensity, FileError> {
    let (constants, source) = (&context.constants, context.source);
    let range = entry.range.positive(constants, source)?;
    let correction = entry
        .correction
        .iter()
        .map(|coefficients| {
            if coefficients.is_empty() {
                return Ok(Polynomial::identity());
            }
            let values: Result<Vec<f64>, FileError> =
                coefficients.iter().map(|c| c.evaluate(constants, source).map(|x| x.value)).collect();
            values.map(Polynomial)
        })
        .collect::<Result<Vec<_>, _>>()?;
    debug_assert_eq!(correction.len(), context.species * context.species);
    let bounds = match &entry.bounds {
        None => None,
        Some([low, high]) => {
            let low = low.evaluate(constants, source)?;
            let high = high.evaluate(constants, source)?;
            if low.value >= high.value {
                return Err(low.error(
                    source,
                    FileErrorKind::Value(format!(
                        "the lower bound {} is not below the upper {}",
                        low.value, high.value
                    )),
                ));
            }
            Some(Bounds { low: low.value, high: high.value, below: entry.below })
        }
    };
    Ok(WeightedDensity {
        name: entry.name.clone(),
        kernel: Kernel::new(entry.kernel, range, dimensions),
        force_kernel: Kernel::new(entry.force_kernel, range, dimensions),
        includes_self: entry.includes_self,
        correction,
        bounds,
    })
}

fn bind_thermostats(
    entries: &[ThermostatEntry],
    context: &Context,
) -> Result<Vec<Option<Thermostat>>, FileError> {
    let (constants, source) = (&context.constants, context.source);
    let count = context.species;
    let mut all = vec![None; count * count];
    // The entry for all pairs comes first, so that entries for single pairs replace it.
    let ordered =
        entries.iter().filter(|e| e.between.is_none()).chain(entries.iter().filter(|e| e.between.is_some()));
    for entry in ordered {
        let gamma = entry.gamma.evaluate(constants, source)?;
        if gamma.value < 0.0 {
            return Err(gamma
                .error(source, FileErrorKind::Value(format!("must not be negative, is {}", gamma.value))));
        }
        let exponent = match &entry.exponent {
            Some(number) => number.positive(constants, source)?,
            None => 1.0,
        };
        let thermostat =
            Thermostat { gamma: gamma.value, range: entry.range.positive(constants, source)?, exponent };
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
