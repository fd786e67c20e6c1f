//! From the unit square to where samples are wanted: each warp `x` with its density `x_pdf` and its inverse `x_inverse`.
//!
//! Directions about an axis are [`LocalDir`](math::LocalDir)s, directions of the whole sphere are [`Dir`](math::Dir)s. An
//! inverse takes a point of the target to the `u` that gives it.

mod disk;
mod hemisphere;
mod lanes;
mod line;
mod octahedral;
mod spherical;
mod triangle;

pub use disk::{concentric_disk, concentric_disk_inverse, concentric_disk_pdf};
pub use hemisphere::{
    cosine_hemisphere, cosine_hemisphere_inverse, cosine_hemisphere_pdf, uniform_cone, uniform_cone_inverse,
    uniform_cone_pdf, uniform_hemisphere, uniform_hemisphere_inverse, uniform_hemisphere_pdf, uniform_sphere,
    uniform_sphere_inverse, uniform_sphere_pdf,
};
pub use lanes::{
    SphericalRectangleLanes, concentric_disk_lanes, cosine_hemisphere_lanes, uniform_triangle_lanes,
};
pub use line::{
    Equiangular, bilinear, bilinear_inverse, bilinear_pdf, exponential, exponential_inverse, exponential_pdf,
    linear, linear_inverse, linear_pdf, power_law, power_law_inverse, power_law_pdf, tent, tent_inverse,
    tent_pdf, truncated_exponential, truncated_exponential_inverse, truncated_exponential_pdf,
};
pub use octahedral::{equal_area_sphere, equal_area_sphere_inverse, equal_area_sphere_pdf, wrap_equal_area};
pub use spherical::{DirectionOnShape, Rectangle, SphericalRectangle, SphericalTriangle};
pub use triangle::{uniform_triangle, uniform_triangle_inverse, uniform_triangle_pdf};
