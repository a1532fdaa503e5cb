// A walk through a tree of boxes, whose leaves name a surface.
// A template: src/kernel/trees.rs fills in the names that begin with a dollar sign, once for the nearest hit and once for shadow rays.

fn $walk(start: Ray, first: Hit) -> Hit {
    let near = approach(start, record($header));
    let ray = near.ray;
    var hit = brought_near(first, near);
    let slabs = slabs_of(ray);
    var at = Place(1u, 0u);
    while at.node != 0u && $goes_on trips_left > 0u {
        trips_left -= 1u;
        // Goes to the next leaf whose box is met. A test of the leaf inside this loop would take its time at every visit, even if it
        // is masked off.
        var item = 0u;
        while at.node != 0u && item == 0u && trips_left > 0u {
            trips_left -= 1u;
            at = $walk_visit(slabs, at, hit.t, &item);
        }
        if item != 0u {
            let i = (item >> 1u) - 1u;
            let s = surface_at(i << 2u);
            hit = $keep(hit, $call, item);
        }
    }
    return put_back(hit, near, first);
}

fn $walk_visit(slabs: Slabs, at: Place, t: f32, item: ptr<function, u32>) -> Place {
    let place = four_records($nodes + at.node);
    let a = textureLoad(records, place);
    let b = textureLoad(records, place + vec2u(1u, 0u));
    let c = textureLoad(records, place + vec2u(2u, 0u));
    let low_0 = bitcast<vec3f>(a.xyz);
    let high_0 = bitcast<vec3f>(vec3u(a.w, b.xy));
    let low_1 = bitcast<vec3f>(vec3u(b.zw, c.x));
    let high_1 = bitcast<vec3f>(c.yzw);
    let leaf = c.w == LEAF;
    *item = select(0u, a.x, leaf);
    let entry_0 = select(box_entry(slabs, low_0, high_0, t), MISSED, leaf);
    let entry_1 = select(box_entry(slabs, low_1, high_1, t), MISSED, leaf);
    return onward(at, entry_0, entry_1);
}
