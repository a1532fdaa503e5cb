// Densities of scattering, for the weights of light paths, in scenes with Phong's lobes. Every other material scatters like the cosine.

// Keeps quotients of densities within the range of f32.
const MOST_QUOTIENT: f32 = 1.0e12;

fn quotient(cos: f32, pdf: f32) -> f32 {
    return fmin(fmax(cos, 0.0) / fmax(pdf, TINY), MOST_QUOTIENT);
}

// The density from wi to wo, given that from wo to wi. The lobe is the same both ways, and the cosine is not.
fn pdf_back(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    let matt = (1.0 - lobe_probability(x.material.color, x.material.specular)) * INV_PI;
    return pdf + matt * (x.cos_o - dot(x.n, wi));
}

// The cosine of wi over the density with which a path from wo is scattered to wi.
fn cos_over_pdf(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    return select(PI, quotient(dot(x.n, wi), pdf), is_phong(x.material));
}

// The same from wi to wo; `pdf` is still that from wo to wi.
fn cos_over_pdf_back(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    return select(PI, quotient(x.cos_o, pdf_back(x, wi, pdf)), is_phong(x.material));
}

// The first over the second.
fn turned(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    return cos_over_pdf(x, wi, pdf) / fmax(cos_over_pdf_back(x, wi, pdf), 1.0 / MOST_QUOTIENT);
}
