// Vectors: orthonormal frames [Duff2017], reflection, angles.

const PI: f32 = 3.14159265;
const INV_PI: f32 = 0.31830989;
const INV_2PI: f32 = 0.15915494;

// n times z plus two unit vectors that complete n to a right-handed frame, times x and y.
fn from_frame(n: vec3f, local: vec3f) -> vec3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let tangent = vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    let bitangent = vec3f(b, s + n.y * n.y * a, -n.y);
    return tangent * local.x + bitangent * local.y + n * local.z;
}

// Unit length for what has it but for rounding: one step of Newton's method, without root or quotient.
fn renormalized(v: vec3f) -> vec3f {
    return v * (1.5 - 0.5 * dot(v, v));
}

// (cos, sin) of 2 pi (u - 1/2), u in [0, 1), to 2e-7: WGSL promises no more than 5e-4 of its own. Taylor's series
// of half the angle, which lies within pi / 2, and the formulas that double it.
fn unit_circle(u: f32) -> vec2f {
    let t = PI * (u - 0.5);
    let t2 = t * t;
    let s = t * (1.0 + t2 * (-1.6666667e-1 + t2 * (8.3333333e-3 + t2 * (-1.9841270e-4 + t2 * (2.7557319e-6 - t2 * 2.5052108e-8)))));
    let c = 1.0 + t2 * (-0.5 + t2 * (4.1666667e-2 + t2 * (-1.3888889e-3 + t2 * (2.4801587e-5 + t2 * (-2.7557319e-7 + t2 * 2.0876757e-9)))));
    return vec2f(1.0 - 2.0 * s * s, 2.0 * s * c);
}

// Square root of max(x, 0): rounding may have made x negative.
fn safe_sqrt(x: f32) -> f32 {
    return sqrt(fmax(x, 0.0));
}

// Direction d reflected about unit normal n.
fn mirrored(d: vec3f, n: vec3f) -> vec3f {
    return renormalized(d - 2.0 * dot(d, n) * n);
}
