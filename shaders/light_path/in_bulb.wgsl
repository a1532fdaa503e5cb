// Light paths from lights in bulbs: see bulb/.

// The bulb of a light: how many shells it has, or 0 if there is none; and the numbers of their surfaces.
struct BulbShells {
    count: u32,
    inner: u32,
    outer: u32,
    // Light that they reflect once is sampled too.
    reflected: bool,
}

// Whether paths from the eye sample the light that has come to this vertex, the first one that scatters.
fn is_from_bulb(path: ptr<function, LightPath>) -> bool {
    let bulb = path.bulb;
    let vertices = path.depth - 1u;
    let straight = (path.reflections == 0u) & (vertices == bulb.count);
    let inner = (bulb.count == 2u) & (vertices == vertices_on(BULB_INNER, bulb.count));
    let once = bulb.reflected & (path.reflections == 1u) & (path.crossed == bulb.outer)
        & ((path.by == bulb.outer) | (path.by == bulb.inner))
        & (inner | (vertices == vertices_on(BULB_OUTER, bulb.count)));
    return straight | once;
}
