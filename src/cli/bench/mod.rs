//! `etendue bench`: error against rendering time.

pub mod args;
mod report_table;
mod scaling;

use super::args::Backend;
use super::failure::Failure;
use super::files::{Files, is_stdout, write_text};
use super::progress::Progress;
use super::say;
use super::signals::Signals;
use crate::bench::{
    Contender, EngineKind, Entrant, Plan, Reference, Results, Unready, mean_path_length, measure,
    panels, record, reference, table,
};
use crate::engine::EngineError;
use crate::gpu::Gpu;
use crate::kernel::Access;
use crate::plot::{self, Panel};
use crate::provenance::hash::scene_hash;
use crate::render::{backend, memory};
use crate::run::Tally;
use crate::scene::{Scene, parse};
use crate::settings::Settings;
use crate::world::World;
use args::BenchArgs;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Default rendering time for each engine and scene.
const TIME: Duration = Duration::from_secs(20);

/// Runs the benchmark, and prints the results so far if it ends early.
pub fn bench(args: &BenchArgs) -> Result<(), Failure> {
    let (plots, mut files) = check_files(args)?;
    if args.reference.is_some() && args.scenes.len() > 1 {
        return Err(Failure::Input(format!(
            "--reference needs a single scene, found {}",
            args.scenes.len()
        )));
    }
    super::set_threads(args.talk.threads);
    let signals =
        Signals::install().map_err(|e| Failure::Device(format!("cannot handle signals: {e}")))?;
    // Refuse scenes with errors before the first measurement.
    let read =
        |path: &PathBuf| parse::parse_str(path, &parse::read_text(path)?).map_err(Failure::Scene);
    let scenes: Vec<Scene> = args.scenes.iter().map(read).collect::<Result<_, _>>()?;
    for file in scenes.iter().flat_map(|s| &s.row_files) {
        files.reads("a table of a scene", &file.path)?;
    }
    let gpu = open(args)?;
    let mut bench = Bench {
        args,
        gpu,
        signals,
        progress: Progress::new(&args.talk),
        json: String::new(),
    };
    let mut panels = Vec::new();
    let ended = if args.report_table {
        bench.report_table()
    } else if args.scaling {
        bench.scaling(&mut panels)
    } else {
        bench.scenes(&scenes, &mut panels)
    };
    bench.progress.finish();
    let written = bench.write(&plots, &panels);
    match (ended, written) {
        (Err(failure), Err(e)) => {
            say!("warning: {e}");
            Err(failure)
        }
        (ended, written) => ended.and(written),
    }
}

/// The plots with their formats, and all files. Refuses plots of unknown formats, outputs that can't be written, and outputs
/// that would overwrite another file.
fn check_files(args: &BenchArgs) -> Result<(Vec<(PathBuf, plot::Format)>, Files), Failure> {
    let mut plots = Vec::new();
    for path in &args.plot {
        let format = plot::Format::from_path(path).map_err(Failure::Input)?;
        plots.push((path.clone(), format));
    }
    let mut files = Files::default();
    for path in &args.scenes {
        files.reads("a scene", path)?;
    }
    if let Some(path) = &args.reference {
        files.reads("the reference", path)?;
    }
    for path in &args.plot {
        files.writes("--plot", path)?;
    }
    if let Some(path) = &args.json {
        files.writes_text("--json", path)?;
    }
    Ok((plots, files))
}

/// The adapter, if one of the given engines needs it. Without `--engine`: the adapter that a render would use, if any.
fn open(args: &BenchArgs) -> Result<Option<Arc<Gpu>>, Failure> {
    let wanted = match args.engine[..] {
        [] => Backend::Auto,
        ref e if e.iter().any(|e| e.on_gpu()) => Backend::Gpu,
        _ if args.adapter.is_some() => {
            let message = "--adapter can't be used here: no --engine runs on an adapter";
            return Err(Failure::Input(message.into()));
        }
        _ => return Ok(None),
    };
    let (gpu, note) = backend::open(wanted, args.adapter.as_deref())?;
    if let Some(note) = note.filter(|_| !args.talk.quiet) {
        say!("{note}");
    }
    Ok(gpu.map(Arc::new))
}

/// A benchmark in progress.
struct Bench<'a> {
    args: &'a BenchArgs,
    gpu: Option<Arc<Gpu>>,
    signals: Signals,
    progress: Progress,
    /// The JSON lines so far.
    json: String,
}

