//! Axis-aligned boxes around the things of a world.

use super::Geometry;
use glam::DVec3;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box of the points within `reach` of `center`, axis by axis.
    pub fn about(center: DVec3, reach: DVec3) -> Self {
        Self {
            min: center - reach,
            max: center + reach,
        }
    }

    /// The box around a disk.
    pub fn disk(center: DVec3, normal: DVec3, radius: f64) -> Self {
        let across = (DVec3::ONE - normal * normal).max(DVec3::ZERO);
        Self::about(
            center,
            radius * DVec3::from_array(across.to_array().map(f64::sqrt)),
        )
    }

    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

impl Geometry {
    /// The box around it; `None` for a plane, which has none, and for a huge sphere, whose box would hold everything.
    pub fn bounds(&self) -> Option<Bounds> {
        match *self {
            Self::Plane { .. } | Self::HugeSphere { .. } => None,
            Self::Implicit(ref implicit) => {
                let (center, radius) = implicit.ball();
                Some(Bounds::about(center, DVec3::splat(radius)))
            }
            Self::Sphere { center, radius } => Some(Bounds::about(center, DVec3::splat(radius))),
            Self::Disk {
                center,
                normal,
                radius,
                ..
            } => Some(Bounds::disk(center, normal, radius)),
            Self::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let top = base + axis * (offsets[1] - offsets[0]);
                Some(Bounds::disk(base, axis, radius).union(Bounds::disk(top, axis, radius)))
            }
        }
    }
}
