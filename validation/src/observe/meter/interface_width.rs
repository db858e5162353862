use super::Meter;
use super::across::Across;
use crate::observe::frame::Frame;
use crate::observe::keys::{AXIS, BINS, Table};
use crate::observe::observation::{Kind, Observation};
use crate::observe::profile::{DensityProfile, interface, slab_edges};
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
                proportion to their noise. `width`, `liquid`, `vapour`, `thickness` (2 z₀). Where the interface is no such \
                curve the fit misleads, so the profile's own widths are given too: `width_10_90`, between the places where \
                10 and 90 % of the way between the plateaus are made (1.10 w of a tanh), and `width_slope`, w with the \
                slope of a straight line through three tenths of the interface. If nothing can be fitted `width` has no \
                value, and densities are those of the plateaus. Jackknife errors. No values if the profile is not that of \
                one slab.",
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

    fn forget(&mut self) {
        self.series.clear();
    }

    fn finish(&self) -> Vec<Observation> {
        let centres = self.across.middles();
        let volume = self.across.bin_volume();
        let fit = self.series.jackknife_many(|means| {
            let density = means.iter().map(|n| n / volume).collect();
            let profile = DensityProfile { centres: centres.clone(), density, error: Vec::new() };
            let found = slab_edges(&profile)?;
            let widths = [found.ten_ninety, found.steepest];
            Some(match interface(&profile) {
                Some(fit) => vec![fit.width, fit.liquid, fit.vapour, 2.0 * fit.place, widths[0], widths[1]],
                None => vec![f64::NAN, found.liquid, found.vapour, 2.0 * found.place, widths[0], widths[1]],
            })
        });
        let at = |k: usize| [fit.get(k).copied().unwrap_or(Measured::NONE)];
        vec![
            Observation::new("interface_width", "Interfaces of a slab", Kind::Scalar)
                .samples(self.series.samples())
                .column("width", "length", at(0))
                .column("liquid", "1/volume", at(1))
                .column("vapour", "1/volume", at(2))
                .column("thickness", "length", at(3))
                .column("width_10_90", "length", at(4))
                .column("width_slope", "length", at(5))
                .note(if fit.is_empty() { "The profile is not that of a slab." } else { "" }),
        ]
    }
}
