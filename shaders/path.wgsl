// The path loop. Every invocation takes one pixel through a range of samples.

struct Path {
    ray: Ray,
    // Product of f cos / pdf at the vertices so far, over the chances of surviving roulette.
    beta: vec3f,
    // The greatest channel of beta where the path first scattered into more than one direction; 1 before.
    shown: f32,
    // Radiance gathered so far.
    radiance: vec3f,
    // Number of the vertex that `ray` will meet. The first one after the eye has 1.
    depth: u32,
    // The last scattering was specular, or there was none: light met by chance counts in full.
    specular: bool,
    // Every scattering so far was specular.
    all_specular: bool,
    // What light met by chance is weighed against: the density of the last scattering per solid angle, or 0 if light sampling
    // alone counts there; what that vertex is to lights; and the sum of the weights of all lights there.
    pdf: f32,
    receiver: Receiver,
    light_weights: f32,
    // Whitted's integrator: only a light counts from here on.
    only_lights: bool,
    // Glances still to be sent before the path itself, this one included: see glance/.
    glances: u32,
    // What light that is met by chance is weighed against beside light samples: see light_path/ and bulb/.
    trail: LightTrail,
    bulbs: BulbTrail,
}

@compute @workgroup_size(64)
fn render(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let pixel = pixel_of(group.x, lane);
    if any(pixel.texel >= params.size) {
        return;
    }
    var film: PixelFilm;
    load_pixel(pixel, &film);
    let sight = sight_of(film.mark);
    begin_trips();
    keep_counts(&film, true);
    var path: Path;
    begin_path(&path, true, camera_path(pixel, film.s, sight.glances, sight), sight.glances, vec3f(0.0));
    // One vertex of a path a turn. The host keeps the turns below the driver's limit on loop trips, or the kernel counts them.
    while film.s < film.end && trips_remain() {
        // Meet the next surface.
        let hit = next_hit(&path, pixel, sight, &film);
        let meets_light = hit.key < LIGHT_KEYS;

        // A light ends the path.
        if meets_light & sees_lights(&path, sight) {
            let light = path.beta * emission(&path, hit) * share_of_light(&path, sight);
            path.radiance += light;
            note_hidden(&film, false, is_hidden(&path) & path.specular & any(light > vec3f(0.0)));
        }

        // A surface sends it on, or ends it. Some surface there always is, whatever was met: lanes that met none go through the
        // motions.
        let meets_surface = !meets_light & (hit.key != NONE) & looks_on(&path, sight);
        let met = Hit(hit.t, select(0u, hit.key, meets_surface));
        let lives = scatter_if(meets_surface, &path, met, pixel, sight, &film);
        next_path(&path, lives, pixel, sight, &film);
    }
    store_pixel(pixel, &film);
}

// The camera ray of sample s of the pixel, or of a glance of it.
fn camera_path(pixel: Pixel, s: u32, glances: u32, sight: Sight) -> Ray {
    return camera_ray(pixel.place, film_position(pixel.key, s, params.seed, glances, sight.across));
}

// Begins another path along `ray` if the last one has `ended`, with the radiance that glances have `seen`. The fields left out are
// not read before the first scattering sets them.
fn begin_path(path: ptr<function, Path>, ended: bool, ray: Ray, glances: u32, seen: vec3f) {
    path.ray.o = select(path.ray.o, ray.o, ended);
    path.ray.d = select(path.ray.d, ray.d, ended);
    path.ray.face = select(path.ray.face, ray.face, ended);
    path.ray.medium = select(path.ray.medium, ray.medium, ended);
    path.beta = select(path.beta, vec3f(1.0), ended);
    path.shown = select(path.shown, 1.0, ended);
    path.radiance = select(path.radiance, seen, ended);
    path.depth = select(path.depth, 1u, ended);
    path.specular = path.specular | ended;
    path.all_specular = path.all_specular | ended;
    path.only_lights = path.only_lights & !ended;
    path.glances = select(path.glances, glances, ended);
    begin_trail(path, ended);
}
