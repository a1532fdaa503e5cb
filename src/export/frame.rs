//! Axes for flat things.

use glam::{DMat3, DVec3};

/// Axes of a disk or rectangle: right-handed, with unit `z` as given.
pub(super) fn around(z: DVec3) -> DMat3 {
    let (x, y) = z.any_orthonormal_pair();
    DMat3::from_cols(x, y, z)
}

/// The same with `x` as close to `along` as it can be.
pub(super) fn along(z: DVec3, along: DVec3) -> DMat3 {
    let x = (along - z * along.dot(z)).try_normalize();
    x.map_or_else(|| around(z), |x| DMat3::from_cols(x, z.cross(x), z))
}
