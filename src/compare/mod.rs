//! Tests whether two pictures are equal up to their noise.
//!
//! Pictures with error layers get a [`Verdict`], whose only threshold is the false-alarm rate. For others the user gives
//! limits on [`Metrics`], which can't distinguish noise from a difference.

pub mod flip;
mod grid;
pub mod html;
pub mod layers;
pub mod metrics;
mod picture;
mod renders;
mod report;
mod text;
pub mod verdict;

pub use metrics::Metrics;
pub use picture::{Noise, Side, Unit};
pub use verdict::Verdict;

/// The rate of false alarms over the whole picture, unless another is asked for.
pub const DEFAULT_ALPHA: f64 = 0.001;

/// What texts and pages call two pictures, unless one of them is a golden.
pub(crate) const LABELS: [&str; 2] = ["A", "B"];

/// What is asked of two pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// False-alarm rate of the verdict over the whole picture.
    pub alpha: f64,
    /// The most that the mean FLIP may be.
    pub max_flip: Option<f64>,
    /// The most that [`Metrics::relative_rmse`] may be.
    pub max_relative_rmse: Option<f64>,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            alpha: DEFAULT_ALPHA,
            max_flip: None,
            max_relative_rmse: None,
        }
    }
}

/// What a comparison found.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Distances, noise included.
    pub metrics: Metrics,
    /// What the noise leaves of them, if both pictures state theirs.
    pub verdict: Option<Verdict>,
    /// Limits that are exceeded, in words.
    pub exceeded: Vec<String>,
    /// Layers that were asked for and differ, in words.
    pub layers: Vec<String>,
    /// What the user should know about the pair.
    pub notes: Vec<String>,
    /// Whether every pixel is the same to the bit.
    pub identical: bool,
    /// Whether both hold the same samples, as a film and its picture do: of one scene and seed, and equal but for rounding.
    pub same_samples: bool,
    /// What texts call the two pictures.
    pub(crate) labels: [&'static str; 2],
}

/// Why two pictures can't be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Incomparable {
    /// Their sizes differ.
    #[error("{a} has {} x {} pixels, but {b} has {} x {}", .sizes[0][0], .sizes[0][1], .sizes[1][0], .sizes[1][1])]
    Size {
        /// Name of A.
        a: String,
        /// Name of B.
        b: String,
        /// Width and height of both.
        sizes: [[u32; 2]; 2],
    },
    /// Their pixels without samples are not the same.
    #[error(
        "pixel ({x}, {y}) has samples in {with}, but none in {without}; compare pictures of the same regions"
    )]
    Regions {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// Name of the picture that has it.
        with: String,
        /// Name of the other.
        without: String,
    },
    /// No verdict is possible, and there are no limits.
    #[error(
        "{name} does not state its noise (it has no error layers, no sample counts, or fewer than two replicates), so a \
         limit is needed"
    )]
    NoNoise {
        /// The picture without error layers.
        name: String,
    },
}

/// Compares two pictures; A is the reference where the order matters.
pub fn compare(a: &Side, b: &Side, limits: &Limits) -> Result<Comparison, Incomparable> {
    check(a, b)?;
    let limited = limits.max_flip.is_some() || limits.max_relative_rmse.is_some();
    let identical = a.rgb == b.rgb;
    let silent = [a, b].into_iter().find(|p| p.noise.is_none());
    let verdict = match silent {
        None => Some(verdict::verdict(a, b, limits.alpha)),
        // Equal pixels need no limit.
        Some(_) if limited || identical => None,
        Some(picture) => {
            return Err(Incomparable::NoNoise {
                name: picture.name.clone(),
            });
        }
    };
    let metrics = Metrics::new(a, b);
    let over = |what: &str, value: f64, limit: Option<f64>| {
        let limit = limit.filter(|limit| value.is_nan() || value > *limit)?;
        Some(format!("{what} is {value:.4}, above the limit {limit}"))
    };
    let exceeded = [
        over("mean FLIP", metrics.flip, limits.max_flip),
        over(
            "relative RMSE",
            metrics.relative_rmse(),
            limits.max_relative_rmse,
        ),
    ];
    Ok(Comparison {
        metrics,
        verdict,
        exceeded: exceeded.into_iter().flatten().collect(),
        layers: Vec::new(),
        notes: notes(a, b),
        identical,
        same_samples: same_samples(a, b),
        labels: LABELS,
    })
}

