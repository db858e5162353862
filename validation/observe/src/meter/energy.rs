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

    const NEEDS: Want = Want { energy: true, ..Want::FORCES };

    const PAIRS: Pairs = Pairs::List;

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
        let (view, fluid) = (frame.view, &frame.evaluator.fluid);
        let excess = if fluid.species.len() > 1 { frame.excess() } else { &view.potential[..1] };
        // One potential has the total of the step.
        let pairs = match fluid.pairs.len() {
            terms @ 0..=1 => view.potential[1..1 + terms].to_vec(),
            _ => frame.evaluation().pair_energies(view.pool, fluid),
        };
        let count = view.x.len() as f64;
        let all = std::iter::once(view.kinetic_energy)
            .chain(excess.iter().copied())
            .chain(pairs)
            .map(|energy| energy / count);
        self.series.push(&all.collect::<Vec<f64>>())
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
