//! What traces paths: a world, the settings, and a way to find lights.

use super::Estimator;
use crate::settings::Settings;
use crate::world::World;

/// Traces paths through a scene in f64.
#[derive(Debug, Clone)]
pub struct Tracer {
    pub(super) world: World,
    pub(super) settings: Settings,
    pub(super) estimator: Estimator,
}

impl Tracer {
    /// A tracer for `world`.
    pub fn new(world: World, settings: Settings, estimator: Estimator) -> Self {
        Self {
            world,
            settings,
            estimator,
        }
    }

    /// The scene.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What decides about the picture besides the scene.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}
