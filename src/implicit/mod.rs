//! Implicit surfaces: where a formula f(x, y, z) has a certain value.

pub mod arithmetic;
pub mod formula;
pub mod interval;
mod parse;
pub mod roots;
mod shape;

pub use arithmetic::Arithmetic;
pub use formula::{Formula, Node};
pub use parse::WrongFormula;
pub(crate) use shape::DiskPlace;
pub use shape::{Clip, Implicit};
