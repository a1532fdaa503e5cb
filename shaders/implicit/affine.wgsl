// Affine arithmetic along a ray: what a formula can be on a part of it [Knoll2009].
//
// The part is middle + u half, with u from -1 to 1. A number that varies along it is x + y u, and up to z more or less: a vec3f. Products
// keep what is linear in u, and put the rest into z, which also takes every rounding error. So z falls with the square of the part's
// length down to the rounding of the formula itself, and what is said of the sign is true.

// Twice the greatest relative error of one rounding.
const ROUNDING: f32 = 1.2e-7;
// As in src/implicit/arithmetic.rs.
const SMALLEST: f32 = 1.0e-30;
const LARGEST_EXPONENT: f32 = 80.0;

// A coordinate of the ray: in the middle, half its change, and its own rounding error.
fn affine_coordinate(middle: f32, half: f32, slack: f32) -> vec3f {
    return vec3f(middle, half, slack);
}

fn affine_number(n: f32) -> vec3f {
    return vec3f(n, 0.0, ROUNDING * abs(n));
}

// With the rounding error of its first two numbers.
fn affine_rounded(a: vec3f) -> vec3f {
    return vec3f(a.xy, a.z + ROUNDING * (abs(a.x) + abs(a.y)));
}

fn affine_add(a: vec3f, b: vec3f) -> vec3f {
    return affine_rounded(a + b);
}

fn affine_shift(a: vec3f, n: f32) -> vec3f {
    return affine_rounded(vec3f(a.x + n, a.y, a.z + ROUNDING * abs(n)));
}

fn affine_subtract(a: vec3f, b: vec3f) -> vec3f {
    return affine_rounded(vec3f(a.xy - b.xy, a.z + b.z));
}

fn affine_negate(a: vec3f) -> vec3f {
    return vec3f(-a.xy, a.z);
}

fn affine_scale(a: vec3f, n: f32) -> vec3f {
    let s = a * n;
    return vec3f(s.xy, abs(s.z) + 2.0 * ROUNDING * (abs(s.x) + abs(s.y)));
}

// The products of u with u lie between 0 and 1: half of them is known.
fn affine_multiply(a: vec3f, b: vec3f) -> vec3f {
    let curved = 0.5 * a.y * b.y;
    let large_a = abs(a.x) + abs(a.y);
    let large_b = abs(b.x) + abs(b.y);
    let rest = large_a * (b.z + ROUNDING * large_b) + a.z * (large_b + b.z) + abs(curved);
    return vec3f(a.x * b.x + curved, a.x * b.y + a.y * b.x, rest);
}

fn affine_square(a: vec3f) -> vec3f {
    let curved = 0.5 * a.y * a.y;
    let large = abs(a.x) + abs(a.y);
    let rest = large * (2.0 * a.z + ROUNDING * large) + a.z * a.z + curved;
    return vec3f(a.x * a.x + curved, 2.0 * a.x * a.y, rest);
}

// A function of a. At a.x it has `value` and the derivative `slope`; `bend` times the square of the distance from there is the most
// by which it leaves its tangent.
fn affine_function(a: vec3f, value: f32, slope: f32, bend: f32, error: f32) -> vec3f {
    let reach = abs(a.y) + a.z;
    let rise = slope * a.y;
    let rest = abs(slope) * a.z + bend * reach * reach + error + 4.0 * ROUNDING * (abs(value) + abs(rise));
    return vec3f(value, rise, rest);
}

// Any number between.
fn affine_between(low: f32, high: f32) -> vec3f {
    return vec3f(0.5 * (low + high), 0.0, 0.5 * (high - low) + ROUNDING * (abs(low) + abs(high)));
}

fn affine_inverse(a: vec3f) -> vec3f {
    let low = abs(a.x) - abs(a.y) - a.z;
    let inverse = 1.0 / select(fmin(a.x, -SMALLEST), fmax(a.x, SMALLEST), a.x > 0.0);
    let square = inverse * inverse;
    let known = affine_function(a, inverse, -square, square / fmax(low, SMALLEST), 0.0);
    let known_if = low > SMALLEST;
    return select(affine_between(-1.0 / SMALLEST, 1.0 / SMALLEST), known, known_if);
}

fn affine_sqrt(a: vec3f) -> vec3f {
    let reach = abs(a.y) + a.z;
    let low = a.x - reach;
    let root = sqrt(fmax(a.x, SMALLEST));
    let inverse = 1.0 / root;
    // sqrt(x + d) is sqrt(x) + d / (2 sqrt(x)) - d^2 / (2 sqrt(x) (sqrt(x) + sqrt(x + d))^2).
    let known = affine_function(a, root, 0.5 * inverse, 0.5 * inverse * inverse * inverse, 0.0);
    let most = sqrt(fmax(a.x + reach, 0.0));
    return select(affine_between(0.0, most), known, low > 0.0);
}

