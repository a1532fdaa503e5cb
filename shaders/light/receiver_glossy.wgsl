// Receivers of light in scenes with glossy materials: which light, and which point of it, depends on the lobe.

// What lights are chosen for at some point: its normal there, and how it scatters.
struct Receiver {
    n: vec3f,
    // Where it mirrors the eye.
    r: vec3f,
    // How much of all light it scatters, and at most of light from r, in one unit; and an eighth of the lobe's exponent.
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

// One of two opposite points of the cap, by how much light the receiver about scatters from there [Talbot2005]. A lobe often
// sees just a part of a light. With a second point drawn afresh the variance was the same, with three or four hardly less.
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
