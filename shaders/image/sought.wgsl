// The part of the path loop that seeks lights in mirror balls: see mirror_ball.wgsl.

// After this many turns of the path loop, all paths that wait to be sent are sent together. Few paths are sent, and a software adapter
// runs a branch for all lanes as soon as one lane needs it. src/kernel/images.rs puts a loop over these turns around the vertex of
// path.wgsl. 8 and 12 were equally fast; 2, 4, 6 and 16 were slower.
const TURNS: u32 = 8u;

struct ImageTrail {
    // What the path remembers of its last vertices: see mirror_ball.wgsl.
    memory: u32,
    // The path waits to be sent to an image. Until then the direction of its ray holds two random numbers and the image's number.
    sends: bool,
    // The normal where its ray starts.
    normal: vec3f,
}

fn begin_trail(path: ptr<function, Path>, ended: bool) {
    path.trail.memory = select(path.trail.memory, FREE, ended);
    path.trail.sends = path.trail.sends && !ended;
}

fn is_sent(trail: ImageTrail) -> bool {
    return trail.memory >= SENT;
}

// A path that was sent to an image ends at every surface that is not a mirror.
fn trail_goes_on(trail: ImageTrail, x: ptr<function, Interaction>) -> bool {
    return !is_sent(trail) || is_mirror(x.material);
}

// At a diffuse surface: chooses whether the path is sent to an image. At a mirror: checks that a path that was sent has met the right
// mirror. Returns whether the path has gone astray.
fn follow_images(path: ptr<function, Path>, x: ptr<function, Interaction>, light_weights: f32, u: Draws, s: ptr<function, Scattered>) -> bool {
    let diffuse = is_diffuse(x.material);
    let mirror = is_mirror(x.material);
    let image = choose_image(x.p, x.n, light_weights, u.lobe);
    let chooses = diffuse && path.depth + 1u < LAST_DEPTH;
    let taken = chooses && image.taken;
    s.wi = select(s.wi, vec3f(u.direction, f32(image.index)), taken);
    s.weight *= select(1.0, image.inverse_probability, chooses) * select(1.0, INV_PI, taken);
    s.specular = s.specular || taken;
    let left = select(FREE, select(FROM_DIFFUSE, image_memory(image.index), taken), diffuse);
    let memory = select(left, after_mirror(path.trail.memory, x.number, x.cos_o), mirror);
    path.trail = ImageTrail(memory, taken, x.n);
    return mirror && memory == ASTRAY;
}

// Gives a path that is sent to an image its direction.
fn send(path: ptr<function, Path>) {
    let choice = path.ray.d;
    let index = u32(choice.z);
    let image = sample_image(path.ray.o, image_ball(index), image_light(index), choice.xy);
    let weight = fmax(dot(path.trail.normal, image.d), 0.0) * image.inverse_pdf;
    path.beta *= weight;
    path.ray.d = select(path.trail.normal, image.d, weight > 0.0);
    path.trail.sends = false;
}
