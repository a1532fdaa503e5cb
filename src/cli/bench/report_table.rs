//! `etendue bench --report-table`: the report's Figure 9.

use super::Bench;
use crate::bench::figure9::{self, Cell, SETTINGS};
use crate::bench::{EngineKind, record, table};
use crate::cli::failure::Failure;
use crate::cli::progress::clock;
use crate::render::memory;
use crate::scene::parse;
use crate::settings::Settings;
use crate::world::World;
use std::path::Path;
use std::time::Duration;

/// Default rendering time for each engine and setting.
const TIME: Duration = Duration::from_secs(240);

impl Bench<'_> {
    /// Measures every setting with every engine, and prints a table for each engine.
    pub(super) fn report_table(&mut self) -> Result<(), Failure> {
        let mut cells = Vec::new();
        let ended = self.settings(&mut cells);
        for kind in EngineKind::ALL {
            let Some(cell) = cells.iter().find(|c: &&Cell| c.engine == kind.name()) else {
                continue;
            };
            let [width, height] = cell.resolution;
            let head = format!("{}, {width}x{height}, {}", kind.name(), cell.adapter);
            let text = table::figure9(kind, &cells);
            self.show(&format!("{head}\n{text}"))?;
        }
        for cell in &cells {
            self.json += &record::line(&record::Record::ReportTable(cell));
        }
        let blank = figure9::blank(&cells);
        if !blank.is_empty() && !self.args.talk.quiet {
            self.progress.say(&format!(
                "note: blank cells would take longer than --time {} ({})",
                clock(self.time().as_secs_f64()),
                blank.join(", ")
            ));
        }
        ended
    }

    fn time(&self) -> Duration {
        self.args.time.unwrap_or(TIME)
    }

    fn settings(&mut self, cells: &mut Vec<Cell>) -> Result<(), Failure> {
        let time = self.time();
        for setting in &SETTINGS {
            let scene =
                parse::parse_str(Path::new(setting.scene), setting.text).map_err(Failure::Scene)?;
            let settings = Settings::resolve(&scene, &setting.overrides(&self.args.overrides()));
            memory::check(
                u64::from(settings.size[0]) * u64::from(settings.size[1]),
                false,
            )?;
            let world = World::new(&scene, settings.size);
            for kind in self.engines(&world) {
                let mut contender = self.contender(kind, &world, &settings)?;
                let text = format!("{}, {}", setting.name, kind.name());
                let progress = &mut self.progress;
                let stop = &self.signals.stop;
                let done = figure9::measure(
                    setting,
                    &mut contender,
                    &settings,
                    time,
                    stop,
                    cells,
                    |fraction| progress.share(fraction, &text),
                );
                if !self.stopped_or(done)? {
                    return Err(self.interrupted());
                }
            }
        }
        Ok(())
    }
}
