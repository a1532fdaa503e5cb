//! What a call has left in a tile's textures and counters, as it was read back.

use crate::engine::{Counters, Part};
use crate::film::coverage::Rect;
use crate::film::{BLOCK, Film, REPLICATES, Sums};

/// Running sums that lie in a tile's textures.
pub(super) struct Held {
    pub tile: Rect,
    /// Which texture.
    pub place: usize,
    /// The sums, rows of the tile.
    pub running: Vec<[Sums<f32>; REPLICATES]>,
}

impl Held {
    /// Whether the parts that go on with a block go on from just these sums: they need not be put into the textures again
    /// then.
    pub fn serves(&self, film: &Film, tile: Rect, parts: &[Part]) -> bool {
        let same = |rect: Rect, y: u32| {
            let width = rect.width() as usize;
            let here =
                (y - tile.y0) as usize * tile.width() as usize + (rect.x0 - tile.x0) as usize;
            let there = film.index(rect.x0, y);
            let bytes: &[u8] = bytemuck::cast_slice(&self.running[here..here + width]);
            bytes == bytemuck::cast_slice::<_, u8>(&film.partial()[there..there + width])
        };
        self.tile == tile
            && !film.partial().is_empty()
            && parts
                .iter()
                .filter(|p| goes_on(p))
                .all(|p| (p.rect.y0..p.rect.y1).all(|y| same(p.rect, y)))
    }
}

/// Whether a part goes on with a block that is begun.
pub(super) fn goes_on(part: &Part) -> bool {
    !part.samples.start.is_multiple_of(BLOCK)
}

/// What the counters of some pixels say, as `shaders/path.wgsl` packs them for a block that begins with sample number `block`:
/// all of it together, and which pixels have lost samples of which replicates.
pub(super) fn count_row(
    pixels: impl Iterator<Item = (u32, u32, [u32; 4])>,
    block: u64,
) -> (Counters, Vec<(u32, u32, [u64; REPLICATES])>) {
    let mut counters = Counters::default();
    let mut lost = Vec::new();
    for (x, y, c) in pixels {
        let half = |k: usize, shift: u32| u64::from(c[k] >> shift & 0xffff);
        counters.rays += u64::from(c[0]);
        counters.truncated += half(1, 0);
        let left_out = [half(2, 0), half(2, 16), half(3, 0), half(3, 16)];
        if left_out != [0; REPLICATES] {
            lost.push((x, y, left_out));
            counters.nonfinite += left_out.iter().sum::<u64>();
            let first = (x, y, block + half(1, 16) - 1);
            counters.first_nonfinite = counters.first_nonfinite.or(Some(first));
        }
    }
    (counters, lost)
}
