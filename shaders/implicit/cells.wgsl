// The cells of a volume: steps from one to the next, the trilinear function in one, and its cubic along a ray.

struct CellStep {
    // Where the ray leaves a cell or a cube of cells, and the cell that it enters.
    t: f32,
    cell: vec3i,
}

// The ray q + t w leaves the aligned cube of cells around `cell` with the side 2^bits. It was in the cell at `since`. The cube may reach
// beyond the `last` cell.
fn beyond_cube(q: vec3f, w: vec3f, inverse: vec3f, cell: vec3i, bits: u32, since: f32, last: vec3i) -> CellStep {
    let side = vec3i(1i << bits);
    let low = (cell >> vec3u(bits)) << vec3u(bits);
    let forward = inverse > vec3f(0.0);
    let ends = (vec3f(select(low, low + side, forward)) - q) * inverse;
    let x = ends.x <= ends.y && ends.x <= ends.z;
    let y = !x && ends.y <= ends.z;
    let t = fmax(fmin(ends.x, fmin(ends.y, ends.z)), since);
    // Along the other axes it is still beside the cube, and in the volume, whatever rounding says: a ray may run in its last face.
    let beside = clamp(vec3i(floor(q + t * w)), low, min(low + side - vec3i(1), last));
    let next = select(low - vec3i(1), low + side, forward);
    return CellStep(t, select(beside, next, vec3<bool>(x, y, !x && !y)));
}

// The values at the corners: those of the lower z first, x fastest.
struct Cell {
    low: vec4f,
    high: vec4f,
}

fn largest_of(c: Cell) -> f32 {
    let most = max(abs(c.low), abs(c.high));
    return fmax(fmax(most.x, most.y), fmax(most.z, most.w));
}

// The gradient at a point of the cell, and in w the value.
fn cell_sloped(c: Cell, f: vec3f) -> vec4f {
    let z = mix(c.low, c.high, f.z);
    let dz = c.high - c.low;
    let y = mix(z.xy, z.zw, f.y);
    let dy = z.zw - z.xy;
    let dzy = mix(dz.xy, dz.zw, f.y);
    return vec4f(y.y - y.x, mix(dy.x, dy.y, f.x), mix(dzy.x, dzy.y, f.x), mix(y.x, y.y, f.x));
}

// The function from a to b, two points of the cell: the coefficients of its cubic in Bernstein's form. Each is a mean of values of the
// function at corners of the box between a and b, so nothing cancels.
fn cell_cubic(c: Cell, a: vec3f, b: vec3f) -> vec4f {
    let za = mix(c.low, c.high, a.z);
    let zb = mix(c.low, c.high, b.z);
    let aa = mix(za.xy, za.zw, a.y);
    let ba = mix(za.xy, za.zw, b.y);
    let ab = mix(zb.xy, zb.zw, a.y);
    let bb = mix(zb.xy, zb.zw, b.y);
    let one = mix(aa.x, aa.y, b.x) + mix(ba.x, ba.y, a.x) + mix(ab.x, ab.y, a.x);
    let two = mix(ba.x, ba.y, b.x) + mix(ab.x, ab.y, b.x) + mix(bb.x, bb.y, a.x);
    return vec4f(mix(aa.x, aa.y, a.x), one * (1.0 / 3.0), two * (1.0 / 3.0), mix(bb.x, bb.y, b.x));
}

// The roots of k u^2 + 2 h u + c, in order; both 0 if there are none.
fn roots_of_quadratic(k: f32, h: f32, c: f32) -> vec2f {
    let square = h * h - k * c;
    let s = h + select(-1.0, 1.0, h >= 0.0) * sqrt(fmax(square, 0.0));
    let one = -s / select(k, TINY, abs(k) < TINY);
    let two = -c / select(s, TINY, abs(s) < TINY);
    return select(vec2f(0.0), vec2f(fmin(one, two), fmax(one, two)), square >= 0.0);
}

// A part of a cubic on which it falls from above 0 to 0 or below, and a guess.
struct Bracket {
    low: f32,
    high: f32,
    u: f32,
}

// A step to the root of the parabola with the cubic's value, slope and bend at u, or of bisection where that leads out. A step of Newton's
// method would only halve the distance to a root that is nearly double.
fn narrower(b: Bracket, first: f32, c: vec3f) -> Bracket {
    let value = first + b.u * (c.x + b.u * (c.y + b.u * c.z));
    let slope = c.x + b.u * (2.0 * c.y + b.u * (3.0 * c.z));
    let bend = c.y + b.u * (3.0 * c.z);
    let low = select(b.low, b.u, value > 0.0);
    let high = select(b.u, b.high, value > 0.0);
    let steep = fmax(-slope, 0.0) + sqrt(fmax(slope * slope - 4.0 * bend * value, 0.0));
    let guess = b.u + 2.0 * value / fmax(steep, TINY);
    return Bracket(low, high, select(0.5 * (low + high), guess, guess >= low && guess <= high));
}

