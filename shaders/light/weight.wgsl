// The weight of a light in the choice among lights: how much it could send to a receiver.

// An estimate, up to a factor, of what the light would send to a receiver at p with normal n if nothing were in between. It is the
// irradiance of a distant disk, r^2 cos cos / d^2, with every length increased by the radius. So it is finite and about right near the
// light as well, it is positive for every light that can contribute, and it needs one division. It is 0 only if p is behind the light,
// or the light is below the receiver's horizon.
fn light_weight(light: DiskLight, p: vec3f, at: Receiver) -> f32 {
    let r2 = light.radius * light.radius;
    let to = light.center - p;
    let inverse = 1.0 / (dot(to, to) + r2);
    let h = dot(light.normal, p) - light.offset;
    let above = fmax(dot(at.n, to) + light.radius, 0.0);
    let brightness = dot(light.radiance, LIGHT_COLORS);
    let facing = h + light.radius * (r2 * inverse);
    // The factors are dimensionless, because products of many lengths leave the range of f32, and a compiler may multiply in any order.
    let per_length = light.radius * inverse;
    let sent = select(0.0, brightness * (facing * per_length) * (above * per_length), h > 0.0);
    return sent * scattered(at, to, inverseSqrt(fmax(dot(to, to), TINY_SQUARE)), light.radius);
}
