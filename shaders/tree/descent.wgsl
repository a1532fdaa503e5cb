// A walk of one ray through the trees of one kind of surface.
// A template: src/kernel/trees.rs fills in the names that begin with a dollar sign, once for the nearest hit and once for shadow rays.
// See tree/visit.wgsl for its steps.

fn $walk(start: Ray, first: Hit) -> Hit {
    var hit = first;
    var header = $header;
    while header != 0u && $goes_on trips_left > 0u {
        trips_left -= 1u;
        let place = four_records(header);
        let here = hit;
        let near = approach(start, textureLoad(records, place));
        let tree = textureLoad(records, place + vec2u(1u, 0u));
        let ray = near.ray;
        let slabs = slabs_of(ray);
        hit = brought_near(here, near);
        var walk: $walk_place;
        walk.at = tree.x;
        while walk.at != 0u && $goes_on trips_left > 0u {
            trips_left -= 1u;
            $walk_visit(ray, slabs, &walk, &hit);
        }
        hit = put_back(hit, near, here);
        header = tree.y;
    }
    return hit;
}
