//! Sets environment variables that Vulkan drivers read.

use super::args::Command;
use crate::bench::reference::default_cache;
use std::ffi::OsString;

/// Up to this many camera paths, an unoptimised kernel is faster overall on lavapipe: it compiles in half the time (0.1 to
/// 0.25 s less) and runs half as fast.
const FEW_PATHS: u64 = 400_000;

/// Sets the variables for `command`. A value that the user has set stays. Call it while the process has a single thread.
pub(super) fn prepare(command: &Command) {
    // Mesa's device-select layer complains on stderr if there is no display.
    set("NODEVICE_SELECT", || Some("1".into()));
    wide_vectors();
    if few_paths(command) {
        // Turns off LLVM's optimisations. The results have the same bits.
        set("GALLIVM_PERF", || Some("nopt".into()));
    }
    if matches!(command, Command::Bench(_)) {
        // A benchmark measures compiling, so no kernel may come from the cache.
        set("MESA_SHADER_CACHE_DISABLE", || Some("true".into()));
    }
    // Read by lavapipe. Its own default is a thread for each core of the machine, also where this process may use fewer of them
    // (a control group's quota, `taskset`).
    let threads = command.talk().and_then(|t| t.threads).map(usize::from);
    let usable = std::thread::available_parallelism().map(usize::from);
    if let Some(threads) = threads.or(usable.ok()) {
        set("LP_NUM_THREADS", || Some(threads.to_string().into()));
    }
}

fn is_set(name: &str) -> bool {
    std::env::var_os(name).is_some()
}

fn set(name: &str, value: impl FnOnce() -> Option<OsString>) {
    if !is_set(name)
        && let Some(value) = value()
    {
        // SAFETY: the process still has a single thread, so nothing else reads the environment.
        unsafe { std::env::set_var(name, value) };
    }
}

/// Uses 512-bit vectors on llvmpipe, whose default is 256: samples have the same bits and take a quarter less time. Mesa's
/// disk cache does not distinguish kernels by vector width, so a shared cache gives wrong pictures. Kernels of this width get
/// their own cache, or none.
fn wide_vectors() {
    const WIDTH: &str = "LP_NATIVE_VECTOR_WIDTH";
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
        && !is_set(WIDTH)
    {
        set(WIDTH, || Some("512".into()));
        let folder = default_cache().map(|cache| cache.join("mesa-512"));
        match folder.filter(|folder| std::fs::create_dir_all(folder).is_ok()) {
            // SAFETY: as in `set`. Overrides the user's value too, whose cache may hold kernels of another width.
            Some(folder) => unsafe { std::env::set_var("MESA_SHADER_CACHE_DIR", folder) },
            None => set("MESA_SHADER_CACHE_DISABLE", || Some("true".into())),
        }
    }
}

/// Whether the command line alone shows that there are few paths to render.
fn few_paths(command: &Command) -> bool {
    match command {
        Command::Render(args) => match (args.size, args.spp) {
            (Some([width, height]), Some(spp)) => {
                let pixels = u64::from(width) * u64::from(height);
                pixels.saturating_mul(spp) <= FEW_PATHS
            }
            _ => false,
        },
        _ => false,
    }
}
