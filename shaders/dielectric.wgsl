// Smooth dielectric boundary: the unpolarised Fresnel equations and Snell's law.

struct Refraction {
    // Share of the light that is transmitted; 0 under total internal reflection.
    transmitted: f32,
    // Cosine of the refracted ray to the normal.
    cos_t: f32,
}

// For a ray that meets the boundary at cosine cos_i > 0; eta is the index ahead over the index behind.
// Transmission is computed itself, for 1 - reflection would cancel near grazing.
fn refraction(cos_i: f32, eta: f32) -> Refraction {
    let cos2_t = 1.0 - (1.0 - cos_i) * (1.0 + cos_i) / (eta * eta);
    let cos_t = safe_sqrt(cos2_t);
    let s = cos_i + eta * cos_t;
    let p = eta * cos_i + cos_t;
    // 2 eta c_i c_t (1 / s^2 + 1 / p^2), with one quotient; products of four cosines stay within f32.
    let inv_sp = 1.0 / fmax(s * p, TINY);
    let t = 2.0 * eta * cos_i * cos_t * ((s * s + p * p) * inv_sp * inv_sp);
    return Refraction(select(0.0, t, cos2_t > 0.0), cos_t);
}

// The refracted direction of d at unit normal n, which faces the ray.
fn refracted(d: vec3f, n: vec3f, cos_i: f32, cos_t: f32, eta: f32) -> vec3f {
    let inv_eta = 1.0 / eta;
    return renormalized(d * inv_eta + n * (cos_i * inv_eta - cos_t));
}
