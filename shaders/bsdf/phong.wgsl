// The modified Phong model [Lafortune1994]: f = kd / pi + ks (n + 2) / (2 pi) cos^n(alpha), alpha the angle to
// the mirror direction; the lobe is zero where cos(alpha) <= 0 and below the surface.

// cos^n(alpha) between unit vectors w and r. At large n a power of the cosine would lose its digits
// to rounding near 1, so the angle is taken from the difference of the vectors.
fn phong_power(w: vec3f, r: vec3f, exponent: f32) -> f32 {
    let diff = w - r;
    let x = 0.5 * dot(diff, diff);
    // log(1 - x); the series is good to 1e-7 below 0.05.
    let series = -x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * 0.2))));
    let log_cos = select(log(fmax(1.0 - x, TINY)), series, x < 0.05);
    return select(0.0, exp(exponent * log_cos), x < 1.0);
}

struct LobeSample {
    d: vec3f,
    // cos^n(alpha) of d, computed from the random number itself.
    power: f32,
}

// Unit direction about r with density (n + 1) / (2 pi) cos^n(alpha) per solid angle.
fn sample_lobe(r: vec3f, exponent: f32, u: vec2f) -> LobeSample {
    // 1 - u is never 0.
    let log_u = log(1.0 - u.x) * (1.0 / (exponent + 1.0));
    // 1 - cos^2(alpha) = 1 - exp(2 log_u); the series is good to 1e-7 below 0.05.
    let x = 2.0 * log_u;
    let series = -x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0))));
    let sin2 = select(1.0 - exp(x), series, x > -0.05);
    let circle = unit_circle(u.y) * safe_sqrt(sin2);
    let d = renormalized(from_frame(r, vec3f(circle, safe_sqrt(1.0 - sin2))));
    return LobeSample(d, exp(exponent * log_u));
}

// Probability of choosing the specular lobe.
fn lobe_probability(kd: vec3f, ks: vec3f) -> f32 {
    let d = kd.x + kd.y + kd.z;
    let s = ks.x + ks.y + ks.z;
    return s / fmax(d + s, TINY);
}

struct PhongValue {
    // f times the cosine, per steradian.
    f_cos: vec3f,
    // Density of the mixture of both lobes, per solid angle.
    pdf: f32,
}

// For a direction at cosine `cos` > 0 to the normal whose cos^n(alpha) is `power`.
fn phong_value(kd: vec3f, ks: vec3f, exponent: f32, cos: f32, power: f32) -> PhongValue {
    let choice = lobe_probability(kd, ks);
    let lobe = power * INV_2PI;
    let f = kd * INV_PI + ks * ((exponent + 2.0) * lobe);
    let pdf = (1.0 - choice) * cos * INV_PI + choice * (exponent + 1.0) * lobe;
    return PhongValue(f * cos, pdf);
}

struct PhongSample {
    d: vec3f,
    // f times the cosine over the density.
    weight: vec3f,
    // Density of the mixture of both lobes, per solid angle.
    pdf: f32,
}

// A direction from one of the two lobes about normal n, as `choice` selects. r is the mirror direction, the axis of the specular lobe.
fn sample_lobes(kd: vec3f, ks: vec3f, exponent: f32, n: vec3f, r: vec3f, choice: f32, u: vec2f) -> PhongSample {
    let probability = lobe_probability(kd, ks);
    let from_lobe = choice < probability;
    let lobe = sample_lobe(r, exponent, u);
    let d = select(sample_cosine(n, u), lobe.d, from_lobe);
    let power = select(phong_power(d, r, exponent), lobe.power, from_lobe);
    let cos = dot(n, d);
    let value = phong_value(kd, ks, exponent, cos, power);
    let quotient = value.f_cos * (1.0 / fmax(value.pdf, TINY));
    // Without a diffuse part the powers in the quotient cancel, and only this is left.
    let pure = ks * ((exponent + 2.0) / (exponent + 1.0) * cos);
    // Below the horizon the sample counts as zero and is not drawn again.
    return PhongSample(d, select(vec3f(0.0), select(quotient, pure, probability >= 1.0), cos > 0.0), value.pdf);
}

fn sample_phong(x: ptr<function, Interaction>, u: Draws) -> Scattered {
    let m = x.material;
    let s = sample_lobes(m.color, m.specular, m.exponent, x.n, mirrored(-x.wo, x.n), u.lobe, u.direction);
    return Scattered(s.d, s.weight, s.pdf, false, x.medium);
}

fn evaluate_phong(x: ptr<function, Interaction>, wi: vec3f) -> BsdfValue {
    let m = x.material;
    let power = phong_power(wi, mirrored(-x.wo, x.n), m.exponent);
    let value = phong_value(m.color, m.specular, m.exponent, dot(x.n, wi), power);
    return BsdfValue(value.f_cos, value.pdf);
}
