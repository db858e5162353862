//! A fluid as WGSL: ψ with its slopes, weight functions, pair potentials and drag, pasted into the kernels of `wgsl/`.
//!
//! Numbers of the model are no part of the text but constants in a buffer, so that a new temperature needs no compiler
//! unless it changes the form of a formula.

use crate::Unsupported;
use crate::table::{of_curve, of_spline};
use psidpd_core::engine::Plan;
use psidpd_core::model::curve::{Curve, CurveForm};
use psidpd_core::model::expression::{Formula, Program, TooLarge};
use psidpd_core::model::kernel::Kernel;
use psidpd_core::model::pair::{PairForm, PairPotential};
use psidpd_core::model::{Bounds, Continuation, ExcessFreeEnergy, Fluid, Polynomial};
use std::collections::HashMap;
use std::fmt::Write;

/// Invocations of a workgroup.
pub const LANES: u32 = 128;
/// Cells that a workgroup sums.
pub const SCAN: u32 = 1024;
/// Sums of each workgroup.
pub const ENTRIES: u32 = 36;
/// Most constants: a uniform buffer has 64 KiB.
const MOST_CONSTANTS: usize = 16_384;
/// Most species, whose masses have a place.
const MOST_SPECIES: usize = 64;

/// The kernels of a fluid.
#[derive(Debug, Clone, PartialEq)]
pub struct Shader {
    /// WGSL.
    pub text: String,
    /// Constants by their index in the text; a multiple of 4.
    pub constants: Vec<f32>,
    /// Tables, one after the other; never empty.
    pub tables: Vec<f32>,
    /// Variables of ψ; 0 without a density pass.
    pub variables: usize,
}

impl Shader {
    /// Writes the kernels of a fluid.
    pub fn new(fluid: &Fluid) -> Result<Shader, Unsupported> {
        if fluid.species.len() > MOST_SPECIES {
            return Err(unsupported(format!("more than {MOST_SPECIES} species")));
        }
        let plan = Plan::new(fluid).map_err(too_large)?;
        let variables = plan.slope_width();
        let mut writer = Writer { fluid, plan: &plan, numbers: Numbers::default(), tables: Vec::new() };
        let mut body = writer.drag_weight();
        body += &writer.pair_terms()?;
        body += &writer.many_body();
        body += &writer.excess()?;
        let add_weights = writer.add_weights();
        let densities = plan.passes().iter().map(|d| &fluid.densities[*d]);
        let of_density = densities.map(|d| d.kernel.range()).fold(0.0, f64::max);
        let of_drag = plan.noise_range().unwrap_or(0.0);
        let ranges = [("RANGE2", fluid.cutoff()), ("DENSITY_RANGE2", of_density), ("DRAG_RANGE2", of_drag)];
        let mut text = String::new();
        for (name, value) in [
            ("LANES", LANES),
            ("SCAN", SCAN),
            ("ENTRIES", ENTRIES),
            ("V", variables.max(1) as u32),
            ("D", fluid.dimensions as u32),
        ] {
            let _ = writeln!(text, "const {name} = {value}u;");
        }
        for kernels in [include_str!("wgsl/forces.wgsl"), include_str!("wgsl/heat.wgsl")] {
            let mut kernels = kernels
                .replace("@ADD_WEIGHTS", &add_weights)
                .replace("@MANY_BODY", "many_body(i, j, species, of_other, r)");
            for (name, range) in ranges {
                let square = writer.number(range * range);
                kernels = kernels.replace(&format!("@NEIGHBOURS({name})"), &LOOP.replace("@RANGE2", &square));
            }
            body += &kernels.replace("@END", "}}}");
        }
        let Writer { numbers, mut tables, .. } = writer;
        let mut constants = numbers.finish()?;
        constants.resize(constants.len().next_multiple_of(4).max(4), 0.0);
        if constants.len() > MOST_CONSTANTS {
            return Err(unsupported(format!("a fluid with more than {MOST_CONSTANTS} constants")));
        }
        if tables.is_empty() {
            tables.push(0.0);
        }
        let _ = writeln!(text, "const CONSTANTS = {}u;", constants.len() / 4);
        for part in [
            include_str!("wgsl/common.wgsl"),
            include_str!("wgsl/kernels.wgsl"),
            &body,
            include_str!("wgsl/motion.wgsl"),
        ] {
            for line in part.lines() {
                match line.strip_prefix("@KERNEL ").and_then(|rest| rest.strip_suffix(" {")) {
                    Some(name) => text += &KERNEL.replace("@NAME", name),
                    None => text += line,
                }
                text.push('\n');
            }
        }
        Ok(Shader { text, constants, tables, variables })
    }
}

