// STRATA x STRATA cells of a pixel, visited in an order that is shuffled for every round of STRATA^2 samples.

// Position i of a random permutation of `count` cells.
fn shuffled_cell(i: u32, count: u32, order: u32) -> u32 {
    return permute(i, count, order);
}

// Position i of a random permutation of `count` elements, keyed by p [Kensler2013].
fn permute(i: u32, count: u32, p: u32) -> u32 {
    var mask = count - 1u;
    mask |= mask >> 1u;
    mask |= mask >> 2u;
    mask |= mask >> 4u;
    mask |= mask >> 8u;
    mask |= mask >> 16u;
    var k = permute_step(i, mask, p);
    // Fewer than half of all values are outside the range. Each is permuted again until it is inside.
    while k >= count {
        k = permute_step(k, mask, p);
    }
    return (k + p) % count;
}

fn permute_step(i: u32, mask: u32, p: u32) -> u32 {
    var k = i;
    k ^= p;
    k *= 0xe170893du;
    k ^= p >> 16u;
    k ^= (k & mask) >> 4u;
    k ^= p >> 8u;
    k *= 0x0929eb3fu;
    k ^= p >> 23u;
    k ^= (k & mask) >> 1u;
    k *= 1u | (p >> 27u);
    k *= 0x6935fa69u;
    k ^= (k & mask) >> 11u;
    k *= 0x74dcb303u;
    k ^= (k & mask) >> 2u;
    k *= 0x9e501cc3u;
    k ^= (k & mask) >> 2u;
    k *= 0xc860a3dfu;
    k &= mask;
    k ^= k >> 5u;
    return k;
}

// Moves `jitter`, uniform in [0, 1)^2, into the cell of sample s.
fn in_stratum(pixel: u32, s: u32, seed: u32, jitter: vec2f, own: bool) -> vec2f {
    let cell = shuffled_cell(s % ROUND_SAMPLES, ROUND_SAMPLES, hash_pixel(pixel, s / ROUND_SAMPLES, seed ^ ORDER_STREAM).x);
    let corner = vec2f(f32(cell % STRATA), f32(cell / STRATA));
    return (corner + jitter) * (1.0 / f32(STRATA));
}
