// Walking a bounding volume hierarchy that is four wide, with the children's boxes on a grid of 8 bits [Ylitie2017]. The walk itself is
// generated for each kind of surface: see visit.wgsl, descent.wgsl and queue.wgsl.

// The texture is divided into units of four records. Unit 0 is a node without children: a walk goes there when it is done.
//
//   a node      origin of the grid, marks; the least coordinates of its children's boxes, by axis, and the greatest along x; the
//               greatest along y and z, unit of the first child, 0
//   a sphere    centre, radius; item, solid, parent
//   a disk      centre, radius; normal, offset; item, face
//   a cylinder  base, radius; axis, offset; faces, 0; top, solid, parent, item
//
// The coordinates are steps of the grid, 8 bits each, of the first child in the lowest ones. The marks are, from the lowest bit, the
// exponents of the step along x, y and z, as f32 has them; in four bits the number of children; and in the highest bit a 1. Children
// stand side by side. An item is 2 (number of the surface + 1), + 1 if the surface can block light.
//
// Before each tree stands a header: a sphere around the tree; unit of the root, unit of the next header of the same kind of surface or 0.
const NODE_MARK: u32 = 0x80000000u;

// The word for a child that is not met, or not there. Words of others are less.
const NO_CHILD: u32 = 0xffffffffu;

// Loop trips left to the invocation: see trips/counted.wgsl. When none are left, the result of the walk is not used, and the sample begins
// again in the next dispatch.
var<private> trips_left: u32 = 0xffffffffu;

// A ray that starts far from a tree, moved along its direction to where the tree begins.
struct Approach {
    ray: Ray,
    // How far it was moved.
    moved: f32,
}

// A point in the distance is known only to about |o| 2^-24. If the tree is smaller than that, such a ray might meet any box, and a walk
// would visit them all. Moved, it is one certain ray. Rays that start within a thousand radii of the centre stay as they are: nearly all do.
fn approach(ray: Ray, header: vec4u) -> Approach {
    let around = bitcast<vec4f>(header);
    let to = around.xyz - ray.o;
    let far = dot(to, to) > 1.0e6 * around.w * around.w;
    let moved = select(0.0, fmax(dot(to, ray.d) - 2.0 * around.w, 0.0), far);
    return Approach(Ray(ray.o + moved * ray.d, ray.d, ray.face, ray.medium, ray.target_face), moved);
}

// A hit, seen from where the ray was moved to.
fn brought_near(hit: Hit, near: Approach) -> Hit {
    return Hit(hit.t - near.moved, hit.key);
}

// A hit of the moved ray, seen from where the ray starts; `first` if it is none.
fn put_back(hit: Hit, near: Approach, first: Hit) -> Hit {
    return Hit(select(first.t, hit.t + near.moved, hit.key != first.key), hit.key);
}

// A ray made ready for boxes.
struct Slabs {
    inverse: vec3f,
    // The greatest rounding error of the ray's origin or of a hit. Boxes are met as if they were larger by it: the walk must not miss
    // what a loop over all surfaces would meet. The boxes make up for the rounding errors of what they hold: see src/world/tree/mod.rs.
    slack: f32,
}

fn slabs_of(ray: Ray) -> Slabs {
    // Components that are zero or almost zero, of either sign, are replaced, so that the inverse is finite.
    let d = select(ray.d, vec3f(1.0e-20), abs(ray.d) < vec3f(1.0e-20));
    // About twenty units in the last place of f32.
    return Slabs(1.0 / d, 1.2e-6 * (abs(ray.o.x) + abs(ray.o.y) + abs(ray.o.z)));
}

// The solid and the parent of an opaque thing in a tree of glass ones. It is met from any medium, and never from inside.
const ANY_MEDIUM: u32 = 0xffffffffu;

// The medium just outside a leaf, as seen by a ray.
fn parent_of(leaf: u32, ray: Ray) -> u32 {
    return select(leaf, ray.medium, leaf == ANY_MEDIUM);
}

fn is_node(a: vec4u) -> bool {
    return a.w >= NODE_MARK;
}

