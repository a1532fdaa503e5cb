// Random numbers, keyed by (pixel, sample, dimension, seed) [Jarzynski2020]: the value of a sample depends
// on nothing else, so the work can be cut anywhere.

fn pcg4d(key: vec4u) -> vec4u {
    var v = key * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4u(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Uniform in [0, 1): 24 bits, for f32(0xffffffffu) would round to 1.
fn unit_float(v: vec4u) -> vec4f {
    return vec4f(v >> vec4u(8u)) * 0x1.0p-24;
}

// What one path vertex draws.
struct Draws {
    // Point on a light (2), direction of scattering (2).
    points: vec4f,
    // Which light, which lobe (or reflection against refraction), roulette; the last is spare.
    choices: vec4f,
}

fn draw(key: vec4u) -> Draws {
    let a = pcg4d(key);
    // One more round makes four more words for a third of the price.
    var b = a ^ (a >> vec4u(16u));
    b.x += b.y * b.w;
    b.y += b.z * b.x;
    b.z += b.x * b.y;
    b.w += b.y * b.z;
    return Draws(unit_float(a), unit_float(b));
}

// The same for the first vertex that scatters into more than one direction: light choice and point from the additive
// recurrence of the plastic ratio's kin [Roberts2018], the lobe of a glossy surface from the golden ratio's, direction
// from the first two dimensions of Sobol's sequence [Burley2020]. All run through the samples i of one replicate; a
// shift of its own, modulo 1 and digit by digit, makes every sample uniform and the replicates independent.
fn draw_spread(u: Draws, pixel: u32, replicate: u32, i: u32, seed: u32) -> Draws {
    let shift = hash_pixel(pixel, replicate, seed ^ 0x5bd1e995u);
    let more = (shift ^ (shift >> vec2u(16u))) * 0x9e3779b1u;
    let light = vec3u(shift.x ^ more.y, shift) + i * vec3u(0xd1b54a33u, 0xabc98389u, 0x8cb92ba7u);
    let x = reverseBits(i);
    var y = x ^ (x << 16u);
    y ^= (y & 0x00ff00ffu) << 8u;
    y ^= (y & 0x0f0f0f0fu) << 4u;
    y ^= (y & 0x33333333u) << 2u;
    y ^= (y & 0x55555555u) << 1u;
    let direction = vec2u(x, y) ^ more;
    let points = unit_float(vec4u(light.yz, direction));
#if PHONG
    let lobe = ((more.y ^ (more.y >> 15u)) * 0x2c1b3c6du) + i * 0x9e3779b9u;
    let choices = unit_float(vec4u(light.x, lobe, 0u, 0u));
    return Draws(points, vec4f(choices.xy, u.choices.zw));
#else
    let choice = unit_float(light.xxxx).x;
    return Draws(points, vec4f(choice, u.choices.yzw));
#endif
}

// Two words for the place in a pixel, which asks for less than light does: few multiplications, for every one of them is
// paid in every turn of the path loop.
fn hash_pixel(pixel: u32, s: u32, seed: u32) -> vec2u {
    var v = (pixel ^ (seed * 0x85ebca6bu)) * 0x9e3779b1u + s * 0xc2b2ae35u;
    v = (v ^ (v >> 15u)) * 0x2c1b3c6du;
    v = (v ^ (v >> 12u)) * 0x297a2d39u;
    v ^= v >> 15u;
    let w = (v ^ 0x68bc21ebu) * 0x846ca68bu;
    return vec2u(v, w ^ (w >> 16u));
}

#if STRATA

// Position i of a random permutation of `count` cells of a pixel.
fn shuffled_cell(i: u32, count: u32, order: u32) -> u32 {
#if STRATA_NOT_A_POWER_OF_TWO
    return permute(i, count, order);
#else
    return (i ^ (order >> 16u)) % count;
#endif
}
#endif

#if STRATA_NOT_A_POWER_OF_TWO
// Position i of a random permutation of `count` elements, keyed by p [Kensler2013].
fn permute(i: u32, count: u32, p: u32) -> u32 {
    var mask = count - 1u;
    mask |= mask >> 1u;
    mask |= mask >> 2u;
    mask |= mask >> 4u;
    mask |= mask >> 8u;
    mask |= mask >> 16u;
    var k = permute_step(i, mask, p);
    // Fewer than half of all values lie outside; each is sent on until it lies inside.
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
#endif
