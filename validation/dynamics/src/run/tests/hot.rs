//! Runs that are stopped as too hot, and that are not.

use super::*;
use crate::run::tests::resume::finished;
use crate::run::{Begin, Runner};

/// A start at kT = 5 is as hot as it must be; at a step far too long the run stops, and says since when it was hot.
#[test]
fn hot_is_what_is_hotter_than_its_stage() {
    let folder = tempfile::tempdir().unwrap();
    let text = |kt: f64, dt: f64| {
        format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = {kt:?}\nseed = 1\nbox = 4.0\ndensity = 6.05\ndt = {dt:?}\nsteps = 4000\n\
             [output]\nthermo = 0\ncheckpoint = 0\n"
        )
    };
    let warm = support::scene(IDEAL, &text(5.0, 0.02)).unwrap();
    let last = finished(&warm, &folder.path().join("warm"), Begin::New).last;
    assert!((last.temperature / 5.0 - 1.0).abs() < 0.4, "{last:?}");
    let scene = support::scene(SET6, &text(1.0, 0.04)).unwrap();
    let mut runner = Runner::begin(&scene, &folder.path().join("hot"), Begin::New).unwrap();
    let error = runner.run_to_end(&mut |_| ()).unwrap_err();
    let RunError::Stopped { cause, .. } = &error else { panic!("{error}") };
    let RunError::TooHot { step, since, ratio, .. } = **cause else { panic!("{error}") };
    // Ten relaxation times of the drag are some tens of steps at least.
    assert!(since + 30 <= step && ratio > 2.0, "{error}");
}
