//! Renders on a device that stays open, and resumes pictures.

use super::backend::Device;
use super::memory::{self, Need};
use super::{
    CPU_TIME, DEFAULT_SPP, Error, MAX_SAMPLES, Options, Picture, Progress, plan, provenance,
};
use crate::engine::EngineError;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::film::pilot::Pilot;
use crate::provenance::Provenance;
use crate::run::{self, Job, Run, StopReason, Tally};
use crate::scene::{self, Canonical, Scene};
use crate::settings::{Changed, Settings};
use crate::world::World;
use std::ops::ControlFlow;
use std::time::Instant;

/// An open device, for picture after picture: an animation, or one picture that is brought on. Opening a device takes a part of a
/// second, which short renderings would spend each time.
///
/// ```
/// use etendue::{Backend, Options, Renderer, Scene};
///
/// let options = Options { spp: Some(4), backend: Backend::Cpu, ..Options::default() };
/// let renderer = Renderer::open(&options)?;
/// for frame in 0..3 {
///     let scene = Scene::builder()
///         .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0, [16, 12])
///         .diffuse("white", [0.8; 3])
///         .sphere([0.1 * f64::from(frame), 0.5, 0.0], 0.5, "white")
///         .light([0.0, 3.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3])
///         .build()?;
///     let picture = renderer.render(&scene, &options)?;
///     assert_eq!(picture.samples()[0], 4);
/// }
/// # Ok::<(), etendue::Error>(())
/// ```
#[derive(Clone)]
pub struct Renderer {
    device: Device,
}

impl Renderer {
    /// Opens the device that the options' `backend` and `adapter` name. Later options may leave them out, and are refused if they name
    /// another.
    pub fn open(options: &Options) -> Result<Self, Error> {
        options.check()?;
        let device = Device::open(options.backend, options.adapter.as_deref())?;
        Ok(Self { device })
    }

    /// [`render`](crate::render()) on this device.
    pub fn render(&self, scene: &Scene, options: &Options) -> Result<Picture, Error> {
        self.render_with(scene, options, |_| ControlFlow::Continue(()))
    }