fn check(a: &Side, b: &Side) -> Result<(), Incomparable> {
    if a.size != b.size {
        return Err(Incomparable::Size {
            a: a.name.clone(),
            b: b.name.clone(),
            sizes: [a.size, b.size],
        });
    }
    if let Some(i) = (0..a.covered.len()).find(|&i| a.covered[i] != b.covered[i]) {
        let (with, without) = if a.covered[i] { (a, b) } else { (b, a) };
        return Err(Incomparable::Regions {
            x: i as u32 % a.size[0],
            y: i as u32 / a.size[0],
            with: with.name.clone(),
            without: without.name.clone(),
        });
    }
    Ok(())
}

/// Whether both are of one scene and seed, and equal but for the rounding of files.
fn same_samples(a: &Side, b: &Side) -> bool {
    let agree = |key: &str| a.origin(key).is_some_and(|x| b.origin(key) == Some(x));
    let close = |(x, y): (&f64, &f64)| (x - y).abs() <= verdict::ROUNDING * x.abs().max(y.abs());
    let channels = a.rgb.as_flattened().iter().zip(b.rgb.as_flattened());
    agree("scene_hash") && agree("seed") && channels.into_iter().all(close)
}

/// How many pixels a picture that ends at white shows white where the other one is brighter.
fn clipped_away(clipped: &Side, other: &Side) -> usize {
    let pairs = clipped.rgb.iter().zip(&other.rgb);
    let is = |(p, q): &(&[f64; 3], &[f64; 3])| (0..3).any(|c| p[c] >= 1.0 && q[c] > 1.0);
    pairs.filter(is).count()
}

fn notes(a: &Side, b: &Side) -> Vec<String> {
    let both = |key: &str| Some((a.origin(key)?, b.origin(key)?));
    let mut notes = Vec::new();
    let alone = |p: &&Side| p.noise.as_ref().is_some_and(|n| n.luminance_alone);
    if let Some(picture) = [a, b].into_iter().find(alone) {
        notes.push(format!(
            "{} states the noise of its luminance alone: that is tested, and a change of colour without one of brightness is not seen",
            picture.name
        ));
    }
    let clipped = match (a.clipped, b.clipped) {
        (true, false) => Some((a, b)),
        (false, true) => Some((b, a)),
        _ => None,
    };
    if let Some((picture, other)) = clipped
        && let pixels @ 1.. = clipped_away(picture, other)
    {
        notes.push(format!(
            "{} ends at white, as 8-bit pictures do: {pixels} of {} pixels are white in it and brighter in {}, and count as different; \
             compare EXR files with EXR files",
            picture.name,
            picture.rgb.len(),
            other.name
        ));
    }
    if let Some((x, y)) = both("scene_hash")
        && x != y
    {
        notes.push("the pictures are of different scenes or settings (their hashes differ)".into());
    }
    if let Some((x, y)) = both("seed")
        && x == y
    {
        notes.push(format!(
            "both were rendered with seed {x}: they share samples where their sample numbers overlap, and both may miss the \
             same rare light paths; render one with another seed"
        ));
    }
    notes
}

impl Comparison {
    /// Whether nothing speaks against the pictures being the same.
    pub fn same(&self) -> bool {
        self.exceeded.is_empty()
            && self.layers.is_empty()
            && self.verdict.as_ref().is_none_or(Verdict::same)
    }
}
