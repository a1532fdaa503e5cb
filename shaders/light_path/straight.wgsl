// Straight code: see control/straight.wgsl.

fn advance_if(meets: bool, path: ptr<function, LightPath>, hit: Hit, work: ptr<function, Work>) -> bool {
    return advance(path, meets, hit, work);
}
