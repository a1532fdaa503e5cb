// Smooth dielectric boundary: the unpolarised Fresnel equations and Snell's law.

struct Refraction {
    // Share of the light that is transmitted; 0 under total internal reflection.
    transmitted: f32,
    // Cosine of the refracted ray to the normal.
    cos_t: f32,
}

// For a ray that meets the boundary at cosine cos_i > 0; eta is the index ahead over the index behind.
// The transmission is computed directly, because 1 - reflection would lose its digits near grazing incidence.
fn refraction(cos_i: f32, eta: f32) -> Refraction {
    let cos2_t = 1.0 - (1.0 - cos_i) * (1.0 + cos_i) / (eta * eta);
    let cos_t = safe_sqrt(cos2_t);
    let s = cos_i + eta * cos_t;
    let p = eta * cos_i + cos_t;
    // 2 eta c_i c_t (1 / s^2 + 1 / p^2), with one division. Products of four cosines stay within the range of f32.
    let inv_sp = 1.0 / fmax(s * p, TINY);
    let t = 2.0 * eta * cos_i * cos_t * ((s * s + p * p) * inv_sp * inv_sp);
    return Refraction(select(0.0, t, cos2_t > 0.0), cos_t);
}

// The refracted direction of d at unit normal n, which faces the ray.
fn refracted(d: vec3f, n: vec3f, cos_i: f32, cos_t: f32, eta: f32) -> vec3f {
    let inv_eta = 1.0 / eta;
    return renormalized(d * inv_eta + n * (cos_i * inv_eta - cos_t));
}

// Reflection or refraction is chosen at random, in proportion to the light that each carries. A glance may be told which way to go: then
// half of the glances go each way, and each counts twice the share of its way. Glass reflects about a twentieth of the light, so
// a random choice would take the reflection too rarely, and its image would be noisy.
fn sample_dielectric(x: ptr<function, Interaction>, u: Draws) -> Scattered {
    // The index inside over the index outside.
    let ior = x.material.exponent;
    let eta = select(1.0 / ior, ior, x.outside);
    let fresnel = refraction(x.cos_o, eta);
    let by_chance = x.way == BY_CHANCE;
    let crosses = select(x.way == CROSSES, u.lobe < fresnel.transmitted, by_chance);
    let share = select(2.0 * select(1.0 - fresnel.transmitted, fresnel.transmitted, crosses), 1.0, by_chance);
    let wi = select(mirrored(-x.wo, x.n), refracted(-x.wo, x.n, x.cos_o, fresnel.cos_t, eta), crosses);
    let weight = select(vec3f(1.0), x.material.color, crosses) * share;
    return Scattered(wi, weight, 0.0, true, select(x.medium, select(x.parent, x.solid, x.outside), crosses));
}
