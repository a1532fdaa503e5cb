// No light is in a bulb.

struct BulbShells {
    unused: u32,
}

fn bulb_shells(light: u32) -> BulbShells {
    return BulbShells(0u);
}

fn is_from_bulb(path: ptr<function, LightPath>) -> bool {
    return false;
}
