//! Files: how they are written whole, held by one process at a time, what kind they are, and what can go wrong with them.

pub mod atomic;
mod error;
pub mod kind;
pub mod lock;
pub(crate) mod nifti;
pub mod npy;
mod resolve;
pub mod room;

pub(crate) use error::reason;
pub use error::{FileError, open};
pub use resolve::resolve;