    /// [`render_with`](crate::render_with) on this device.
    pub fn render_with(
        &self,
        scene: &Scene,
        options: &Options,
        watch: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Picture, Error> {
        render(Some(&self.device), None, scene, options, watch)
    }

    /// Takes more samples of a picture, of the scene that it shows: `options.spp` counts those that it has. What the options leave
    /// open is as it was, and what they say otherwise is refused. A picture that has all samples comes back as it is. After an
    /// error it is lost: keep a copy, or a file.
    pub fn resume(
        &self,
        picture: Picture,
        scene: &Scene,
        options: &Options,
    ) -> Result<Picture, Error> {
        self.resume_with(picture, scene, options, |_| ControlFlow::Continue(()))
    }

    /// The same, and `watch` hears how far it has come.
    pub fn resume_with(
        &self,
        picture: Picture,
        scene: &Scene,
        options: &Options,
        watch: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Picture, Error> {
        render(Some(&self.device), Some(picture), scene, options, watch)
    }
}

/// Renders `scene`, or resumes `held`, on an open device or on one that is opened for it once all is checked.
pub(super) fn render(
    device: Option<&Device>,
    held: Option<Picture>,
    scene: &Scene,
    options: &Options,
    mut watch: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Picture, Error> {
    options.check()?;
    let device = device
        .map(|open| open.for_options(options.backend, options.adapter.as_deref()))
        .transpose()?;
    let (scene, text) = scene::checked(scene).map_err(Error::Scene)?;
    let held = held.map(Picture::into_parts);
    let mut overrides = options.overrides();
    if let Some((_, before)) = &held {
        overrides = overrides.or_held(&before.settings, &Changed::default());
    }
    let settings = Settings::resolve(&scene, &overrides);
    let asked = match &held {
        Some((film, _)) if options.regions.is_empty() => plan::held_regions(film),
        _ => options.regions.clone(),
    };
    let regions = within(&asked, settings.size)?;
    let bounds = plan::bounds(&regions);
    memory::check_need(Need {
        pixels: bounds.area(),
        light_paths: settings.may_trace_light(&scene),
        film: held.is_none(),
        shown: false,
    })?;
    let ordered = Canonical::new(&scene);
    let new = Provenance::of(&ordered, text, &settings);
    let adaptive = match &held {
        Some((film, before)) => fits(film, before, &new, options, &regions)?,
        None => options.adaptive,
    };
    let world = World::of(&ordered, settings.size);
    let device = match device {
        Some(device) => device,
        None => Device::open(options.backend, options.adapter.as_deref())?,
    };
    let mut chosen = device.engine(&world, &settings, |_| ())?;
    let light_paths = chosen.engine.light_paths();
    let (mut film, before) = match held {
        Some((film, _)) if film.splats().map(|s| s.setup) != light_paths => {
            let message = "the picture cannot be resumed on this device, for only one of them has light paths (see Options::light_paths)";
            return Err(Error::Input(message.into()));
        }
        Some(held) => held,
        None => {
            let mut film = Film::new(settings.size, bounds, settings.strata);
            film.pilot = adaptive.then(|| Pilot::new(&regions));
            let mut before = new;
            before.settings.light_paths = light_paths.is_some();
            (film, before)
        }
    };

    let ends = options.time.is_some() || options.error.is_some();
    let unless_told = if ends { MAX_SAMPLES } else { DEFAULT_SPP };
    let wanted = options.spp.unwrap_or(unless_told);
    let samples = match &options.numbers {
        Some(numbers) => numbers.clone(),
        None if adaptive => 0..wanted,
        None => 0..plan::end_for(wanted, &regions, &film.coverage),
    };
    let on_cpu = chosen.engine.device().backend == "cpu";
    let is_told = ends || options.spp.is_some() || options.numbers.is_some();
    let job = Job {
        tiles: run::tiles(&regions, chosen.tile_pixels),
        samples,
        round: settings.round(),
        time: options.time.or((on_cpu && !is_told).then_some(CPU_TIME)),
        error: options.error,
        black: before.black,
        call: run::CALL,
        adaptive: adaptive.then_some(settings.seed),
    };
    let device = chosen.engine.device().clone();
    let mut run = Run::new(&job, chosen.engine.as_mut(), &mut film, &options.stop);
    let mut told: Option<Told> = None;
    let black = before.black;
    // What ends it besides the engine is `watch`, and that is no error.
    let ended = run.go(|film, tally| {
        if told.as_ref().is_some_and(|last| !last.is_due(tally)) {
            return Ok(());
        }
        told = Some(Told {
            samples: tally.samples,
            when: Instant::now(),
        });
        match watch(&Progress { film, tally, black }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(None::<EngineError>),
        }
    });
    let tally = run.tally;
    let ended = match ended {
        Ok(reason) => reason,
        Err(None) => StopReason::Interrupted,
        Err(Some(e)) => return Err(Error::Device(e.to_string())),
    };
    if film.coverage.is_empty() {
        return Err(Error::Stopped);
    }
    if ended != StopReason::Interrupted && told.is_some_and(|last| last.samples != tally.samples) {
        let (film, tally) = (&film, &tally);
        // It has ended already, whatever the answer is.
        let _ = watch(&Progress { film, tally, black });
    }
    let (provenance, _) = provenance(&before, &device, &film, &tally);
    Ok(Picture::new(film, provenance, Some(ended), chosen.note))
}

/// What `watch` was told last.
struct Told {
    samples: f64,
    when: Instant,
}

impl Told {
    /// Whether there is something new, and it is time. Calls to the engine take up to a second: where they do, each is told.
    fn is_due(&self, tally: &Tally) -> bool {
        tally.samples != self.samples && self.when.elapsed() >= run::CALL / 2
    }
}

/// The pixels to render, within a picture of `size`: all if none are asked for.
fn within(asked: &[Rect], size: [u32; 2]) -> Result<Vec<Rect>, Error> {
    let whole = Rect::whole(size);
    if asked.is_empty() {
        return Ok(vec![whole]);
    }
    let [width, height] = size;
    for r in asked {
        if r.area() == 0 || r.union(&whole) != whole {
            return Err(Error::Input(format!(
                "region {r} is empty or reaches out of the picture of {width}x{height} pixels"
            )));
        }
    }
    Ok(asked.to_vec())
}

/// Refuses to resume a film as something else. Returns whether it is adaptive.
fn fits(
    film: &Film,
    before: &Provenance,
    new: &Provenance,
    options: &Options,
    regions: &[Rect],
) -> Result<bool, Error> {
    let refuse = |why: String| {
        Err(Error::Input(format!(
            "the picture cannot be resumed: {why}"
        )))
    };
    // Whether there are light paths is seen when the engine is there.
    let mut new = new.clone();
    new.settings.light_paths = before.settings.light_paths;
    if let Err(differ) = before.same_samples(&new) {
        return refuse(format!("picture and options: {differ}"));
    }
    let bounds = plan::bounds(regions);
    if film.bounds.union(&bounds) != film.bounds {
        return refuse(format!(
            "it holds the region {}, and the options have {bounds}; render the rest for itself, and merge the two",
            film.bounds
        ));
    }
    match &film.pilot {
        None if options.adaptive => refuse("it is not adaptive, and the options are".into()),
        Some(_) if options.numbers.is_some() => {
            refuse("it is adaptive, and numbers of samples cannot be chosen".into())
        }
        Some(pilot) if !pilot.is_for(regions) => refuse("it is adaptive in other regions".into()),
        pilot => Ok(pilot.is_some()),
    }
}
