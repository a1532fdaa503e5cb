//! `etendue render`: renders a scene file to pictures, a film and a report.

use super::args::{Backend, RenderArgs};
use super::audience::{self, Audience};
use super::denoise::{self, Made, prepare, with_denoised, write_pictures};
use super::events;
use super::failure::Failure;
use super::files::{Files, Written, write_text};
use super::layers;
use super::looks::measured;
use super::progress::{Progress, clock, point};
use super::saver::{self, Saver, longest_call};
use super::say;
use super::signals::Signals;
use super::stages::Stages;
use super::{ending, plan, resume, room};
use crate::engine::DeviceInfo;
use crate::files::kind;
use crate::files::lock::Lock;
use crate::film::Film;
use crate::film::REPLICATES;
use crate::film::coverage::Rect;
use crate::film::error::{Doubt, RelativeError};
use crate::film::pilot::Pilot;
use crate::film::replicates::NoReplicates;
use crate::gpu::Making;
use crate::kernel::{self, Access};
use crate::layers::View;
use crate::log::{End, Event, Point};
use crate::output::report::{self, Report, Seconds};
use crate::output::store;
use crate::output::{Extra, Format};
use crate::provenance::Provenance;
use crate::render::backend::{self, Chosen};
use crate::render::memory::{self, Need};
use crate::render::plan::bounds as bounds_of;
use crate::run::{self, Job, Run, StopReason, Tally};
use crate::scene::{Canonical, Scene, check, parse};
use crate::settings::Settings;
use crate::world::World;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Seconds of rendering beside which a trial of each light is nothing.
const TRIAL_PAYS: f64 = 5.0;

/// Renders a scene.
pub fn render(args: &RenderArgs) -> Result<(), Failure> {
    let begun = Instant::now();

    // Check everything that can be checked before the first sample. What is no scene comes first: its name may be that of a picture.
    kind::check_text(&args.scene, "a scene")?;
    let outputs = with_denoised(&outputs(args), args.denoise.denoise)?;
    let files = check_files(args, &outputs)?;
    plan::check_flags(args.backend, args.adapter.as_deref())?;
    super::set_threads(args.talk.threads);
    let signals =
        Signals::install().map_err(|e| Failure::Device(format!("cannot handle signals: {e}")))?;
    let mut audience = Audience::gather(args)?;
    let done = render_before(&mut audience, args, begun, &outputs, files, &signals);
    // Those who follow hear of a failure before they are left.
    let done = done.map_err(|failure| {
        failure.print();
        match failure {
            Failure::Interrupted { .. } => failure,
            other => Failure::Said(other.status()),
        }
    });
    audience.leave();
    done
}

