//! The command line: one file for each command, and what they share.

mod adapters;
mod args;
mod audience;
mod bench;
mod check;
mod compare;
mod denoise;
mod develop;
mod drivers;
mod ending;
mod events;
mod export;
mod failure;
mod files;
mod info;
mod layers;
mod looks;
mod make_scene;
mod merge;
mod plan;
mod plot;
mod progress;
mod regress;
mod render;
mod resume;
mod review;
mod room;
mod saver;
mod schema;
mod selftest;
mod shell;
mod signals;
mod stages;
mod time_left;
mod values;
mod watch;

use crate::files::FileError;
use args::{Cli, Command};
use clap::Parser;
use clap::error::{ContextKind, ContextValue};
pub(crate) use events::say;
use failure::Failure;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// Parses the command line, runs the command, and turns a failure into its message and exit status.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(mut e) => {
            suggest_render(&mut e);
            // Help and version go to stdout and are not errors. Neither is a closed stdout.
            let _ = e.print();
            return ExitCode::from(if e.use_stderr() { 2 } else { 0 });
        }
    };
    if let Some(talk) = cli.command.talk() {
        events::set_style(&talk);
    }
    drivers::prepare(&cli.command);
    signals::outlive_size_limits();
    let done = match cli.command {
        Command::Render(args) => render::render(&args),
        Command::Check(args) => check::check(&args),
        Command::Develop(args) => develop::develop(&args),
        Command::Info(args) => info::info(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Selftest(args) => selftest::selftest(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Regress(args) => regress::regress(&args),
        Command::MakeScene(args) => make_scene::make_scene(&args),
        Command::Export(args) => export::export(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Watch(args) => watch::watch(&args),
        Command::Plot(args) => plot::plot(&args),
        Command::Adapters => adapters::adapters(),
        Command::Schema => schema::schema(),
        Command::Completions(args) => shell::completions(&args),
        Command::Man(args) => shell::man(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.status())
        }
    }
}

/// Suggests `render` where a scene stands in place of a command.
fn suggest_render(e: &mut clap::Error) {
    if let Some(ContextValue::String(word)) = e.get(ContextKind::InvalidSubcommand)
        && Path::new(word)
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        let tip = format!("to render a scene: etendue render {word}");
        // The most similar command is similar by chance.
        e.remove(ContextKind::SuggestedSubcommand);
        e.insert(
            ContextKind::Suggested,
            ContextValue::StyledStrs(vec![tip.into()]),
        );
    }
}

/// Writes data to stdout. A closed pipe (`| head`) is not a failure.
fn write_stdout(data: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(data.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(FileError::io(Path::new("stdout"), "cannot write", &e).into())
        }
        _ => Ok(()),
    }
}

/// Gives rayon `--threads` threads, or one per core without the flag.
fn set_threads(threads: Option<u16>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    // Fails only if the pool exists already. A process runs a single command, so it does not.
    let _ = pool.build_global();
}
