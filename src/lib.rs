//! etendue: a GPU path tracer for analytic scenes that reports the error of every picture.
//!
//! ```text
//! scenes/x.toml -> scene::parse -> Scene -> World -> kernel::compose and gpu
//!               -> dispatches -> Film (f64 on the host) -> pictures, report
//! ```
//!
//! The CPU [`reference`] takes the same [`world::World`] and gives the same [`film::Film`].

pub mod bench;
pub mod cli;
mod coincidence;
pub mod compare;
pub mod engine;
pub mod film;
pub mod gpu;
pub mod kernel;
pub mod output;
pub mod provenance;
pub mod reference;
pub mod regress;
pub mod run;
pub mod scene;
pub mod selftest;
pub mod settings;
pub mod stats;
pub mod world;
