//! Random models, for tests of several packages.

use std::fmt::Write;

/// Random numbers from a seed; the test does not shrink a model, as a shorter text would be another model.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A short decimal number, so that a failing model can be read.
    pub fn number(&mut self, low: f64, high: f64) -> f64 {
        (self.within(low, high) * 100.0).round() / 100.0
    }

    fn pick<'a>(&mut self, from: &'a [String]) -> &'a str {
        &from[self.below(from.len())]
    }
}

/// A smooth function of the variables with moderate values and slopes.
fn expression(random: &mut Random, variables: &[String], depth: usize) -> String {
    if depth == 0 {
        return format!("{}*{}", random.number(0.1, 0.5), random.pick(variables));
    }
    let a = expression(random, variables, depth - 1);
    let b = expression(random, variables, depth / 2);
    match random.below(9) {
        0 => format!("({a} + {b})"),
        1 => format!("({a} - {b})"),
        2 => format!("0.5*({a})*({b})"),
        3 => format!("tanh({a})"),
        4 => format!("sin({a} + {b})"),
        5 => format!("exp(-0.1*({a})^2)"),
        6 => format!("ln(1 + ({a})^2)"),
        7 => format!("sqrt(1 + ({a})^2)"),
        _ => format!("({a})/(1 + ({b})^2)"),
    }
}

const KERNELS: [&str; 6] = ["linear", "quadratic", "bell", "lucy", "cubic-spline", "wendland-c2"];
const NAMES: [&str; 3] = ["A", "B", "C"];

pub fn model_text(random: &mut Random) -> String {
    let dimensions = 2 + random.below(2);
    let species = &NAMES[..1 + random.below(3)];
    let densities = &["n", "m"][..1 + random.below(2)];
    let quoted: Vec<String> = species.iter().map(|s| format!("\"{s}\"")).collect();
    let mut text =
        format!("title = \"random\"\ndimensions = {dimensions}\nspecies = [{}]\n", quoted.join(", "));
    // Writing to a String cannot fail.
    let mut bounded = 0;
    for name in densities {
        let kernel = KERNELS[random.below(KERNELS.len())];
        let _ =
            writeln!(text, "[density.{name}]\nkernel = \"{kernel}\"\nrange = {}", random.number(0.7, 1.1));
        let _ = writeln!(text, "self = {}", random.below(2) == 1);
        let polynomial =
            |r: &mut Random| format!("[{}, {}, 0.0{}]", r.number(-0.1, 0.5), r.number(0.8, 1.2), r.below(3));
        match random.below(3) {
            0 => {}
            1 => {
                let _ = writeln!(text, "correction = {}", polynomial(random));
            }
            _ => {
                let (a, b) = (species[0], species[species.len() - 1]);
                let (one, two) = (polynomial(random), polynomial(random));
                let other = if a == b { String::new() } else { format!(", \"{b}|{a}\" = {two}") };
                let _ = writeln!(text, "correction = {{ \"{a}|{b}\" = {one}{other} }}");
            }
        }
        // Every bounded variable triples the number of terms of the reference, whose derivatives are symbolic.
        if bounded + species.len() <= 4 && random.below(3) > 0 {
            bounded += species.len();
            let typical = 4.0 / species.len() as f64;
            let (low, high) = (random.number(0.3, 0.9) * typical, random.number(1.0, 1.5) * typical);
            let below = ["linear", "constant"][random.below(2)];
            let _ = writeln!(text, "bounds = [{low:.3}, {high:.3}]\nbelow = \"{below}\"");
        }
    }
    let _ = writeln!(text, "[excess_free_energy]");
    let variables: Vec<String> = densities
        .iter()
        .flat_map(|d| std::iter::once((*d).to_owned()).chain(species.iter().map(move |s| format!("{d}_{s}"))))
        .collect();
    for name in species {
        let density = densities[random.below(densities.len())];
        let psi = match random.below(6) {
            0 if species.len() == 1 => format!(
                "{{ pressure = \"rho*kT/(1 - 0.0{}*rho) - {}*rho^2\", density = \"{density}\" }}",
                1 + random.below(3),
                random.number(0.1, 2.0)
            ),
            1 => format!("{{ table = \"psi.csv\", density = \"{density}\" }}"),
            _ => {
                let depth = 1 + random.below(3);
                let (first, second) =
                    (expression(random, &variables, depth), expression(random, &variables, 1));
                format!("\"{}*({first}) + {second}\"", random.number(1.0, 5.0))
            }
        };
        let _ = writeln!(text, "{name} = {psi}");
    }
    for a in 0..species.len() {
        for b in a..species.len() {
            let _ = writeln!(text, "[[pair]]\nbetween = [\"{}\", \"{}\"]", species[a], species[b]);
            let _ = match random.below(4) {
                0 => writeln!(
                    text,
                    "form = \"spline\"\nstrength = 9.5\nA = 2\nB = 1\nrange_A = 0.8\nrange_B = 1.0"
                ),
                1 => writeln!(text, "form = \"expression\"\nphi = \"4*(1 - r^2)^3\"\nrange = 1"),
                2 => writeln!(text, "form = \"table\"\nfile = \"phi.txt\""),
                _ => {
                    writeln!(text, "form = \"soft\"\nstrength = {}\nrange = 0.9", random.number(-20.0, 40.0))
                }
            };
        }
    }
    text
}
