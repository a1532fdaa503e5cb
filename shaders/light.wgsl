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
    let h = max(dot(light.normal, p) - light.offset, 0.0);
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
    let height = select((q - s) / max(2.0 * h, TINY), 2.0 * h * (r2 / max(q + s, TINY_SQUARE)), far);
#else
    let q = sqrt(s * s + 4.0 * h * h * r2);
    let height = select(q - s, 2.0 * h * r2, far) / max(select(2.0 * h, q + s, far), TINY_SQUARE);
#endif
    return Cap(v, h, a2, s, q, select(0.0, height, h > 0.0));
}

struct LightSample {
    // Unit direction to the point chosen on the disk, and the distance to it.
    d: vec3f,
    distance: f32,
    // Per solid angle; 0: no sample, the point is behind the light or in its plane.
    pdf: f32,
}

fn sample_cap(light: DiskLight, cap: Cap, u: vec2f) -> LightSample {
    let depth = (1.0 - u.x) * cap.height;
    let rho = safe_sqrt(u.x * (light.radius * light.radius + (1.0 - u.x) * cap.height * cap.height));
    let circle = unit_circle(u.y) * rho;
    let d = from_frame(light.normal, vec3f(circle, -depth)) - cap.v;
    let length = length(d);
    let pdf = length / (3.14159265 * max(cap.height, TINY_SQUARE));
    let to_disk = cap.h / max(cap.h + depth, TINY);
    return LightSample(d / max(length, TINY), length * to_disk, select(0.0, pdf, cap.height > 0.0 && length > 0.0));
}

// The density with which sample_cap takes direction d, which meets the disk; per solid angle.
fn cap_pdf(light: DiskLight, cap: Cap, d: vec3f) -> f32 {
    let along = dot(light.normal, d);
    let chord = 2.0 * (cap.s / (2.0 * max(cap.h, TINY)) * along - dot(cap.v, d));
    return select(0.0, max(chord, 0.0) / (3.14159265 * max(cap.height, TINY_SQUARE)), cap.height > 0.0);
}

#if SEVERAL_LIGHTS
// What the light would send to a receiver with normal n at the cap's point if nothing were in between,
// up to a factor: the closed form of the irradiance of a disk, which is exact while the whole disk is above the
// receiver's horizon. Below, a tenth of what a receiver that faces the light would get keeps every light that can
// contribute; 0 only when none of it can.
fn light_weight(light: DiskLight, cap: Cap, n: vec3f) -> f32 {
    let r2 = light.radius * light.radius;
    let hq = cap.h / max(cap.q, TINY_SQUARE);
    let parallel = hq * cap.height;
    let across = 2.0 * hq * r2 / (cap.a2 + cap.h * cap.h + r2 + cap.q);
    let axial = dot(light.normal, cap.v);
    let irradiance = -parallel * dot(n, light.normal) - across * (dot(n, cap.v) - dot(n, light.normal) * axial);
    let facing = parallel + across * sqrt(cap.a2);
    let below = dot(n, cap.v) >= light.radius;
    let luminance = dot(light.radiance, vec3f(0.2126, 0.7152, 0.0722));
    return select(max(irradiance, 0.1 * facing) * luminance, 0.0, below);
}
#endif
