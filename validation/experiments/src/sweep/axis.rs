use psidpd_dynamics::scene::Edit;
use std::str::FromStr;

/// A key and the values that it takes in turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub key: String,
    pub edits: Vec<Edit>,
    pub text: String,
}

/// `KEY=LOW:HIGH:N` for N evenly spaced values, `KEY=A,B,C` for a list.
impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Axis, String> {
        let expected = || "expected KEY=LOW:HIGH:N, as kT=0.5:1.5:11, or a list, as kT=0.5,1,2".to_owned();
        let (key, values) = text.split_once('=').ok_or_else(expected)?;
        let ends: Vec<&str> = values.split(':').map(str::trim).collect();
        let values: Vec<String> = match ends[..] {
            [_] => values.split(',').map(|v| v.trim().to_owned()).collect(),
            [low, high, n] => {
                let number = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite());
                let (low, high) = number(low).zip(number(high)).ok_or_else(expected)?;
                let n = n.parse::<usize>().ok().filter(|n| (2..=10_000).contains(n)).ok_or_else(expected)?;
                spaced(low, high, n)
            }
            _ => return Err(expected()),
        };
        let edits = values.iter().map(|v| format!("{key}={v}").parse()).collect::<Result<_, String>>()?;
        Ok(Axis { key: key.trim().to_owned(), edits, text: text.to_owned() })
    }
}

/// Evenly spaced numbers with few digits.
fn spaced(low: f64, high: f64, n: usize) -> Vec<String> {
    let step = (high - low) / (n - 1) as f64;
    // Twelve digits, without the noise of the last bits.
    let short = |x: f64| format!("{x:.11e}").parse::<f64>().unwrap_or(x).to_string();
    (0..n).map(|k| short(low + step * k as f64)).collect()
}

impl Axis {
    pub fn is_numeric(&self) -> bool {
        self.edits.iter().all(|e| e.number().is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_lists() {
        let values = |text: &str| -> Vec<String> {
            text.parse::<Axis>().unwrap().edits.iter().map(|e| e.value().to_owned()).collect()
        };
        assert_eq!(values("kT=0.5:1.5:11")[..4], ["0.5", "0.6", "0.7", "0.8"]);
        assert_eq!(values("kT=0.5:1.5:11").len(), 11);
        assert_eq!(values("density = 3, 4"), ["3", "4"]);
        assert_eq!(values("integrator=aboba"), ["aboba"]);
        for bad in ["kT", "kT=1:2", "kT=1:2:1", "kT=a:2:3", "kT=1:2:3:4", "kT=1,,2"] {
            assert!(bad.parse::<Axis>().is_err(), "{bad}");
        }
    }
}
