//! The `etendue` program: see `etendue --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    etendue::cli::main()
}
