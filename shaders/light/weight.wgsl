// How much a light could send to a receiver, by which lights are chosen.

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
    return sent * scattered(at, to, inverseSqrt(fmax(dot(to, to), TINY_SQUARE)), light.radius);
}
