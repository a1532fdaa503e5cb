// The pinhole camera: jittered strata over the pixel's square, box filter.

// Where in the pixel's square sample s lies, in [0, 1)^2: strata x strata cells, visited in an order
// shuffled anew for every round of strata^2 samples.
fn film_position(pixel: u32, s: u32, seed: u32) -> vec2f {
    let jitter = pcg4d(vec4u(pixel, s, 0u, seed));
#if STRATA
    let round = s / (STRATA * STRATA);
    let order = jitter_order(pixel, round, seed);
    let cell = permute(s % (STRATA * STRATA), STRATA * STRATA, order);
    let corner = vec2f(f32(cell % STRATA), f32(cell / STRATA));
    return (corner + unit_float(jitter).xy) * (1.0 / f32(STRATA));
#else
    return unit_float(jitter).xy;
#endif
}

#if STRATA
// One word for every pixel and round.
fn jitter_order(pixel: u32, round: u32, seed: u32) -> u32 {
    return pcg4d(vec4u(pixel, round, 0xffffffffu, seed)).x;
}
#endif

fn camera_ray(pixel: vec2u, within: vec2f) -> Ray {
    // Whole pixels first: their difference is exact.
    let x = (f32(pixel.x) - CAMERA_CENTER.x) + within.x;
    let y = (f32(pixel.y) - CAMERA_CENTER.y) + within.y;
    let d = normalize(CAMERA_FORWARD + x * CAMERA_DX + y * CAMERA_DY);
    return Ray(CAMERA_EYE, d, NO_FACE, CAMERA_MEDIUM, NO_FACE);
}
