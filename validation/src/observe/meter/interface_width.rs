use super::Meter;
use super::across::Across;
use crate::observe::frame::Frame;
use crate::observe::keys::{AXIS, BINS, Table};
use crate::observe::observation::{Kind, Observation};
use crate::observe::profile::{DensityProfile, interface};
use crate::observe::request::Options;
use crate::observe::series::{Measured, Series};
use psidpd_core::document::FileError;
use serde::{Deserialize, Serialize};

/// Densities of a slab and its vapour, and the width of the interfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InterfaceWidth {
    across: Across,
    series: Series,
}

impl Meter for InterfaceWidth {
    const TABLE: Table = Table {
        path: "interface_width",
        title: "width of the interfaces of a slab",
        array: false,
        forms: ("", &[]),
        about: "w = (ρ_L − ρ_V)/max|dρ/dz|, as Warren, Phys. Rev. E 68, 066702 (2003), eq. 19, defines it, from a fit of \
                (ρ_L + ρ_V)/2 − (ρ_L − ρ_V)/2 tanh((|z| − z₀)/d) to both flanks of the recentred density profile, \
                averaged over each bin: w = 2d. Differences of neighbouring bins would overrate the slope in \
                proportion to their noise. `width`, `liquid`, `vapour`, `thickness` (2 z₀). Jackknife errors. No \
                values if the profile is not that of one slab.",
        keys: &[AXIS, BINS],
    };

    fn read(options: &Options) -> Result<InterfaceWidth, FileError> {
        let across = Across::read(options, true)?;
        let series = Series::new(across.bins);
        Ok(InterfaceWidth { across, series })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let Some(fractions) = self.across.fractions(&frame.view) else { return false };
        let mut counts = vec![0.0; self.across.bins];
        fractions.iter().filter_map(|s| self.across.bin(*s)).for_each(|bin| counts[bin] += 1.0);
        self.series.push(&counts)
    }

    fn finish(&self) -> Vec<Observation> {
        let centres = self.across.middles();
        let volume = self.across.bin_volume();
        let fit = self.series.jackknife_many(|means| {
            let density = means.iter().map(|n| n / volume).collect();
            let fit = interface(&DensityProfile { centres: centres.clone(), density, error: Vec::new() })?;
            Some(vec![fit.width, fit.liquid, fit.vapour, 2.0 * fit.place])
        });
        let at = |k: usize| [fit.get(k).copied().unwrap_or(Measured::NONE)];
        vec![
            Observation::new("interface_width", "Interfaces of a slab", Kind::Scalar)
                .samples(self.series.samples())
                .column("width", "r_c", at(0))
                .column("liquid", "1/volume", at(1))
                .column("vapour", "1/volume", at(2))
                .column("thickness", "r_c", at(3))
                .note(if fit.is_empty() { "The profile is not that of a slab." } else { "" }),
        ]
    }
}
