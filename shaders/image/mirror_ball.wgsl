// Light that reaches a diffuse surface by way of a mirror ball. Found by chance, it is the noisiest light of a room with such a ball: few
// directions lead there, and each brings the light's full radiance. But the ball shows every point of a light in exactly one place,
// which can be computed. So some paths are sent to the image of a light, and paths that get there by chance do not count the light.

// What a path remembers of its last vertices. FREE: nothing. FROM_DIFFUSE: the last one was diffuse. BY_MIRROR, with a mirror's number:
// the last one was on that mirror, and the one before it was diffuse.
const FREE: u32 = 0u;
const FROM_DIFFUSE: u32 = 1u;
const BY_MIRROR: u32 = 0x40000000u;
// SENT, with the numbers of a mirror and a light: the path was sent to that image. SENT_AND_MET: it has met the mirror as well. ASTRAY:
// it was sent, but has met a mirror in a place that does not show the light.
const SENT: u32 = 0x80000000u;
const SENT_AND_MET: u32 = 0xc0000000u;
const ASTRAY: u32 = 0xffffffffu;
// The mirror's number is in the lowest MIRROR_BITS bits, and the light's number in the bits above.
const MIRROR_MASK: u32 = (1u << MIRROR_BITS) - 1u;

// Where a path would meet the ball at a cosine below this, the light is left to chance. There the image is so narrow that it carries
// almost no light, and Newton's method may fail. Elsewhere its four steps are accurate to 1e-6, as a test with a million random
// positions has shown.
const LEAST_IMAGE_COS: f32 = 0.25;

// Paths are sent to points of a disk that is larger than the light by this factor, so that rounding loses no part of the light.
const IMAGE_RIM: f32 = 1.001;

// The choice of an image, or of none.
struct ChosenImage {
    index: u32,
    taken: bool,
    inverse_probability: f32,
}

// An estimate of what a receiver at p with normal n gets by way of a ball, in the unit of light_weight. Seen from afar, the image of a
// light is smaller than the light by (radius / 2 distance)^2. `strength` holds the factors that do not depend on the receiver. The
// estimate is 0 only where no light comes that way.
fn image_weight(p: vec3f, n: vec3f, ball: Sphere, strength: f32) -> f32 {
    let to = ball.center - p;
    let inverse = inverseSqrt(fmax(dot(to, to), TINY_SQUARE));
    let above = fmax((dot(n, to) + ball.radius) * inverse, 0.0);
    let per_length = ball.radius * inverse;
    return select(0.0, strength * above * (per_length * per_length), per_length < 1.0);
}

// One step of Newton's method, for the place where a ball of radius 1 shows point b to point a. All directions are in the plane of a, b
// and the ball's centre, as (cosine, sine) of their angle from a, seen from the centre. `angle` is the direction of b, and m is an
// estimate of the direction of the place; the result is a better one. a and b are at distances 1 / inverse.x and 1 / inverse.y from the
// centre. The equation is sin(m - rest) = sin(m) inverse.y - sin(rest) inverse.x, with rest = angle - m.
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
    // Lengths are in units of the ball's radius.
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
    // The first estimate is exact for small angles.
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
    // Coddington's equations: a narrow bundle of rays spreads by sum + curved / cos in the plane of incidence, and by sum + curved cos
    // across it.
    let distance = dot(there, d);
    let beyond = dot(onward, onward) * inverse_onward;
    let sum = distance + beyond;
    let curved = 2.0 * distance * beyond;
    let growth = (sum * cos + curved) * (sum + curved * cos);
    // If the ball hides the light from p, there is no such place. Then Newton's method does not converge, or it converges to a place
    // where the ray would pass through the ball.
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
