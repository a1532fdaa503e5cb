// No bulbs: no light lies in glass balls alone.

struct BulbTrail {
    unused: u32,
}

fn gather_bulbs(asks: bool, path: ptr<function, Path>, x: ptr<function, Interaction>, u: Draws, film: ptr<function, PixelFilm>) {}

fn follow_bulbs(path: ptr<function, Path>, x: ptr<function, Interaction>, scattered: Scattered) {}

fn share_beside_bulbs(path: ptr<function, Path>, hit: Hit, light: DiskLight, index: u32, share: f32) -> f32 {
    return share;
}
