//! Implicit surfaces: where a function of x, y and z has a certain value. The function is a formula, or runs between the numbers of a volume.

pub mod arithmetic;
pub mod formula;
pub mod grid;
pub mod hierarchy;
pub mod interval;
mod parse;
mod plateaus;
pub mod roots;
mod shape;
pub mod volume;

pub use arithmetic::Arithmetic;
pub use formula::{Formula, Node};
pub use grid::Grid;
pub use parse::WrongFormula;
pub(crate) use plateaus::Plateaus;
pub(crate) use shape::DiskPlace;
pub use shape::{Clip, Implicit};
pub use volume::{AxisOrder, Volume};
