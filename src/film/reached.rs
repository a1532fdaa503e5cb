//! Where light could have been found: blocks of pixels whose paths have met a surface that scatters.

use super::coverage::Rect;

/// Pixels per side of a block.
pub const REACHED_SIDE: u32 = 4;

/// Which blocks of a picture have had a path that scattered and went on. If a block and those around it have found no light, it is
/// not known how bright they are: unlike a background, they may be lit by light that is rarely found.
///
/// Only engines that look for light by chance report such paths. Without them (direct light alone, Whitted's integrator), light
/// that shadow rays do not find is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reached {
    columns: u32,
    /// 1 for every such block of the whole picture, row by row.
    blocks: Vec<u8>,
}

impl Reached {
    /// None, of a picture of `size` pixels.
    pub(super) fn new(size: [u32; 2]) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(REACHED_SIDE));
        Self {
            columns,
            blocks: vec![0; columns as usize * rows as usize],
        }
    }

    /// From its stored parts. `None` if they do not fit a picture of `size`.
    pub(crate) fn from_blocks(size: [u32; 2], blocks: Vec<u8>) -> Option<Self> {
        let new = Self::new(size);
        let fits = blocks.len() == new.blocks.len() && blocks.iter().all(|b| *b <= 1);
        fits.then_some(Self { blocks, ..new })
    }

    /// Rows and columns of blocks of a picture of `size` pixels.
    pub(crate) fn shape(size: [u32; 2]) -> [u32; 2] {
        let [columns, rows] = size.map(|n| n.div_ceil(REACHED_SIDE));
        [rows, columns]
    }

    /// The blocks, row by row.
    pub(crate) fn blocks(&self) -> &[u8] {
        &self.blocks
    }

    /// Notes that a path of pixel (x, y) has scattered.
    pub(super) fn note(&mut self, x: u32, y: u32) {
        let i = self.index(x, y);
        self.blocks[i] = 1;
    }

    /// Whether a path of the block of pixel (x, y) has scattered.
    pub(super) fn has(&self, x: u32, y: u32) -> bool {
        self.blocks[self.index(x, y)] == 1
    }

    /// Notes what `other`, of the same picture, does.
    pub(super) fn merge(&mut self, other: &Self) {
        let both = self.blocks.iter_mut().zip(&other.blocks);
        both.for_each(|(a, b)| *a |= b);
    }

    /// The block of pixel (x, y).
    pub(super) fn index(&self, x: u32, y: u32) -> usize {
        (y / REACHED_SIDE) as usize * self.columns as usize + (x / REACHED_SIDE) as usize
    }

    /// How many pixels of `covered` lie in reached blocks that have found no light, nor have the blocks around them. `lit` has
    /// an entry for every block: whether any of its pixels has light.
    pub(super) fn unlit(&self, lit: &[bool], covered: impl Iterator<Item = Rect>) -> u64 {
        let columns = self.columns as usize;
        let rows = self.blocks.len() / columns;
        let dark = |i: usize| {
            let (row, column) = (i / columns, i % columns);
            let near = |k: usize, n: usize| k.saturating_sub(1)..(k + 2).min(n);
            near(row, rows).all(|y| near(column, columns).all(|x| !lit[y * columns + x]))
        };
        let unlit: Vec<bool> = (0..self.blocks.len())
            .map(|i| self.blocks[i] == 1 && !lit[i] && dark(i))
            .collect();
        let mut pixels = 0;
        for rect in covered {
            for y in rect.y0..rect.y1 {
                let of_row = (rect.x0..rect.x1).filter(|&x| unlit[self.index(x, y)]);
                pixels += of_row.count() as u64;
            }
        }
        pixels
    }
}
