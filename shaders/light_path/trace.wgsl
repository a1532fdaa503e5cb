// Light paths: from a light to a specular surface, and on, as a path from the eye goes. Wherever a surface scatters that the eye sees,
// the light that it sends there is a splat on the film. This finds what paths from the eye hardly ever meet: light that mirrors and glass
// have gathered.
//
// Every splat is weighed against the chance that a path from the eye meets the light: see weighed.wgsl. So it is never brighter than what
// the path carries, however close the eye is.
//
// Splats are listed, and the host adds them up in whole numbers: the sum depends on no order.

struct LightParams {
    // Pass and number in it of the first light path, and how many there are.
    first_pass: u32,
    first_path: u32,
    paths: u32,
    // Light paths of an invocation, invocations, and splats for which each has room.
    each: u32,
    invocations: u32,
    room: u32,
    seed: u32,
    // Loop trips that an invocation may take, and 2: see film.wgsl.
    trips: u32,
    opaque_two: u32,
}

@group(1) @binding(0) var<uniform> params: LightParams;
// Pixel, row by row, plus the replicate in the two highest bits; R, G, B as bits of f32. `room` for each invocation.
@group(1) @binding(1) var<storage, read_write> splats: array<vec4u>;
// Of each invocation: light paths done so far; splats and rays of this dispatch; whether there was no room for another splat.
@group(1) @binding(2) var<storage, read_write> progress: array<vec4u>;

// The work of an invocation.
struct Work {
    // Its first splat's place.
    splats_at: u32,
    // Its light paths from `done` to `end`, and the present one's pass and number.
    done: u32,
    end: u32,
    pass_number: u32,
    number: u32,
    // Splats and rays so far, and when the last light path ended: those of an unfinished one do not count.
    counts: vec2u,
    kept: vec2u,
    // There is no room for another splat.
    full: bool,
}

struct LightPath {
    ray: Ray,
    // The light's radiance, times f cos / pdf at the vertices so far, over the chances of surviving roulette.
    beta: vec3f,
    // What beta was at the start, its greatest channel.
    start: f32,
    // See start_density; and the ratio of the densities with which a path from the eye and this one are scattered, over all vertices.
    density: f32,
    turned: f32,
    // Number of the vertex that `ray` will meet. The first one after the light has 1.
    depth: u32,
    // The surface that the first ray must meet.
    target_surface: u32,
    // How many surfaces have reflected it, the last of these, and the last that it crossed: see bulb/. And the bulb that its light is in.
    reflections: u32,
    by: u32,
    crossed: u32,
    bulb: BulbShells,
}

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3u) {
    let invocation = id.x;
    if invocation >= params.invocations {
        return;
    }
    var work = Work();
    work.splats_at = invocation * params.room;
    work.done = progress[invocation].x;
    work.end = min(params.each, params.paths - invocation * params.each);
    begin_trips();
    var path: LightPath;
    start_path(&path, true, &work, invocation);
    while work.done < work.end && !work.full && trips_remain() {
        // Meet the next surface.
        let hit = intersect(path.ray);
        work.counts.y += 1u;
        let goes_on = (hit.key != NONE) & (hit.key >= LIGHT_KEYS) & ((path.depth > 1u) | ((hit.key >> 2u) == path.target_surface));

        // Add what the eye sees of it, and go on.
        let met = Hit(hit.t, select(0u, hit.key, goes_on));
        let lives = spend_trips(advance_if(goes_on, &path, met, &work)) | work.full;

        // Start the next light path at once.
        work.done += select(1u, 0u, lives);
        work.kept = select(work.counts, work.kept, lives);
        start_path(&path, !lives, &work, invocation);
    }
    progress[invocation] = vec4u(work.done, work.kept, select(0u, 1u, work.full));
}

// Starts another light path if the last one has `ended`.
fn start_path(path: ptr<function, LightPath>, ended: bool, work: ptr<function, Work>, invocation: u32) {
    if ended {
        let n = params.first_path + invocation * params.each + work.done;
        work.pass_number = params.first_pass + n / PHOTONS;
        work.number = n % PHOTONS;
        let u = draw(vec4u(work.number, work.pass_number, 0u, params.seed ^ LIGHT_STREAM));
        let pair = pair_at(u32(u.light * 0x1.0p24));
        let index = pair / AIM_COUNT;
        let light = light_at(index);
        let aim = aim_at(pair % AIM_COUNT);
        let circle = unit_circle(u.light_point.y) * (light.radius * sqrt(u.light_point.x));
        let y = light.center + from_frame(light.normal, vec3f(circle, 0.0));
        let cone = cone_to(aim.center, aim.radius, y);
        let height = u.direction.x * cone.height;
        let narrow = from_frame(cone.axis, vec3f(unit_circle(u.direction.y) * safe_sqrt(height * (2.0 - height)), 1.0 - height));
        let d = select(renormalized(narrow), sample_cosine(light.normal, u.direction), cone.wide);
        let cos = dot(d, light.normal);
        path.ray = Ray(y, d, light.face, light_medium(index), NO_FACE);
        path.beta = light.radiance;
        path.start = fmax(fmax(light.radiance.x, light.radiance.y), light.radiance.z);
        path.density = start_density(cone, cos, aim_density(index, aim.index));
        path.turned = 1.0;
        path.depth = 1u;
        path.reflections = 0u;
        path.bulb = bulb_shells(index);
        // A direction below the horizon meets nothing.
        path.target_surface = select(NONE, aims[AIM_PLACES + 5u * aim.index + 4u], cos > 0.0);
    }
}

