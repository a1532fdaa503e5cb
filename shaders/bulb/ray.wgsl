// The ray from a light in a bulb to a point outside: see src/world/bulbs/mod.rs. Shells are concentric spheres, so the ray stays in the plane of
// its ends and the centre, and its impact, n r sin(angle to the radius), is the same everywhere. At a radius r in a medium of index n that
// sine is the impact times k = 1 / (n r).

struct Bulb {
    center: vec3f,
    // k inside and outside of the inner shell, then of the outer one. A bulb of one shell has an inner one that changes nothing.
    inverse_impacts: vec4f,
    // The index inside over the one outside, of both shells.
    etas: vec2f,
    // Indices at the light and outside.
    indices: vec2f,
    // Of both shells together, and of the inner one.
    transmittance: vec3f,
    inner_transmittance: vec3f,
    // How many shells there are; 0: the light is in no bulb.
    shells: u32,
    // The probability of ways that are reflected; 0: these are not sampled.
    reflected: f32,
    // The numbers of the shells' surfaces, and the medium outside.
    surface: u32,
    inner_surface: u32,
    medium: u32,
}

// The angle around the centre that a ray sweeps, less the angle at which it leaves the light: its cosine, its sine over the impact, and its
// derivative by the impact.
struct Sweep {
    cos: f32,
    sin: f32,
    slope: f32,
}

// Adds the arcsine of k times the impact, or three times that. Angles are added as rotations, because an arcsine of WGSL is good to three
// digits.
fn add_arcsine(s: Sweep, impact2: f32, k: f32, thrice: bool) -> Sweep {
    let sin2 = impact2 * k * k;
    let cos2 = fmax(1.0 - sin2, 1.0e-6);
    let inverse = inverseSqrt(cos2);
    let cos = cos2 * inverse * select(1.0, 1.0 - 4.0 * sin2, thrice);
    let sin = k * select(1.0, 3.0 - 4.0 * sin2, thrice);
    let slope = k * inverse * select(1.0, 3.0, thrice);
    return Sweep(s.cos * cos - impact2 * s.sin * sin, s.sin * cos + s.cos * sin, s.slope + slope);
}

// The sweep to the place outside whose k is `far`. A reflected ray goes once more through the centre's half plane, which adds pi.
fn sweep(bulb: Bulb, impact: f32, far: f32, way: u32) -> Sweep {
    let i2 = impact * impact;
    let k = bulb.inverse_impacts;
    let reflected = way != BULB_STRAIGHT;
    let outer = way == BULB_OUTER;
    var s = Sweep(select(1.0, -1.0, reflected), 0.0, 0.0);
    s = add_arcsine(s, i2, -k.x, reflected);
    s = add_arcsine(s, i2, k.y, outer);
    s = add_arcsine(s, i2, -k.z, outer);
    s = add_arcsine(s, i2, k.w, false);
    return add_arcsine(s, i2, -far, false);
}

// The plane of a ray.
struct BulbPlane {
    // Unit vectors: from the centre to the light's point, and across it towards the receiver.
    along: vec3f,
    across: vec3f,
    // Cosine and sine of the angle at the centre between light and receiver.
    between: vec2f,
    // The light's distance from the centre times its index, and the receiver's distance.
    start: f32,
    distance: f32,
}

// Of the light's point y and the receiver's x, both relative to the centre.
fn bulb_plane(bulb: Bulb, y: vec3f, x: vec3f) -> BulbPlane {
    let distance = length(x);
    let to_receiver = x * (1.0 / fmax(distance, TINY));
    let from_center = length(y);
    let along = select(y * (1.0 / fmax(from_center, TINY)), to_receiver, from_center < TINY);
    let cos = dot(along, to_receiver);
    let aside = to_receiver - along * cos;
    let sin = length(aside);
    return BulbPlane(along, aside * (1.0 / fmax(sin, TINY)), vec2f(cos, sin), bulb.indices.x * from_center, distance);
}

// One step of Newton's method. `leaves` is the cosine and sine of the angle to `along` at which the ray leaves the light.
fn nearer_angle(bulb: Bulb, plane: BulbPlane, leaves: vec2f, far: f32, way: u32) -> vec2f {
    let impact = plane.start * leaves.y;
    let s = sweep(bulb, impact, far, way);
    let swept = rotated(leaves, vec2f(s.cos, impact * s.sin));
    let off = swept.y * plane.between.x - swept.x * plane.between.y;
    let step = off / (1.0 + plane.start * leaves.x * s.slope);
    let next = leaves + step * vec2f(leaves.y, -leaves.x);
    return next * inverseSqrt(dot(next, next));
}

