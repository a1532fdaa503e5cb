// A walk through a tree of disks, whose leaves hold the disks.
// A template: src/kernel/trees.rs fills in the names that begin with a dollar sign, once for the nearest hit and once for shadow rays.

fn $walk(start: Ray, first: Hit) -> Hit {
    let near = approach(start, record($header));
    let ray = near.ray;
    var hit = brought_near(first, near);
    let slabs = slabs_of(ray);
    var at = Place(1u, 0u);
    while at.node != 0u && $goes_on trips_left > 0u {
        trips_left -= 1u;
        // Two visits in each loop trip: older drivers limit the number of trips, and this takes no longer.
        at = $walk_visit(ray, slabs, at, &hit);
        at = $walk_visit(ray, slabs, at, &hit);
    }
    return put_back(hit, near, first);
}

fn $walk_visit(ray: Ray, slabs: Slabs, at: Place, hit: ptr<function, Hit>) -> Place {
    let place = four_records($nodes + at.node);
    let a = textureLoad(records, place);
    let b = textureLoad(records, place + vec2u(1u, 0u));
    let c = textureLoad(records, place + vec2u(2u, 0u));
    let low_0 = bitcast<vec3f>(a.xyz);
    let high_0 = bitcast<vec3f>(vec3u(a.w, b.xy));
    let low_1 = bitcast<vec3f>(vec3u(b.zw, c.x));
    let high_1 = bitcast<vec3f>(c.yzw);
    let leaf = c.w == LEAF;
    if leaf {
        let item = c.x;
        let i = (item >> 1u) - 1u;
        let disk = Disk(low_0, bitcast<f32>(a.w), bitcast<vec3f>(b.xyz), bitcast<f32>(b.w));
        *hit = $keep(*hit, $call, item);
    }
    let entry_0 = select(box_entry(slabs, low_0, high_0, hit.t), MISSED, leaf);
    let entry_1 = select(box_entry(slabs, low_1, high_1, hit.t), MISSED, leaf);
    return onward(at, entry_0, entry_1);
}
