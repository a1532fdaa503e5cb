//! A picture from a scene in one call: the way of the data for a program that uses the library. The command line goes the
//! same way by the same steps, and adds films, checkpoints and files.

pub mod backend;
pub mod memory;
mod picture;
pub mod plan;
mod renderer;

pub use backend::Backend;
pub use picture::{Picture, merge};
pub use renderer::Renderer;

use crate::engine::DeviceInfo;
use crate::files::FileError;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::film::error::RelativeError;
use crate::implicit::WrongFormula;
use crate::provenance::Provenance;
use crate::run::Tally;
use crate::scene::parse::{self, ReadError};
use crate::scene::{Diagnostic, LARGEST_RESOLUTION, LARGEST_STRATA, Scene, SceneBuilder};
use crate::settings::{Integrator, LightParts, Overrides};
use std::io::ErrorKind;
use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Samples a pixel when no stop condition is given.
pub const DEFAULT_SPP: u64 = 256;

/// Rendering time on the CPU reference unless a stop condition is given: [`DEFAULT_SPP`] samples of an ordinary picture take minutes
/// there.
pub const CPU_TIME: Duration = Duration::from_secs(30);

/// The longest rendering: a year.
pub const LONGEST: Duration = Duration::from_secs(366 * 86400);

/// The most samples that a pixel can have: they are numbered in 32 bits.
pub const MAX_SAMPLES: u64 = u32::MAX as u64;

/// The most light samples at a vertex.
pub const MAX_SHADOW_RAYS: u32 = 1024;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene breaks rules of its format, one message for each place; never empty.
    #[error("{}", one_a_line(.0))]
    Scene(Vec<Diagnostic>),
    /// Options that cannot be, or do not fit together or the scene.
    #[error("{0}")]
    Input(String),
    /// No usable adapter, or the device failed.
    #[error("{0}")]
    Device(String),
    /// A file can't be had, or its content is wrong.
    #[error(transparent)]
    File(#[from] FileError),
    /// It was stopped before any pixel had a sample.
    #[error("stopped before the first sample")]
    Stopped,
}

fn one_a_line(diagnostics: &[Diagnostic]) -> String {
    let lines: Vec<String> = diagnostics.iter().map(Diagnostic::to_string).collect();
    lines.join("\n")
}

impl From<ReadError> for Error {
    fn from(e: ReadError) -> Self {
        match e {
            ReadError::Io { path, source } if source.kind() == ErrorKind::IsADirectory => {
                let message = "not a scene (a directory)".into();
                FileError::Io { path, message }.into()
            }
            ReadError::Io { path, source } => {
                FileError::io(&path, "cannot read the scene", &source).into()
            }
            ReadError::Invalid(diagnostics) => Self::Scene(diagnostics),
        }
    }
}

impl From<WrongFormula> for Error {
    fn from(wrong: WrongFormula) -> Self {
        Self::Input(wrong.to_string())
    }
}

impl Scene {
    /// The scene in a file, and in the files of rows that it names.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Ok(parse::read(path.as_ref())?)
    }

    /// The scene in the text of a scene file. Files of rows that it names lie relative to the working directory.
    pub fn parse(text: &str) -> Result<Self, Error> {
        parse::parse_str(Path::new("scene"), text).map_err(Error::Scene)
    }
}

impl SceneBuilder {
    /// The scene, or all that is wrong with it: [`Error::Scene`], whose messages name the things that were given.
    pub fn build(&self) -> Result<Scene, Error> {
        self.checked().map_err(Error::Scene)
    }
}

/// What to render, with what, and until when: the first stop condition that is met ends it. Without any it is
/// [`DEFAULT_SPP`] samples a pixel, and on the CPU reference at most [`CPU_TIME`].
///
/// A clone shares `stop` with its original: give each rendering that is cancelled on its own another one.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Stop when every pixel has this many samples (with `adaptive`: on average).
    pub spp: Option<u64>,
    /// Take only the samples of these numbers: disjoint ones may be taken on several machines and [merged](crate::merge). Not together
    /// with another stop condition, or with `adaptive`.
    pub numbers: Option<Range<u64>>,
    /// Stop after this long in the engine, at most a year, but not before every pixel has a sample. How many samples that is differs from run
    /// to run.
    pub time: Option<Duration>,
    /// Stop when the picture's estimated relative error, plus twice its uncertainty, is at most this; 0.02 is 2 %, and 1 the most. Not while there is no
    /// light yet in a part of the picture where there might be some: give `time` or `spp` too, for where there is none.
    pub error: Option<f64>,
    /// Set it to true, from any thread, to end the rendering at once; [`render`] then gives what there is. Before the first sample it
    /// ends only after the kernel is ready, with [`Error::Stopped`].
    pub stop: Arc<AtomicBool>,
    /// What renders.
    pub backend: Backend,
    /// Part of the name of the adapter to use, in any case.
    pub adapter: Option<String>,
    /// Width and height in pixels instead of the scene's.
    pub size: Option<[u32; 2]>,
    /// Only these pixels; the whole picture if empty.
    pub regions: Vec<Rect>,
    /// Samples go where the noise is.
    pub adaptive: bool,
    /// Seed of every random number; the scene's, or 0, if not given.
    pub seed: Option<u32>,
    /// Path vertices after the eye, the one on the light included.
    pub max_depth: Option<u32>,
    /// Cells a side into which a pixel is divided.
    pub strata: Option<u32>,
    /// Light samples at every vertex, over all lights together.
    pub shadow_rays: Option<u32>,
    /// Which light is kept; all if not given.
    pub light: Option<LightParts>,
    /// How light travels; the whole rendering equation if not given.
    pub integrator: Option<Integrator>,
    /// Whether light that comes by way of mirrors and glass is also traced from the lights, where the scene has a use for that; it is if
    /// not given. Not on the CPU reference.
    pub light_paths: Option<bool>,
}

