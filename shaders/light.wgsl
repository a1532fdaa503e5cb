// Disk lights: cap sampling, its density, and how much a light could send to a receiver.

// Emits `radiance` from the side its normal points to; n.p = offset on its plane.
struct DiskLight {
    center: vec3f,
    radius: f32,
    normal: vec3f,
    offset: f32,
    radiance: vec3f,
    face: u32,
}

// The sphere through the rim and the point p sees the disk as a cap. Points uniform in area on that cap
// are cosine-distributed about the sphere's normal at p, and each stands for a point of the disk.
struct Cap {
    // p relative to the disk's centre, and its height above the disk's plane.
    v: vec3f,
    h: f32,
    // Squared distance from the axis, and a^2 + h^2 - r^2.
    a2: f32,
    s: f32,
    // sqrt(s^2 + 4 h^2 r^2).
    q: f32,
    // Height of the cap; 0 where the light shows its back.
    height: f32,
}

fn cap_of(light: DiskLight, p: vec3f) -> Cap {
    let r2 = light.radius * light.radius;
    let v = p - light.center;
    let h = fmax(dot(light.normal, p) - light.offset, 0.0);
    let radial = v - light.normal * dot(light.normal, v);
    let a2 = dot(radial, radial);
    let s = a2 + h * h - r2;
    // (q - s) / 2h = 2 h r^2 / (q + s), and either form cancels on one side of s = 0.
    let far = s > 0.0;
#if EXTREME_LIGHTS
    // The same without fourth powers of lengths, which leave f32: q is the product of the distances to the rim's nearest
    // and farthest point.
    let a = sqrt(a2);
    let q = length(vec2f(a - light.radius, h)) * length(vec2f(a + light.radius, h));
    let height = select((q - s) / fmax(2.0 * h, TINY), 2.0 * h * (r2 / fmax(q + s, TINY_SQUARE)), far);
#else
    let q = sqrt(s * s + 4.0 * h * h * r2);
    let height = select(q - s, 2.0 * h * r2, far) / fmax(select(2.0 * h, q + s, far), TINY_SQUARE);
#endif
    return Cap(v, h, a2, s, q, select(0.0, height, h > 0.0));
}

struct LightSample {
    // Unit direction to the point chosen on the disk, and the distance to it.
    d: vec3f,
    distance: f32,
    // 1 / density per solid angle; 0: no sample, the point is behind the light or in its plane.
    inverse_pdf: f32,
}

// The direction to a point of the cap, given by a unit vector away from the light's axis and a number in [0, 1); not yet the
// distance to the disk, but that to the cap.
fn cap_point(light: DiskLight, cap: Cap, outwards: vec3f, u: f32) -> LightSample {
    let depth = (1.0 - u) * cap.height;
    let rho = safe_sqrt(u * (light.radius * light.radius + (1.0 - u) * cap.height * cap.height));
    let d = outwards * rho - light.normal * depth - cap.v;
    let length2 = dot(d, d);
    let inverse_length = inverseSqrt(fmax(length2, TINY_SQUARE));
    let inverse_pdf = 3.14159265 * cap.height * inverse_length;
    let sample = cap.height > 0.0 && length2 > 0.0;
    return LightSample(d * inverse_length, length2 * inverse_length, select(0.0, inverse_pdf, sample));
}

// Onwards from there to the disk.
fn from_cap(cap: Cap, sample: LightSample, u: f32) -> LightSample {
    let to_disk = cap.h / fmax(cap.h + (1.0 - u) * cap.height, TINY);
    return LightSample(sample.d, sample.distance * to_disk, sample.inverse_pdf);
}

fn sample_cap(light: DiskLight, cap: Cap, u: vec2f) -> LightSample {
    let outwards = from_frame(light.normal, vec3f(unit_circle(u.y), 0.0));
    return from_cap(cap, cap_point(light, cap, outwards, u.x), u.x);
}

// The density with which sample_cap takes direction d, which meets the disk; per solid angle.
fn cap_pdf(light: DiskLight, cap: Cap, d: vec3f) -> f32 {
    let along = dot(light.normal, d);
    let chord = 2.0 * (cap.s / (2.0 * fmax(cap.h, TINY)) * along - dot(cap.v, d));
    return select(0.0, fmax(chord, 0.0) / (3.14159265 * fmax(cap.height, TINY_SQUARE)), cap.height > 0.0);
}

