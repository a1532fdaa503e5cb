// Mirror reflection: direction d reflected about unit normal n.

fn mirrored(d: vec3f, n: vec3f) -> vec3f {
    return renormalized(d - 2.0 * dot(d, n) * n);
}
