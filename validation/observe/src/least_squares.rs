//! Least squares with the method of Levenberg and Marquardt.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector, Dyn, VecStorage};

/// [`least_squares_with`] slopes that are differences over `steps`.
pub fn least_squares(
    start: &[f64],
    steps: &[f64],
    residuals: impl Fn(&[f64]) -> Option<Vec<f64>>,
) -> Option<(Vec<f64>, f64)> {
    least_squares_with(start, &residuals, |at| slopes(at, steps, &residuals))
}

/// Finds the parameters with the least sum of squared residuals, and that sum. The search begins at `start`; `slopes` has a row for
/// each residual and a column for each parameter. The search avoids parameters without residuals. The result is
/// `None` if `start` has no residuals and if the search fails.
pub fn least_squares_with(
    start: &[f64],
    residuals: impl Fn(&[f64]) -> Option<Vec<f64>>,
    slopes: impl Fn(&[f64]) -> Option<DMatrix<f64>>,
) -> Option<(Vec<f64>, f64)> {
    let count = residuals(start)?.len();
    let problem = Problem { at: DVector::from_column_slice(start), count, residuals, slopes };
    let search = LevenbergMarquardt::new().with_ftol(1e-14).with_xtol(1e-10).with_gtol(1e-14);
    let (found, report) = search.minimize(problem);
    // Where residuals have kinks, the search may reach the least sum without noticing it. Such a result is accepted too.
    let found_it = report.termination.was_successful()
        || matches!(
            report.termination,
            TerminationReason::NoImprovementPossible(_) | TerminationReason::LostPatience
        );
    found_it.then(|| (found.at.as_slice().to_vec(), 2.0 * report.objective_function))
}

/// The slopes of the residuals by central differences over `steps`: a row for each residual.
pub fn slopes(
    at: &[f64],
    steps: &[f64],
    residuals: impl Fn(&[f64]) -> Option<Vec<f64>>,
) -> Option<DMatrix<f64>> {
    let beside = |k: usize, h: f64| {
        let mut at = at.to_vec();
        at[k] += h;
        residuals(&at).map(DVector::from_vec)
    };
    let column = |(k, h): (usize, &f64)| Some((beside(k, *h)? - beside(k, -h)?) / (2.0 * h));
    let columns: Vec<DVector<f64>> = steps.iter().enumerate().map(column).collect::<Option<_>>()?;
    Some(DMatrix::from_columns(&columns))
}

struct Problem<R, S> {
    at: DVector<f64>,
    count: usize,
    residuals: R,
    slopes: S,
}

impl<R, S> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<R, S>
where
    R: Fn(&[f64]) -> Option<Vec<f64>>,
    S: Fn(&[f64]) -> Option<DMatrix<f64>>,
{
    type ResidualStorage = VecStorage<f64, Dyn, nalgebra::U1>;
    type JacobianStorage = VecStorage<f64, Dyn, Dyn>;
    type ParameterStorage = VecStorage<f64, Dyn, nalgebra::U1>;

    fn set_params(&mut self, at: &DVector<f64>) {
        self.at.copy_from(at);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        // Large residuals make the search try a shorter step.
        let found = (self.residuals)(self.at.as_slice()).unwrap_or_else(|| vec![1e100; self.count]);
        Some(DVector::from_vec(found))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        (self.slopes)(self.at.as_slice())
    }
}
