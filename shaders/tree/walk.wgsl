// Walking a bounding volume hierarchy without a stack: node k has the children 2k and 2k + 1, and one bit for each level says
// whether the sibling of the node there is still to be visited. The walk itself is generated for each kind of surface.

// Each node has four records. The first three hold twelve words, six for each child.
//
//   a box      least corner, greatest corner
//   a sphere   centre, radius, item, LEAF
//
// An item is 2 (number of the surface + 1), + 1 if the surface can block light. If spheres bound solids, the fourth record holds the
// solid and its parent of either child. Every other surface has a node of its own:
//
//   a disk     centre, radius; normal, offset; item, face, 0, LEAF
//   the rest   item in the first word, LEAF in the twelfth
//
// A header of four records stands before each tree. Its first record is a sphere around the tree: centre and radius. Node 0 has two
// boxes that nothing meets: a walk goes there when it is done.
const LEAF: u32 = 0xffffffffu;

// Farther than anything.
const MISSED: f32 = 1.0e38;

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
    // The ray's origin, moved by the greatest rounding error of the origin or of a hit: `enter` for the sides of a box by which the ray
    // enters, `leave` for those by which it leaves. The walk must not miss what a loop over all surfaces would meet. The boxes make up
    // for the rounding errors of what they hold: see src/world/tree.rs.
    enter: vec3f,
    leave: vec3f,
    inverse: vec3f,
    backwards: vec3<bool>,
}

fn slabs_of(ray: Ray) -> Slabs {
    // Components that are zero or almost zero, of either sign, are replaced, so that the inverse is finite.
    let d = select(ray.d, vec3f(1.0e-20), abs(ray.d) < vec3f(1.0e-20));
    let inverse = 1.0 / d;
    let backwards = d < vec3f(0.0);
    // About sixteen units in the last place of f32.
    let slack = 1.0e-6 * (abs(ray.o.x) + abs(ray.o.y) + abs(ray.o.z));
    let against = select(vec3f(slack), vec3f(-slack), backwards);
    return Slabs(ray.o + against, ray.o - against, inverse, backwards);
}

// Where the ray enters the box, if no farther than t, else MISSED.
fn box_entry(s: Slabs, low: vec3f, high: vec3f, t: f32) -> f32 {
    let enter = (select(low, high, s.backwards) - s.enter) * s.inverse;
    let leave = (select(high, low, s.backwards) - s.leave) * s.inverse;
    let near = fmax(fmax(enter.x, enter.y), fmax(enter.z, 0.0));
    let far = fmin(fmin(leave.x, leave.y), fmin(leave.z, t));
    // The distances themselves have rounding errors.
    return select(MISSED, near, near * 0.99999 <= far);
}

// Where a walk is: a node, and one bit for each level that says whether the sibling there is still to be visited. The lowest bit is for the
// level of the node.
struct Place {
    node: u32,
    siblings: u32,
}

// The next node: the nearer child that is met, or else the last sibling that was put off.
fn onward(at: Place, entry_0: f32, entry_1: f32) -> Place {
    let second = entry_1 < entry_0;
    let met = fmin(entry_0, entry_1) < MISSED;
    let both = fmax(entry_0, entry_1) < MISSED;
    let levels = firstTrailingBit(at.siblings | 0x80000000u);
    let node = select((at.node >> levels) ^ 1u, 2u * at.node + u32(second), met);
    let siblings = select((at.siblings >> levels) ^ 1u, 2u * at.siblings + u32(both), met);
    let over = !met && at.siblings == 0u;
    return Place(select(node, 0u, over), select(siblings, 0u, over));
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
