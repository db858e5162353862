//! Surface tension of a slab from the pressure tensor.

use super::error::ObserveError;

/// The surface tension at each sample, γ = (L_z/2) [P_zz − (P_xx + P_yy)/2], energy per area (k_B T / r_c²).
///
/// The slab lies normal to z in a periodic box and so has two interfaces, which share the excess: hence the half. `lz` is a
/// length (r_c), the pressures are energies per volume (k_B T / r_c³). NaN and infinite samples give NaN or infinite tensions.
///
/// # Errors
///
/// The function fails for components of different lengths, and for an `lz` that is not a positive number.
pub fn tension_series(lz: f64, pxx: &[f64], pyy: &[f64], pzz: &[f64]) -> Result<Vec<f64>, ObserveError> {
    if !(lz.is_finite() && lz > 0.0) {
        return Err(ObserveError::BoxLength(lz));
    }
    if pxx.len() != pyy.len() || pyy.len() != pzz.len() {
        return Err(ObserveError::Pressures { xx: pxx.len(), yy: pyy.len(), zz: pzz.len() });
    }
    Ok(pxx.iter().zip(pyy).zip(pzz).map(|((xx, yy), zz)| 0.5 * lz * (zz - 0.5 * (xx + yy))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_excess_goes_to_each_interface() {
        let gamma = tension_series(20.0, &[-1.0, 1.0], &[-3.0, 1.0], &[0.5, 1.0]);
        assert_eq!(gamma, Ok(vec![25.0, 0.0]));
        assert_eq!(tension_series(1.0, &[], &[], &[]), Ok(vec![]));
    }

    #[test]
    fn bad_records_are_refused() {
        assert_eq!(
            tension_series(1.0, &[0.0], &[], &[0.0]),
            Err(ObserveError::Pressures { xx: 1, yy: 0, zz: 1 })
        );
        assert_eq!(tension_series(0.0, &[], &[], &[]), Err(ObserveError::BoxLength(0.0)));
        assert!(tension_series(f64::NAN, &[], &[], &[]).is_err());
    }
}