/// Renders a scene before an audience.
fn render_before(
    audience: &mut Audience,
    args: &RenderArgs,
    begun: Instant,
    outputs: &[PathBuf],
    mut files: Files,
    signals: &Signals,
) -> Result<(), Failure> {
    let denoiser = args.denoise.denoiser(args.talk.threads)?;

    // Read the scene, and the film if it exists.
    let mut stages = Stages::new(&args.talk);
    stages.begin(format!("reading {}", args.scene.display()));
    let text = parse::read_text(&args.scene)?;
    let scene = parse::parse_str(&args.scene, &text).map_err(Failure::Scene)?;
    for file in &scene.row_files {
        files.reads("a table of the scene", &file.path)?;
    }
    let _lock = args.film.as_deref().map(Lock::new).transpose()?;
    if let Some(path) = &args.film {
        stages.begin(format!("reading {}", path.display()));
    }
    let old = resume::film(args)?;
    let args = &match &old {
        Some((film, held)) => plan::as_film(args, film, held)?,
        None => args.clone(),
    };
    let settings = match &old {
        Some((_, held)) => resume::settings(args, &scene, held),
        None => Settings::resolve(&scene, &args.overrides()),
    };
    let regions = plan::regions(args, &settings)?;
    let bounds = bounds_of(&regions);
    let things = plan::things(&scene);
    stages.begin(format!("sorting {things}"));
    let ordered = Canonical::new(&scene);
    stages.begin(format!("hashing {things}"));
    let new = Provenance::of(&ordered, text, &settings);
    stages.end();
    memory::check_need(Need {
        pixels: bounds.area(),
        light_paths: settings.may_trace_light(&scene),
        film: old.is_none(),
        shown: args.listen.is_some() || args.tev.is_some(),
    })?;
    let (mut film, mut provenance) = match (old, &args.film) {
        (Some((film, held)), Some(path)) => {
            resume::check_same_samples(args, path, &held, &new)?;
            plan::check_bounds(path, &film, bounds, &args.region)?;
            plan::check_adaptive(args, path, &film, &regions)?;
            (film, held)
        }
        _ => {
            let mut film = Film::new(settings.size, bounds, settings.strata);
            film.pilot = args.adaptive.then(|| Pilot::new(&regions));
            (film, new)
        }
    };
    let left_slice = provenance.slice.filter(|_| args.samples.is_none());
    if film.coverage.is_empty() || provenance.slice.is_some() {
        provenance.slice = args.samples.as_ref().map(|s| [s.start, s.end]);
    }
    let samples = plan::samples(args, &settings, &regions, &film.coverage)?;

    let least = REPLICATES as u64 * settings.round();
    if denoiser.is_some() && samples.end < least {
        return Err(Failure::Input(NoReplicates::TooFew(least).to_string()));
    }

    // Make the engine, and write its kernel for --dump-wgsl.
    stages.begin(format!("preparing {things}"));
    let world = World::of(&ordered, settings.size);
    drop(ordered);
    stages.begin(match args.backend {
        Backend::Cpu => "preparing the CPU reference",
        Backend::Auto | Backend::Gpu => "opening the adapter",
    });
    let adapter = args.adapter.as_deref();
    let mut chosen = backend::choose(args.backend, adapter, &world, &settings, |making| {
        stages.begin(match making {
            Making::Composing => "generating the kernel".to_owned(),
            Making::Packing => format!("building trees of {things}"),
            Making::Compiling => "compiling the kernel".to_owned(),
        });
    })?;
    stages.end();
    let light_paths = chosen.engine.light_paths();
    if film.coverage.is_empty() {
        provenance.settings.light_paths = light_paths.is_some();
    } else if film.splats().map(|s| s.setup) != light_paths {
        return Err(resume::other_light_paths(args, &film));
    }
    let time_is_default = args.time.is_none();
    let args = &plan::on_device(args, chosen.engine.device());
    if let Some(path) = &args.dump_wgsl {
        let wgsl = chosen.wgsl.take();
        let wgsl = wgsl.unwrap_or_else(|| kernel::compose(&world, &settings, None).wgsl);
        write_text(path, &wgsl)?;
    }
    let job = Job {
        tiles: run::tiles(&regions, chosen.tile_pixels),
        samples,
        round: settings.round(),
        time: args.time,
        error: args.error,
        black: provenance.black,
        call: longest_call(args),
        adaptive: args.adaptive.then_some(settings.seed),
    };
    audience.open_log(args.log.as_deref(), !film.coverage.is_empty())?;
    let start = plan::start(args, &provenance, &job, &film, chosen.engine.device());
    audience.start(start, &provenance, chosen.engine.device());
    if !args.talk.quiet
        && let Some(note) = &chosen.note
    {
        say!("{note}");
    }
    room::say_little(args, outputs, &film, light_paths.is_some());
    say_suspect(args, &scene, &settings, chosen.engine.device());
    if !args.talk.quiet {
        say_start(args, &settings, &chosen, &job, &film)?;
        say_other_adapters(args, &provenance, chosen.engine.device());
    }
    if let Some([first, end]) = left_slice {
        say!(
            "warning: this film is a slice, samples {first}..{end}; --spp and --rays ask for others, so it may no longer fit its neighbours"
        );
    }

    // Render.
    let device = chosen.engine.device().clone();
    let mut saver = Saver::new(args, &provenance, &device);
    let mut progress = Progress::new(&args.talk).of_black(provenance.black);
    let mut run = Run::new(&job, chosen.engine.as_mut(), &mut film, &signals.stop);
    let ended = run.go(|film, tally| {
        progress.show(film, tally);
        saver.meanwhile(film, tally, &progress);
        audience.meanwhile(film, tally, &progress);
        Ok::<(), Failure>(())
    });
    let tally = run.tally;
    progress.finish();
    audience.show_end(&film, &tally);
    if matches!(ended, Ok(StopReason::Interrupted)) && tally.counters.paths > 0 && !args.talk.quiet
    {
        say!("interrupted: saving what there is; another signal would lose it");
    }

    // Save the film however the run ended. Write pictures only if the run did not fail, but even if the film could not be
    // saved: then they are the only result.
    stages.begin("looking at every pixel");
    let (provenance, error) = saver.provenance(&film, &tally);
    let mut written = Written::default();
    if let Some(path) = args.film.as_ref().filter(|_| tally.counters.paths > 0) {
        stages.begin(format!("saving {}", path.display()));
        let saved = store::save(path, &film, &provenance);
        let rescued = match &saved {
            Ok(()) => None,
            Err(_) => saver::rescue(path, &film, &provenance),
        };
        written.note(path, saved);
        if let Some(other) = rescued {
            say!(
                "warning: {}: the film can't be saved there; it is in {}, with all samples",
                path.display(),
                other.display()
            );
            written.note(&other, Ok::<(), Failure>(()));
        }
    }
    stages.end();
    let reason = match ended {
        Ok(reason) => reason,
        Err(failure) => {
            let _ = written.end();
            return Err(failure);
        }
    };
    let mut made = None;
    if !film.coverage.is_empty() {
        let mut extra = Extra::default();
        let mut progress = Progress::new(&args.talk);
        let denoiser = denoiser.filter(|_| reason != StopReason::Interrupted);
        if denoiser.is_some() || !args.pictures.layers.is_empty() {
            let view = View::new(&scene, &settings);
            let bounds = film.bounds;
            extra = layers::make(&args.pictures, &view, bounds, &mut progress);
            if let Some(by) = &denoiser {
                let task = prepare(&film, &provenance, &view, &mut progress);
                let task = task.map_err(|why| Failure::Input(why.to_string()));
                let done =
                    task.and_then(|task| Made::new(by, &task, &film, &provenance, &mut progress));
                match done {
                    Ok(done) => {
                        done.add_to(&mut extra);
                        made = Some(done);
                    }
                    // The unbiased picture is written all the same.
                    Err(failure) => written.note(Path::new("denoised picture"), Err(failure)),
                }
            }
        }
        progress.finish();
        let of = (&film, &provenance);
        let beside = (&extra, made.as_ref());
        let outputs: Vec<PathBuf> = outputs.iter().chain(&args.watch).cloned().collect();
        let next = |_: usize, path: &Path| stages.begin(format!("writing {}", path.display()));
        write_pictures(&outputs, of, &args.pictures, beside, &mut written, next)?;
    }
    stages.end();
    events::emit(&ended_so(stop_reason(args, reason), &tally, &error), true);
    if let Some(path) = &args.report {
        let facts = report::Run {
            scene: args.scene.display().to_string(),
            device: &device,
            regions: &args.region,
            stop_reason: stop_reason(args, reason).into(),
            seconds: Seconds {
                compile: chosen.compile_seconds,
                render: tally.seconds,
                total: begun.elapsed().as_secs_f64(),
            },
            counters: tally.counters,
        };
        let mut report = Report::new(facts, &film, &provenance);
        report.denoised = made.as_ref().map(Made::report);
        let json = report.to_json();
        if let Err(e) = write_text(path, &json) {
            written.note(path, Err(e));
        }
    }
    if !args.talk.quiet {
        if let Some(made) = &made {
            say!("{}", made.statement());
        }
        ending::say_end(args, &film, &error, &tally, reason, written.list());
        let is_png = |path: &PathBuf| Format::from_path(path) == Ok(Format::Png);
        if outputs.iter().any(is_png) {
            ending::say_exposure(&film, args.pictures.exposure);
        }
        if reason == StopReason::Time && time_is_default {
            say!(
                "note: without a stop condition the CPU reference ends after {}; for more samples: --spp N or --time TIME",
                clock(args.time.unwrap_or_default().as_secs_f64())
            );
        }
    }
    ending::warn(&settings, &tally.counters, &error);
    let tries_lights = args.error.is_some() || tally.seconds > TRIAL_PAYS;
    if tries_lights && error.doubt != Some(Doubt::NoLight) && reason != StopReason::Interrupted {
        ending::warn_of_idle_lights(&scene);
    }
    written.end()?;
    match reason {
        StopReason::Interrupted => Err(Failure::Interrupted {
            signal: signals.number(),
        }),
        _ => Ok(()),
    }
}

