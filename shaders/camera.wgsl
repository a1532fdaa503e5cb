// The pinhole camera: jittered strata over the pixel's square, box filter.

// Where in the pixel's square sample s lies, in [0, 1)^2: strata x strata cells, visited in an order shuffled anew for
// every round of strata^2 samples. Glance k > 0 of the sample stays in its k-th share of that cell, of `across` x `across`:
// two or four.
fn film_position(pixel: u32, s: u32, seed: u32, k: u32, across: u32) -> vec2f {
    var jitter = vec2f(hash_pixel(pixel, s + (k << 24u), seed) >> vec2u(8u)) * 0x1.0p-24;
#if SEEN_LIGHTS
    let share = vec2f(f32((k - 1u) & (across - 1u)), f32((k - 1u) >> (across >> 1u)));
    jitter = select(jitter, (share + jitter) * (1.0 / f32(across)), k > 0u);
#endif
#if STRATA
    let cell = shuffled_cell(s % ROUND_SAMPLES, ROUND_SAMPLES, hash_pixel(pixel, s / ROUND_SAMPLES, ~seed).x);
    let corner = vec2f(f32(cell % STRATA), f32(cell / STRATA));
    return (corner + jitter) * (1.0 / f32(STRATA));
#else
    return jitter;
#endif
}

fn camera_ray(pixel: vec2u, within: vec2f) -> Ray {
    // Whole pixels first: their difference is exact.
    let x = (f32(pixel.x) - CAMERA_CENTER.x) + within.x;
    let y = (f32(pixel.y) - CAMERA_CENTER.y) + within.y;
    let d = normalize(CAMERA_FORWARD + x * CAMERA_DX + y * CAMERA_DY);
    return Ray(CAMERA_EYE, d, NO_FACE, CAMERA_MEDIUM, NO_FACE);
}