struct BulbRay {
    // Unit direction from the receiver to the outer shell, and the direction in which the ray leaves the light.
    d: vec3f,
    leaves: vec3f,
    // The solid angle at the receiver for an area of the light is spread * per_length^2 times the cosine at the light. Lengths may be
    // large, so they are apart.
    spread: f32,
    per_length: f32,
    // What the shells let through.
    transmitted: vec3f,
}

// The ray that leaves the light at the angle whose cosine and sine are `leaves`, and meets the receiver.
fn bulb_ray(bulb: Bulb, plane: BulbPlane, leaves: vec2f, far: f32, way: u32) -> BulbRay {
    let impact = plane.start * leaves.y;
    let s = sweep(bulb, impact, far, way);
    // A solid angle at the light becomes an area at the receiver: by the derivative of the swept angle in the plane, and by the quotient of
    // the sines across it.
    let widens = (1.0 + plane.start * leaves.x * s.slope) * abs(s.cos + leaves.x * plane.start * s.sin);
    let sin = impact * far;
    let cos = safe_sqrt(1.0 - sin * sin);
    let n = bulb.indices.x / (bulb.indices.y * plane.distance);
    // Towards larger angles, and away from the centre, at the receiver.
    let onwards = plane.across * plane.between.x - plane.along * plane.between.y;
    let outwards = plane.along * plane.between.x + plane.across * plane.between.y;
    let sines = impact * bulb.inverse_impacts.yw;
    let cosines = vec2f(safe_sqrt(1.0 - sines.x * sines.x), safe_sqrt(1.0 - sines.y * sines.y));
    let inner = refraction(cosines.x, bulb.etas.x).transmitted;
    let outer = refraction(cosines.y, bulb.etas.y).transmitted;
    var passed = bulb.transmittance * (inner * outer);
    passed *= select(1.0, 1.0 - inner, way == BULB_INNER);
    let again = bulb.inner_transmittance * inner;
    passed *= select(vec3f(1.0), again * again * (1.0 - outer), way == BULB_OUTER);
    return BulbRay(
        renormalized(-outwards * cos - onwards * sin),
        plane.along * leaves.x + plane.across * leaves.y,
        1.0 / fmax(widens * cos, TINY),
        n,
        passed
    );
}

// The cosine and sine of the angle at which the ray leaves the light's point to reach the receiver. src/world/bulbs/mod.rs tries whether
// four steps are enough.
fn leaving_angle(bulb: Bulb, plane: BulbPlane, far: f32, way: u32) -> vec2f {
    var leaves = select(plane.between, -plane.between, way != BULB_STRAIGHT);
    leaves = nearer_angle(bulb, plane, leaves, far, way);
    leaves = nearer_angle(bulb, plane, leaves, far, way);
    leaves = nearer_angle(bulb, plane, leaves, far, way);
    return nearer_angle(bulb, plane, leaves, far, way);
}

// Whether a reflected ray meets the light's own disk where it crosses what is in the inner shell again. `to_light` leads from the centre to
// the disk's.
fn meets_own_light(bulb: Bulb, plane: BulbPlane, leaves: vec2f, way: u32, light: DiskLight, to_light: vec3f) -> bool {
    let impact = plane.start * leaves.y;
    let sines = impact * bulb.inverse_impacts.xyz;
    let cosines = sqrt(max(vec3f(1.0) - sines * sines, vec3f(0.0)));
    // Cosine and sine of twice each arcsine. The inner shell's reflection sends the ray nearest to the centre at the angle `leaves`, less
    // twice the first, plus a right angle. On the way to the outer shell and back it sweeps twice the second less twice the third.
    let cos = 1.0 - 2.0 * sines * sines;
    let sin = 2.0 * sines * cosines;
    var at = rotated(rotated(leaves, vec2f(cos.x, -sin.x)), vec2f(0.0, 1.0));
    let outer = rotated(rotated(at, vec2f(cos.y, sin.y)), vec2f(cos.z, -sin.z));
    at = select(at, outer, way == BULB_OUTER);
    let nearest = (plane.along * at.x + plane.across * at.y) * (impact / bulb.indices.x);
    let d = plane.across * at.x - plane.along * at.y;
    let facing = dot(light.normal, d);
    let t = dot(light.normal, to_light - nearest) / select(facing, TINY, facing == 0.0);
    let off = nearest + t * d - to_light;
    return (way != BULB_STRAIGHT) & (dot(off, off) <= light.radius * light.radius);
}

fn rotated(v: vec2f, by: vec2f) -> vec2f {
    return vec2f(v.x * by.x - v.y * by.y, v.y * by.x + v.x * by.y);
}