/// The pictures to write: those of `--output`, else STEM.exr and STEM.png in the working directory.
fn outputs(args: &RenderArgs) -> Vec<PathBuf> {
    if !args.output.is_empty() {
        return args.output.clone();
    }
    let stem = args.scene.file_stem().unwrap_or("picture".as_ref());
    [".exr", ".png"]
        .map(|extension| {
            let mut name = stem.to_owned();
            name.push(extension);
            name.into()
        })
        .to_vec()
}

/// Refuses outputs that can't be written, and outputs that would overwrite another file.
fn check_files(args: &RenderArgs, outputs: &[PathBuf]) -> Result<Files, Failure> {
    for path in outputs {
        Format::from_path(path).map_err(Failure::Input)?;
    }
    layers::check(&args.pictures, outputs, args.watch.as_deref())?;
    if args.denoise.denoise {
        denoise::check(&args.pictures)?;
    }
    if let Some(path) = &args.watch
        && Format::from_path(path) != Ok(Format::Png)
    {
        let path = path.display();
        return Err(Failure::Input(format!(
            "--watch {path}: the name must end in .png"
        )));
    }
    let mut files = Files::default();
    files.reads("the scene", &args.scene)?;
    let picture = match args.output[..] {
        [] => "the default picture (--output changes it)",
        _ => "--output",
    };
    for path in outputs {
        files.writes(picture, path)?;
    }
    if let Some(path) = &args.watch {
        files.writes("--watch", path)?;
    }
    if let Some(path) = &args.film {
        files.writes_film("--film", path)?;
    }
    audience::check_files(args, &mut files)?;
    if let Some(path) = &args.dump_wgsl {
        files.writes_text("--dump-wgsl", path)?;
    }
    if let Some(path) = &args.report {
        files.writes_text("--report", path)?;
    }
    Ok(files)
}

