// Branches: see control/branching.wgsl.

fn advance_if(meets: bool, path: ptr<function, LightPath>, hit: Hit, work: ptr<function, Work>) -> bool {
    var lives = false;
    if meets {
        lives = advance(path, true, hit, work);
    }
    return lives;
}
