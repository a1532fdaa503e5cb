//! What a call leaves in a tile's textures and counters, as it was read back.

use crate::engine::{Counters, Part};
use crate::film::coverage::Rect;
use crate::film::{BLOCK, Film, REPLICATES, Reach, Sums};
use std::ops::Range;

/// Running sums that lie in a tile's textures.
pub(super) struct Held {
    pub tile: Rect,
    /// Which texture.
    pub place: usize,
    /// The sums, rows of the tile.
    pub running: Vec<[Sums<f32>; REPLICATES]>,
}

impl Held {
    /// Whether the parts that continue a block continue from exactly these sums, so that the textures need not be filled again.
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
                .filter(|p| continues_block(p))
                .all(|p| (p.rect.y0..p.rect.y1).all(|y| same(p.rect, y)))
    }
}

/// Whether a part continues a block that already has samples.
pub(super) fn continues_block(part: &Part) -> bool {
    !part.samples.start.is_multiple_of(BLOCK)
}

/// What the counters of a row of pixels say.
#[derive(Default)]
pub(super) struct CountedRow {
    /// Their totals.
    pub counters: Counters,
    /// Pixels that lost samples, and how many each replicate lost.
    pub lost: Vec<(u32, u32, [u64; REPLICATES])>,
    /// Pixels of which a path has gone on from a surface, and how far.
    pub reached: Vec<(u32, u32, Reach)>,
}

/// As in `shaders/film.wgsl`.
const FURTHER: u32 = 0x8000;
const HIDDEN: u32 = 0x4000;
const FOUND: u32 = 0x2000;

/// Unpacks the counters of some pixels, as `PixelFilm` of `shaders/film.wgsl` holds them, for `samples` of one block.
pub(super) fn count_row(
    pixels: impl Iterator<Item = (u32, u32, [u32; 4])>,
    samples: &Range<u64>,
) -> CountedRow {
    let block = samples.start / BLOCK * BLOCK;
    let mut row = CountedRow::default();
    let CountedRow {
        counters,
        lost,
        reached,
    } = &mut row;
    for (x, y, c) in pixels {
        let half = |k: usize, shift: u32| u64::from(c[k] >> shift & 0xffff);
        counters.rays += u64::from(c[0]);
        if c[1] & FOUND != 0 {
            reached.push((x, y, Reach::Found));
        } else if c[1] & HIDDEN != 0 {
            reached.push((x, y, Reach::Hidden));
        } else if c[1] & FURTHER != 0 {
            reached.push((x, y, Reach::Further));
        } else if u64::from(c[0]) > samples.end - samples.start {
            reached.push((x, y, Reach::Surface));
        }
        counters.truncated += half(1, 0) & u64::from(FOUND - 1);
        let left_out = [half(2, 0), half(2, 16), half(3, 0), half(3, 16)];
        if left_out != [0; REPLICATES] {
            lost.push((x, y, left_out));
            counters.nonfinite += left_out.iter().sum::<u64>();
            let first = (x, y, block + half(1, 16) - 1);
            counters.first_nonfinite = counters.first_nonfinite.or(Some(first));
        }
    }
    row
}