/// What is suspect about the scene: in full where it changes the picture, by number where it does not.
fn say_suspect(args: &RenderArgs, scene: &Scene, settings: &Settings, device: &DeviceInfo) {
    let on_gpu = (device.backend != "cpu").then_some(settings.size);
    let lints = check::lints(scene, on_gpu);
    for warning in &lints.picture {
        say!("warning: {warning}");
    }
    let remarks = lints.remarks.len();
    if remarks > 0 && !args.talk.quiet {
        let s = if remarks == 1 { "" } else { "s" };
        let scene = args.scene.display();
        say!("note: {remarks} remark{s} about this scene; see: etendue check {scene}");
    }
}

/// The start-up line: the scene, the device, and the stop conditions.
fn say_start(
    args: &RenderArgs,
    settings: &Settings,
    chosen: &Chosen,
    job: &Job,
    film: &Film,
) -> Result<(), Failure> {
    let [width, height] = settings.size;
    let pixels: u64 = job.tiles.iter().map(Rect::area).sum();
    let part = if args.region.is_empty() {
        String::new()
    } else {
        format!(" ({pixels} pixels)")
    };
    let name = args.scene.file_stem().unwrap_or(args.scene.as_os_str());
    let mut text = format!(
        "{}: {width}x{height}{part}, {}, on {}",
        name.display(),
        plan::ends(args, settings)?,
        chosen.engine.device().brief()
    );
    // Only what is out of the ordinary.
    if let Some(access) = chosen.access.filter(|a| *a != Access::Baked) {
        text += &format!(", {} kernel", access.name());
    }
    if chosen.engine.light_paths().is_some() {
        text += ", with light paths";
    }
    if let (Some(path), false) = (&args.film, film.coverage.is_empty()) {
        let held = plan::brief_samples(film);
        text += &format!("; {} holds {held}", path.display());
    }
    say!("{text}");
    Ok(())
}

/// A note if other devices rendered parts of the film.
fn say_other_adapters(args: &RenderArgs, held: &Provenance, device: &DeviceInfo) {
    let others: Vec<String> = held
        .devices
        .iter()
        .filter(|used| !used.device.rounds_like(device))
        .map(|used| format!("{} ({})", used.device.name, used.device.driver))
        .collect();
    if let (Some(path), false) = (&args.film, others.is_empty()) {
        say!(
            "note: {} holds samples from {}; {} rounds differently, so the picture is equal only up to noise",
            path.display(),
            others.join(", "),
            device.name
        );
    }
}

/// The last event of a run.
fn ended_so(reason: &str, tally: &Tally, error: &RelativeError) -> Event {
    let point = Point {
        fraction: None,
        seconds_left: None,
        error: measured(error, tally.samples, tally.seconds),
        ..point(tally)
    };
    let stop_reason = reason.into();
    Event::End(End { stop_reason, point })
}

/// The report's word for what ended the run.
fn stop_reason(args: &RenderArgs, reason: StopReason) -> &'static str {
    match reason {
        StopReason::Samples if args.samples.is_some() => "samples",
        StopReason::Samples => "spp",
        StopReason::Time => "time",
        StopReason::Error => "error",
        StopReason::Interrupted => "interrupted",
    }
}
