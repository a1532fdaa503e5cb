// Light paths on surfaces with smooth normals.

// What a light path that is scattered from x.wo to wi carries beside a path from the eye that takes the same way back [Veach1996]. Light
// counts by the cosine to the surface's own normal where it arrives and leaves, and f by that to the smooth one. Light that comes from
// behind the smooth normal is not scattered, but by mirrors and glass.
fn adjoint(x: ptr<function, Interaction>, wi: vec3f) -> f32 {
    let arrives = x.cos_o * abs(dot(x.geometric, wi));
    return arrives / fmax(abs(dot(x.geometric, x.wo) * dot(x.n, wi)), TINY);
}
