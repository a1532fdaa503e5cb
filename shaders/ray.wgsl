// Rays, hits, and what a path knows about where it stands.

// Farther than anything; a ray that meets nothing ends here.
const FAR: f32 = 3.0e38;
// Smaller than any length that matters; keeps quotients finite.
const TINY: f32 = 1.0e-30;
// The same for squares of lengths, and for what is made of them.
const TINY_SQUARE: f32 = 1.0e-37;
// The key of no surface.
const NONE: u32 = 0xffffffffu;
// No face: the eye stands on nothing, and an ordinary ray aims at no light.
const NO_FACE: u32 = 0u;

// A ray o + t d, |d| = 1, in world space. It stands on `face` (coincident planar faces share one),
// is inside the dielectric solid `medium` (0: air), and, if it is a shadow ray, aims at the plane of
// face `target`. Sides are never inferred from rounded numbers: the world's preparation tells each
// intersection which root can be met, and `medium` and `face` say the rest.
struct Ray {
    o: vec3f,
    d: vec3f,
    face: u32,
    medium: u32,
    target_face: u32,
}

// The nearest hit so far: distance, and the key of what was met (4 x its number + the part met).
struct Hit {
    t: f32,
    key: u32,
}

// The larger and the smaller of two numbers; of a number and NaN, b. A driver's own max and min take care of NaN, and
// llvmpipe's also halve wide vectors: these are one instruction where those are five.
fn fmax(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn fmin(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

// 1 / x, finite at 0. Division is what a software adapter is slowest at, so faces with one normal share one of these.
fn safe_inverse(x: f32) -> f32 {
    return 1.0 / select(fmin(x, -1.0e-20), fmax(x, 1.0e-20), x > 0.0);
}

// The nearer of a hit and a candidate at distance t >= 0 that is met if `met`. Ties go to the earlier.
fn nearer(hit: Hit, met: bool, t: f32, key: u32) -> Hit {
    let take = met && t < hit.t;
    return Hit(select(hit.t, t, take), select(hit.key, key, take));
}
