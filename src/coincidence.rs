//! When two surfaces count as one. Every decision whether surfaces coincide, share a plane or touch is made here.
//!
//! Three parts of the program ask: [`World`](crate::world::World) gives flat faces that coincide one equation,
//! [`Canonical`](crate::scene::Canonical) keeps the order of the file among surfaces that coincide, and the lints of
//! [`scene::check`](crate::scene::check) warn of surfaces that should not. Scenes and worlds both depend on this module, so it
//! knows neither: it takes points, unit normals and radii.

use glam::DVec3;

/// Surfaces closer than this, relative to their size, coincide. Angles between normals are held to the same number.
pub(crate) const COINCIDENT: f64 = 1e-6;

/// A wider tolerance that finds all surfaces that may coincide: two surfaces may do so by way of a third.
pub(crate) const MAY_COINCIDE: f64 = 4.0 * COINCIDENT;

/// The distance below which something of this size coincides with something else.
pub(crate) fn slack(size: f64) -> f64 {
    COINCIDENT * size
}

/// Whether a point at this distance from a surface of this size is on the surface.
pub(crate) fn touches(distance: f64, size: f64) -> bool {
    distance.abs() <= slack(size)
}

/// Whether planes with these unit normals are parallel. The normals may point to opposite sides.
pub(crate) fn parallel(a: DVec3, b: DVec3, within: f64) -> bool {
    a.cross(b).length() <= within
}

/// Whether a face lies in a plane, given the normals of both, the `height` of the face's centre over the plane, and the
/// [`face_size`].
pub(crate) fn in_plane(normals: [DVec3; 2], height: f64, size: f64, within: f64) -> bool {
    parallel(normals[0], normals[1], within) && height.abs() <= within * size
}

/// The size of the smaller of two flat faces. An infinite plane has no size of its own, so two planes are compared at their
/// points nearest the origin: `offsets` are the distances of both planes from it.
pub(crate) fn face_size(radius: f64, offsets: [f64; 2]) -> f64 {
    if radius.is_finite() {
        radius
    } else {
        offsets[0].abs().max(offsets[1].abs())
    }
}

/// A flat face: a disk, a light, the cap of a cylinder, or a whole plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flat {
    /// The centre; any point of a plane.
    pub center: DVec3,
    /// Unit normal. That of a cap points out of the cylinder.
    pub normal: DVec3,
    /// Infinite for planes.
    pub radius: f64,
}

impl Flat {
    /// Whether both faces lie in one plane and overlap there.
    pub fn coincides(&self, other: &Self, within: f64) -> bool {
        let (small, large) = if self.radius <= other.radius {
            (self, other)
        } else {
            (other, self)
        };
        let between = small.center - large.center;
        let height = large.normal.dot(between);
        let offsets = [small, large].map(|f| f.normal.dot(f.center));
        let size = face_size(small.radius, offsets);
        let aside = (between - large.normal * height).length();
        let overlap =
            large.radius.is_infinite() || aside < self.radius + other.radius - within * size;
        overlap && in_plane([small.normal, large.normal], height, size, within)
    }

    /// Whether two disks are one, but for the side that their normals point to.
    pub fn same_disk(&self, other: &Self) -> bool {
        let near = slack(self.radius);
        (self.radius - other.radius).abs() <= near && self.center.distance(other.center) <= near
    }
}

/// Whether two spheres coincide. The tolerance is relative to the first.
pub(crate) fn spheres(centers: [DVec3; 2], radii: [f64; 2], within: f64) -> bool {
    centers[0].distance(centers[1]) + (radii[0] - radii[1]).abs() <= within * radii[0]
}

/// The curved side of a cylinder.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tube {
    /// One end of the axis.
    pub base: DVec3,
    /// The other end.
    pub top: DVec3,
    /// Radius.
    pub radius: f64,
}

impl Tube {
    /// Whether some of both sides coincides: they have one axis and one radius, and overlap along the axis. The tolerance is
    /// relative to the radius of `self`.
    pub fn coincides(&self, other: &Self, within: f64) -> bool {
        let near = within * self.radius;
        let length = self.length();
        let axis = (self.top - self.base) / length;
        let along = |p: DVec3| axis.dot(p - self.base);
        let beside = |p: DVec3| (p - self.base - axis * along(p)).length();
        let ends = [along(other.base), along(other.top)];
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        (self.radius - other.radius).abs() <= near
            && beside(other.base) <= near
            && beside(other.top) <= near
            && low < length - near
            && high > near
    }

    /// Whether both are as long as each other.
    pub fn same_length(&self, other: &Self) -> bool {
        (self.length() - other.length()).abs() <= slack(self.length())
    }

    fn length(&self) -> f64 {
        self.base.distance(self.top)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disk(center: DVec3, normal: DVec3, radius: f64) -> Flat {
        Flat {
            center,
            normal,
            radius,
        }
    }

    #[test]
    fn faces_coincide_within_a_millionth_of_the_smaller() {
        let floor = disk(DVec3::ZERO, DVec3::Y, f64::INFINITY);
        for (height, expected) in [(0.9e-6, true), (1.1e-6, false), (-0.9e-6, true)] {
            let plate = disk(DVec3::new(7.0, 0.5 * height, 0.0), DVec3::NEG_Y, 0.5);
            assert_eq!(floor.coincides(&plate, COINCIDENT), expected, "{height}");
            assert_eq!(plate.coincides(&floor, COINCIDENT), expected, "{height}");
        }
        let tilted = disk(DVec3::ZERO, DVec3::new(2e-6, 1.0, 0.0).normalize(), 0.5);
        assert!(!floor.coincides(&tilted, COINCIDENT));
        assert!(floor.coincides(&tilted, MAY_COINCIDE));
    }

    #[test]
    fn disks_of_one_plane_coincide_where_they_overlap() {
        let at = |x: f64| disk(DVec3::X * x, DVec3::Y, 1.0);
        assert!(at(0.0).coincides(&at(1.999), COINCIDENT));
        assert!(!at(0.0).coincides(&at(2.0), COINCIDENT), "rim to rim");
        assert!(at(0.0).same_disk(&at(0.5e-6)) && !at(0.0).same_disk(&at(0.1)));
    }

    #[test]
    fn planes_are_compared_by_their_distance_from_the_origin() {
        let plane = |y: f64| disk(DVec3::Y * y, DVec3::Y, f64::INFINITY);
        assert!(plane(100.0).coincides(&plane(100.000_09), COINCIDENT));
        assert!(!plane(0.0).coincides(&plane(1e-9), COINCIDENT));
    }

    #[test]
    fn sides_coincide_along_the_length_that_they_share() {
        let tube = |low: f64, high: f64| Tube {
            base: DVec3::Y * low,
            top: DVec3::Y * high,
            radius: 0.5,
        };
        assert!(tube(0.0, 2.0).coincides(&tube(3.0, 1.0), COINCIDENT));
        assert!(!tube(0.0, 2.0).coincides(&tube(2.0, 3.0), COINCIDENT));
        assert!(tube(0.0, 2.0).same_length(&tube(5.0, 3.0)));
        assert!(spheres([DVec3::ZERO; 2], [1.0, 1.0 + 0.9e-6], COINCIDENT));
        assert!(!spheres([DVec3::ZERO; 2], [1.0, 1.0 + 1.1e-6], COINCIDENT));
    }
}
