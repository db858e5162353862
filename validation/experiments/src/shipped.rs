//! Shipped model files that more than one family of experiments runs.

/// Warren's lighter liquid.
pub const SET5: &str = include_str!("../../models/warren2003-set5.toml");
/// Warren's denser liquid.
pub const SET6: &str = include_str!("../../models/warren2003-set6.toml");
pub const STANDARD: &str = include_str!("../../models/standard-dpd.toml");
/// The van der Waals fluid in two dimensions.
pub const VAN_DER_WAALS: &str = include_str!("../../models/van-der-waals-2d.toml");
/// A mixture with an energy of mixing.
pub const HUGGINS: &str = include_str!("../../models/huggins.toml");
/// The fluid of Groot and Warren with a linear kernel.
pub const LINEAR: &str = include_str!("../../models/groot-warren-linear.toml");
/// A pair potential of two splines that attracts.
pub const SPLINE: &str = include_str!("../../models/spline-attractive.toml");