#if LIGHT_WEIGHTS
// Half luminance, half all channels alike: by luminance alone a blue light would hardly ever be chosen.
const LIGHT_COLORS: vec3f = vec3f(0.273, 0.5243, 0.2027);

// What light is sent to at some point: its normal there, and how it scatters.
struct Receiver {
    n: vec3f,
#if GLOSSY
    // Where it mirrors the eye.
    r: vec3f,
    // How much of all light it scatters, and at most of light from r, in one unit; and an eighth of the lobe's exponent.
    diffuse: f32,
    specular: f32,
    narrow: f32,
#endif
}

#if GLOSSY
// About how much it scatters of the light of things in a ball of this radius; `to` leads to its centre, 1 / `inverse` far. At an
// angle alpha off the lobe's axis cos^n(alpha) is about exp(-n sin^2(alpha) / 2), for which (1 + n sin^2(alpha) / 8)^-4
// stands; over the ball it is as much flatter as it is wider.
fn scattered(at: Receiver, to: vec3f, inverse: f32, radius: f32) -> f32 {
    let along = dot(to, at.r) * inverse;
    let off2 = select(1.0, fmax(1.0 - along * along, 0.0), along > 0.0);
    let size = radius * inverse;
    let flat = 1.0 + fmin(size * size * at.narrow, 1.0e6);
    let wide = flat + fmin(off2 * at.narrow, 1.0e6);
    let ratio = flat / wide;
    return at.diffuse + at.specular * (ratio * ratio) * (ratio * ratio) / flat;
}
#endif

// About what the light would send to a receiver at p with normal n if nothing were in between, up to a factor: the
// irradiance of a disk far away, r^2 cos cos / d^2, with every length made longer by the radius. That keeps it finite
// and about right near the light, keeps every light that can contribute, and costs one quotient. 0 only where the light
// shows its back or lies below the receiver's horizon.
fn light_weight(light: DiskLight, p: vec3f, at: Receiver) -> f32 {
    let r2 = light.radius * light.radius;
    let to = light.center - p;
    let inverse = 1.0 / (dot(to, to) + r2);
    let h = dot(light.normal, p) - light.offset;
    let above = fmax(dot(at.n, to) + light.radius, 0.0);
    let brightness = dot(light.radiance, LIGHT_COLORS);
    let facing = h + light.radius * (r2 * inverse);
    // Factors without unit: a compiler may take them in any order, and products of many lengths leave f32.
    let per_length = light.radius * inverse;
    let sent = select(0.0, brightness * (facing * per_length) * (above * per_length), h > 0.0);
#if GLOSSY
    return sent * scattered(at, to, inverseSqrt(fmax(dot(to, to), TINY_SQUARE)), light.radius);
#else
    return sent;
#endif
}

#if GLOSSY
struct SuitedSample {
    to: LightSample,
    // What it is worth beside a sample of sample_cap.
    worth: f32,
}

// One of two opposite points of the cap, by how much light the receiver about scatters from there [Talbot2005]. A lobe often
// sees just a part of a light. With a second point drawn afresh the variance was the same, with three or four hardly less.
fn sample_suited(light: DiskLight, cap: Cap, at: Receiver, u: vec2f, choice: f32) -> SuitedSample {
    let outwards = from_frame(light.normal, vec3f(unit_circle(u.y), 0.0));
    let opposite = fract(u.x + 0.5);
    let one = cap_point(light, cap, outwards, u.x);
    let two = cap_point(light, cap, -outwards, opposite);
    let suits_one = fmax(dot(at.n, one.d), 0.0) * one.inverse_pdf * scattered(at, one.d, 1.0, 0.0);
    let suits_two = fmax(dot(at.n, two.d), 0.0) * two.inverse_pdf * scattered(at, two.d, 1.0, 0.0);
    let sum = suits_one + suits_two;
    let second = choice * sum >= suits_one;
    let taken = LightSample(
        select(one.d, two.d, second),
        select(one.distance, two.distance, second),
        select(one.inverse_pdf, two.inverse_pdf, second)
    );
    let suits = select(suits_one, suits_two, second);
    let worth = select(0.0, 0.5 * (sum / select(1.0, suits, suits > 0.0)), suits > 0.0);
    return SuitedSample(from_cap(cap, taken, select(u.x, opposite, second)), worth);
}
#endif
#endif
