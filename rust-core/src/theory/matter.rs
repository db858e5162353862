//! What theory says of the matter of a wall, where it is not given.

use super::MeanField;
use crate::document::FileError;
use crate::model::wall::{Surface, Wall};
use crate::model::{Fluid, Model};

/// The mean local densities of a particle in matter of this number density, with correlations to first order, for each density of the
/// model. `None` where there is no such theory: it is for one species.
pub fn local_densities_of_matter(fluid: &Fluid, density: f64) -> Option<Vec<f64>> {
    let found = MeanField::new(fluid).ok()?.correlations().ok()??.at(density)?;
    let own = fluid.densities.iter().map(|d| if d.includes_self { d.kernel.value(0.0) } else { 0.0 });
    Some(found.mean_density.iter().zip(own).map(|(n, own)| n + own).collect())
}

/// The drag coefficient at which a fluid of this viscosity, number density and mean mass does not slip at a wall, whose range of drag
/// is that of `wall` or of the model. `None` if the drag has no range, or the fluid no density. A round wall gets the drag of a plane one.
///
/// # Errors
/// Fails if the fluid can have no such wall.
pub fn drag_without_slip(
    model: &Model,
    wall: &Wall,
    kt: f64,
    viscosity: f64,
    [density, mass]: [f64; 2],
) -> Result<Option<f64>, FileError> {
    let plane = Surface::Face { axis: 0, high: false };
    let of_one = Wall { surface: plane, drag: [Some(1.0), wall.drag[1]], ..wall.clone() };
    let fluid = model.clone().with_walls(vec![of_one]).at(kt)?;
    let friction = fluid.walls.iter().flat_map(|wall| &wall.fields).find_map(|field| field.friction.as_ref());
    let friction = friction.filter(|_| density > 0.0);
    Ok(friction.map(|friction| friction.factor_without_slip(viscosity, density, [kt, mass])))
}
