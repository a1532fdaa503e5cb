//! The surfaces of shapes and lights, as [`coincidence`] compares them.

use super::{Light, Shape};
use crate::coincidence::{self, Flat, MAY_COINCIDE, Tube};

impl Light {
    /// Its face.
    pub(super) fn flat(&self) -> Flat {
        Flat {
            center: self.center,
            normal: self.normal,
            radius: self.radius,
        }
    }
}

impl Shape {
    /// Its flat faces: none for spheres, both caps of a cylinder.
    pub(super) fn flats(&self) -> Vec<Flat> {
        let flat = |center, normal, radius| Flat {
            center,
            normal,
            radius,
        };
        match *self {
            Self::Sphere { .. } | Self::Implicit(_) => Vec::new(),
            Self::Plane { point, normal } => vec![flat(point, normal, f64::INFINITY)],
            Self::Disk {
                center,
                normal,
                radius,
            } => vec![flat(center, normal, radius)],
            Self::Cylinder { base, top, radius } => {
                let axis = (top - base).normalize();
                vec![flat(base, -axis, radius), flat(top, axis, radius)]
            }
        }
    }

    /// The side of a cylinder.
    pub(super) fn tube(&self) -> Option<Tube> {
        match *self {
            Self::Cylinder { base, top, radius } => Some(Tube { base, top, radius }),
            _ => None,
        }
    }

    /// Whether both are spheres, or both are cylinders, and their curved surfaces coincide.
    pub(super) fn curved_coincides(&self, other: &Self, within: f64) -> bool {
        if let (
            &Self::Sphere { center, radius },
            &Self::Sphere {
                center: other_center,
                radius: other_radius,
            },
        ) = (self, other)
        {
            return coincidence::spheres([center, other_center], [radius, other_radius], within);
        }
        let tubes = self.tube().zip(other.tube());
        tubes.is_some_and(|(a, b)| a.coincides(&b, within))
    }

    /// Whether two shapes of one kind may coincide anywhere, by a generous measure. Their order in the file then decides which of
    /// them a ray meets.
    pub(super) fn may_coincide(&self, other: &Self) -> bool {
        if let Self::Implicit(_) = self {
            return self == other;
        }
        let (flats, others) = (self.flats(), other.flats());
        self.curved_coincides(other, MAY_COINCIDE)
            || flats
                .iter()
                .any(|f| others.iter().any(|g| f.coincides(g, MAY_COINCIDE)))
    }
}
