// An implicit surface: where a formula has the value 0, within bounds. Or the solid where it is less.
// A template: src/kernel/emit/implicit.rs fills in the names that begin with a dollar sign, once for each surface. $formula is the
// formula along a part of the ray, in affine arithmetic, and $sloped its gradient.
//
// A ray takes part after part, from its start on. Affine arithmetic says of each that there is no root; or from which place on there may
// be one, and before which one there must be. What is left of the part is looked at again, down to the tolerance: near a simple root its
// length is squared each time. So no root is passed over, however thin the solid. Where rounding is larger than what the formula changes
// by, as at double roots, it ends at the least part, which counts as met if the ray does not lead out of the solid there.
//
// A ray that stands on the surface starts at a root. The part in which the formula can't be told from 0 because of that is left out: it
// is a few roundings divided by the slope.

fn $name(hit: Hit, ray: Ray) -> Hit {
    let v = ray.o - $center;
    let origin = vec3f(dot($row_x, v), dot($row_y, v), dot($row_z, v));
    let w = vec3f(dot($row_x, ray.d), dot($row_y, ray.d), dot($row_z, ray.d));
    let span = $span;
    let inside = $inside;
    let on_surface = ray.face == $key + 1u;
    let begin = select(fmax(span.x, 0.0), 0.0, inside);
    let finish = fmax(span.y, 0.0);
    let end = fmin(finish, hit.t) - begin;
    let asked = $asked && (inside || (span.x <= span.y && end > 0.0 && ray.face != $key + 2u));
    let q = origin + begin * w;

    // The start of the ray.
    let first = $formula(q + $least * w, $least * w, $slack);
    let slope = first.y / $least;
    let known = select(first.x < 0.0, first.y < 0.0, on_surface);
    let sign = $sign;
    let leaving = on_surface && begin < $zone;
    let beyond = sign * first.x + abs(first.y) + first.z < 0.0 && !leaving && $solid;
    // How far back the ray has passed the bounds, and the surface.
    let by_cap = -span.x * abs(slope) < abs(first.x) && !inside;

    var a = select(0.0, clamp(4.0 * first.z / fmax(abs(slope), TINY), 2.0 * $least, $zone), leaving);
    var stride = select(0.3 * end, $first_step, leaving);
    // The formula has been seen to have the sign that it has outside.
    var clear = !leaving;
    var met = beyond;
    var t = 0.0;
    var turns = 0u;
    // The formula's rounding error near the surface: the least that a part has had. Where the ray starts it may be a thousand times larger.
    var noise = first.z;
    while asked && !met && a < end && turns < $most_turns && trips_left > 0u {
        trips_left -= 1u;
        turns += 1u;
        let b = fmin(a + stride, end);
        let length = b - a;
        let half = 0.5 * length;
        let middle = a + half;
        let f = $formula(q + middle * w, half * w, $slack);
        noise = fmin(noise, f.z);
        let height = sign * f.x;
        let rise = sign * f.y;
        let free = height - abs(rise) > f.z;
        let free_at_a = height - rise > f.z;
        let crossed = height + rise < -f.z;

        // The part in which the first root may be.
        let inverse = 1.0 / fmax(abs(rise), TINY);
        let may = select(a, fmax(middle + half * (height - f.z) * inverse, a), free_at_a);
        let must = select(b, fmax(middle + half * (height + f.z) * inverse, may), crossed);
        clear = clear || free_at_a;
        // It is good enough, or rounding alone is left.
        let found = crossed && clear && (must - may <= $tolerance || f.z <= 2.0 * noise);
        // Along the surface rounding alone would be looked at, again and again.
        let blurred = !clear && f.z <= 4.0 * noise;
        // A ray may run beside the surface, as near as rounding, for hundreds of least parts. So the least part grows from the 48th on, to 512
        // times its length.
        let least = $least * exp2(clamp(0.25 * (f32(turns) - 48.0), 0.0, 9.0));
        let smallest = length <= select(least, fmax(least, 0.5 * a), blurred);
        let ends_here = crossed || (clear && rise <= 0.0);
        met = !free && (found || (smallest && ends_here));
        t = select(may, 0.5 * (may + must), found);

        // The next part: as long as should be free, by what the formula bends here; a little longer where a root is near.
        let skips = free || (smallest && !ends_here);
        let bend = fmax(f.z - noise, TINY) / (half * half);
        let down = fmax(-rise, 0.0) / half;
        let left = fmax(select(0.5 * (f.z - noise), height + rise - noise, skips), noise);
        let bent = bend * left;
        let level = down * down;
        let next = left * select(1.4 / (down + sqrt(level + bent)), 1.8 / fmax(down, TINY), bent < 0.3 * level);
        let rest = b - may;
        let shorter = select(
            select(0.5 * length, clamp(next, 0.25 * rest, 0.75 * rest), free_at_a),
            fmin(must - may, 0.5 * length),
            crossed
        );
        stride = fmax(select(shorter, fmin(next, 16.0 * length), skips), 0.5 * least);
        a = select(may, b, skips);
    }
    // Whoever has no turns left meets what there may be.
    let tired = !met && a < end && turns >= $most_turns;
    met = asked && (met || tired);
    let surface = nearer(hit, met, begin + select(t, a, tired), $key + select(0u, 1u, beyond && by_cap));
    return $result;
}

// Where a ray of direction d has met it, near p.
fn $name_vertex(cap: bool, p: vec3f, d: vec3f) -> Vertex {
    let v = p - $center;
    let start = vec3f(dot($row_x, v), dot($row_y, v), dot($row_z, v));
    // Newton's method along the gradient. Far from a root it would lead away.
    var q = start;
    var f = $sloped(q);
    for (var k = 0u; k < $newton; k++) {
        let n = unit_or(f.xyz, vec3f(0.0));
        let stride = n * (f.w / fmax(abs(dot(f.xyz, n)), TINY));
        q -= select(vec3f(0.0), stride, dot(stride, stride) < $reach * $reach);
        f = $sloped(q);
    }
    let bounds = $onto;
    let moved = select(q, bounds.p, cap) - start;
    let n = select(f.xyz, bounds.n, cap);
    return Vertex(
        p + moved.x * $column_x + moved.y * $column_y + moved.z * $column_z,
        unit_or(n.x * $column_x + n.y * $column_y + n.z * $column_z, -d)
    );
}
