//! The GPU: adapters, buffers, and the engine that dispatches kernels.

mod adapters;
mod engine;
mod glances;
mod held;
mod instance;
mod light_paths;
pub mod pack;
pub mod probe;
#[cfg(test)]
mod same_hits;
mod scene;
mod tile;
mod volumes;
mod work;

pub use adapters::{AdapterReport, Choice, Gpu, adapters};
pub use engine::{GpuEngine, Making};

/// Why there is no GPU engine.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all, or none with the name asked for.
    #[error("{0}")]
    NoAdapter(String),
    /// The kernel is not valid WGSL, whatever the adapter.
    #[error(
        "the kernel made for this scene is invalid, which is a bug of etendue: please report it with the scene: {0}"
    )]
    Kernel(String),
    /// The adapter cannot do what this picture needs.
    #[error("{adapter}: {problem}")]
    Unable {
        /// Its name.
        adapter: String,
        /// What it cannot do, with the numbers.
        problem: String,
    },
}
