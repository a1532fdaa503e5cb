// Lights that overlap in one plane: the first hides the others.

// Whether the shadow ray ends on a light that lies in the same plane as number `light` and comes before it.
fn hidden_by_light(ray: Ray, distance: f32, light: u32) -> bool {
    let p = ray.o + distance * ray.d;
    var hidden = false;
    for (var i = 0u; i < light; i++) {
        let before = light_at(i);
        let v = p - before.center;
        hidden = hidden || (before.face == ray.target_face && dot(v, v) <= before.radius * before.radius);
    }
    return hidden;
}
