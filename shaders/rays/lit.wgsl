// A shadow ray that is traced at once.

// Whether it reaches its light.
fn is_lit(shadow: Ray, distance: f32, light: u32) -> bool {
    return !occluded(shadow, distance, light);
}
