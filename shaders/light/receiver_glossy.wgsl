// Receivers of light in scenes with glossy materials. The lobe affects which light is chosen, and which point on it. Every
// material but Phong is treated as matt.

// The surface for which a light is chosen: its normal, and how it scatters.
struct Receiver {
    n: vec3f,
    // wo mirrored about n: the axis of the lobe.
    r: vec3f,
    // The diffuse part of f, and the specular part at its greatest, for light from r; both times pi. Then an eighth of the exponent.
    diffuse: f32,
    specular: f32,
    narrow: f32,
}

fn receiver_at(x: ptr<function, Interaction>) -> Receiver {
    let m = x.material;
    let phong = is_phong(m);
    let shares = vec2f(dot(m.color, LIGHT_COLORS), dot(m.specular, LIGHT_COLORS));
    return Receiver(
        x.n,
        mirrored(-x.wo, x.n),
        select(1.0, shares.x, phong),
        select(0.0, shares.y * (0.5 * m.exponent + 1.0), phong),
        select(0.0, 0.125 * m.exponent, phong)
    );
}

// An estimate of how much of the light from a ball of this radius the receiver scatters. `to` leads to the ball's centre, at distance
// 1 / `inverse`. At an angle alpha to the lobe's axis, cos^n(alpha) is about exp(-n sin^2(alpha) / 2), which is approximated by
// (1 + n sin^2(alpha) / 8)^-4. The mean over a ball is a wider lobe, whose peak is lower by the same factor.
fn scattered(at: Receiver, to: vec3f, inverse: f32, radius: f32) -> f32 {
    let along = dot(to, at.r) * inverse;
    let off2 = select(1.0, fmax(1.0 - along * along, 0.0), along > 0.0);
    let size = radius * inverse;
    let flat = 1.0 + fmin(size * size * at.narrow, 1.0e6);
    let wide = flat + fmin(off2 * at.narrow, 1.0e6);
    let ratio = flat / wide;
    return at.diffuse + at.specular * (ratio * ratio) * (ratio * ratio) / flat;
}

// Resampled importance sampling [Talbot2005]: takes one of two opposite points of the cap, in proportion to an estimate of how much
// light the receiver scatters from there. A lobe often covers only a part of a light. With a second random point instead of the
// opposite one the variance was the same; with three or four points it was hardly less.
fn sample_light(light: DiskLight, cap: Cap, at: Receiver, u: vec2f, choice: f32) -> LightSample {
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
        select(one.inverse_pdf, two.inverse_pdf, second),
        1.0
    );
    let suits = select(suits_one, suits_two, second);
    let worth = select(0.0, 0.5 * (sum / select(1.0, suits, suits > 0.0)), suits > 0.0);
    let sample = from_cap(cap, taken, select(u.x, opposite, second));
    return LightSample(sample.d, sample.distance, sample.inverse_pdf, worth);
}
