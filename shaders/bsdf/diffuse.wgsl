// Lambertian reflection: f = reflectance / pi, sampled by the cosine, so that a sample's weight is the reflectance itself.

// Unit direction about n with density cos / pi per solid angle.
fn sample_cosine(n: vec3f, u: vec2f) -> vec3f {
    let circle = unit_circle(u.y) * sqrt(u.x);
    return from_frame(n, vec3f(circle, sqrt(1.0 - u.x)));
}

fn diffuse_pdf(cos: f32) -> f32 {
    return select(0.0, fmax(cos, 0.0) * INV_PI, MIS_DIFFUSE);
}

fn sample_diffuse(x: ptr<function, Interaction>, u: Draws) -> Scattered {
    let wi = sample_cosine(x.n, u.direction);
    return Scattered(wi, x.material.color, diffuse_pdf(dot(x.n, wi)), false, x.medium);
}

fn evaluate_diffuse(x: ptr<function, Interaction>, wi: vec3f) -> BsdfValue {
    let cos = dot(x.n, wi);
    return BsdfValue(x.material.color * (INV_PI * cos), diffuse_pdf(cos));
}
