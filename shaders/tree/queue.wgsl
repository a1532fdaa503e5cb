// A walk of a whole queue of rays through the trees of one kind of surface: see rays/queued.wgsl.
// A template: see tree/descent.wgsl.

// What the rays of a queue meet.
fn trace(queue: Queue) -> Traced {
    var traced = Traced(intersect_apart(queue.own), false, false);
    let spare_apart = intersect_apart(queue.spare);
    var header = $header;
    var spare_waits = queue.spare_waits;
    while header != 0u && trips_left > 0u {
        trips_left -= 1u;
        let place = four_records(header);
        let around = textureLoad(records, place);
        let tree = textureLoad(records, place + vec2u(1u, 0u));
        header = tree.y;
        let shadow = approach(queue.shadow, around);
        let own = approach(queue.own, around);
        let spare = approach(queue.spare, around);
        let own_slabs = slabs_of(own.ray);
        let spare_slabs = slabs_of(spare.ray);
        let own_hit = brought_near(traced.hit, own);
        let spare_hit = brought_near(spare_apart, spare);
        // Only after all trees is it known that the path's own ray meets nothing.
        spare_waits = spare_waits & (header == 0u);

        var in_shadow = queue.shadow_waits & !traced.blocked;
        var in_spare = false;
        var ray = either_ray(own.ray, shadow.ray, in_shadow);
        var slabs = either_slabs(own_slabs, slabs_of(shadow.ray), in_shadow);
        var hit = either_hit(own_hit, Hit(queue.distance - shadow.moved, NONE), in_shadow);
        // Where they begin.
        let root = vec4u(tree.x, 0u, 0u, 0u);
        let from_eye = select(queue.entry, root, queue.entry.x == AT_ROOTS);
        let own_start = select(vec4u(0u), select(root, from_eye, queue.own_from_eye), queue.own_waits);
        // Neither ray from the eye can meet the tree.
        let past = spare_waits & (own_start.x == 0u) & (own_hit.key == NONE);
        var walk: $walk_place;
        let start = select(own_start, root, in_shadow);
        walk.at = start.x;
        $begin
        while walk.at != 0u && trips_left > 0u {
            trips_left -= 1u;
            $walk_visit(ray, slabs, &walk, &hit);
            // Is it the next one's turn?
            let met = hit.key != NONE;
            let over = walk.at == 0u;
            let to_own = in_shadow & (over | met);
            let to_spare = spare_waits & !in_shadow & !in_spare & over & !met;
            traced.blocked = traced.blocked | (in_shadow & met);
            ray = either_ray(either_ray(ray, own.ray, to_own), spare.ray, to_spare);
            slabs = either_slabs(either_slabs(slabs, own_slabs, to_own), spare_slabs, to_spare);
            hit = either_hit(either_hit(hit, own_hit, to_own), spare_hit, to_spare);
            let again = select(own_start, from_eye, to_spare);
            let begins = to_own | to_spare;
            walk.at = select(walk.at, again.x, begins);
            $again
            in_shadow = in_shadow & !to_own;
            in_spare = in_spare | to_spare;
        }
        hit = either_hit(hit, spare_hit, past);
        in_spare = in_spare | past;
        traced.passed = in_spare;
        traced.hit = either_hit(put_back(hit, own, traced.hit), put_back(hit, spare, spare_apart), in_spare);
    }
    return traced;
}
