//! What Vulkan drivers read from the environment.

use super::args::Command;
use crate::bench::reference::default_cache;
use std::ffi::OsString;

/// Camera paths up to which a kernel that is compiled in half the time and takes twice as long is the faster one: lavapipe
/// compiles for a tenth to a quarter of a second longer to be rid of the difference.
const FEW_PATHS: u64 = 400_000;

/// Sets it for `command`; a value that the user has set stays. For a process that has one thread yet.
pub(super) fn prepare(command: &Command) {
    // Mesa's layer for choosing among screens complains on stderr where there is no screen.
    set("NODEVICE_SELECT", || Some("1".into()));
    wide_vectors();
    if few_paths(command) {
        // Without LLVM's optimisations; what is left gives the same bits.
        set("GALLIVM_PERF", || Some("nopt".into()));
    }
    let talk = match command {
        Command::Render(args) => Some(args.talk),
        Command::Selftest(args) => Some(args.talk),
        Command::Regress(args) => Some(args.talk),
        Command::Bench(args) => {
            // What a kernel costs is told for one that is compiled afresh.
            set("MESA_SHADER_CACHE_DISABLE", || Some("true".into()));
            Some(args.talk)
        }
        _ => None,
    };
    if let Some(threads) = talk.and_then(|t| t.threads) {
        // lavapipe's own.
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
        // SAFETY: the process has one thread yet, so nobody reads the environment meanwhile.
        unsafe { std::env::set_var(name, value) };
    }
}

/// llvmpipe takes 256-bit vectors of its own accord; with these a sample has the same bits and costs a quarter less. Mesa's
/// disk cache does not tell kernels of one width from those of another, and would give wrong pictures: these have a
/// cache of their own, or none.
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
            // SAFETY: as above. Wherever the user's cache is, it may hold kernels of another width.
            Some(folder) => unsafe { std::env::set_var("MESA_SHADER_CACHE_DIR", folder) },
            None => set("MESA_SHADER_CACHE_DISABLE", || Some("true".into())),
        }
    }
}

/// Whether the command line alone says that there is little to render.
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
