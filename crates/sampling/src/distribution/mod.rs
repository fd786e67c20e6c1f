//! Distributions given by tables: piecewise constant on the unit interval and square, and weighted choices.
//!
//! Tables are built in double precision; what comes out is `f32`, and a sample always lies in the cell whose density it
//! reports. Zero cells are never sampled; a table of zeros counts as constant, so that nothing has to be asked first.

mod alias;
mod few;
mod piecewise;
mod windowed;

pub use alias::{AliasTable, Choice};
pub use few::{chances, choose};
pub use piecewise::{PiecewiseConstant1D, PiecewiseConstant2D, Sample1D, Sample2D};
pub use windowed::{WHOLE, Window, Windowed2D};
