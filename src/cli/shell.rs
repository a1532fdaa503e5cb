//! `etendue completions` and `etendue man`: what a shell and `man` know about the program, from the same definitions as its help.

use super::args::{Cli, CompletionsArgs, ManArgs};
use super::failure::Failure;
use super::{say, write_stdout};
use crate::files::{FileError, atomic};
use clap::CommandFactory;
use clap_mangen::Man;
use std::io;

/// Prints the completion script of a shell.
pub fn completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "etendue", &mut script);
    write_stdout(&String::from_utf8_lossy(&script))
}

/// Writes a page for the program and one for each command to a folder, or prints the program's.
pub fn man(args: &ManArgs) -> Result<(), Failure> {
    let mut program = Cli::command().disable_help_subcommand(true);
    // Gives every command its whole name.
    program.build();
    let commands = program.get_subcommands().cloned();
    let mut pages = std::iter::once(program.clone())
        .chain(commands)
        .map(Man::new);
    let Some(dir) = &args.dir else {
        return pages
            .next()
            .map_or(Ok(()), |page| write_stdout(&text(&page)));
    };
    std::fs::create_dir_all(dir).map_err(|e| {
        let action = match dir.exists() {
            true => "cannot create",
            false => "no such folder, and it can't be made",
        };
        FileError::io(dir, action, &e)
    })?;
    let mut count = 0;
    for page in pages {
        let text = text(&page);
        atomic::replace(&dir.join(page.get_filename()), |f| {
            io::Write::write_all(f, text.as_bytes())
        })?;
        count += 1;
    }
    say!("wrote {count} pages to {}", dir.display());
    Ok(())
}

fn text(page: &Man) -> String {
    let mut text = Vec::new();
    // Memory takes it.
    let _ = page.render(&mut text);
    // What stands after the help begins with examples.
    String::from_utf8_lossy(&text)
        .replace(".SH EXTRA\nExamples:\n", ".SH EXAMPLES\n")
        .replace(".SH EXTRA\nExample:\n", ".SH EXAMPLES\n")
}
