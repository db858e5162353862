use crate::run::Observed;
use psidpd_core::model::Polynomial;
use psidpd_observe::Measured;

#[derive(Debug, Clone)]
pub struct Point {
    pub total: f64,
    /// For each (β at α), row-major: the number density of β.
    pub own: Vec<f64>,
    /// For each (β at α): ⟨n_β⟩ at the particles of α.
    pub means: Vec<Measured>,
    /// For one species: ⟨(n − ⟨n⟩)²⟩ and ⟨(n − ⟨n⟩)³⟩.
    pub spread: Option<[f64; 2]>,
    pub temperature: Measured,
    pub pressure: Measured,
}

impl Point {
    /// From a run of species `names` at number densities `rho`.
    pub fn of(observed: &Observed, names: &[String], rho: &[f64]) -> Point {
        let pairs = || (0..names.len()).flat_map(|a| (0..names.len()).map(move |b| (a, b)));
        let means = pairs()
            .map(|(a, b)| observed.scalar("local_density_means", &format!("mean_{}_{}", names[a], names[b])))
            .collect();
        Point {
            total: rho.iter().sum(),
            own: pairs().map(|(_, b)| rho[b]).collect(),
            means,
            spread: (names.len() == 1).then(|| spread(observed)),
            temperature: observed.temperature(),
            pressure: observed.pressure(),
        }
    }

    /// ⟨n^m⟩, for one species up to m = 3 with the spread of n; else ⟨n⟩^m.
    pub fn moment(&self, pair: usize, m: usize) -> f64 {
        let n = self.means[pair].value;
        let [second, third] = self.spread.unwrap_or([0.0; 2]);
        match m {
            2 => n * n + second,
            3 => n * n * n + 3.0 * n * second + third,
            _ => n.powi(m as i32),
        }
    }

    /// ⟨ρ̃(n)⟩.
    pub fn corrected(&self, pair: usize, polynomial: &Polynomial) -> Measured {
        let value = polynomial.0.iter().enumerate().map(|(m, c)| c * self.moment(pair, m)).sum();
        let n = self.means[pair];
        Measured { value, error: (polynomial.at(n.value).1 * n.error).abs() }
    }
}

/// Central moments of the distribution of the local density.
fn spread(observed: &Observed) -> [f64; 2] {
    let Some(curve) = observed.get("local_density") else { return [0.0; 2] };
    let (Some(x), Some(p)) = (&curve.x, curve.columns.first()) else { return [0.0; 2] };
    let weigh = |f: &dyn Fn(f64) -> f64| -> f64 {
        let terms = x.values.iter().zip(&p.values).filter(|(_, p)| p.is_finite());
        let (mut sum, mut norm) = (0.0, 0.0);
        for (n, p) in terms {
            sum += p * f(*n);
            norm += p;
        }
        if norm > 0.0 { sum / norm } else { 0.0 }
    };
    let mean = weigh(&|n| n);
    let width = x.values.get(1).map_or(0.0, |second| second - x.values[0]);
    // The bins themselves have a width (Sheppard's correction).
    let second = weigh(&|n| (n - mean).powi(2)) - width * width / 12.0;
    [second.max(0.0), weigh(&|n| (n - mean).powi(3))]
}