impl Options {
    /// Refuses values that no picture can have.
    fn check(&self) -> Result<(), Error> {
        let within = |what: &str, value: Option<u64>, low: u64, high: u64| match value {
            Some(v) if !(low..=high).contains(&v) => Err(Error::Input(format!(
                "{what} is {v}, but must be a whole number from {low} to {high}"
            ))),
            _ => Ok(()),
        };
        for side in self.size.iter().flatten() {
            let side = Some(u64::from(*side));
            within("a side of size", side, 1, LARGEST_RESOLUTION.into())?;
        }
        within("spp", self.spp, 1, MAX_SAMPLES)?;
        if let Some(numbers) = &self.numbers {
            if numbers.start >= numbers.end || numbers.end > MAX_SAMPLES {
                let Range { start, end } = numbers;
                return Err(Error::Input(format!(
                    "numbers are {start}..{end}, but must end after they start, and at {MAX_SAMPLES} at most"
                )));
            }
            let other = self.spp.is_some() || self.time.is_some() || self.error.is_some();
            if other || self.adaptive {
                let message = "numbers say which samples are taken: spp, time, error and adaptive can't be given with them";
                return Err(Error::Input(message.into()));
            }
        }
        within(
            "max_depth",
            self.max_depth.map(u64::from),
            1,
            u32::MAX.into(),
        )?;
        within(
            "strata",
            self.strata.map(u64::from),
            1,
            LARGEST_STRATA.into(),
        )?;
        within(
            "shadow_rays",
            self.shadow_rays.map(u64::from),
            1,
            MAX_SHADOW_RAYS.into(),
        )?;
        if let Some(error) = self.error
            && !(error > 0.0 && error <= 1.0)
        {
            let message = format!(
                "error is {error}, but must be a number above 0 and at most 1, which is 100 %"
            );
            return Err(Error::Input(message));
        }
        if let Some(time) = self.time
            && (time.is_zero() || time > LONGEST)
        {
            let message = format!("time is {time:?}, but must be more than 0 and at most a year");
            return Err(Error::Input(message));
        }
        if let Some(light) = self.light
            && !(light.emitted || light.direct || light.indirect)
        {
            return Err(Error::Input("light keeps none, but must keep some".into()));
        }
        if self.backend == Backend::Cpu && self.adapter.is_some() {
            let message = "adapter names a GPU, which the CPU reference does not use";
            return Err(Error::Input(message.into()));
        }
        Ok(())
    }

    fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            max_depth: self.max_depth,
            strata: self.strata,
            seed: self.seed,
            shadow_rays: self.shadow_rays,
            light: self.light,
            integrator: self.integrator,
            light_paths: self.light_paths,
        }
    }
}

/// How far a rendering has come.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    film: &'a Film,
    tally: &'a Tally,
    black: bool,
}

impl Progress<'_> {
    /// Samples of a pixel so far, on average.
    pub fn samples(&self) -> f64 {
        self.tally.samples
    }

    /// Seconds spent rendering so far.
    pub fn seconds(&self) -> f64 {
        self.tally.seconds
    }

    /// The part that is done, 0 to 1, by the stop condition that looks nearest; `None` while nothing is known.
    pub fn fraction(&self) -> Option<f64> {
        self.tally.forecast.map(|f| f.fraction)
    }

    /// Seconds left, likewise.
    pub fn seconds_left(&self) -> Option<f64> {
        self.tally.forecast.map(|f| f.left)
    }

    /// The picture's relative error so far. This looks at every pixel.
    pub fn relative_error(&self) -> RelativeError {
        self.film.relative_error().of_black(self.black)
    }
}

/// Renders `scene`. The scene is checked first, whether it was read, built, or changed since; nothing is printed.
///
/// ```
/// use etendue::{Backend, Options, Scene};
///
/// let scene = Scene::builder()
///     .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0, [16, 12])
///     .diffuse("white", [0.8; 3])
///     .sphere([0.0, 0.5, 0.0], 0.5, "white")
///     .light([0.0, 3.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3])
///     .build()?;
/// let options = Options { spp: Some(16), backend: Backend::Cpu, ..Options::default() };
/// let picture = etendue::render(&scene, &options)?;
/// assert_eq!(picture.size(), [16, 12]);
/// assert!(picture.relative_error().value.is_some());
/// # Ok::<(), etendue::Error>(())
/// ```
pub fn render(scene: &Scene, options: &Options) -> Result<Picture, Error> {
    render_with(scene, options, |_| ControlFlow::Continue(()))
}

/// The same, and `watch` hears how far it has come: once there are samples, then about once a second if there are more, and at the
/// end. When it breaks, the rendering ends, and the picture
/// is what there is.
pub fn render_with(
    scene: &Scene,
    options: &Options,
    watch: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Picture, Error> {
    renderer::render(None, None, scene, options, watch)
}

/// The provenance of `film`, which a run on `device` has brought on from `before`, and the film's relative error.
pub fn provenance(
    before: &Provenance,
    device: &DeviceInfo,
    film: &Film,
    tally: &Tally,
) -> (Provenance, RelativeError) {
    let mut provenance = before.clone();
    provenance.add_work(device, tally.counters, tally.seconds);
    let error = provenance.describe(film);
    (provenance, error)
}

#[cfg(test)]
mod tests;
