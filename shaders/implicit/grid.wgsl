// An isosurface: where the trilinear function between the numbers of a volume has the value 0, or the solid where it is less.
// A template: src/kernel/emit/grid.rs fills in the names that begin with a dollar sign, once for each surface. Coordinates count cells.
//
// A ray goes from cube to cube. A texture says of each cell how large the aligned cube of cells around it is that has no root: what a
// min-max hierarchy [Wald2005] says of one level, read in one step. In a cell that may have one the function along the ray is a cubic.
//
// No ray slips between cells. Neighbours share their values, and a ray that comes into a cell on the other side of the level than it
// should be on has met the surface there, whatever rounding made of the cell before.
//
// A ray that stands on the surface starts at a root. That one is divided out of the cubic, until the ray is clear of the surface by more
// than roundings.

fn $name_height(c: vec3i) -> f32 {
    return $height;
}

fn $name_cell(c: vec3i) -> Cell {
    let at = clamp(c, vec3i(0), $last);
    return Cell(
        vec4f($name_height(at), $name_height(at + vec3i(1, 0, 0)), $name_height(at + vec3i(0, 1, 0)), $name_height(at + vec3i(1, 1, 0))),
        vec4f($name_height(at + vec3i(0, 0, 1)), $name_height(at + vec3i(1, 0, 1)), $name_height(at + vec3i(0, 1, 1)), $name_height(at + vec3i(1, 1, 1)))
    );
}

fn $name_cube(c: vec3i) -> u32 {
    return textureLoad($name_cubes, clamp(c, vec3i(0), $last), 0).x;
}

fn $name(hit: Hit, ray: Ray) -> Hit {
    let v = ray.o - $center;
    let origin = vec3f(dot($row_x, v), dot($row_y, v), dot($row_z, v));
    let w = vec3f(dot($row_x, ray.d), dot($row_y, ray.d), dot($row_z, ray.d));
    let span = span_of_box(origin, w, vec3f(0.0), $cells);
    let inside = $inside;
    let begin = select(fmax(span.x, 0.0), 0.0, inside);
    let finish = fmax(span.y, 0.0);
    let end = fmin(finish, hit.t) - begin;
    let asked = $asked && (inside || (span.x <= span.y && end > 0.0 && ray.face != $key + 2u));
    let q = clamp(origin + begin * w, vec3f(0.0), $cells);
    let inverse = 1.0 / select(w, select(vec3f(-1.0e-20), vec3f(1.0e-20), w >= vec3f(0.0)), abs(w) < vec3f(1.0e-20));

    // The start of the ray.
    var cell = clamp(vec3i(q), vec3i(0), $last);
    let corners = $name_cell(cell);
    let start = cell_sloped(corners, q - vec3f(cell));
    let height = start.w;
    let slope = dot(start.xyz, w);
    let leaving = ray.face == $key + 1u && begin * fmax(abs(w.x), fmax(abs(w.y), abs(w.z))) < $near;
    let known = select(height < 0.0, slope < 0.0, leaving);
    let sign = $sign;
    let noise = $noise * largest_of(corners);
    let beyond = sign * height < -noise && !leaving && $solid;
    // How far back the ray has passed the bounds, and the surface.
    let by_cap = -span.x * abs(slope) < abs(height) && !inside;

    // The side of the level on which cubes are passed.
    let over = $positive == (sign > 0.0);
    // The function has been seen to have the sign that it has before the surface.
    var clear = !leaving && sign * height > noise;
    var a = 0.0;
    var t = 0.0;
    var met = beyond;
    var goes = asked && !met && end > 0.0;
    while goes && trips_left > 0u {
        trips_left -= 1u;
        var cube = $name_cube(cell);
        var free = cube > 0u && (cube < $below) == over;
        while goes && free && trips_left > 0u {
            trips_left -= 1u;
            let next = beyond_cube(q, w, inverse, cell, (cube & ($below - 1u)) - 1u, a, $last);
            a = next.t;
            cell = next.cell;
            clear = true;
            goes = a < end && all(cell >= vec3i(0)) && all(cell <= $last);
            cube = $name_cube(cell);
            free = cube > 0u && (cube < $below) == over;
        }

        // A cell with a root, perhaps.
        let next = beyond_cube(q, w, inverse, cell, 0u, a, $last);
        let b = fmin(next.t, end);
        let corner = vec3f(cell);
        let enter = clamp(q + a * w - corner, vec3f(0.0), vec3f(1.0));
        let leave = clamp(q + b * w - corner, vec3f(0.0), vec3f(1.0));
        let values = $name_cell(cell);
        let cubic = sign * cell_cubic(values, enter, leave);
        let blur = $noise * largest_of(values);
        // By the end of the cell before it has fallen by more than roundings.
        let fallen = cubic.x <= select(-blur, 0.0, clear) && (clear || a > 0.0);
        let u = select(select(root_after_start(cubic, blur), first_root(cubic), clear), 0.0, fallen);
        met = goes && u <= 1.0;
        t = select(t, a + u * (b - a), met);
        clear = clear || cubic.w > blur;
        a = b;
        cell = next.cell;
        goes = goes && !met && a < end && all(cell >= vec3i(0)) && all(cell <= $last);
    }
    met = asked && met;
    let surface = nearer(hit, met, begin + t, $key + select(0u, 1u, beyond && by_cap));
    return $result;
}

// Where a ray of direction d has met it, near p.
fn $name_vertex(cap: bool, p: vec3f, d: vec3f) -> Vertex {
    let v = p - $center;
    let start = vec3f(dot($row_x, v), dot($row_y, v), dot($row_z, v));
    let cell = clamp(vec3i(start), vec3i(0), $last);
    let corner = vec3f(cell);
    let values = $name_cell(cell);
    // Newton's method along the gradient, which is that of the scene's lengths. Far from a root it would lead away.
    var q = start;
    var f = cell_sloped(values, q - corner);
    for (var k = 0u; k < $newton; k++) {
        let n = f.xyz * $metric;
        let stride = n * (f.w / fmax(dot(f.xyz, n), TINY));
        q -= select(vec3f(0.0), stride, dot(stride, stride) < $reach * $reach);
        f = cell_sloped(values, q - corner);
    }
    let bounds = onto_box(start, 0.5 * $cells, 0.5 * $cells);
    let moved = select(q, bounds.p, cap) - start;
    let n = select(f.xyz, bounds.n, cap);
    return Vertex(
        p + moved.x * $column_x + moved.y * $column_y + moved.z * $column_z,
        unit_or(n.x * $normal_x + n.y * $normal_y + n.z * $normal_z, -d)
    );
}
