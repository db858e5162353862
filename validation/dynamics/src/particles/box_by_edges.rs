//! Serialises a box as its origin, edges and periodic directions. All other fields follow from these by the
//! same operations, hence with the same bits.

use nalgebra::Matrix3;
use psidpd_core::engine::PeriodicBox;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

#[derive(Serialize, Deserialize)]
struct Edges {
    origin: [f64; 3],
    edges: [[f64; 3]; 3],
    periodic: [bool; 3],
}

pub fn serialize<S: Serializer>(domain: &PeriodicBox, to: S) -> Result<S::Ok, S::Error> {
    let edges = std::array::from_fn(|k| domain.edge(k));
    Edges { origin: domain.origin(), edges, periodic: domain.periodic() }.serialize(to)
}

pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<PeriodicBox, D::Error> {
    let Edges { origin, edges, periodic } = Edges::deserialize(from)?;
    PeriodicBox::new(origin, Matrix3::from_columns(&edges.map(Into::into)), periodic)
        .map_err(D::Error::custom)
}
