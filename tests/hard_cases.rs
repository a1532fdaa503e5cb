//! The hard cases of `etendue selftest`, one test for each of them on the GPU adapter, there with all that
//! can be in trees too, and on the CPU reference.

use etendue::gpu::{Choice, Gpu};
use etendue::kernel::Access;
use etendue::selftest::{Backend, Case, cases};
use libtest_mimic::{Arguments, Failed, Trial};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn run(case: Case, backend: &Backend) -> Result<(), Failed> {
    let measures = case.run(backend).map_err(|e| e.to_string())?;
    let wrong: Vec<String> = measures
        .iter()
        .filter(|m| !m.passed())
        .map(ToString::to_string)
        .collect();
    if wrong.is_empty() {
        return Ok(());
    }
    let device = backend.device();
    let (name, driver) = (device.name, device.driver);
    Err(format!("{}\n{}\non {name} ({driver})", case.what, wrong.join("\n")).into())
}

/// `access`: with kernels of that kind, instead of those that users get.
fn on_gpu(case: Case, access: Option<Access>) -> Result<(), Failed> {
    let gpu = Gpu::open(&Choice::default())
        .map_err(|e| format!("no GPU: {e}\ninstall a Vulkan driver (scripts/test does)"))?;
    let backend = Backend::gpu(gpu, Arc::new(AtomicBool::new(false)));
    match access {
        Some(access) => run(case, &backend.with_access(access)),
        None => run(case, &backend),
    }
}

fn on_cpu(case: Case) -> Result<(), Failed> {
    run(case, &Backend::cpu(Arc::new(AtomicBool::new(false))))
}

fn main() {
    let mut args = Arguments::from_args();
    // Each case uses all cores by itself.
    args.test_threads = args.test_threads.or(Some(1));
    for a in &etendue::gpu::adapters() {
        println!("adapter: {} ({})", a.device.name, a.device.driver);
    }
    let mut trials = Vec::new();
    for case in cases() {
        trials.push(Trial::test(format!("gpu::{}", case.id()), move || {
            on_gpu(case, None)
        }));
        trials.push(Trial::test(format!("tree::{}", case.id()), move || {
            on_gpu(case, Some(Access::Tree))
        }));
        trials.push(Trial::test(format!("cpu::{}", case.id()), move || {
            on_cpu(case)
        }));
    }
    libtest_mimic::run(&args, trials).exit();
}
