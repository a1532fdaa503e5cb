// Lambertian reflection: f = reflectance / pi, sampled by the cosine, so that a sample's weight is the
// reflectance itself.

// Unit direction about n with density cos / pi per solid angle.
fn sample_cosine(n: vec3f, u: vec2f) -> vec3f {
    let circle = unit_circle(u.y) * sqrt(u.x);
    return from_frame(n, vec3f(circle, sqrt(1.0 - u.x)));
}
