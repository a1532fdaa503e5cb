// Random numbers, keyed by (pixel, sample, dimension, seed) [Jarzynski2020]: the value of a sample depends
// on nothing else, so the work can be cut anywhere.

// Streams: what is mixed into a key so that two uses of one pixel and sample share no random numbers. They are declared here alone;
// src/kernel/streams.rs reads them, for the host and for the test that no two of them meet.

// Times its number, into the seed of a glance.
const GLANCE_STREAM: u32 = 0x9e3779b9u;
// Into the seed of the coin that gives glances their halves at glass.
const COIN_STREAM: u32 = 0x7f4a7c15u;
// Into the seed of a replicate's shifts of its low-discrepancy numbers.
const SHIFT_STREAM: u32 = 0x5bd1e995u;
// Into the seed of what scrambles places in the pixel together with points on lights.
const TOGETHER_STREAM: u32 = 0x1b873593u;
// Into the seed of the order in which a pixel's strata are visited.
const ORDER_STREAM: u32 = 0xffffffffu;
// Into the seed of the host's pilots, whose samples are in no picture.
const PILOT_STREAM: u32 = 0xb5297a4du;
// Into the seed of light paths, which have their number and pass where others have pixel and sample.
const LIGHT_STREAM: u32 = 0x510e527fu;
// Shadow ray k has its number in the depth of its key, from this bit on.
const SHADOW_RAY_SHIFT: u32 = 20u;
// Glance k has its number in the sample of the key of its place in the pixel, from this bit on.
const GLANCE_SHIFT: u32 = 24u;

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

// What a vertex draws: all of it uniform in [0, 1).
struct Draws {
    // Point on a light, and direction of scattering.
    light_point: vec2f,
    direction: vec2f,
    // Which light; which lobe, or reflection against refraction; roulette; and one to spare.
    light: f32,
    lobe: f32,
    roulette: f32,
    spare: f32,
}

// What one light sample takes of it.
struct LightDraws {
    which: vec2f,
    point: vec2f,
    lobe: f32,
}

fn draw(key: vec4u) -> Draws {
    let a = pcg4d(key);
    // One more round makes four more words for a third of the price.
    var b = a ^ (a >> vec4u(16u));
    b.x += b.y * b.w;
    b.y += b.z * b.x;
    b.z += b.x * b.y;
    b.w += b.y * b.z;
    let points = unit_float(a);
    let choices = unit_float(b);
    return Draws(points.xy, points.zw, choices.x, choices.y, choices.z, choices.w);
}

// What the vertex with key (pixel, sample, depth, seed) draws. The first vertex that scatters into more than one direction gets
// low-discrepancy numbers for its light, its direction, and if it is glossy its lobe: of several specular vertices in a row each
// chooses between reflection and refraction on its own.
fn draw_vertex(key: vec4u, first: bool, glossy: bool) -> Draws {
    let u = draw(key);
    let round = key.y / ROUND_SAMPLES;
    let i = round / REPLICATES * ROUND_SAMPLES + key.y % ROUND_SAMPLES;
    let spread = draw_spread(key.x, round % REPLICATES, i, key.w);
    return Draws(
        select(u.light_point, first_light_point(key.x, key.y, key.w, spread.light_point), first),
        select(u.direction, spread.direction, first),
        select(u.light, spread.light, first),
        select(u.lobe, spread.lobe, first & glossy),
        u.roulette,
        u.spare
    );
}

struct SpreadDraws {
    light_point: vec2f,
    direction: vec2f,
    light: f32,
    lobe: f32,
}

// Low-discrepancy numbers: light choice and point from the additive recurrence of the plastic ratio's kin [Roberts2018], the lobe
// from the golden ratio's, direction from the first two dimensions of Sobol's sequence [Burley2020]. All run through the samples i
// of one replicate; a shift of its own, modulo 1 and digit by digit, makes every sample uniform and the replicates independent.
fn draw_spread(pixel: u32, replicate: u32, i: u32, seed: u32) -> SpreadDraws {
    let shift = hash_pixel(pixel, replicate, seed ^ SHIFT_STREAM);
    let more = (shift ^ (shift >> vec2u(16u))) * 0x9e3779b1u;
    let light = vec3u(shift.x ^ more.y, shift) + i * vec3u(0xd1b54a33u, 0xabc98389u, 0x8cb92ba7u);
    let x = direction_order(pixel, replicate, i, seed);
    var y = x ^ (x << 16u);
    y ^= (y & 0x00ff00ffu) << 8u;
    y ^= (y & 0x0f0f0f0fu) << 4u;
    y ^= (y & 0x33333333u) << 2u;
    y ^= (y & 0x55555555u) << 1u;
    let direction = vec2u(x, y) ^ more;
    let lobe = ((more.y ^ (more.y >> 15u)) * 0x2c1b3c6du) + i * 0x9e3779b9u;
    let points = unit_float(vec4u(light.yz, direction));
    let choices = unit_float(vec4u(light.x, lobe, 0u, 0u));
    return SpreadDraws(points.xy, points.zw, choices.x, choices.y);
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

// Power heuristic [Veach1995]: the weight of a sample of density 1 / inverse, which the other way of sampling takes with density b.
fn power_heuristic(inverse: f32, b: f32) -> f32 {
    // The ratio first: squares of large densities overflow.
    let r = b * inverse;
    return 1.0 / (1.0 + r * r);
}
