//! f64 values as WGSL text that reads back as the nearest f32.

use glam::DVec3;

/// The nearest f32, written so that it reads back exactly. The value must be within f32's range.
pub(super) fn float(x: f64) -> String {
    let f = x as f32;
    debug_assert!(f.is_finite(), "{x} does not fit a kernel");
    // -0.0 only makes constants look different.
    format!("{:?}", if f == 0.0 { 0.0 } else { f })
}

/// A `vec3f`.
pub(super) fn vector(v: DVec3) -> String {
    format!("vec3f({}, {}, {})", float(v.x), float(v.y), float(v.z))
}
