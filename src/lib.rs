//! etendue: a GPU path tracer for analytic scenes that reports the error of every picture.
//!
//! A [`Scene`] is read from a file or [built in code](Scene::builder), and [`render`] makes a [`Picture`] of it, on a GPU or
//! on the CPU reference: radiance, its standard error, and samples of every pixel, and where it all comes from.
//!
//! ```no_run
//! use etendue::{Options, Scene};
//!
//! fn main() -> Result<(), etendue::Error> {
//!     let scene = Scene::read("scenes/three_materials.toml")?;
//!     let picture = etendue::render(&scene, &Options { error: Some(0.2), ..Options::default() })?;
//!     println!("{:?} samples a pixel", picture.provenance().samples);
//!     picture.save("picture.exr")
//! }
//! ```
//!
//! The way of the data:
//!
//! ```text
//! scenes/x.toml -> scene::parse -> Scene -> World -> kernel::compose and gpu
//!               -> dispatches -> Film (f64 on the host) -> pictures, report
//! ```
//!
//! The CPU reference takes the same world and gives the same [`Film`].
//!
//! Without an adapter it renders on the CPU reference, twenty times as slow; [`Picture::note`] then says why. The program `etendue` sets
//! environment variables for software drivers, which a library must not: on a processor with AVX-512, `LP_NATIVE_VECTOR_WIDTH=512`
//! (with a `MESA_SHADER_CACHE_DIR` of its own) takes a quarter off the time on llvmpipe, and changes no bit.
//!
//! # Features
//!
//! `cli`, on by default, holds the program `etendue` and all that only it needs: command line, progress bar, plots, signals.
//! A program that renders with the library alone does without: `default-features = false`.

mod coincidence;
pub mod compare;
mod date;
pub mod regress;
pub mod scene;

pub use engine::{Counters, DeviceInfo};
pub use files::FileError;
pub use files::npy::Numbers;
pub use film::coverage::Rect;
pub use film::error::{Doubt, RelativeError};
pub use film::{Estimate, Film};
pub use glam::{DMat3, DVec3};
pub use implicit::{Clip, Grid, Implicit, Volume, WrongFormula};
pub use provenance::{DeviceUse, Provenance};
pub use render::{
    Backend, CPU_TIME, DEFAULT_SPP, Error, MAX_SAMPLES, Options, Picture, Progress, Renderer,
    merge, render, render_with,
};
pub use run::StopReason;
pub use scene::{Scene, SceneBuilder};
pub use settings::{Integrator, LightParts, Settings};

// The parts behind that. They are public for this repository's own tests and benchmarks alone, and no promise: what a program
// can rely on stands above.
#[doc(hidden)]
pub mod engine;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod film;
#[doc(hidden)]
pub mod gpu;
#[doc(hidden)]
pub mod implicit;
#[doc(hidden)]
pub mod kernel;
#[doc(hidden)]
pub mod layers;
#[doc(hidden)]
pub mod output;
#[doc(hidden)]
pub mod provenance;
#[doc(hidden)]
pub mod reference;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod run;
#[doc(hidden)]
pub mod selftest;
#[doc(hidden)]
pub mod settings;
#[doc(hidden)]
pub mod stats;
#[doc(hidden)]
pub mod world;

// The program's own.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod bench;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod denoise;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod export;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod log;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod plot;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod watch;

/// The examples of its page are tests.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
struct LibraryPage;
