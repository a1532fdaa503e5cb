// Orthonormal frames [Duff2017].

// n times z plus two unit vectors that complete n to a right-handed frame, times x and y.
fn from_frame(n: vec3f, local: vec3f) -> vec3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let tangent = vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    let bitangent = vec3f(b, s + n.y * n.y * a, -n.y);
    return tangent * local.x + bitangent * local.y + n * local.z;
}

// (cos, sin) of 2 pi (u - 1/2), u in [0, 1): the range that WGSL promises sin and cos to be good on.
fn unit_circle(u: f32) -> vec2f {
    let phi = 6.2831853 * (u - 0.5);
    return vec2f(cos(phi), sin(phi));
}

// Square root of max(x, 0): rounding may have made x negative.
fn safe_sqrt(x: f32) -> f32 {
    return sqrt(max(x, 0.0));
}
