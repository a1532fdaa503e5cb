// Smooth normals of an isosurface: by differences of its function over two cells along each axis, less where the volume ends.
// A template: src/kernel/emit/grid.rs fills in the names that begin with a dollar sign.

fn $name_value(q: vec3f) -> f32 {
    let cell = clamp(vec3i(q), vec3i(0), $last);
    return cell_sloped($name_cell(cell), q - vec3f(cell)).w;
}

fn $name_difference(q: vec3f, axis: vec3f) -> f32 {
    let low = max(q - axis, vec3f(0.0));
    let high = min(q + axis, $cells);
    return ($name_value(high) - $name_value(low)) / dot(high - low, axis);
}

// The normal about which light is scattered at p, where the surface's own is n: on the same side.
fn $name_smooth(p: vec3f, n: vec3f) -> vec3f {
    let v = p - $center;
    let q = clamp(vec3f(dot($row_x, v), dot($row_y, v), dot($row_z, v)), vec3f(0.0), $cells);
    let x = $name_difference(q, vec3f(1.0, 0.0, 0.0));
    let y = $name_difference(q, vec3f(0.0, 1.0, 0.0));
    let z = $name_difference(q, vec3f(0.0, 0.0, 1.0));
    let smooth_n = unit_or(x * $normal_x + y * $normal_y + z * $normal_z, n);
    // Where the volume is coarser than what it shows, differences may point anywhere.
    return select(n, smooth_n, dot(smooth_n, n) > 0.0);
}
