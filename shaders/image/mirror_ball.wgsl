// Light that reaches a diffuse surface by way of a mirror ball. Met by chance it is the noisiest light of a room with such a
// ball: few directions lead there, and each brings the light's full radiance. But the ball shows every point of a light in
// just one place, which can be found. So some paths are sent there, and those that come there by chance do not count it.

// What a path remembers of its last vertices: nothing; that the last one was diffuse; or, with the number of a mirror, that
// this was the one after.
const FREE: u32 = 0u;
const FROM_DIFFUSE: u32 = 1u;
const BY_MIRROR: u32 = 0x40000000u;
// Or that it was sent, with the numbers of mirror and light; and that it has met the mirror; and that it went astray.
const SENT: u32 = 0x80000000u;
const SENT_AND_MET: u32 = 0xc0000000u;
const ASTRAY: u32 = 0xffffffffu;
// The mirror's number, in the lowest MIRROR_BITS, and the light's above it.
const MIRROR_MASK: u32 = (1u << MIRROR_BITS) - 1u;

// Where the ball is met at less than this cosine its light is left to chance. There the image is so narrow that it holds next
// to nothing, and Newton's method may fail; elsewhere its four steps are right to 1e-6, by a million random places.
const LEAST_IMAGE_COS: f32 = 0.25;

// Points of a disk this much larger than the light are sought, so that rounding takes away none of the light itself.
const IMAGE_RIM: f32 = 1.001;

// A choice among the images, or that of none.
struct ChosenImage {
    index: u32,
    taken: bool,
    inverse_probability: f32,
}

// About what a receiver at p with normal n gets by way of a ball, as light_weight counts it: seen from afar, the image of a
// light is smaller by (radius / 2 distance)^2. `strength` has what does not depend on the receiver. 0 only where nothing
// comes that way.
fn image_weight(p: vec3f, n: vec3f, ball: Sphere, strength: f32) -> f32 {
    let to = ball.center - p;
    let inverse = inverseSqrt(fmax(dot(to, to), TINY_SQUARE));
    let above = fmax((dot(n, to) + ball.radius) * inverse, 0.0);
    let per_length = ball.radius * inverse;
    return select(0.0, strength * above * (per_length * per_length), per_length < 1.0);
}

// One step of Newton's method towards the place where a ball of radius 1 shows b to a: in the plane of both and the centre,
// at distances 1 / inverse.x and 1 / inverse.y and an angle with this cosine and sine, from a unit vector m, whose angle is
// counted from a, to a better one. A root of sin(m - rest) = sin(m) inverse.y - sin(rest) inverse.x, rest = angle - m.
fn image_step(m: vec2f, angle: vec2f, inverse: vec2f) -> vec2f {
    let rest = vec2f(dot(angle, m), angle.y * m.x - angle.x * m.y);
    let f = m.y * rest.x - m.x * rest.y - m.y * inverse.y + rest.y * inverse.x;
    let slope = 2.0 * dot(m, rest) - m.x * inverse.y - rest.x * inverse.x;
    let step = fmin(fmax(-f / fmax(slope, 1.0e-3), -1.0), 1.0);
    let moved = vec2f(m.x - step * m.y, m.y + step * m.x);
    return moved * (1.5 - 0.5 * dot(moved, moved));
}

struct ImageSample {
    // Unit direction to where the ball shows the point chosen on the light.
    d: vec3f,
    // 1 / density per solid angle; 0: no sample.
    inverse_pdf: f32,
}

// A direction from p to the image of a light, uniform in area on the light.
fn sample_image(p: vec3f, ball: Sphere, light: DiskLight, u: vec2f) -> ImageSample {
    // The ball's radius is the unit.
    let unit = 1.0 / ball.radius;
    let radius = light.radius * (IMAGE_RIM * unit);
    let circle = unit_circle(u.y) * (radius * sqrt(u.x));
    let a = (p - ball.center) * unit;
    let b = (light.center - ball.center) * unit + from_frame(light.normal, vec3f(circle, 0.0));
    let inverse = vec2f(inverseSqrt(fmax(dot(a, a), TINY_SQUARE)), inverseSqrt(fmax(dot(b, b), TINY_SQUARE)));
    let x = a * inverse.x;
    let cos_angle = dot(b, x) * inverse.y;
    let across = b * inverse.y - cos_angle * x;
    let inverse_sin = inverseSqrt(fmax(dot(across, across), TINY_SQUARE));
    let angle = vec2f(cos_angle, dot(across, across) * inverse_sin);
    // To begin with what is exact for small angles.
    var m = vec2f(1.0 - inverse.y + (1.0 - inverse.x) * angle.x, (1.0 - inverse.x) * angle.y);
    m *= inverseSqrt(fmax(dot(m, m), TINY_SQUARE));
    m = image_step(m, angle, inverse);
    m = image_step(m, angle, inverse);
    m = image_step(m, angle, inverse);
    let before = m;
    m = image_step(m, angle, inverse);
    let normal = m.x * x + m.y * (across * inverse_sin);
    let there = normal - a;
    let onward = b - normal;
    let inverse_there = inverseSqrt(fmax(dot(there, there), TINY_SQUARE));
    let inverse_onward = inverseSqrt(fmax(dot(onward, onward), TINY_SQUARE));
    let d = there * inverse_there;
    let cos = -dot(d, normal);
    let cos_onward = dot(onward, normal) * inverse_onward;
    let cos_light = -dot(light.normal, onward) * inverse_onward;
    // A narrow bundle of rays grows by sum + curved / cos in the plane of the ray and the normal, and by sum + curved cos
    // across it (Coddington's equations).
    let distance = dot(there, d);
    let beyond = dot(onward, onward) * inverse_onward;
    let sum = distance + beyond;
    let curved = 2.0 * distance * beyond;
    let growth = (sum * cos + curved) * (sum + curved * cos);
    // There is no such place where the ball itself lies between, and Newton's method stays on its way then, or finds one
    // where the ray would go through.
    let found = abs(before.x * m.y - before.y * m.x) < 0.01 && fmin(cos, cos_onward) > 0.5 * LEAST_IMAGE_COS;
    let seen = found && cos_light > 0.0 && inverse.x < 1.0;
    let inverse_pdf = PI * radius * radius * cos_light * cos / fmax(growth, TINY);
    return ImageSample(d, select(0.0, inverse_pdf, seen));
}

// What a path remembers when it has met mirror `number` at this cosine.
fn after_mirror(memory: u32, number: u32, cos: f32) -> u32 {
    let known = cos >= LEAST_IMAGE_COS;
    let right = memory < SENT_AND_MET && (memory & MIRROR_MASK) == number && known;
    let sent = select(ASTRAY, memory | SENT_AND_MET, right);
    return select(select(FREE, BY_MIRROR | number, memory == FROM_DIFFUSE && known), sent, memory >= SENT);
}
