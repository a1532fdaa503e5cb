//! The command line: one file for each command, and what they share.

mod adapters;
mod args;
mod backend;
mod bench;
mod check;
mod compare;
mod develop;
mod failure;
mod make_scene;
mod memory;
mod merge;
mod plan;
mod progress;
mod regress;
mod render;
mod saver;
mod schema;
mod selftest;
mod signals;
mod values;

use crate::output::FileError;
use args::{Cli, Command};
use clap::Parser;
use failure::Failure;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// Writes a line to stderr. Unlike `eprintln!` it does not panic when nobody listens.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}
pub(crate) use say;

/// Runs the program: parses the command line, does what it says, and turns a failure into its
/// message and exit status.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version go to stdout and are no error; a reader that has gone is none either.
            let _ = e.print();
            return ExitCode::from(if e.use_stderr() { 2 } else { 0 });
        }
    };
    prepare_environment(&cli.command);
    signals::outlive_size_limits();
    let done = match cli.command {
        Command::Render(args) => render::render(&args),
        Command::Check(args) => check::check(&args),
        Command::Develop(args) => develop::develop(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Selftest(args) => selftest::selftest(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Regress(args) => regress::regress(&args),
        Command::MakeScene(args) => make_scene::make_scene(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Adapters => adapters::adapters(),
        Command::Schema => schema::schema(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.status())
        }
    }
}

/// What Vulkan drivers read from the environment; a value that the user has set stays.
fn prepare_environment(command: &Command) {
    let set = |name: &str, value: &str| {
        if std::env::var_os(name).is_none() {
            // SAFETY: the process has one thread yet, so nobody reads the environment meanwhile.
            unsafe { std::env::set_var(name, value) };
        }
    };
    // Mesa's layer for choosing among screens complains on stderr where there is no screen.
    set("NODEVICE_SELECT", "1");
    // llvmpipe takes 256-bit vectors of its own accord; with these a sample has the same bits and costs a quarter less. Its
    // disk cache does not tell kernels of one width from those of another, and would give wrong pictures: no cache then.
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
        && std::env::var_os("LP_NATIVE_VECTOR_WIDTH").is_none()
    {
        set("LP_NATIVE_VECTOR_WIDTH", "512");
        // SAFETY: as above.
        unsafe { std::env::set_var("MESA_SHADER_CACHE_DISABLE", "true") };
    }
    let talk = match command {
        Command::Render(args) => Some(args.talk),
        Command::Selftest(args) => Some(args.talk),
        Command::Bench(args) => Some(args.talk),
        _ => None,
    };
    if let Some(threads) = talk.and_then(|t| t.threads) {
        // lavapipe's own.
        set("LP_NUM_THREADS", &threads.to_string());
    }
}

/// Writes data to stdout. A reader that has seen enough (`| head`) is no failure.
fn write_stdout(data: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(data.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(FileError::io(Path::new("stdout"), "cannot write", &e).into())
        }
        _ => Ok(()),
    }
}

/// Gives rayon `--threads` threads; one for each core without.
fn set_threads(threads: Option<u16>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    // Fails only when the pool stands already, and a process runs one command.
    let _ = pool.build_global();
}
