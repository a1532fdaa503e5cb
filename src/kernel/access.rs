//! How a kernel reaches the scene's values.

use crate::engine::DeviceInfo;
use crate::world::World;

/// The most surfaces, lights included, that are baked; scenes with more have trees.
///
/// In paths per second the two are equal at about a hundred spheres. On lavapipe 22.3 with 512-bit vectors baked kernels and trees
/// traced 12 and 3.6 million at 8 spheres, 6.0 and 3.7 at 48, 3.5 and 3.5 at 96; 16 lights over 40 surfaces of every shape and
/// material ran 1.3 times as fast when baked. But unrolled code takes longer to compile: 1.0 s instead of 0.7 s at 48 spheres, and
/// twice that at 96. A picture of few samples does not earn that back.
pub const BAKED_LIMIT: usize = 56;

/// Where the surfaces and lights are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// One line of code for each surface, with its values in the text.
    Baked,
    /// Loops over storage buffers.
    Buffers,
    /// Bounding volume hierarchies in a storage texture.
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

    /// The same for a known device. SwiftShader's compiler takes minutes for the long straight code of a dozen baked surfaces, and
    /// a second for loops.
    pub fn choose_for(world: &World, device: &DeviceInfo) -> Self {
        match Self::choose(world) {
            Self::Baked if device.name.contains("SwiftShader") => Self::Buffers,
            access => access,
        }
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baked => "baked",
            Self::Buffers => "buffers",
            Self::Tree => "tree",
        }
    }
}
