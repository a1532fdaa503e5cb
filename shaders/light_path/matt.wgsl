// Densities of scattering, for the weights of light paths, in scenes whose surfaces scatter like the cosine or are specular.

// The cosine of wi over the density with which a path from wo is scattered to wi.
fn cos_over_pdf(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    return PI;
}

// The same from wi to wo; `pdf` is still that from wo to wi.
fn cos_over_pdf_back(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    return PI;
}

// The first over the second.
fn turned(x: ptr<function, Interaction>, wi: vec3f, pdf: f32) -> f32 {
    return 1.0;
}