// The pair of light and aim that the number `at` below 2^24 chooses.
fn pair_at(at: u32) -> u32 {
    var low = 0u;
    var high = AIM_PAIRS - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        let below = at < aims[AIM_SUMS + middle];
        high = select(high, middle, below);
        low = select(middle + 1u, low, below);
    }
    return low;
}

// Adds the splat of the surface at `hit`, and sends the path on. False if the path ends there, or meets no surface.
fn advance(path: ptr<function, LightPath>, meets: bool, hit: Hit, work: ptr<function, Work>) -> bool {
    var x = interaction(path.ray, hit, BY_CHANCE);
    let specular = is_specular(x.material);
    let u = draw(vec4u(work.number, work.pass_number, path.depth, params.seed ^ LIGHT_STREAM));
    // Light of bulbs is sampled from here, by paths from the eye.
    let sampled = !specular & is_from_bulb(path);
    splat_if(meets & !specular & !sampled & (x.medium == CAMERA_MEDIUM), path, &x, work);

    let scattered = sample_bsdf(&x, u);
    let reflected = scattered.medium == x.medium;
    path.reflections += select(0u, 1u, reflected);
    path.by = select(path.by, x.number, reflected);
    path.crossed = select(x.number, NONE, reflected);
    path.ray = Ray(x.p, scattered.wi, x.face, scattered.medium, NO_FACE);
    path.turned = fmin(path.turned / fmax(turned(&x, scattered.wi, scattered.pdf), TINY), 1.0e30);
    // The vertex on the light counts too.
    let last = path.depth + 1u >= LAST_DEPTH;
    path.depth += 1u;
#if SMOOTH
    let beta = path.beta * (scattered.weight * adjoint(&x, scattered.wi));
#else
    let beta = path.beta * scattered.weight;
#endif
    let brightest = fmax(fmax(beta.x, beta.y), beta.z);
    let survival = fmin(1.0, brightest / fmax(path.start, TINY));
    path.beta = beta * (1.0 / fmax(survival, TINY));
    return meets && !sampled && !last && brightest > 0.0 && u.roulette < survival;
}

// Adds the light that the surface scatters to the eye, if the eye sees it.
fn splat_if(wanted: bool, path: ptr<function, LightPath>, x: ptr<function, Interaction>, work: ptr<function, Work>) {
    let to = CAMERA_EYE - x.p;
    let along = -dot(to, CAMERA_FORWARD);
    let r = length(to);
    let d = to * (1.0 / fmax(r, TINY));
    let place = CAMERA_CENTER - vec2f(dot(to, CAMERA_DX), dot(to, CAMERA_DY)) * (CAMERA_SCALE / fmax(along, TINY));
    let in_view = along > 0.0 && all(place >= vec2f(0.0)) && all(place < 2.0 * CAMERA_CENTER);
#if SMOOTH
    let cos = select(0.0, dot(x.geometric, d), dot(x.n, d) > 0.0);
#else
    let cos = dot(x.n, d);
#endif
    if wanted && in_view && cos > 0.0 {
        let bsdf = evaluate_bsdf(x, d);
        let turns = fmin(path.turned * cos_over_pdf_back(x, d, bsdf.pdf), 1.0e30);
        let ratio = path.density * turns * pixel_spread(r, along);
#if SMOOTH
        let value = path.beta * (bsdf.f_cos * (adjoint(x, d) * turns / fmax(ratio + cos, TINY)));
#else
        let value = path.beta * (bsdf.f_cos * (turns / fmax(ratio + cos, TINY)));
#endif
        let y = value.x + value.y + value.z;
        if y > 0.0 {
            work.counts.y += 1u;
            let hit = intersect(Ray(x.p, d, x.face, x.medium, NO_FACE));
            if hit.t >= r {
                if work.counts.x < params.room {
                    let pixel = vec2u(place);
                    let replicate = work.pass_number / ROUND_SAMPLES % REPLICATES;
                    let index = pixel.y * CAMERA_WIDTH + pixel.x;
                    splats[work.splats_at + work.counts.x] = vec4u(index | (replicate << 30u), bitcast<vec3u>(value));
                    work.counts.x += 1u;
                } else {
                    work.full = true;
                }
            }
        }
    }
}
