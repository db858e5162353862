use crate::document::{FileError, Section, Source, Value};
use crate::fluid::{ExcessFreeEnergy, Fluid};
use crate::number::Number;
use crate::pair::PairEntry;
use std::path::Path;
use std::sync::Arc;

/// A `[[pair]]` table.
#[derive(Debug, Clone)]
pub struct PairTable {
    pub between: [usize; 2],
    pub form: PairEntry,
}

/// A `[[thermostat]]` table.
#[derive(Debug, Clone)]
pub struct ThermostatEntry {
    /// The pair of species; `None` for every pair without an entry of its own.
    pub between: Option<[usize; 2]>,
    pub gamma: Number,
    pub range: Number,
    pub exponent: Option<Number>,
}

fn read_between(value: &Value, species: &[String]) -> Result<[usize; 2], FileError> {
    let [a, b] = &value.array()?[..] else { return Err(value.error("expected two species")) };
    let index = |name: &Value| name.string()?.among("species", species.iter().zip(0..));
    Ok([index(a)?, index(b)?])
}

/// Reads every `[[pair]]`.
pub fn read_pairs(root: &Section, species: &[String], directory: &Path) -> Result<Vec<PairTable>, FileError> {
    let tables = root.get("pair").map_or(Ok(Vec::new()), |value| value.array())?;
    let read = |item: &Value| {
        let table = item.section()?;
        let between = read_between(&table.require("between")?, species)?;
        let form = PairEntry::read(&table.require("form")?, &table, directory)?;
        Ok(PairTable { between, form })
    };
    tables.iter().map(read).collect()
}

/// Reads every `[[thermostat]]`.
pub fn read_thermostats(root: &Section, species: &[String]) -> Result<Vec<ThermostatEntry>, FileError> {
    let Some(value) = root.get("thermostat") else { return Ok(Vec::new()) };
    let mut entries: Vec<ThermostatEntry> = Vec::new();
    for item in value.array()? {
        let table = item.section()?;
        let between = table.read("between", |value| read_between(value, species))?;
        let sorted = |[a, b]: [usize; 2]| [a.min(b), a.max(b)];
        if entries.iter().any(|e| e.between.map(sorted) == between.map(sorted)) {
            return Err(table.error("this pair of species has a thermostat already"));
        }
        entries.push(ThermostatEntry {
            between,
            gamma: Number::require(&table, "gamma")?,
            range: Number::require(&table, "range")?,
            exponent: table.read("exponent", Number::read)?,
        });
    }
    Ok(entries)
}

/// In a fluid whose particles interact, every two species must have an interaction: a forgotten entry
/// must not look like an ideal mixture.
pub fn check_coverage(source: &Arc<Source>, fluid: &Fluid) -> Result<(), FileError> {
    let count = fluid.species.len();
    // Row-major for pairs of species in order; the entries below the diagonal stay false.
    let mut coupled = vec![false; count * count];
    let mut couple = |a: usize, b: usize| coupled[a.min(b) * count + a.max(b)] = true;
    fluid.pairs.iter().for_each(|term| couple(term.between[0], term.between[1]));
    for (alpha, excess) in fluid.excess.iter().enumerate() {
        for variable in 0..fluid.variables() {
            let depends = match excess {
                ExcessFreeEnergy::Formula(formula) => formula.depends_on(variable),
                ExcessFreeEnergy::Curve(curve) => curve.density == variable / count,
                ExcessFreeEnergy::Slopes(law) => law.slopes[variable].is_constant() != Some(0.0),
            };
            if depends {
                couple(alpha, variable % count);
            }
        }
    }
    let nothing = coupled.iter().all(|c| !c);
    let missing =
        |table: &[bool]| (0..count).find_map(|a| (a..count).find(|b| !table[a * count + b]).map(|b| (a, b)));
    let whole = |key: &str, message: String, help: String| {
        Err(FileError::new(source, 0..0, key, message).with_help(help))
    };
    if let (false, Some((a, b))) = (nothing, missing(&coupled)) {
        let (a, b) = (&fluid.species[a], &fluid.species[b]);
        return whole(
            "pair",
            format!("nothing acts between species {a} and {b}"),
            format!(
                "add a [[pair]] with between = [\"{a}\", \"{b}\"], of strength 0 if they do not interact"
            ),
        );
    }
    let held: Vec<bool> = fluid.thermostats.iter().map(Option::is_some).collect();
    if let (true, Some((a, b))) = (held.iter().any(|h| *h), missing(&held)) {
        let (a, b) = (&fluid.species[a], &fluid.species[b]);
        return whole(
            "thermostat",
            format!("species {a} and {b} have no thermostat, but other pairs have one"),
            "leave `between` out for a thermostat of every pair, or add one with gamma = 0".into(),
        );
    }
    Ok(())
}
