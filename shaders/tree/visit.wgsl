// One step of a walk: a node or a leaf.
// A template: src/kernel/trees.rs fills in the names that begin with a dollar sign. $walk_leaf is another template, by the kind of surface.

// Where a walk is: the unit of a node or a leaf, and what was put off on the way there, the last first: a word
// for each node on the way, as `put_off` makes it. They are in registers: an array would lie in memory.
struct $walk_place {
    at: u32,
    $words
}

fn $walk_visit(ray: Ray, slabs: Slabs, walk: ptr<function, $walk_place>, hit: ptr<function, Hit>) {
    let place = four_records(walk.at);
    let a = textureLoad(records, place);
    let b = textureLoad(records, place + vec2u(1u, 0u));
    let c = textureLoad(records, place + vec2u(2u, 0u));
    // A leaf sets the distance, and a node reads it. A processor does both at the same time if neither waits for the other.
    let met = children_met(ray.o, slabs, a, b, c, hit.t);
    if !is_node(a) {
        *hit = $walk_leaf(*hit, ray, place, a, b);
    }
    let down = met.x != NO_CHILD;
    let more = put_off(c.z, met);
    let next = walk.put_off_0;
    let rest = without_next(next);
    walk.at = select(next_of(next), c.z + (met.x & 3u), down);
    let push = more != 0u;
    let pop = !down && rest == 0u;
$shift
}
