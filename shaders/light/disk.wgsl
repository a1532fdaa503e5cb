// Disk lights: cap sampling and its density.

// It emits `radiance` from the side that its normal points to. Its plane is n.p = offset.
struct DiskLight {
    center: vec3f,
    radius: f32,
    normal: vec3f,
    offset: f32,
    radiance: vec3f,
    face: u32,
}

// The rim of the disk and the receiver's point p lie on one sphere. The disk cuts a cap off that sphere, which covers the same directions
// from p as the disk does. If points are uniform in area on the cap, the directions to them are cosine-distributed about the sphere's
// normal at p. Each point of the cap stands for the point of the disk in the same direction.
struct Cap {
    // p relative to the disk's centre, and the height of p above the disk's plane.
    v: vec3f,
    h: f32,
    // Squared distance a^2 of p from the disk's axis, and a^2 + h^2 - r^2.
    a2: f32,
    s: f32,
    // sqrt(s^2 + 4 h^2 r^2).
    q: f32,
    // Height of the cap; 0 if p is behind the light or in its plane.
    height: f32,
}

fn cap_of(light: DiskLight, p: vec3f) -> Cap {
    let r2 = light.radius * light.radius;
    let v = p - light.center;
    let h = fmax(dot(light.normal, p) - light.offset, 0.0);
    let radial = v - light.normal * dot(light.normal, v);
    let a2 = dot(radial, radial);
    let s = a2 + h * h - r2;
    // The cap's height is (q - s) / 2h = 2 h r^2 / (q + s). The first form loses its digits for s > 0, the second for s < 0.
    let far = s > 0.0;
#if EXTREME_LIGHTS
    // The same without fourth powers of lengths, which may leave the range of f32. q is the product of the distances to the nearest
    // and the farthest point of the rim.
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
    // 1 / density per solid angle. 0 means no sample: the receiver is behind the light or in its plane.
    inverse_pdf: f32,
    // A factor beside 1 / density: 1 for sample_cap; for glossy receivers, the resampling weight.
    worth: f32,
}

// The direction to a point of the cap. `outwards` is a unit vector away from the light's axis, and u lies in [0, 1). The distance is the
// one to the cap; from_cap replaces it with the one to the disk.
fn cap_point(light: DiskLight, cap: Cap, outwards: vec3f, u: f32) -> LightSample {
    let depth = (1.0 - u) * cap.height;
    let rho = safe_sqrt(u * (light.radius * light.radius + (1.0 - u) * cap.height * cap.height));
    let d = outwards * rho - light.normal * depth - cap.v;
    let length2 = dot(d, d);
    let inverse_length = inverseSqrt(fmax(length2, TINY_SQUARE));
    let inverse_pdf = PI * cap.height * inverse_length;
    let sample = cap.height > 0.0 && length2 > 0.0;
    return LightSample(d * inverse_length, length2 * inverse_length, select(0.0, inverse_pdf, sample), 1.0);
}

// The same sample with the distance to the disk.
fn from_cap(cap: Cap, sample: LightSample, u: f32) -> LightSample {
    let to_disk = cap.h / fmax(cap.h + (1.0 - u) * cap.height, TINY);
    return LightSample(sample.d, sample.distance * to_disk, sample.inverse_pdf, sample.worth);
}

fn sample_cap(light: DiskLight, cap: Cap, u: vec2f) -> LightSample {
    let outwards = from_frame(light.normal, vec3f(unit_circle(u.y), 0.0));
    return from_cap(cap, cap_point(light, cap, outwards, u.x), u.x);
}

// The density per solid angle with which sample_cap takes direction d. d must meet the disk.
fn cap_pdf(light: DiskLight, cap: Cap, d: vec3f) -> f32 {
    let along = dot(light.normal, d);
    let chord = 2.0 * (cap.s / (2.0 * fmax(cap.h, TINY)) * along - dot(cap.v, d));
    return select(0.0, fmax(chord, 0.0) / (PI * fmax(cap.height, TINY_SQUARE)), cap.height > 0.0);
}
