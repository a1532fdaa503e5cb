// The bounds of an implicit surface, in the space of its formula: a box, or a ball around the origin.

// Where the line q + t w is within a box: nowhere if the second number is less than the first.
fn span_of_box(q: vec3f, w: vec3f, low: vec3f, high: vec3f) -> vec2f {
    let inverse = 1.0 / select(w, select(vec3f(-1.0e-20), vec3f(1.0e-20), w >= vec3f(0.0)), abs(w) < vec3f(1.0e-20));
    let a = (low - q) * inverse;
    let b = (high - q) * inverse;
    let near = select(b, a, a < b);
    let far = select(a, b, a < b);
    return vec2f(fmax(near.x, fmax(near.y, near.z)), fmin(far.x, fmin(far.y, far.z)));
}

// The same of a ball.
fn span_of_ball(q: vec3f, w: vec3f, radius: f32) -> vec2f {
    let a = 1.0 / fmax(dot(w, w), TINY_SQUARE);
    let b = -dot(q, w) * a;
    let across = q + b * w;
    let rest = radius * radius - dot(across, across);
    let half = sqrt(fmax(rest, 0.0) * a);
    return select(vec2f(FAR, -FAR), vec2f(b - half, b + half), rest >= 0.0);
}

// q moved onto a box with this middle and half extent, and the outward normal there.
fn onto_box(q: vec3f, middle: vec3f, half: vec3f) -> Vertex {
    let v = q - middle;
    let share = abs(v) / half;
    let first = share.x >= share.y && share.x >= share.z;
    let second = !first && share.y >= share.z;
    let side = select(vec3f(-1.0), vec3f(1.0), v >= vec3f(0.0));
    let axis = vec3<bool>(first, second, !first && !second);
    return Vertex(select(q, middle + half * side, axis), select(vec3f(0.0), side, axis));
}

// The same of a ball.
fn onto_ball(q: vec3f, radius: f32) -> Vertex {
    let n = unit_or(q, vec3f(1.0, 0.0, 0.0));
    return Vertex(n * radius, n);
}

// v with length 1; `otherwise` if it has none. Its square need not fit f32.
fn unit_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let largest = fmax(abs(v.x), fmax(abs(v.y), abs(v.z)));
    let scaled = v * (1.0 / fmax(largest, TINY));
    return select(otherwise, scaled * inverseSqrt(fmax(dot(scaled, scaled), TINY_SQUARE)), largest > TINY);
}
