//! Observables, which read a simulation and never change it.
//!
//! [`read`] reads the requests of a scene. [`Observers`] measures them during the run; each observable is a
//! [`meter`]. The results are [`Observation`]s with error bars. All other functions work on recorded series and
//! frames. All quantities are in the reduced units of the simulation (length r_c, energy k_B T, mass m).
//! No function panics on any input.

pub mod configurational;
pub mod drift;
pub mod edges;
mod error;
pub mod flux;
pub mod frame;
pub mod keys;
pub mod least_squares;
pub mod meter;
pub mod observation;
pub mod observers;
pub mod options;
pub mod order;
pub mod piece;
pub mod profile;
pub mod request;
pub mod series;
pub mod statistics;
pub mod young_laplace;

pub use drift::{Drift, drift};
pub use error::ObserveError;
pub use flux::Recorded;
pub use meter::Pairs;
pub use observation::{Abscissa, Column, Kind, Observation};
pub use observers::Observers;
pub use options::{Centre, Drive, Place, Slab};
pub use profile::{ProfileAccumulator, interface_width};
pub use request::{Observe, Request, read};
pub use series::{Measured, Series};
pub use statistics::{Comparison, Estimate, difference, estimate, threshold};

#[cfg(test)]
mod tests {
    use super::keys::{COMMON, Key};
    use super::request;
    use std::path::Path;

    /// The reference in the documentation is current; `PSIDPD_UPDATE_DOCS=1` writes it anew.
    #[test]
    fn the_reference_is_current() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/observables.md");
        let text = reference();
        if std::env::var_os("PSIDPD_UPDATE_DOCS").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        assert!(
            std::fs::read_to_string(&path).is_ok_and(|t| t == text),
            "PSIDPD_UPDATE_DOCS=1 cargo test renews it"
        );
    }

    /// The reference of `[observe]` as Markdown.
    fn reference() -> String {
        let mut out = String::from(include_str!("introduction.md"));
        out.push_str("\n## Keys of every observable\n\n");
        list(&mut out, COMMON);
        for table in request::tables() {
            out.push_str(&format!("\n## `{}`: {}\n\n{}\n", table.path, table.title, table.about));
            if !table.keys.is_empty() {
                out.push('\n');
                list(&mut out, table.keys);
            }
        }
        out
    }

    fn list(out: &mut String, keys: &[Key]) {
        out.push_str("| key | value | if left out | meaning |\n|---|---|---|---|\n");
        for key in keys {
            // A vertical bar would end the cell.
            let [value, default, about] =
                [&key.value.describe(), key.default(), key.about].map(|text| text.replace('|', "\\|"));
            out.push_str(&format!("| `{}` | {value} | {default} | {about} |\n", key.name));
        }
    }
}
