//! How a kernel reaches the scene's values.

use crate::engine::DeviceInfo;
use crate::world::World;

/// Scenes with more surfaces, lights included, have trees. By paths a second the two are even at about a hundred spheres (on
/// lavapipe 22.3, of 512-bit vectors: 12 million at 8 spheres against 3.6, 6.0 at 48 against 3.7, 3.5 at 96 against 3.5), and 16
/// lights over 40 things of every shape and material run 1.3 times as fast when baked; but unrolled code costs its compiler 0.7
/// s at 48 spheres, 1.0 s instead of 0.7 s there, and twice that at 96, which a picture of few samples does not earn back.
pub const BAKED_LIMIT: usize = 56;

/// Where the surfaces and lights are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// One line of code a surface, its values in the text.
    Baked,
    /// Loops over storage buffers.
    Buffers,
    /// Bounding volume hierarchies in storage buffers.
    Tree,
}

impl Access {
    /// By the number of surfaces alone: the same scene always gets the same kernel.
    pub fn choose(world: &World) -> Self {
        if world.lights.len() + world.primitives.len() <= BAKED_LIMIT {
            Self::Baked
        } else {
            Self::Tree
        }
    }

    /// The same on a known device. SwiftShader's compiler takes minutes over the long straight code of a dozen baked
    /// surfaces, and a second over the loops.
    pub fn choose_for(world: &World, device: &DeviceInfo) -> Self {
        match Self::choose(world) {
            Self::Baked if device.name.contains("SwiftShader") => Self::Buffers,
            access => access,
        }
    }

    /// The word for it in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baked => "baked",
            Self::Buffers => "buffers",
            Self::Tree => "tree",
        }
    }
}
