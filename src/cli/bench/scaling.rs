//! `etendue bench --scaling`: seconds per path against the number of objects.

use super::{Bench, TIME, once};
use crate::bench::scaling::{self, Plan, Scaling, Series, text};
use crate::bench::{EngineKind, Unready, panels as draw, record};
use crate::cli::failure::Failure;
use crate::engine::EngineError;
use crate::kernel::Access;
use crate::plot::Panel;
use crate::render::memory;
use crate::settings::Settings;
use crate::world::World;

impl Bench<'_> {
    /// Measures every series. Adds its results to `panels` even if it ends early.
    pub(super) fn scaling(&mut self, panels: &mut Vec<Panel>) -> Result<(), Failure> {
        let plan = Plan {
            most: self.args.up_to as usize,
            time: self.args.time.unwrap_or(TIME),
            most_samples: self.args.max_spp,
        };
        let scene = Series::Spheres.scene(1).map_err(Failure::Scene)?;
        let settings = Settings::resolve(&scene, &self.args.overrides());
        memory::check(settings.size.map(u64::from).iter().product(), false)?;
        let engines = self.scaling_engines(&World::new(&scene, settings.size));
        for (i, series) in Series::ALL.into_iter().enumerate() {
            let mut scaling = Scaling::new(series, &engines);
            let progress = &mut self.progress;
            let all = Series::ALL.len() as f64;
            let ended = scaling::measure(
                &mut scaling,
                self.gpu.as_ref(),
                &self.args.overrides(),
                &plan,
                &self.signals.stop,
                |fraction, text| progress.share((i as f64 + fraction) / all, text),
            );
            self.show(&text::text(&scaling))?;
            self.json += &record::scaling_lines(&scaling);
            panels.push(Panel::Scaling(draw::scaling(&scaling)));
            match ended {
                Ok(true) => {}
                Ok(false) | Err(Unready::Engine(EngineError::Stopped)) => {
                    return Err(self.interrupted());
                }
                Err(e) => return Err(Failure::Device(e.to_string())),
            }
        }
        Ok(())
    }

    /// The engines to compare, without duplicates. By default those of the adapter, except gpu-baked if the adapter's
    /// compiler is too slow for it even on this small `world`.
    fn scaling_engines(&self, world: &World) -> Vec<EngineKind> {
        if !self.args.engine.is_empty() {
            return once(self.args.engine.clone());
        }
        let Some(gpu) = &self.gpu else {
            return vec![EngineKind::Cpu];
        };
        let mut kinds = vec![EngineKind::GpuBuffers, EngineKind::GpuTree];
        if Access::choose_for(world, gpu.info()) == Access::Baked {
            kinds.insert(0, EngineKind::GpuBaked);
        }
        kinds
    }
}