impl Bench<'_> {
    /// Measures every scene. Adds its results to `panels` even if it ends early.
    fn scenes(&mut self, scenes: &[Scene], panels: &mut Vec<Panel>) -> Result<(), Failure> {
        for (path, scene) in self.args.scenes.iter().zip(scenes) {
            self.scene(&path.display().to_string(), scene, panels)?;
        }
        Ok(())
    }

    fn scene(&mut self, name: &str, scene: &Scene, panels: &mut Vec<Panel>) -> Result<(), Failure> {
        let settings = Settings::resolve(scene, &self.args.overrides());
        let area = u64::from(settings.size[0]) * u64::from(settings.size[1]);
        // The reference, and the picture that is compared with it.
        memory::check(2 * area, true)?;
        let hash = scene_hash(scene, &settings);
        // Read the given reference first: it may be refused, and making engines takes time.
        let given = match &self.args.reference {
            Some(path) => Some(reference::given(path, &hash, settings.size)?),
            None => None,
        };
        let world = World::new(scene, settings.size);
        let mut contenders = Vec::new();
        for kind in self.engines(&world) {
            self.progress
                .share(0.0, &format!("{name}: preparing {}", kind.name()));
            contenders.push(self.contender(kind, &world, &settings)?);
        }
        let length = mean_path_length(scene, &settings, &self.signals.stop);
        let reference = match given {
            Some(reference) => reference,
            None => self.make_reference(name, scene, &settings, &world, &mut contenders)?,
        };
        if let Some(warning) = &reference.warning {
            self.progress.say(&format!("warning: {warning}"));
        }
        let first = settings.seed;
        let seeds = (0..).map(|k| first.wrapping_add(k));
        let plan = Plan {
            seeds: seeds
                .filter(|s| Some(*s) != reference.seed)
                .take(self.args.seeds as usize)
                .collect(),
            time: self.args.time.unwrap_or(TIME),
            most_samples: self.args.max_spp,
        };
        let mut results = Results {
            scene: name.into(),
            scene_hash: hash,
            mean_path_length: self.stopped_or(length)?,
            entrants: contenders.iter().map(Entrant::from).collect(),
            settings,
            reference,
            measurements: Vec::new(),
        };
        let progress = &mut self.progress;
        let ended = measure(
            &mut contenders,
            &results.reference.truth,
            &results.settings,
            &plan,
            &self.signals.stop,
            &mut results.measurements,
            |s| {
                let (engine, samples) = (s.engine.name(), s.samples);
                progress.share(s.fraction, &format!("{name}: {engine}, {samples} samples"));
            },
        );
        self.show(&table::text(&results, self.args.wide))?;
        self.json += &record::lines(&results);
        panels.push(Panel::Error(panels::errors(&results)));
        match ended {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.interrupted()),
            Err(e) => self.stopped_or(Err(e)),
        }
    }

    /// The engines for this scene, without duplicates.
    fn engines(&self, world: &World) -> Vec<EngineKind> {
        let mut kinds = self.args.engine.clone();
        if kinds.is_empty() {
            let usual = self
                .gpu
                .as_ref()
                .map(|gpu| EngineKind::with_access(Access::choose_for(world, gpu.info())));
            // Add the CPU reference for comparison, except for the report's table, where it is too slow.
            if usual.is_none() || !self.args.report_table {
                kinds.push(EngineKind::Cpu);
            }
            kinds.splice(0..0, usual);
        }
        once(kinds)
    }

    fn contender(
        &self,
        kind: EngineKind,
        world: &World,
        settings: &Settings,
    ) -> Result<Contender, Failure> {
        Contender::new(kind, self.gpu.as_ref(), world, settings, &self.signals.stop).map_err(|e| {
            match e {
                Unready::Engine(EngineError::Stopped) => self.interrupted(),
                e => Failure::Device(e.to_string()),
            }
        })
    }

    /// A reference rendered by the first engine with light sampling, or by the CPU reference if there is none.
    fn make_reference(
        &mut self,
        name: &str,
        scene: &Scene,
        settings: &Settings,
        world: &World,
        contenders: &mut [Contender],
    ) -> Result<Reference, Failure> {
        let mut own;
        let by = match contenders
            .iter_mut()
            .find(|c| c.kind != EngineKind::CpuBrute)
        {
            Some(contender) => contender,
            None => {
                own = self.contender(EngineKind::Cpu, world, settings)?;
                &mut own
            }
        };
        let samples = self.args.reference_spp;
        let cache = self.args.cache.clone().or_else(reference::default_cache);
        let progress = &mut self.progress;
        let made = reference::make(
            by,
            scene,
            settings,
            samples,
            cache.as_deref(),
            &self.signals.stop,
            |tally: &Tally| {
                let done = tally.samples.min(samples as f64 - 0.5);
                let text = format!("{name}: reference, {done:.0} of {samples} samples");
                progress.share(done / samples as f64, &text);
            },
        );
        match made {
            Ok(Some(reference)) => Ok(reference),
            Ok(None) => Err(self.interrupted()),
            Err(why) => Err(Failure::Device(why)),
        }
    }

    /// Prints a table to stdout, or to stderr if the JSON lines go to stdout.
    fn show(&mut self, text: &str) -> Result<(), Failure> {
        let json = self.args.json.as_deref().is_some_and(is_stdout);
        let quiet = self.args.talk.quiet;
        self.progress.aside(|| match (json, quiet) {
            (false, _) => super::write_stdout(&format!("{text}\n")),
            (true, false) => {
                say!("{text}");
                Ok(())
            }
            (true, true) => Ok(()),
        })
    }

    /// Writes the JSON lines and the plots.
    fn write(&self, plots: &[(PathBuf, plot::Format)], panels: &[Panel]) -> Result<(), Failure> {
        if let Some(path) = &self.args.json {
            write_text(path, &self.json)?;
        }
        for (path, format) in plots.iter().filter(|_| !panels.is_empty()) {
            plot::write(path, *format, panels)?;
        }
        Ok(())
    }

    fn interrupted(&self) -> Failure {
        Failure::Interrupted {
            signal: self.signals.number(),
        }
    }

    fn stopped_or<T>(&self, result: Result<T, EngineError>) -> Result<T, Failure> {
        result.map_err(|e| match e {
            EngineError::Stopped => self.interrupted(),
            e => e.into(),
        })
    }
}

/// Removes duplicates and keeps the order.
fn once(kinds: Vec<EngineKind>) -> Vec<EngineKind> {
    let mut once: Vec<EngineKind> = Vec::new();
    for kind in kinds {
        if !once.contains(&kind) {
            once.push(kind);
        }
    }
    once
}
