//! Scenes with round walls, and those that are refused.

use super::*;

/// Round walls that a scene cannot have are refused, with advice, and what is read is what is asked for.
#[test]
fn round_walls_are_read_and_refused() {
    let scene = |lengths: &str, rest: &str| {
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nsteps = 3\n[box]\nlengths = {lengths}\n{rest}\n"
        );
        support::scene(SET6, &text)
    };
    let wall = |keys: &str| format!("[[wall]]\nkind = \"continuum\"\ndensity = 6.0\n{keys}\n");
    let tube = "shape = \"cylinder\"\nradius = 2.0\nfluid = \"inside\"";
    let ball = "shape = \"sphere\"\nradius = 1.0\nfluid = \"outside\"";
    let fluid = "[[part]]\nshape = \"rest\"\ndensity = 3.0\n";
    let read = scene(
        "[6.0, 7.0, 8.0]",
        &format!(
            "{fluid}{}",
            wall("shape = \"cylinder\"\naxis = \"y\"\nradius = 2.0\nfluid = \"inside\"\ncenter = [3.1, 4.2]")
        ),
    )
    .unwrap();
    let round = read.model.walls()[0].surface.round().copied().unwrap();
    assert_eq!((round.across, round.center, round.inside), ([true, false, true], [3.1, 3.5, 4.2], true));
    assert_eq!(read.initial_state().len(), (3.0 * std::f64::consts::PI * 4.0 * 7.0).round() as usize);
    // The density of a scene fills the side of the fluid.
    let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nsteps = 3\nbox = 8.0\ndensity = 3.0\n";
    let two = format!(
        "{text}{}{}",
        wall(&format!("{ball}\ncenter = [2.0, 2.0, 2.0]")),
        wall(&format!("{ball}\ncenter = [5.0, 5.0, 5.0]"))
    );
    let two = support::scene(SET6, &two).unwrap();
    let free = 512.0 - 2.0 * 4.0 / 3.0 * std::f64::consts::PI;
    assert_eq!(two.initial_state().len(), (3.0 * free).round() as usize);
    assert!(
        two.initial_state().x.iter().all(|x| [2.0, 5.0].iter().all(|c| x
            .iter()
            .map(|x| (x - c) * (x - c))
            .sum::<f64>()
            >= 1.0))
    );
    for (lengths, rest, message) in [
        (
            "8.0",
            format!("{fluid}{}", wall(&format!("{tube}\nfaces = [\"zlo\"]"))),
            "give faces of the box, or a shape",
        ),
        ("8.0", format!("{fluid}{}", wall("radius = 2.0")), "belongs to a round wall"),
        ("8.0", format!("{fluid}{}", wall("")), "faces"),
        ("8.0", format!("{fluid}{}", wall("shape = \"cylinder\"\nfluid = \"inside\"")), "radius"),
        ("8.0", format!("{fluid}{}", wall("shape = \"cylinder\"\nradius = 2.0")), "fluid"),
        (
            "8.0",
            format!("{fluid}{}", wall("shape = \"cone\"\nradius = 2.0\nfluid = \"inside\"")),
            "unknown shape",
        ),
        (
            "8.0",
            format!("{fluid}{}", wall("shape = \"sphere\"\nradius = 2.0\nfluid = \"inside\"\naxis = \"z\"")),
            "a sphere has no axis",
        ),
        (
            "8.0",
            format!("{fluid}{}", wall("shape = \"sphere\"\nradius = 0.9\nfluid = \"outside\"")),
            "smaller than the range",
        ),
        ("4.9", format!("{fluid}{}", wall(tube)), "5.0 along x, or more"),
        ("3.9", format!("{fluid}{}", wall(ball)), "4.0 along x, or more"),
        (
            "8.0",
            format!("{fluid}{}", wall(&format!("{tube}\ncenter = [1.9, 4.0]"))),
            "does not lie in the box along x",
        ),
        (
            "8.0\nboundary = \"reflecting\"",
            format!("{fluid}{}", wall(&format!("{ball}\ncenter = [4.0, 4.0, 1.9]"))),
            "1 from the reflecting faces",
        ),
        (
            "8.0",
            format!("{fluid}{}", wall(&format!("{tube}\nvelocity = [0.1, 0.0, 0.0]"))),
            "moves along its axis only",
        ),
        (
            "8.0",
            format!("{fluid}{}", wall(&format!("{ball}\nvelocity = [0.0, 0.0, 0.1]"))),
            "moves along its axis only",
        ),
        (
            "8.0",
            format!(
                "{fluid}{}{}",
                wall(&format!("{ball}\ncenter = [2.0, 2.0, 2.0]")),
                wall(&format!("{ball}\ncenter = [4.5, 2.0, 2.0]"))
            ),
            "0.5000 apart",
        ),
        (
            "8.0",
            format!(
                "{fluid}{}{}",
                wall(&format!("{ball}\ncenter = [1.0, 2.0, 2.0]")),
                wall(&format!("{ball}\ncenter = [6.8, 2.0, 2.0]"))
            ),
            "0.2000 apart",
        ),
        ("8.0", format!("{fluid}{}{}", wall(tube), wall(ball)), "no other round one beside it"),
        (
            "8.0\nboundary = [\"reflecting\", \"periodic\", \"periodic\"]",
            format!("{fluid}{}{}", wall(tube), wall("faces = [\"xlo\"]")),
            "no other across it",
        ),
        ("8.0", format!("[[part]]\nshape = \"box\"\ndensity = 3.0\n{}", wall(tube)), "starts in the matter"),
    ] {
        let error = scene(lengths, &rest).unwrap_err().to_string();
        assert!(error.contains(message), "{rest}: {error}");
    }
    // A tube may have ends.
    let ends = format!("{fluid}{}{}", wall(tube), wall("faces = [\"zlo\", \"zhi\"]"));
    assert!(scene("8.0\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]", &ends).is_ok());
}

/// The time step of a scene is judged by a piece of its fluid that is far from all walls.
#[test]
fn pieces_of_the_fluid_have_no_round_walls() {
    use crate::trial::{Composition, Piece};
    let scene = beside(CAPILLARY, STAGE);
    let of = Composition {
        model: &scene.model,
        masses: &scene.mass,
        kt: 1.0,
        densities: &scene.densities(),
        seed: 1,
    };
    assert!((of.densities[0] - 6.05).abs() < 0.02, "{:?}", of.densities);
    assert!(Piece::settled(&of).unwrap().is_ok());
}

/// Starts in the matter are errors.
#[test]
fn a_start_in_the_matter_is_an_error() {
    let scene = beside(BALL, STAGE);
    let mut state = scene.initial_state();
    state.x[5] = [1.4, 2.9, 2.6];
    let error = scene.simulation(state).unwrap_err().to_string();
    assert!(error.contains("particle 6 starts in the matter of a wall"), "{error}");
}
