// Mirror reflection.

fn sample_mirror(x: ptr<function, Interaction>, u: Draws) -> Scattered {
    return Scattered(mirrored(-x.wo, x.n), x.material.color, 0.0, true, x.medium);
}
