// STRATA x STRATA cells of a pixel, visited in an order that is shuffled for every round of STRATA^2 samples. STRATA is a power of two.

// Position i of a random permutation of `count` cells: an XOR is enough, because `count` is a power of two.
fn shuffled_cell(i: u32, count: u32, order: u32) -> u32 {
    return (i ^ (order >> 16u)) % count;
}

// Moves `jitter`, uniform in [0, 1)^2, into the cell of sample s.
fn in_stratum(pixel: u32, s: u32, seed: u32, jitter: vec2f, own: bool) -> vec2f {
    let cell = shuffled_cell(s % ROUND_SAMPLES, ROUND_SAMPLES, hash_pixel(pixel, s / ROUND_SAMPLES, seed ^ ORDER_STREAM).x);
    let corner = vec2f(f32(cell % STRATA), f32(cell / STRATA));
    return (corner + jitter) * (1.0 / f32(STRATA));
}
