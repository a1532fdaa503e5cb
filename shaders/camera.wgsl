// The pinhole camera, with a box filter.

// Where in the pixel's square sample s lies, in [0, 1)^2: in its stratum. Glance k > 0 of the sample stays in its share of that
// stratum, number k - 1 of `across` x `across`: two or four.
fn film_position(pixel: u32, s: u32, seed: u32, k: u32, across: u32) -> vec2f {
    let jitter = vec2f(hash_pixel(pixel, s + (k << GLANCE_SHIFT), seed) >> vec2u(8u)) * 0x1.0p-24;
    let share = vec2f(f32((k - 1u) & (across - 1u)), f32((k - 1u) >> (across >> 1u)));
    return in_stratum(pixel, s, seed, select(jitter, (share + jitter) * (1.0 / f32(across)), k > 0u), k == 0u);
}

fn camera_ray(pixel: vec2u, within: vec2f) -> Ray {
    // Whole pixels first: their difference is exact.
    let x = (f32(pixel.x) - CAMERA_CENTER.x) + within.x;
    let y = (f32(pixel.y) - CAMERA_CENTER.y) + within.y;
    let d = normalize(CAMERA_FORWARD + x * CAMERA_DX + y * CAMERA_DY);
    return Ray(CAMERA_EYE, d, NO_FACE, CAMERA_MEDIUM, NO_FACE);
}
