//! Shapes in world space.

use crate::coincidence::slack;
use crate::implicit::{DiskPlace, Implicit};
use crate::scene::Shape;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// A shape in world space. An `offset` is n·p of the plane that a face lies in. Faces that coincide have the same offset to the last
/// bit, or the opposite one.
#[expect(missing_docs, reason = "each variant's text names its fields")]
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// Two-sided flat disk.
    Disk {
        center: DVec3,
        normal: DVec3,
        offset: f64,
        radius: f64,
    },
    /// Solid with two caps. `axis` has unit length. The caps lie in the planes axis·p = offsets\[0\], which holds `base`, and
    /// axis·p = offsets\[1\], which is offsets\[0\] + length.
    Cylinder {
        base: DVec3,
        axis: DVec3,
        offsets: [f64; 2],
        radius: f64,
    },
    /// Infinite plane n·p = offset. The normal of an opaque plane points to the eye's side.
    Plane { normal: DVec3, offset: f64 },
    /// Sphere of ordinary size.
    Sphere { center: DVec3, radius: f64 },
    /// Sphere far larger than the scene: `pole` is its point nearest the world's origin, `normal`
    /// the outward normal there, `radius` its radius.
    HugeSphere {
        pole: DVec3,
        normal: DVec3,
        radius: f64,
    },
    /// Where a formula has a certain value.
    Implicit(Arc<Implicit>),
}

/// Where a flat disk lies, relative to a solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DiskSide {
    /// Wholly inside.
    Inside,
    /// Wholly outside.
    Outside,
    /// The solid's surface may cut it.
    Cut,
}

impl Geometry {
    /// A scene's shape in a world whose origin is at `origin` of the scene.
    pub(super) fn new(shape: &Shape, origin: DVec3) -> Self {
        match *shape {
            Shape::Sphere { center, radius } => Self::Sphere {
                center: center - origin,
                radius,
            },
            Shape::Plane { point, normal } => Self::Plane {
                normal,
                offset: normal.dot(point - origin),
            },
            Shape::Disk {
                center,
                normal,
                radius,
            } => {
                let center = center - origin;
                Self::Disk {
                    center,
                    normal,
                    offset: normal.dot(center),
                    radius,
                }
            }
            Shape::Cylinder { base, top, radius } => {
                let axis = (top - base).normalize();
                let base = base - origin;
                let offset = axis.dot(base);
                Self::Cylinder {
                    base,
                    axis,
                    offsets: [offset, offset + top.distance(base + origin)],
                    radius,
                }
            }
            Shape::Implicit(ref implicit) => {
                let mut moved = Implicit::clone(implicit);
                moved.center -= origin;
                Self::Implicit(Arc::new(moved))
            }
        }
    }

    /// How many faces it has: a cylinder has its side and two caps, an implicit surface has what its formula makes and what its
    /// bounds cut off, anything else has one.
    pub fn parts(&self) -> usize {
        match self {
            Self::Cylinder { .. } => 3,
            Self::Implicit(_) => 2,
            _ => 1,
        }
    }

    /// Whether it is met from both sides, and bounds no solid.
    pub fn is_sheet(&self) -> bool {
        match self {
            Self::Disk { .. } => true,
            Self::Implicit(implicit) => !implicit.closed,
            _ => false,
        }
    }

    /// Whether `p` is strictly inside the solid, or behind the plane. A disk holds nothing.
    pub fn holds(&self, p: DVec3) -> bool {
        match *self {
            Self::Sphere { center, radius } => p.distance_squared(center) < radius * radius,
            Self::HugeSphere {
                pole,
                normal,
                radius,
            } => {
                let v = p - pole;
                v.length_squared() / radius + 2.0 * normal.dot(v) < 0.0
            }
            Self::Plane { normal, offset } => normal.dot(p) < offset,
            Self::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let h = axis.dot(p);
                let m = p - base;
                h > offsets[0] && h < offsets[1] && (m - axis * axis.dot(m)).length() < radius
            }
            Self::Implicit(ref implicit) => implicit.holds(p),
            Self::Disk { .. } => false,
        }
    }

    /// Where the disk around `center` lies. Surfaces that coincide do not cut each other: a disk flush on a cap or a plane is on
    /// the side that `normal` points to.
    pub(super) fn side_of_disk(&self, center: DVec3, normal: DVec3, size: f64) -> DiskSide {
        let sorted = |inside: bool, outside: bool| match (inside, outside) {
            (true, false) => DiskSide::Inside,
            (_, true) => DiskSide::Outside,
            (false, false) => DiskSide::Cut,
        };
        // Whether the whole disk lies below the plane n·p = offset, and whether it lies above.
        let against = |n: DVec3, offset: f64| {
            let (height, reach) = (n.dot(center) - offset, size * n.cross(normal).length());
            let slack = slack(size);
            let (below, above) = (height + reach <= slack, height - reach >= -slack);
            // A flush disk is both, and counts on the side that it faces.
            let outwards = n.dot(normal) > 0.0;
            let (flush_outside, flush_inside) =
                (below && above && outwards, below && above && !outwards);
            (below && !flush_outside, above && !flush_inside)
        };
        match *self {
            Self::Sphere { center: c, radius } => {
                let v = center - c;
                let along = v.dot(normal);
                let across = (v - normal * along).length();
                let slack = slack(radius);
                sorted(
                    along.hypot(across + size) <= radius + slack,
                    along.hypot((across - size).max(0.0)) >= radius - slack,
                )
            }
            Self::Plane { normal: n, offset } => {
                let (inside, outside) = against(n, offset);
                sorted(inside, outside)
            }
            Self::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let m = center - base;
                let out = (m - axis * axis.dot(m)).length();
                let slack = slack(radius);
                let (under_top, over_top) = against(axis, offsets[1]);
                let (over_base, under_base) = against(-axis, -offsets[0]);
                sorted(
                    under_top && over_base && out + size <= radius + slack,
                    over_top || under_base || out - size >= radius - slack,
                )
            }
            Self::Implicit(ref implicit) => match implicit.place_of_disk(center, normal, size) {
                DiskPlace::Inside => DiskSide::Inside,
                DiskPlace::Outside => DiskSide::Outside,
                DiskPlace::Cut => DiskSide::Cut,
            },
            Self::Disk { .. } | Self::HugeSphere { .. } => {
                sorted(self.holds(center), !self.holds(center))
            }
        }
    }

    /// A point well inside a solid, and its volume.
    pub(super) fn core(&self) -> (DVec3, f64) {
        match *self {
            Self::Sphere { center, radius } => (center, radius.powi(3) * 4.0 / 3.0 * PI),
            Self::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let length = offsets[1] - offsets[0];
                (base + axis * (length / 2.0), radius * radius * length * PI)
            }
            Self::Plane { normal, offset } => (normal * offset, f64::INFINITY),
            Self::Implicit(ref implicit) => implicit.core(),
            Self::HugeSphere { .. } | Self::Disk { .. } => (DVec3::ZERO, 0.0),
        }
    }
}