// The first root of a cubic that is above 0 at 0; 2 if there is none up to 1. Between the places at which it is level it falls or rises
// all the way, so a root is never passed over [Marmitt2004]. Three steps leave nothing but rounding.
fn first_root(b: vec4f) -> f32 {
    let d = b.yzw - b.xyz;
    let bend = d.y - d.x;
    let twist = (d.z - d.y) - bend;
    let c = vec3f(3.0 * d.x, 3.0 * bend, twist);
    let level = clamp(roots_of_quadratic(twist, bend, d.x), vec2f(0.0), vec2f(1.0));
    let v = vec2f(b.x) + level * (vec2f(c.x) + level * (vec2f(c.y) + level * c.z));
    let in_first = v.x <= 0.0;
    let in_second = !in_first && v.y <= 0.0;
    var low = select(select(level.y, level.x, in_second), 0.0, in_first);
    var high = select(select(1.0, level.y, in_second), level.x, in_first);
    var above = select(select(v.y, v.x, in_second), b.x, in_first);
    var below = select(select(b.w, v.y, in_second), v.x, in_first);

    // The side of the inflection on which the root lies.
    let turn = clamp(-bend / select(twist, TINY, abs(twist) < TINY), low, high);
    let there = b.x + turn * (c.x + turn * (c.y + turn * c.z));
    let after = there > 0.0;
    low = select(low, turn, after);
    above = select(above, there, after);
    high = select(turn, high, after);
    below = select(there, below, after);

    // Where the cubic is less steep at the inflection than anywhere else, each of its three terms from there on falls, so the root comes
    // before any one of them makes up for the value, and not before half of that. Elsewhere a chord is a good guess. A triple root is
    // found from the first one only.
    let lost = abs(there);
    let slope = c.x + turn * (2.0 * c.y + turn * (3.0 * c.z));
    let by_bend = sqrt(lost / fmax(abs(c.y + 3.0 * turn * c.z), TINY));
    let reach = fmin(fmin(lost / fmax(-slope, TINY), by_bend), pow(lost / fmax(-twist, TINY), 1.0 / 3.0));
    let near = clamp(turn + select(-reach, reach, after), low, high);
    let chord = low + (high - low) * clamp(above / fmax(above - below, TINY), 0.0, 1.0);
    var part = Bracket(low, high, select(chord, near, twist < 0.0));
    part = narrower(part, b.x, c);
    part = narrower(part, b.x, c);
    part = narrower(part, b.x, c);
    return select(2.0, part.u, in_first || in_second || b.w <= 0.0);
}

// The same of a cubic whose value at 0 is a root but for rounding: that one is divided out. Where it falls at once it has its root at 0.
// What it falls by counts from `noise` on; so a ray that dips below 0 at once by less, and rises again, meets the next root.
fn root_after_start(b: vec4f, noise: f32) -> f32 {
    let e = b.yzw - vec3f(b.x);
    // The quotient, a quadratic in Bernstein's form.
    let q = vec3f(3.0 * e.x, 1.5 * e.y, e.z);
    let h = q.y - q.x;
    let k = (q.z - q.y) - h;
    let some = h * h - k * q.x >= 0.0;
    let r = roots_of_quadratic(k, h, q.x);
    let next = select(select(2.0, r.y, r.y > 0.0), r.x, r.x > 0.0);
    let first = select(2.0, next, some);
    let second = select(2.0, r.y, some && r.x > 0.0);
    // Where the quotient is below 0: two parts at most.
    let falls = q.x <= 0.0;
    let begin = vec2f(select(first, 0.0, falls), select(2.0, second, falls));
    let end = vec2f(fmin(select(second, first, falls), 1.0), 1.0);
    // The last part may be deepest where the cell ends.
    let middle = 0.5 * (begin + end);
    let within = -middle * (vec2f(q.x) + middle * (vec2f(2.0 * h) + middle * k));
    let at_end = -end * (vec2f(q.x) + end * (vec2f(2.0 * h) + end * k));
    let deep = (begin < vec2f(1.0)) & (max(within, at_end) > vec2f(noise));
    return select(select(2.0, begin.y, deep.y), begin.x, deep.x);
}
