use super::*;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    names: Vec<String>,
    /// Kinetic energy per particle, then each named contribution per particle.
    series: Series,
}

impl Meter for Energy {
    const TABLE: Table = Table {
        path: "energy",
        title: "energy by terms",
        about: "Per particle of the whole system: `total`, `kinetic`, `potential`, `psi_SPECIES` for Σ ψ over the \
                particles of a species, and `phi_K_A_B` for Σ φ of the K-th `[[pair]]` of the model, between A \
                and B.",
        ..PLAIN
    };

    fn read(options: &Options) -> Result<Energy, FileError> {
        let fluid = options.place.fluid;
        let mut names: Vec<String> = fluid.species.iter().map(|s| format!("psi_{s}")).collect();
        for (k, term) in fluid.pairs.iter().enumerate() {
            let [a, b] = term.between.map(|s| &fluid.species[s]);
            names.push(format!("phi_{}_{a}_{b}", k + 1));
        }
        let series = Series::new(1 + names.len());
        Ok(Energy { names, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let count = frame.view.x.len() as f64;
        let evaluation = frame.evaluation();
        let pair_energies = evaluation.pair_energies(&frame.evaluator.fluid);
        let terms = evaluation.excess.iter().chain(&pair_energies);
        let all: Vec<f64> =
            std::iter::once(&frame.view.kinetic_energy).chain(terms).map(|e| e / count).collect();
        self.series.push(&all)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let mut out = Observation::new("energy", "Energy per particle", Kind::Scalar, &self.series)
            .column("total", "energy", [self.series.linear(|s| s.iter().sum())])
            .column("kinetic", "energy", [self.series.mean(0)])
            .column("potential", "energy", [self.series.linear(|s| s[1..].iter().sum())]);
        for (k, name) in self.names.iter().enumerate() {
            out = out.column(name, "energy", [self.series.mean(1 + k)]);
        }
        vec![out]
    }
}
