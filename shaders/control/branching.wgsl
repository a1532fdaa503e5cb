// Branches, for kernels that loop over buffers or walk through trees: their calls are long, and worth skipping. SwiftShader gets no other
// kernels, and its compiler takes minutes for long straight code.

fn scatter_if(meets: bool, path: ptr<function, Path>, hit: Hit, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) -> bool {
    var lives = false;
    if meets {
        lives = scatter(path, true, hit, pixel, sight, film);
    }
    return lives;
}

fn direct_light_if(asks: bool, x: ptr<function, Interaction>, to: Receiver, key: vec4u, u: Draws, depth: u32, film: ptr<function, PixelFilm>) -> DirectLight {
    var direct: DirectLight;
    if asks {
        direct = direct_light(true, x, to, key, u, depth, film);
    }
    return direct;
}

fn gather_bulbs_if(asks: bool, path: ptr<function, Path>, x: ptr<function, Interaction>, u: Draws, film: ptr<function, PixelFilm>) {
    if asks {
        gather_bulbs(true, path, x, u, film);
    }
}