// Where the sign is not known, between the chord and the chord less its height at 0.
fn affine_abs(a: vec3f) -> vec3f {
    let reach = abs(a.y) + a.z;
    let low = a.x - reach;
    let high = a.x + reach;
    let slope = (abs(high) - abs(low)) / fmax(high - low, SMALLEST);
    let height = fmax(abs(low) + slope * -low, 0.0);
    let mixed = vec3f(slope * a.x + 0.5 * height, slope * a.y, abs(slope) * a.z + 0.5 * height + 4.0 * ROUNDING * (abs(a.x) + reach));
    let known = select(affine_negate(a), a, a.x > 0.0);
    return select(mixed, known, low > 0.0 || high < 0.0);
}

fn affine_min(a: vec3f, b: vec3f) -> vec3f {
    let difference = affine_subtract(a, b);
    let reach = abs(difference.y) + difference.z;
    let mixed = affine_scale(affine_subtract(affine_add(a, b), affine_abs(difference)), 0.5);
    let known = select(b, a, difference.x < 0.0);
    return select(mixed, known, abs(difference.x) > reach);
}

fn affine_max(a: vec3f, b: vec3f) -> vec3f {
    return affine_negate(affine_min(affine_negate(a), affine_negate(b)));
}

// (cos, sin) of x, to 3e-7 and the rounding of x.
fn circle_of(x: f32) -> vec2f {
    let turns = x * INV_2PI;
    return -unit_circle(turns - floor(turns));
}

// The error of circle_of.
fn circle_error(x: f32) -> f32 {
    return 5.0e-7 + 2.0 * ROUNDING * abs(x);
}

fn affine_sin(a: vec3f) -> vec3f {
    let c = circle_of(a.x);
    let known = affine_function(a, c.y, c.x, 0.5, circle_error(a.x));
    return select(known, vec3f(0.0, 0.0, 1.0), known.z > 1.0);
}

fn affine_cos(a: vec3f) -> vec3f {
    let c = circle_of(a.x);
    let known = affine_function(a, c.x, -c.y, 0.5, circle_error(a.x));
    return select(known, vec3f(0.0, 0.0, 1.0), known.z > 1.0);
}

fn affine_exp(a: vec3f) -> vec3f {
    let reach = abs(a.y) + a.z;
    let high = fmin(a.x + reach, LARGEST_EXPONENT);
    let value = exp(fmin(a.x, LARGEST_EXPONENT));
    // WGSL promises three units in the last place, and two more for each unit of x.
    let most = exp(high) * 1.0001;
    let known = affine_function(a, value, value, 0.5 * most, value * ROUNDING * (3.0 + 2.0 * abs(a.x)));
    return select(affine_between(0.0, most), known, reach < 1.0 && a.x + reach < LARGEST_EXPONENT);
}

fn affine_log(a: vec3f) -> vec3f {
    let reach = abs(a.y) + a.z;
    let low = a.x - reach;
    let inverse = 1.0 / fmax(a.x, SMALLEST);
    let floor_of = fmax(low, SMALLEST);
    // WGSL promises 2^-21 from 0.5 to 2, and three units in the last place elsewhere.
    let value = log(fmax(a.x, SMALLEST));
    let known = affine_function(a, value, inverse, 0.5 / (floor_of * floor_of), 5.0e-7);
    let most = log(fmax(a.x + reach, SMALLEST));
    let least = log(SMALLEST);
    return select(affine_between(least - 1.0e-3, most + 1.0e-3), known, low > 0.1 * a.x && low > SMALLEST);
}

// The gradient of a formula, and in w its value.

fn sloped_multiply(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(a.xyz * b.w + b.xyz * a.w, a.w * b.w);
}

fn sloped_square(a: vec4f) -> vec4f {
    return vec4f(a.xyz * (2.0 * a.w), a.w * a.w);
}

fn sloped_inverse(a: vec4f) -> vec4f {
    let inverse = 1.0 / select(fmin(a.w, -SMALLEST), fmax(a.w, SMALLEST), a.w > 0.0);
    return vec4f(a.xyz * (-inverse * inverse), inverse);
}

fn sloped_sqrt(a: vec4f) -> vec4f {
    let root = safe_sqrt(a.w);
    return vec4f(a.xyz * select(0.0, 0.5 / fmax(root, SMALLEST), root > 0.0), root);
}

fn sloped_abs(a: vec4f) -> vec4f {
    return select(a, -a, a.w < 0.0);
}

fn sloped_min(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a.w < b.w);
}

fn sloped_max(a: vec4f, b: vec4f) -> vec4f {
    return select(a, b, a.w < b.w);
}

fn sloped_sin(a: vec4f) -> vec4f {
    let c = circle_of(a.w);
    return vec4f(a.xyz * c.x, c.y);
}

fn sloped_cos(a: vec4f) -> vec4f {
    let c = circle_of(a.w);
    return vec4f(a.xyz * -c.y, c.x);
}

fn sloped_exp(a: vec4f) -> vec4f {
    let value = exp(fmin(a.w, LARGEST_EXPONENT));
    return vec4f(a.xyz * select(0.0, value, a.w < LARGEST_EXPONENT), value);
}

fn sloped_log(a: vec4f) -> vec4f {
    let positive = a.w > SMALLEST;
    return vec4f(a.xyz * select(0.0, 1.0 / fmax(a.w, SMALLEST), positive), log(fmax(a.w, SMALLEST)));
}
