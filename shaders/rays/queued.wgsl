// Rays wait in a queue, and one walk through the tree takes all of them: the shadow ray of the last vertex; the path's own ray; and if
// that meets nothing, which ends the path, the camera ray of the next path. Lanes that run in step wait for each other once, not
// three times, and few of them have nothing to shade. Every sample is the same as with rays/one_by_one.wgsl.

// The shadow ray of the last vertex.
struct ShadowRay {
    ray: Ray,
    // How far away the light is, and what the path gathers of it if nothing is in between.
    distance: f32,
    radiance: vec3f,
    waits: bool,
}
var<private> shadow_ray: ShadowRay;

// The path that has ended waits for its shadow ray, and `path` is already the next one. Its radiance is still in `path`.
var<private> sample_waits: bool = false;

// What the path's ray meets. If it is nothing, `path` is the next one, and this is what its camera ray meets.
fn next_hit(path: ptr<function, Path>, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) -> Hit {
    let sample = film.s + select(0u, 1u, sample_waits);
    let glances = glances_after(path, sight);
    let following = sample + select(1u, 0u, is_glance(path));
    let spare = camera_path(pixel, following, glances, sight);
    // After the last sample only its shadow ray is left.
    let wanted = sample < film.end;
    let traced = trace(Queue(
        shadow_ray.ray,
        shadow_ray.distance,
        shadow_ray.waits,
        path.ray,
        wanted,
        path.depth == 1u,
        spare,
        following < film.end,
        entry_of(pixel.place)
    ));
    let lost = spend_trips(false);

    path.radiance += select(vec3f(0.0), shadow_ray.radiance, shadow_ray.waits & !traced.blocked);
    shadow_ray.waits = false;
    end_sample(path, film, sample_waits & !lost);
    sample_waits = false;

    let passed = traced.passed & !lost;
    count_ray(film, passed);
    end_sample(path, film, passed & !is_glance(path));
    begin_path(path, passed, spare, glances, path.radiance);
    count_ray(film, wanted);
    return Hit(traced.hit.t, select(NONE, traced.hit.key, wanted));
}

// Adds the sample of a path that has `ended`.
fn end_sample(path: ptr<function, Path>, film: ptr<function, PixelFilm>, ended: bool) {
    add_sample(film, path.radiance, ended);
    keep_counts(film, ended);
    path.radiance = select(path.radiance, vec3f(0.0), ended);
}

// Puts a shadow ray into the queue, if none of the surfaces outside the tree blocks it.
fn is_lit(shadow: Ray, distance: f32, light: u32) -> bool {
    let waits = !occluded_apart(shadow, distance, light);
    shadow_ray.ray = shadow;
    shadow_ray.distance = distance;
    shadow_ray.waits = waits;
    return waits;
}

// Remembers what the shadow ray brings, if it `counts`.
fn gather(path: ptr<function, Path>, direct: vec3f, counts: bool) {
    shadow_ray.radiance = direct;
    shadow_ray.waits = shadow_ray.waits & counts;
}

// Starts the next path if this one has ended.
fn next_path(path: ptr<function, Path>, lives: bool, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) {
    sample_waits = !lives & !is_glance(path);
    let glances = glances_after(path, sight);
    let s = film.s + select(0u, 1u, sample_waits);
    begin_path(path, !lives, camera_path(pixel, s, glances, sight), glances, path.radiance);
}
