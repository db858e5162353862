use super::*;
use crate::configurational;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Temperature {
    /// The reason why the fluid has no configurational temperature; empty if it has one.
    missing: String,
    /// Kinetic kT, `Σ F·F`, `−Σ ∇·F`.
    series: Series,
}

impl Meter for Temperature {
    const TABLE: Table = Table {
        path: "temperature",
        title: "temperature, kinetic and configurational",
        about: "`kinetic` is 2K/f, f being d(N − 1) in a periodic box and without walls or frozen particles \
                (`output.md`). `configurational` is ⟨Σ F·F⟩/⟨−Σ ∇·F⟩ with the conservative forces alone \
                (Rugh; Butler et al., J. Chem. Phys. 109, 6519 (1998)), with ∇·F from the second derivatives of ψ, \
                kernels and pair potentials; φ″ of formulas and tables is the five-point difference of the exact φ′. \
                Within the range of the forces from a reflecting face or a round wall a particle counts with w, its distance from the face in \
                ranges, ⟨Σ w F·F⟩/⟨−Σ ∇·(w F)⟩: where space ends the plain ratio is too high. \
                At large time steps the two temperatures err differently. There is no configurational temperature for a force that is not a gradient, for one that jumps at its range (the linear kernel), and in boxes narrower \
                than twice the range.",
        ..PLAIN
    };

    const PAIRS: Pairs = Pairs::SumsAndForces;

    fn read(options: &Options) -> Result<Temperature, FileError> {
        let missing = configurational::missing(options.place.fluid, options.place.domain).unwrap_or("");
        let width = if missing.is_empty() { 3 } else { 1 };
        Ok(Temperature { missing: missing.into(), series: Series::new(width) })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let kinetic = frame.view.temperature;
        if !self.missing.is_empty() {
            return self.series.push(&[kinetic]);
        }
        let [squares, laplacian] = configurational::sums(frame);
        self.series.push(&[kinetic, squares, laplacian])
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let mut out = Observation::new("temperature", "Temperature kT", Kind::Scalar, &self.series);
        out = out.column("kinetic", "energy", [self.series.mean(0)]);
        if self.missing.is_empty() {
            out = out.column("configurational", "energy", [self.series.ratio(|s| s[1], |s| s[2])]);
        } else {
            out = out.note(format!("No configurational temperature: {}.", self.missing));
        }
        vec![out]
    }
}
