//! Devices of a program that was built without GPUs, and what does not depend on how it was built.

use super::*;
#[cfg(not(feature = "gpu"))]
use crate::checkpoint::Caller;
use crate::device::Device;

const SCENE: &str = "model = \"m.toml\"\nkT = 1.0\nbox = 4.0\ndensity = 6.05\nsteps = 2\n";

#[test]
fn the_key_is_read_and_a_wrong_name_has_its_line() {
    let read = |line: &str| support::scene(SET6, &format!("{SCENE}{line}"));
    assert_eq!(read("").unwrap().device, Device::Cpu);
    assert_eq!(read("device = \"gpu:2\"").unwrap().device, Device::Gpu(2));
    let error = read("device = \"cuda\"").unwrap_err().to_string();
    assert!(error.contains("s.toml:6:") && error.contains("cpu, gpu, gpu:N"), "{error}");
}

/// Nothing falls back to the CPU.
#[cfg(not(feature = "gpu"))]
#[test]
fn a_program_without_gpus_says_how_to_build_one_with_them() {
    let scene = support::scene(SET6, &format!("{SCENE}device = \"gpu\"")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let Err(RunError::File(error)) = Runner::begin(&scene, &out, Begin::New) else { panic!() };
    assert!(error.to_string().contains("s.toml:6:") && error.kind.to_string().contains("built without"));
    assert!(error.help.as_ref().unwrap().contains("--features gpu"), "{error}");
    assert!(!out.join("thermo.csv").exists() && Live::new(scene, std::num::NonZeroUsize::MIN).is_err());
    // As with the option, where no file has the key.
    let scene = Scene { device: Device::Gpu(0), ..support::scene(SET6, SCENE).unwrap() };
    let Err(error @ RunError::Device(_)) = Runner::begin(&scene, &out, Begin::New) else { panic!() };
    assert!(error.help(Caller::Options).unwrap().contains("--features gpu"));
}

#[test]
fn the_device_is_no_part_of_what_tells_runs_apart() {
    let scene = support::scene(SET6, SCENE).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    run_scene(&scene, &out, &mut |_| ()).unwrap();
    let other = support::scene(SET6, &format!("{SCENE}device = \"cpu\"")).unwrap();
    assert!(matches!(Runner::begin(&other, &out, Begin::Resume).unwrap().start(), Start::Finished));
}
