// Light of bulbs, sampled from outside: shadow rays that glass refracts on their way.
//
// A path that has scattered outside and meets the light on one of the sampled ways has its light from here; on glossy surfaces both are
// weighed. Light that the shells have reflected more often is left to chance and to light paths.

// What a path must know of the last vertex that scattered into more than one direction.
struct BulbTrail {
    // Where it is, and the density of the direction in which it was left.
    p: vec3f,
    pdf: f32,
    // How many specular vertices have followed. The surface of the first of them, if the path crossed it.
    vertices: u32,
    entered: u32,
    // How many of them reflected the path, and the surface of the last one that did.
    reflections: u32,
    by: u32,
}

fn follow_bulbs(path: ptr<function, Path>, x: ptr<function, Interaction>, scattered: Scattered) {
    path.bulbs.p = select(x.p, path.bulbs.p, scattered.specular);
    path.bulbs.pdf = select(scattered.pdf, path.bulbs.pdf, scattered.specular);
    let reflected = scattered.medium == x.medium;
    let trail = path.bulbs;
    path.bulbs.entered = select(trail.entered, select(x.number, NONE, reflected), trail.vertices == 0u);
    path.bulbs.by = select(trail.by, x.number, reflected);
    path.bulbs.vertices = select(0u, trail.vertices + 1u, scattered.specular);
    path.bulbs.reflections = select(0u, trail.reflections + select(0u, 1u, reflected), scattered.specular);
}

// Adds the light of one bulb to the path's radiance.
fn gather_bulbs(asks: bool, path: ptr<function, Path>, x: ptr<function, Interaction>, u: Draws, film: ptr<function, PixelFilm>) {
    let chosen = choose_bulb(x.p, u.light);
    let bulb = bulb_of(chosen.light);
    let light = light_at(chosen.light);
    let circle = unit_circle(u.light_point.y) * (light.radius * sqrt(u.light_point.x));
    let y = light.center - bulb.center + from_frame(light.normal, vec3f(circle, 0.0));
    let reflected = u.spare < bulb.reflected;
    let half = select(BULB_INNER, BULB_OUTER, (bulb.shells == 1u) | (u.spare < 0.5 * bulb.reflected));
    let way = select(BULB_STRAIGHT, half, reflected);
    let plane = bulb_plane(bulb, y, x.p - bulb.center);
    let far = 1.0 / fmax(bulb.indices.y * plane.distance, TINY);
    let leaves = leaving_angle(bulb, plane, far, way);
    let ray = bulb_ray(bulb, plane, leaves, far, way);
    let hidden = meets_own_light(bulb, plane, leaves, way, light, light.center - bulb.center);
    let inverse_pdf = bulb_inverse_pdf(bulb, ray, light, way) * chosen.inverse_probability;
    let bsdf = evaluate_bsdf(x, ray.d);
    let f_cos = bsdf.f_cos * select(1.0, power_heuristic(inverse_pdf, bsdf.pdf), MIS);
    let last = path.depth + vertices_on(way, bulb.shells);
    let traced = asks & (dot(x.n, ray.d) > 0.0) & (inverse_pdf > 0.0) & (x.medium == bulb.medium)
        & (last < LAST_DEPTH) & keeps(last) & !hidden;
    count_ray(film, traced);
    // This is a branch on purpose: walks through trees are long.
    var lit = false;
    if traced {
        lit = (intersect(Ray(x.p, ray.d, x.face, x.medium, NO_FACE)).key >> 2u) == bulb.surface;
    }
    let radiance = path.beta * (f_cos * light.radiance * ray.transmitted * inverse_pdf);
    path.radiance += select(vec3f(0.0), radiance, lit);
    note_hidden(film, false, BULBS_ARE_ALL & lit & is_hidden(path) & any(radiance > vec3f(0.0)));
}

// 1 / the density per solid angle of the receiver with which a ray is sampled, if its bulb is chosen.
fn bulb_inverse_pdf(bulb: Bulb, ray: BulbRay, light: DiskLight, way: u32) -> f32 {
    let each = bulb.reflected * select(0.5, 1.0, bulb.shells == 1u);
    let probability = select(each, 1.0 - bulb.reflected, way == BULB_STRAIGHT);
    let size = light.radius * ray.per_length;
    return ray.spread * dot(ray.leaves, light.normal) * (PI * size * size / fmax(probability, TINY));
}

// The share of a light met by chance that counts: `share`, unless it was sampled.
fn share_beside_bulbs(path: ptr<function, Path>, hit: Hit, light: DiskLight, index: u32, share: f32) -> f32 {
    let bulb = bulb_of(index);
    let trail = path.bulbs;
    let inner = (bulb.shells == 2u) & (trail.vertices == vertices_on(BULB_INNER, bulb.shells));
    let way = select(select(BULB_OUTER, BULB_INNER, inner), BULB_STRAIGHT, trail.reflections == 0u);
    let once = (bulb.reflected > 0.0) & (trail.reflections == 1u) & (trail.entered == bulb.surface)
        & ((trail.by == bulb.surface) | (trail.by == bulb.inner_surface));
    let sampled = !path.all_specular & (bulb.shells > 0u) & ((trail.reflections == 0u) | once)
        & (trail.vertices == vertices_on(way, bulb.shells));
    var weight = 0.0;
    if MIS {
        let y = path.ray.o + hit.t * path.ray.d - bulb.center;
        let plane = bulb_plane(bulb, y, trail.p - bulb.center);
        let leaves = -vec2f(dot(plane.along, path.ray.d), dot(plane.across, path.ray.d));
        let ray = bulb_ray(bulb, plane, leaves, 1.0 / fmax(bulb.indices.y * plane.distance, TINY), way);
        let inverse_pdf = bulb_inverse_pdf(bulb, ray, light, way) / bulb_probability(index, trail.p);
        weight = 1.0 - power_heuristic(inverse_pdf, trail.pdf);
    }
    return select(share, weight, sampled);
}