// Coordinates of four children, in steps of the grid.
fn on_grid(word: u32) -> vec4f {
    return vec4f(bitcast<vec4i>((vec4u(word) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u)));
}

fn fmax4(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a > b);
}

fn fmin4(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a < b);
}

// The children of a node whose boxes the ray meets no farther than t, the nearest first: the lowest two bits of a word are the number of
// the child. The other bits are where the ray enters, as f32, which orders positive numbers like integers.
fn children_met(o: vec3f, s: Slabs, a: vec4u, b: vec4u, c: vec4u, t: f32) -> vec4u {
    let origin = bitcast<vec3f>(a.xyz);
    let steps = bitcast<vec3f>(((vec3u(a.w) >> vec3u(0u, 8u, 16u)) & vec3u(255u)) << vec3u(23u)) * s.inverse;
    // Where the ray passes the origin of the grid.
    let passes = (origin - o) * s.inverse;
    let wider = s.slack * abs(s.inverse);
    let enter = passes - wider;
    let leave = passes + wider;
    let backwards = s.inverse < vec3f(0.0);
    let high = vec3u(b.w, c.xy);
    let by = select(b.xyz, high, backwards);
    let to = select(high, b.xyz, backwards);
    let near_xy = fmax4(on_grid(by.x) * steps.x + enter.x, on_grid(by.y) * steps.y + enter.y);
    let near = fmax4(near_xy, fmax4(on_grid(by.z) * steps.z + enter.z, vec4f(0.0)));
    let far_xy = fmin4(on_grid(to.x) * steps.x + leave.x, on_grid(to.y) * steps.y + leave.y);
    let far = fmin4(far_xy, fmin4(on_grid(to.z) * steps.z + leave.z, vec4f(t)));
    // The distances themselves have rounding errors. A child that is not there is not met, whatever its coordinates.
    let number = vec4u(0u, 1u, 2u, 3u);
    let there = number < vec4u(select(0u, (a.w >> 24u) & 7u, is_node(a)));
    let met = there & (near * 0.99999 <= far);
    let word = select(vec4u(NO_CHILD), (bitcast<vec4u>(near) & vec4u(0xfffffffcu)) | number, met);
    // A sorting network.
    let low_0 = min(word.xz, word.yw);
    let high_0 = max(word.xz, word.yw);
    let middle = vec2u(max(low_0.x, low_0.y), min(high_0.x, high_0.y));
    let first = min(low_0.x, low_0.y);
    let last = max(high_0.x, high_0.y);
    return vec4u(first, min(middle.x, middle.y), max(middle.x, middle.y), last);
}

// The children after the first, in one word: in 25 bits the unit of child 0; below these, a 1 and then the numbers of the children, two
// bits each, the next one in the lowest. 0 if there are none.
fn put_off(unit: u32, met: vec4u) -> u32 {
    let one = met.y & 3u;
    let two = one | ((met.z & 3u) << 2u);
    let three = two | ((met.w & 3u) << 4u);
    var numbers = select(4u | one, 16u | two, met.z != NO_CHILD);
    numbers = select(numbers, 64u | three, met.w != NO_CHILD);
    return select(0u, (unit << 7u) | numbers, met.y != NO_CHILD);
}

// The unit of the next of the children that were put off; 0 if none was.
fn next_of(word: u32) -> u32 {
    return (word >> 7u) + (word & 3u);
}

// What is left without that one.
fn without_next(word: u32) -> u32 {
    let rest = (word & 0xffffff80u) | ((word & 127u) >> 2u);
    return select(rest, 0u, (word & 0x7cu) == 4u);
}

// The nearer of two hits. If both are at the same distance, the lower key wins: its surface comes first in the scene, and a walk may find
// the two in any order.
fn keep_nearest(hit: Hit, found: Hit, item: u32) -> Hit {
    let take = found.t < hit.t || (found.t == hit.t && found.key < hit.key);
    return Hit(select(hit.t, found.t, take), select(hit.key, found.key, take));
}

// What a shadow ray has met, if the surface of `item` can block light at all.
fn keep_blocker(hit: Hit, found: Hit, item: u32) -> Hit {
    return Hit(hit.t, select(hit.key, found.key, (item & 1u) == 1u));
}
