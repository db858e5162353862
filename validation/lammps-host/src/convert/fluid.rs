//! The fluid that the coefficients of a script describe when LAMMPS runs.

use super::Law;
use psidpd_core::model::{DragWeight, ForceLaw, PresetError, WarrenPair, warren_ab};
use std::collections::BTreeMap;

/// A number of a script: its value if known, and its text.
#[derive(Debug, Clone)]
pub struct Number {
    pub text: String,
    pub value: Option<f64>,
}

impl Number {
    /// Whether two numbers are equal; `None` if that is not known.
    fn is(&self, other: &Number) -> Option<bool> {
        match (self.value, other.value) {
            (Some(a), Some(b)) => Some((a - b).abs() <= 1e-12 * a.abs().max(b.abs())),
            _ => (self.text == other.text).then_some(true),
        }
    }
}

/// What a `pair_coeff` sets.
#[derive(Debug, Clone)]
pub enum Coefficients {
    /// The range of a density.
    Density(Number),
    /// `A B γ rc rd`, and the range and the exponent of drag.
    Forces(Vec<Number>),
}

/// The commands that have set coefficients and masses so far.
#[derive(Debug, Default)]
pub struct Fluid {
    /// Coefficients with the two words for types, in the order of the script.
    pub coefficients: Vec<([String; 2], Coefficients)>,
    /// Masses by words for types.
    pub masses: Vec<(String, Number)>,
    /// The number of atom types, if it is known.
    pub types: Option<usize>,
    pub flat: bool,
}

#[derive(Default)]
struct Pair<'a> {
    density: Option<&'a Number>,
    forces: Option<&'a [Number]>,
}

/// What is wrong with a fluid, or to be looked at.
pub enum Finding {
    Look(String),
    /// The text has `NEAREST` where the name of the file of the nearest model belongs, whose text follows.
    NoPotential(String, Option<String>),
    ByHand(String),
}

impl Fluid {
    /// The number of types, or the largest that a command names.
    fn count(&self) -> usize {
        let words = self.coefficients.iter().flat_map(|(types, _)| types);
        let numbers = words.flat_map(|word| word.split('*')).filter_map(|word| word.parse().ok());
        self.types.or(numbers.max()).unwrap_or(1).min(1000)
    }