/// The head of a kernel: `i` is the particle of this invocation, `block` its workgroup.
const KERNEL: &str = "@compute @workgroup_size(LANES)
fn @NAME(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) lane: u32) {
    let block = group.x + group.y * groups.x;
    let i = block * LANES + lane;";

/// The loop over the neighbours `j` of particle `i` at `own`, with `d = r_i − r_j` and its square `r2`.
const LOOP: &str = "let here = cell_of(own);
        let along_x = ranges(here.x);
        for (var row = 0u; row < select(9u, 3u, D == 2u); row++) {
            let y = neighbour(here.y, row % 3u, 1u);
            let z = select(neighbour(here.z, row / 3u, 2u), 0u, D == 2u);
            if (y == NONE || z == NONE) { continue; }
            let cells = (z * P.cells.y + y) * P.cells.x;
            for (var part = 0u; part < 2u; part++) {
                let begin = cells + select(along_x.x, along_x.z, part == 1u);
                let to = cells + select(along_x.y, along_x.w, part == 1u);
                if (begin == to) { continue; }
                let end = first_of(to);
                for (var j = first_of(begin); j < end; j++) {
                    let at = pos[j];
                    let d = separation(own, at);
                    let r2 = dot(d, d);
                    if (r2 >= @RANGE2 || j == i) { continue; }
                    ";

fn unsupported(what: impl Into<String>) -> Unsupported {
    Unsupported { what: what.into() }
}

fn too_large(_: TooLarge) -> Unsupported {
    unsupported("a formula this long, with the continuations of its bounds")
}

/// The formula `sum + factor x` with the variable `x`.
fn plus(sum: &Formula, factor: &Formula, x: usize) -> Result<Formula, TooLarge> {
    sum.minus(&factor.times(&Formula::linear(0.0, [(x, -1.0)])?)?)
}

/// Numbers of the model, by their place among the constants.
#[derive(Default)]
struct Numbers {
    places: HashMap<u64, usize>,
    values: Vec<f64>,
}

impl Numbers {
    fn name(&mut self, value: f64) -> String {
        let next = self.values.len();
        let place = *self.places.entry(value.to_bits()).or_insert(next);
        if place == next {
            self.values.push(value);
        }
        format!("K.c[{}].{}", place / 4, ["x", "y", "z", "w"][place % 4])
    }

    /// The constants in single precision.
    fn finish(self) -> Result<Vec<f32>, Unsupported> {
        let single = |value: f64| {
            let out_of_range = value.is_finite() && (value != 0.0) != (value as f32).is_normal();
            if out_of_range {
                Err(unsupported(format!("the number {value:e} of the model")))
            } else {
                Ok(value as f32)
            }
        };
        self.values.into_iter().map(single).collect()
    }
}

struct Writer<'a> {
    fluid: &'a Fluid,
    plan: &'a Plan,
    numbers: Numbers,
    tables: Vec<f32>,
}

impl Writer<'_> {
    fn number(&mut self, value: f64) -> String {
        self.numbers.name(value)
    }

    fn count(&self) -> usize {
        self.fluid.species.len()
    }

    /// Statements for each pair of species, of which `of` writes those of one.
    fn by_pair(
        &mut self,
        mut of: impl FnMut(&mut Self, usize, usize) -> Result<String, Unsupported>,
    ) -> Result<String, Unsupported> {
        let count = self.count();
        if count == 1 {
            return of(self, 0, 0);
        }
        let mut text = format!("    switch (min(a, b) * {count}u + max(a, b)) {{\n");
        for a in 0..count {
            for b in a..count {
                let _ = writeln!(text, "    case {}u: {{\n{}    }}", a * count + b, of(self, a, b)?);
            }
        }
        Ok(text + "    default: {}\n    }\n")
    }

    /// `√γ w_R` of a pair, 0 beyond its range.
    fn drag_weight(&mut self) -> String {
        let of = |this: &mut Self, a: usize, b: usize| {
            let law = this.fluid.thermostats[a * this.count() + b].filter(|law| law.gamma > 0.0);
            let Some(law) = law else { return Ok(String::new()) };
            let (root, inverse) = (this.number(law.gamma.sqrt()), this.number(1.0 / law.range));
            let power = match law.exponent {
                1.0 => "t".into(),
                2.0 => "t * t".into(),
                other => format!("m_pow(t, {})", this.number(other)),
            };
            Ok(format!(
                "    let t = 1.0 - r * {inverse};\n    if (t > 0.0) {{ return {root} * ({power}); }}\n"
            ))
        };
        let body = self.by_pair(of).unwrap_or_default();
        format!("fn drag_weight(a: u32, b: u32, r: f32) -> f32 {{\n{body}    return 0.0;\n}}\n")
    }

    /// φ and φ′ of all pair potentials, with densities that every ψ is linear in.
    fn pair_terms(&mut self) -> Result<String, Unsupported> {
        let of = |this: &mut Self, a: usize, b: usize| {
            let (count, plan, fluid) = (this.count(), this.plan, this.fluid);
            let mut text = String::new();
            for (k, term) in plan.linear().iter().enumerate() {
                let c = term.coefficients[a * count + b] + term.coefficients[b * count + a];
                if c != 0.0 {
                    let c = this.number(c);
                    let (value, slope) =
                        (this.weight(&term.kernel, "value"), this.weight(&term.force_kernel, "slope"));
                    let _ = writeln!(text, "    let l{k} = {c} * vec2({value}, {slope});\n    out += l{k};");
                }
            }
            let acting = |between: [usize; 2]| between == [a, b] || between == [b, a];
            for (k, term) in fluid.pairs.iter().enumerate().filter(|(_, term)| acting(term.between)) {
                let range = this.number(term.potential.range());
                let body = this.pair_form(k, &term.potential);
                let _ = writeln!(text, "    if (r < {range}) {{\n{body}    }}");
            }
            Ok(text)
        };
        let body = self.by_pair(of)?;
        Ok(format!(
            "fn pair_terms(a: u32, b: u32, r: f32) -> vec2<f32> {{\n    var out = vec2(0.0);\n{body}    return out;\n}}\n"
        ))
    }

    /// Statements that add φ and φ′ of one potential to `out`.
    fn pair_form(&mut self, k: usize, potential: &PairPotential) -> String {
        match potential {
            PairPotential::Soft(soft) => {
                let (a, range) = (soft.strength, PairForm::range(soft));
                let (inverse, half, minus) =
                    (self.number(1.0 / range), self.number(0.5 * a * range), self.number(-a));
                format!("    let t = 1.0 - r * {inverse};\n    out += vec2({half} * t * t, {minus} * t);\n")
            }
            PairPotential::Spline(spline) => {
                let mut text = String::new();
                for (factor, range) in [
                    (spline.repulsion, spline.repulsion_range),
                    (-spline.attraction, spline.attraction_range),
                ] {
                    let [limit, inverse] = [range, 1.0 / range].map(|x| self.number(x));
                    let [value, slope] = [factor, factor / range].map(|x| self.number(x));
                    let _ = writeln!(
                        text,
                        "    if (r < {limit}) {{ let s = r * {inverse}; out += vec2({value} * value_cubic_spline(s), {slope} * \
                         slope_cubic_spline(s)); }}"
                    );
                }
                text
            }
            PairPotential::Expression(pair) => {
                let wgsl = pair.program.wgsl(&format!("p{k}_"), |_| "r".into(), |c| self.numbers.name(c));
                format!("{}    out += vec2({}, {});\n", wgsl.statements, wgsl.outputs[0], wgsl.outputs[1])
            }
            PairPotential::Table(table) => {
                let from = of_spline(&table.spline, &mut self.tables);
                format!("    out += m_table({from}u, r).xy;\n")
            }
        }
    }

    /// `w(r)` or `w′(r)` of a kernel, 0 beyond its range.
    fn weight(&mut self, kernel: &Kernel, what: &str) -> String {
        let factor = if what == "value" { kernel.value_factor() } else { kernel.slope_factor() };
        let [range, inverse, factor] = [kernel.range(), 1.0 / kernel.range(), factor].map(|x| self.number(x));
        let name = kernel.kind().name().replace('-', "_");
        format!("select(0.0, {factor} * {what}_{name}(r * {inverse}), r < {range})")
    }

    fn add_weights(&mut self) -> String {
        let count = self.count();
        let mut text = String::new();
        if count > 1 {
            text += "let of_other = species_of(vel[j]);\n";
        }
        let other = if count > 1 { "of_other" } else { "0u" };
        for (p, d) in self.plan.passes().iter().enumerate() {
            let weight = self.weight(&self.fluid.densities[*d].kernel.clone(), "value");
            let _ = writeln!(text, "            n[{}u + {other}] += {weight};", p * count);
        }
        text
    }

    /// The sum of `(s_i + s_j) w′` over the densities with a pass.
    fn many_body(&mut self) -> String {
        let count = self.count();
        let mut text =
            "fn many_body(i: u32, j: u32, a: u32, b: u32, r: f32) -> f32 {\n    var sum = 0.0;\n".to_owned();
        for (p, d) in self.plan.passes().iter().enumerate() {
            let kernel = self.fluid.densities[*d].force_kernel;
            let (slope, range, first) =
                (self.weight(&kernel, "slope"), self.number(kernel.range()), p * count);
            let _ = writeln!(
                text,
                "    if (r < {range}) {{ sum += (slopes[i * V + {first}u + b] + slopes[j * V + {first}u + a]) * {slope}; }}"
            );
        }
        text + "    return sum;\n}\n"
    }

    /// ψ and its slopes of every species.
    fn excess(&mut self) -> Result<String, Unsupported> {
        let mut text =
            "struct Excess { psi: f32, slope: array<f32, V>, below: bool, above: bool }\n".to_owned();
        let mut choice = String::new();
        for alpha in 0..self.count() {
            let body = self.excess_of(alpha)?;
            let _ = writeln!(
                text,
                "fn excess_{alpha}(n: array<f32, V>) -> Excess {{\n    var out: Excess;\n{body}    return out;\n}}"
            );
            let _ = writeln!(choice, "    case {alpha}u: {{ return excess_{alpha}(n); }}");
        }
        let _ = writeln!(
            text,
            "fn excess_of(species: u32, n: array<f32, V>) -> Excess {{\n    switch (species) {{\n{choice}    default: {{ return \
             excess_0(n); }}\n    }}\n}}"
        );
        Ok(text)
    }

    fn excess_of(&mut self, alpha: usize) -> Result<String, Unsupported> {
        let (count, fluid, plan) = (self.count(), self.fluid, self.plan);
        let variables: Vec<usize> =
            plan.passes().iter().flat_map(|d| (0..count).map(move |s| d * count + s)).collect();
        let mut text = String::new();
        for (k, v) in variables.iter().enumerate() {
            let density = &fluid.densities[v / count];
            let own =
                if density.includes_self && v % count == alpha { density.kernel.value(0.0) } else { 0.0 };
            let own = self.number(own);
            let (value, slope) =
                self.polynomial(&density.correction[alpha * count + v % count], &format!("u{k}"));
            let _ = writeln!(
                text,
                "    let u{k} = n[{k}] + {own};\n    let c{k} = {value};\n    let g{k} = {slope};"
            );
        }
        match &fluid.excess[alpha] {
            ExcessFreeEnergy::Formula(psi) => {
                let psi = plan.of_passes_only(fluid, alpha, psi);
                text += &self.formula(&psi, &variables).map_err(too_large)?;
            }
            ExcessFreeEnergy::Curve(curve) => text += &self.curve(curve, &variables)?,
            ExcessFreeEnergy::Slopes(law) => {
                let slopes: Vec<Formula> = variables.iter().map(|v| law.slopes[*v].clone()).collect();
                text += &self.program(&law.energy, &slopes, &variables, "c");
            }
        }
        Ok(text)
    }

    fn polynomial(&mut self, polynomial: &Polynomial, x: &str) -> (String, String) {
        if polynomial.is_identity() {
            return (x.to_owned(), "1.0".into());
        }
        let horner = |this: &mut Self, coefficients: Vec<f64>| {
            let first = this.number(*coefficients.last().unwrap_or(&0.0));
            coefficients
                .iter()
                .rev()
                .skip(1)
                .fold(first, |sum, c| format!("({sum} * {x} + {})", this.number(*c)))
        };
        let slope = polynomial.0.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect();
        (horner(self, polynomial.0.clone()), horner(self, slope))
    }

    /// Statements that set ψ and its slopes; `point` names the variables, with their index among the passes behind it.
    fn program(&mut self, psi: &Formula, slopes: &[Formula], variables: &[usize], point: &str) -> String {
        let all = self.fluid.variables();
        let outputs: Vec<&Formula> = std::iter::once(psi).chain(slopes).collect();
        let place = |v: usize| variables.iter().position(|other| *other == v % all).unwrap_or(0);
        // Variables beyond those of the fluid are δ and ½δ² of continuations.
        let name = |v: usize| format!("{}{}", [point, "e", "h", "q"][v / all.max(1)], place(v));
        let wgsl = Program::new(&outputs).wgsl("t", name, |c| self.numbers.name(c));
        let mut text = wgsl.statements + &format!("    out.psi = {};\n", wgsl.outputs[0]);
        for (k, slope) in wgsl.outputs[1..].iter().enumerate() {
            let _ = writeln!(text, "    out.slope[{k}] = {slope} * g{k};");
        }
        text
    }

    fn formula(&mut self, psi: &Formula, variables: &[usize]) -> Result<String, TooLarge> {
        let (count, all) = (self.count(), self.fluid.variables());
        let slopes = variables.iter().map(|v| psi.derivative(*v)).collect::<Result<Vec<_>, _>>()?;
        // A linear ψ needs no continuation.
        let bounds = |k: usize| {
            self.fluid.densities[variables[k] / count].bounds.filter(|_| slopes[k].is_constant().is_none())
        };
        let bounded: Vec<(usize, Bounds)> =
            (0..variables.len()).filter_map(|k| bounds(k).map(|bounds| (k, bounds))).collect();
        if bounded.is_empty() {
            return Ok(self.program(psi, &slopes, variables, "c"));
        }
        // E_v ψ = ψ + δ ψ_v + ½ δ² ψ_vv for every bounded variable, and its derivative ψ_v + δ ψ_vv with the factor 0 or 1
        // of the second order as 2 (½δ²)/δ: the variable of the second is δ itself, or 0.
        let continued = |of: &Formula, but: Option<usize>| {
            let mut sum = of.clone();
            for (k, _) in bounded.iter().filter(|(k, _)| Some(*k) != but) {
                let v = variables[*k];
                let first = sum.derivative(v)?;
                let second = first.derivative(v)?;
                sum = plus(&sum, &first, all + v)?;
                sum = plus(&sum, &second, 2 * all + v)?;
            }
            Ok(sum)
        };
        let mut outside = Vec::new();
        for (k, v) in variables.iter().enumerate() {
            let mut slope = slopes[k].clone();
            if bounded.iter().any(|(other, _)| *other == k) {
                // q stands for δ, or for 0 where ψ′ stays constant.
                let curvature = slope.derivative(*v)?;
                slope = plus(&slope, &curvature, 3 * all + v)?;
            }
            outside.push(continued(&slope, Some(k))?);
        }
        let psi_outside = continued(psi, None)?;
        let mut text = String::new();
        for k in 0..variables.len() {
            let limits = bounded.iter().find(|(other, _)| *other == k).map(|(_, bounds)| *bounds);
            match limits {
                Some(bounds) => text += &self.clamp(&format!("c{k}"), &k.to_string(), bounds),
                None => {
                    let _ = writeln!(text, "    let b{k} = c{k};");
                }
            }
        }
        let inside = self.program(psi, &slopes, variables, "b");
        let outside = self.program(&psi_outside, &outside, variables, "b");
        let _ =
            writeln!(text, "    if (!out.below && !out.above) {{\n{inside}    }} else {{\n{outside}    }}");
        Ok(text)
    }

    /// Moves `x` to its bounds: `b`, with δ = `e`, ½δ² = `h` and `q`, δ or 0.
    fn clamp(&mut self, x: &str, name: &str, bounds: Bounds) -> String {
        let [low, high] = [bounds.low, bounds.high].map(|x| self.number(x));
        let q = match bounds.below {
            Continuation::Linear => format!("e{name}"),
            Continuation::Constant => format!("max(e{name}, 0.0)"),
        };
        format!(
            "    let b{name} = clamp({x}, {low}, {high});\n    let e{name} = {x} - b{name};\n    let q{name} = {q};\n    let h{name} = \
             0.5 * q{name} * q{name};\n    out.below = out.below || e{name} < 0.0;\n    out.above = out.above || e{name} > 0.0;\n"
        )
    }

    fn curve(&mut self, curve: &Curve, variables: &[usize]) -> Result<String, Unsupported> {
        let count = self.count();
        let own = |k: usize| variables[k] / count == curve.density;
        let terms: Vec<String> = (0..variables.len()).filter(|k| own(*k)).map(|k| format!("c{k}")).collect();
        let bounds = self.fluid.densities[curve.density].bounds;
        let from = match &curve.form {
            CurveForm::Table(spline) => of_spline(spline, &mut self.tables),
            CurveForm::Pressure(_) => of_curve(curve, bounds, &mut self.tables)
                .ok_or_else(|| unsupported("this equation of state: it has no table of single precision"))?,
        };
        let mut text = format!("    let total = {};\n", terms.join(" + "));
        match bounds {
            Some(bounds) => text += &self.clamp("total", "", bounds),
            None => text += "    let b = total;\n    let e = 0.0;\n    let q = 0.0;\n    let h = 0.0;\n",
        }
        let _ = writeln!(
            text,
            "    let at = m_table({from}u, b);\n    out.psi = at.x + e * at.y + h * at.z;\n    let slope = at.y + q * at.z;"
        );
        for k in 0..variables.len() {
            let value = if own(k) { format!("slope * g{k}") } else { "0.0".into() };
            let _ = writeln!(text, "    out.slope[{k}] = {value};");
        }
        Ok(text)
    }
}
