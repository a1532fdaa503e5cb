// What a path from the eye must know so that light which it meets by chance can be weighed against light paths [Veach1995].
//
// A light path can arrive like a path from the eye if the eye sees a surface that scatters, and the light is met after mirrors or glass.
// Both sample the same paths. Along mirrors and glass the étendue is conserved, so the ratio of their densities has no term for them: it
// is a factor for each surface that scatters, times the density of light paths at the light. For matt surfaces all factors but that of
// the first one are 1.

struct LightTrail {
    // The ratio, but for the density at the light. 0: no light path can arrive like this one.
    ratio: f32,
    // The specular surface that was met last.
    by: u32,
}

fn begin_trail(path: ptr<function, Path>, ended: bool) {
    path.trail.ratio = select(path.trail.ratio, 0.0, ended);
}

// At a surface that the path met at distance t and leaves as `scattered`.
fn follow_trail(path: ptr<function, Path>, x: ptr<function, Interaction>, t: f32, scattered: Scattered) {
    let along = t * -dot(x.wo, CAMERA_FORWARD);
#if SMOOTH
    let spread = pixel_spread(t, along) / fmax(dot(x.geometric, x.wo), TINY);
#else
    let spread = pixel_spread(t, along) / fmax(x.cos_o, TINY);
#endif
    let first = spread * cos_over_pdf(x, scattered.wi, scattered.pdf);
    let later = path.trail.ratio * turned(x, scattered.wi, scattered.pdf);
#if SMOOTH
    // No light path leaves to where the smooth normal turns away.
    let ratio = select(select(later, first, path.depth == 1u), 0.0, x.cos_o <= 0.0);
#else
    let ratio = select(later, first, path.depth == 1u);
#endif
    path.trail.ratio = select(fmin(ratio, 1.0e30), path.trail.ratio, scattered.specular);
    path.trail.by = select(path.trail.by, x.number, scattered.specular);
}

// Whether the path has scattered where no light path can arrive, for the eye sees that surface in mirrors or glass.
fn is_hidden(path: ptr<function, Path>) -> bool {
    return !path.all_specular & (path.trail.ratio == 0.0);
}

// The weight of a light that was met after mirrors or glass; 1 if no light path could have arrived here.
fn share_of_chance(path: ptr<function, Path>, hit: Hit, light: DiskLight, index: u32) -> f32 {
    let aim = aim_of(path.trail.by);
    let cone = cone_to(aim.center, aim.radius, path.ray.o + hit.t * path.ray.d);
    let density = start_density(cone, -dot(path.ray.d, light.normal), aim_density(index, aim.index));
    let weighs = path.specular & !path.all_specular;
    return 1.0 / (1.0 + select(0.0, path.trail.ratio * density, weighs));
}
