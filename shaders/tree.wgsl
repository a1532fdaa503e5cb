// Walking a bounding volume hierarchy that lies in a list, depth first: a node that is missed names the node to go on
// with, so there is no stack. The walk itself is generated for each kind of surface.

// Two for each node, the second's last word 0:
//   least corner, number of the node after all that is below it; greatest corner, 0.
// Of a leaf that word is 2 (number of the surface + 1), + 1 if it can block light. The leaf of a sphere has instead
//   centre, as above; radius, solid, parent, as above.
// Before each tree: farthest from the origin that it reaches; after it, a node that nothing meets and that leads to
// itself.
// In a storage texture: where each lane has an index of its own lavapipe loads from a buffer word by word, and from a
// sampled texture with a level of detail for each lane, five to ten times as slow.
@group(0) @binding(3) var nodes: texture_storage_2d<rgba32uint, read>;

fn node_low(node: u32) -> vec4u {
    return textureLoad(nodes, vec2u(2u * (node % NODES_A_ROW), node / NODES_A_ROW));
}

fn node_high(node: u32) -> vec4u {
    return textureLoad(nodes, vec2u(2u * (node % NODES_A_ROW) + 1u, node / NODES_A_ROW));
}

// What is left of the loop trips that the driver grants an invocation. When none are left the walk is no use, and the
// sample is begun again by the next dispatch.
var<private> trips_left: u32 = 0xffffffffu;

// A ray made ready for boxes.
struct Slabs {
    // Its origin, moved by what rounding may do to it or to a hit: against the sides that it enters by, and that it leaves
    // by. The walk must not miss what a loop over all surfaces would meet.
    enter: vec3f,
    leave: vec3f,
    inverse: vec3f,
    backwards: vec3<bool>,
}

fn slabs_of(ray: Ray, reach: f32) -> Slabs {
    // Components of either zero, and those that might as well be, become large numbers of either sign.
    let d = select(ray.d, vec3f(1.0e-20), abs(ray.d) < vec3f(1.0e-20));
    let inverse = 1.0 / d;
    let backwards = d < vec3f(0.0);
    // Sixteen units in the last place.
    let slack = 1.0e-6 * (abs(ray.o.x) + abs(ray.o.y) + abs(ray.o.z) + reach);
    let against = select(vec3f(slack), vec3f(-slack), backwards);
    return Slabs(ray.o + against, ray.o - against, inverse, backwards);
}

// Whether the ray meets the box no farther than t.
fn meets_box(s: Slabs, low: vec3f, high: vec3f, t: f32) -> bool {
    let enter = (select(low, high, s.backwards) - s.enter) * s.inverse;
    let leave = (select(high, low, s.backwards) - s.leave) * s.inverse;
    let near = max(max(enter.x, enter.y), max(enter.z, 0.0));
    let far = min(min(leave.x, leave.y), min(leave.z, t));
    // Distances have errors of their own.
    return near * 0.99999 <= far;
}
