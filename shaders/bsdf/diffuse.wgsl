// Lambertian reflection: f = reflectance / pi, sampled by the cosine, so that a sample's weight is the reflectance itself.

fn sample_diffuse(x: ptr<function, Interaction>, u: Draws) -> Scattered {
    let wi = sample_cosine(x.n, u.direction);
    return Scattered(wi, x.material.color, cosine_pdf(dot(x.n, wi)), false, x.medium);
}

fn evaluate_diffuse(x: ptr<function, Interaction>, wi: vec3f) -> BsdfValue {
    let cos = dot(x.n, wi);
    return BsdfValue(x.material.color * (INV_PI * cos), cosine_pdf(cos));
}
