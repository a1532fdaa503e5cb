// What happens to a path where it meets a surface.
//
// A device whose lanes run in step goes through both sides of every branch, and what a branch sets inside a loop stays in registers all
// the way round. So this text selects. Where the compiler wants branches, control/branching.wgsl and the generated functions of
// the materials have them.

// Gathers direct light at `hit` and sends the path on. False if the path ends there, or meets no surface.
fn scatter(path: ptr<function, Path>, meets: bool, hit: Hit, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) -> bool {
    var x = interaction(path.ray, hit, way_at_glass(path, pixel, film.s, sight));
    let specular = is_specular(x.material);

    // Does it end here? The vertex on the light counts too, so nothing can be gathered beyond the last one.
    let wanted = meets & !(WHITTED & path.only_lights) & (specular | !is_glance(path));
    let last = path.depth >= LAST_DEPTH;
    count_truncated(film, COUNT_TRUNCATED & last & wanted);
    note_further(film, meets & !path.all_specular);
    note_hidden(film, meets & is_hidden(path), false);
    let goes_on = wanted & !last;

    // Direct light, where the surface scatters into more than one direction.
    let key = vec4u(pixel.key, film.s, path.depth, vertex_seed(path));
    let u = draw_vertex(key, path.all_specular, is_glossy(x.material));
    let receiver = receiver_at(&x);
    let direct = direct_light_if(goes_on & !specular, &x, receiver, key, u, path.depth, film);
    // Not even zero is added where nothing is asked: beta may have left f32.
    let gathered = path.beta * (direct.radiance * light_scale(x.medium));
    gather(path, gathered, goes_on & !specular);
    gather_bulbs_if(goes_on & !specular, path, &x, u, film);
    path.only_lights = path.only_lights | (WHITTED & !specular);

    // A new direction.
    let scattered = sample_bsdf(&x, u);
    follow_trail(path, &x, hit.t, scattered);
    follow_bulbs(path, &x, scattered);
    path.ray = Ray(x.p, scattered.wi, x.face, scattered.medium, NO_FACE);
    path.specular = scattered.specular;
    path.pdf = scattered.pdf;
    path.receiver = receiver;
    path.light_weights = direct.weights;
    path.depth += 1u;
    return survives_roulette(path, scattered, u.roulette) && goes_on;
}

// Share of `shown` below which a path may be ended. By squared error 0.85 and 1 had 0.88 to 1.08 and 0.80 to 1.12 of the efficiency of
// 0.7, and ending what is below 1 from the fifth vertex on, whatever is shown, 0.72 to 1.01.
const ROULETTE_SHARE: f32 = 0.7;

// Russian roulette ends paths that carry little beside what the pixel shows. What it shows is in proportion to beta where the path
// first scattered into more than one direction, so a dark thing in a bright room is no noisier than a bright one.
fn survives_roulette(path: ptr<function, Path>, scattered: Scattered, u: f32) -> bool {
    let beta = path.beta * scattered.weight;
    let brightest = fmax(fmax(beta.x, beta.y), beta.z);
    let all_specular = path.all_specular & scattered.specular;
    path.shown = select(path.shown, brightest, path.all_specular & !all_specular);
    path.all_specular = all_specular;
    // Glances are few and short, and what they show is to be free of noise.
    let survival = select(fmin(1.0, brightest / fmax(ROULETTE_SHARE * path.shown, TINY)), 1.0, is_glance(path));
    path.beta = beta * (1.0 / fmax(survival, TINY));
    return brightest > 0.0 && u < survival;
}