    fn pairs(&self) -> BTreeMap<(usize, usize), Pair<'_>> {
        let mut pairs: BTreeMap<(usize, usize), Pair> = BTreeMap::new();
        let count = self.count();
        for (types, coefficients) in &self.coefficients {
            let [Some(first), Some(second)] = [&types[0], &types[1]].map(|word| range(word, count)) else {
                continue;
            };
            for i in first.0..=first.1 {
                for j in second.0.max(i)..=second.1 {
                    let pair = pairs.entry((i, j)).or_default();
                    match coefficients {
                        Coefficients::Density(range) => pair.density = Some(range),
                        Coefficients::Forces(forces) => pair.forces = Some(forces),
                    }
                }
            }
        }
        pairs
    }

    /// The words for types of the first coefficients whose types are not known, as those of a loop.
    fn unknown_types(&self) -> Option<&[String; 2]> {
        let count = self.count();
        let mut types = self.coefficients.iter().map(|(types, _)| types);
        types.find(|types| types.iter().any(|word| range(word, count).is_none()))
    }

    /// The types that have coefficients, with their masses: 1 if the script sets none that is known.
    pub fn members(&self) -> Vec<(usize, f64)> {
        let pairs = self.pairs();
        let count = self.count();
        let has = |t: &usize| pairs.iter().any(|((i, j), pair)| (i == t || j == t) && pair.forces.is_some());
        let mass = |t: usize| {
            let sets = |word: &str| range(word, count).is_some_and(|(low, high)| (low..=high).contains(&t));
            self.masses
                .iter()
                .rev()
                .find(|(word, _)| sets(word))
                .and_then(|(_, mass)| mass.value)
                .unwrap_or(1.0)
        };
        (1..=count).filter(has).map(|t| (t, mass(t))).collect()
    }

    /// Whether all densities have one range.
    pub fn has_one_range(&self) -> bool {
        let pairs = self.pairs();
        let mut ranges = pairs.values().filter_map(|pair| pair.forces?.get(4));
        let first = ranges.next();
        ranges.all(|rd| first.is_none_or(|first| first.is(rd) == Some(true)))
    }

    /// Compares the fluid with what the new style computes. In plain DPD there are no densities.
    pub fn check(&self, law: Law, many_body: bool) -> Vec<Finding> {
        if !many_body {
            return vec![];
        }
        let mut found = Vec::new();
        let pairs = self.pairs();
        let unknown = self.unknown_types();
        if let Some([i, j]) = unknown {
            found.push(Finding::Look(format!(
                "the types {i} {j} are known only when LAMMPS runs: densities and forces of a pair must have one range"
            )));
        }
        for ((i, j), pair) in &pairs {
            match pair {
                // What seems to be missing may be that of a type that is not known.
                Pair { density: None, .. } | Pair { forces: None, .. } if unknown.is_some() => {}
                Pair { density: Some(_), forces: None } => found.push(Finding::ByHand(format!(
                    "types {i} {j} have a density without a force: the new style has both or none for a pair"
                ))),
                Pair { density: None, forces: Some(_) } => found.push(Finding::Look(format!(
                    "types {i} {j} had no mdpd/rhosum when LAMMPS ran, and did not count in densities; now they do"
                ))),
                Pair { density: Some(density), forces: Some(forces) } => {
                    let Some(rd) = forces.get(4) else { continue };
                    match density.is(rd) {
                        Some(true) => {}
                        Some(false) => found.push(Finding::Look(format!(
                            "types {i} {j}: densities had the range {}, forces {}; now both have {}",
                            density.text, rd.text, rd.text
                        ))),
                        None => found.push(Finding::Look(format!(
                            "types {i} {j}: densities had the range {}, forces {}, which may differ; now both have {}",
                            density.text, rd.text, rd.text
                        ))),
                    }
                }
                Pair { density: None, forces: None } => {}
            }
        }
        if law == Law::Conservative {
            found.extend(self.check_potential(&pairs));
            found.extend(self.check_masses());
        }
        found
    }

    fn check_potential(&self, pairs: &BTreeMap<(usize, usize), Pair>) -> Option<Finding> {
        let members: Vec<usize> = self.members().into_iter().map(|(t, _)| t).collect();
        let row = |i: &usize, j: &usize| pairs.get(&(*i.min(j), *i.max(j))).and_then(|pair| pair.forces);
        let value = |forces: &[Number], k: usize| forces.get(k).and_then(|number| number.value);
        let first =
            members.first().and_then(|t| row(t, t).or_else(|| members.iter().find_map(|u| row(t, u))))?;
        let all = || members.iter().flat_map(|i| members.iter().filter_map(move |j| row(i, j)));
        let agree = |forces: &[Number], k: usize| forces.get(k)?.is(first.get(k)?);
        let same = |k: usize| all().all(|forces| agree(forces, k) == Some(true));
        if same(1) && same(4) {
            return None;
        }
        let numeric = all().all(|forces| value(forces, 1).is_some() && value(forces, 4).is_some());
        if !numeric {
            return Some(Finding::Look(
                "variables have B or rd: the style refuses coefficients whose B rd^4 differs between pairs of types; --law lucy does not"
                    .into(),
            ));
        }
        let warren = |forces: &[Number]| {
            let at = |k| value(forces, k);
            let weight = at(5).map(|range| DragWeight { range, exponent: at(6).unwrap_or(1.0) });
            Some(WarrenPair {
                a: at(0).unwrap_or(0.0),
                b: at(1)?,
                gamma: at(2).unwrap_or(0.0),
                rc: at(3).unwrap_or(1.0),
                rd: at(4)?,
                weight,
            })
        };
        let names: Vec<String> = members.iter().map(|t| format!("T{t}")).collect();
        // Pairs without coefficients belong to other styles: they are like any others here.
        let table: Vec<Option<WarrenPair>> =
            members.iter().flat_map(|i| members.iter().map(|j| warren(row(i, j).unwrap_or(first)))).collect();
        match warren_ab(&names, &table, if self.flat { 2 } else { 3 }, ForceLaw::Conservative) {
            Err(PresetError::NoPotential { name, first, second, nearest }) => Some(Finding::NoPotential(
                format!(
                    "{name} differs between pairs of types ({first} and {second}): no potential has such a force, and the style \
                     refuses it; --law lucy does not; the nearest model with a potential, for pair_style dpd/psi, NEAREST"
                ),
                Some(nearest),
            )),
            Err(other) => Some(Finding::ByHand(other.to_string())),
            Ok(_) => None,
        }
    }

    fn check_masses(&self) -> Option<Finding> {
        let members = self.members();
        let unknown = self.masses.iter().find(|(_, mass)| mass.value.is_none());
        if let Some((_, mass)) = unknown {
            return Some(Finding::Look(format!(
                "a mass is {}: the built-in weights densities by mass, the conservative law counts each neighbor as 1; with masses other \
                 than 1 the liquid has another density; --law lucy has the weights",
                mass.text
            )));
        }
        let (_, first) = *members.first()?;
        if members.iter().all(|(_, mass)| *mass == 1.0) {
            return None;
        }
        Some(Finding::Look(if members.iter().all(|(_, mass)| *mass == first) {
            format!(
                "all masses are {first}: the built-in weights densities by mass, the conservative law counts each neighbor as 1; B times \
                 {first} makes up for it"
            )
        } else {
            let list: Vec<String> = members.iter().map(|(t, mass)| format!("{mass} of type {t}")).collect();
            format!(
                "masses differ ({}): the built-in weights densities by mass, the conservative law counts each neighbor as 1, and the liquid \
                 is denser (by 14 % in a mixture of masses 1 and 2); --law lucy has the weights",
                list.join(", ")
            )
        }))
    }
}

/// The first and the last type of `2`, `*`, `2*`, `*3` or `2*3` of `count` types.
fn range(word: &str, count: usize) -> Option<(usize, usize)> {
    let end = |text: &str, default: usize| if text.is_empty() { Some(default) } else { text.parse().ok() };
    match word.split_once('*') {
        Some((low, high)) => Some((end(low, 1)?, end(high, count)?.min(count))),
        None => word.parse().ok().map(|t| (t, t)),
    }
}
