use super::across::Across;
use super::*;
use crate::profile::{interface, interface_from, slab_edges};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InterfaceWidth {
    across: Across,
    series: Series,
}

impl Meter for InterfaceWidth {
    const TABLE: Table = Table {
        path: "interface_width",
        title: "width of the interfaces of a slab",
        about: "w = (ρ_L − ρ_V)/max|dρ/dz|, as Warren, Phys. Rev. E 68, 066702 (2003), eq. 19, defines it, from a fit of \
                (ρ_L + ρ_V)/2 − (ρ_L − ρ_V)/2 tanh((|z| − z₀)/d) to both flanks of the recentred density profile, \
                averaged over each bin: w = 2d. Differences of neighbouring bins would overrate the slope in \
                proportion to their noise. `width`, `thickness` (2 z₀). `liquid` and `vapour` are not those of the fit, \
                which averages over the layers near the surface: they are means of the profile over its plateaus, \
                farther from each interface than four times `width_10_90`. Where less than a fifth such distance is \
                left, a note says by how much its layers may change a density; errors are those of chance alone. Where the interface is not a tanh \
                the fit misleads, so the profile's own widths are given too: `width_10_90`, between the places where \
                10 and 90 % of the way between the plateaus are made (1.10 w of a tanh), and `width_slope`, w with the \
                slope of a straight line through three tenths of the interface. If nothing can be fitted `width` has no \
                value. Jackknife errors. No values if the profile is not that of one slab.",
        keys: &[AXIS, BINS],
        ..PLAIN
    };

    const OF_LIQUIDS: bool = true;

    fn read(options: &Options) -> Result<InterfaceWidth, FileError> {
        let across = Across::read(options, true)?;
        let series = Series::new(across.bins);
        Ok(InterfaceWidth { across, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let Some(fractions) = self.across.fractions(frame) else { return false };
        let mut counts = vec![0.0; self.across.bins];
        fractions.iter().filter_map(|s| self.across.bin(*s)).for_each(|bin| counts[bin] += 1.0);
        self.series.push(&counts)
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let centres = self.across.middles();
        let volume = self.across.bin_volume();
        let profile = |means: &[f64]| -> Vec<(f64, f64)> {
            centres.iter().zip(means).map(|(z, n)| (*z, n / volume)).collect()
        };
        let whole = interface(&profile(&self.series.means()));
        let fit = self.series.jackknife(|means| {
            let profile = profile(means);
            let found = slab_edges(&profile)?;
            let fit = interface_from(&profile, whole);
            let (width, place) = fit.map_or((f64::NAN, found.place), |fit| (fit.width, fit.place));
            Some(vec![width, found.liquid, found.vapour, 2.0 * place, found.ten_ninety, found.steepest])
        });
        let doubt = match fit.is_empty() {
            true => [0.0; 2],
            false => slab_edges(&profile(&self.series.means())).map_or([0.0; 2], |found| found.doubt),
        };
        let narrow: Vec<String> = ["liquid", "vapour"]
            .into_iter()
            .zip(doubt)
            .filter(|(_, doubt)| *doubt > 0.0)
            .map(|(name, doubt)| format!("that of the {name} by {doubt:.4}"))
            .collect();
        let note = match (fit.is_empty(), narrow.is_empty()) {
            (true, _) => "The profile is not that of a slab.".into(),
            (_, true) => String::new(),
            _ => format!(
                "Plateaus are narrow: layers of the surface may change a density, {}, which is not in its error.",
                narrow.join(" and ")
            ),
        };
        let at = |k: usize| [fit.get(k).copied().unwrap_or(Measured::NONE)];
        vec![
            Observation::new("interface_width", "Interfaces of a slab", Kind::Scalar, &self.series)
                .column("width", "length", at(0))
                .column("liquid", "1/volume", at(1))
                .column("vapour", "1/volume", at(2))
                .column("thickness", "length", at(3))
                .column("width_10_90", "length", at(4))
                .column("width_slope", "length", at(5))
                .note(note),
        ]
    }
}
