//! `etendue schema`.

use super::failure::Failure;

/// Prints the JSON Schema of scene files.
pub fn schema() -> Result<(), Failure> {
    super::write_stdout(&format!("{:#}\n", crate::scene::schema::schema()))
}
