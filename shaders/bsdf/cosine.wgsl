// Directions distributed as the cosine: for every material that scatters into the whole hemisphere.

// Unit direction about n with density cos / pi per solid angle.
fn sample_cosine(n: vec3f, u: vec2f) -> vec3f {
    let circle = unit_circle(u.y) * sqrt(u.x);
    return from_frame(n, vec3f(circle, sqrt(1.0 - u.x)));
}

// The density that light met by chance is weighed against; 0 where light sampling alone counts.
fn cosine_pdf(cos: f32) -> f32 {
    return select(0.0, fmax(cos, 0.0) * INV_PI, MIS_COSINE);
}
