//! A log in a file.

use super::Event;
use crate::files::FileError;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A log that grows. Every line is in the file as soon as it is known.
#[derive(Debug)]
pub struct LogFile {
    path: PathBuf,
    file: File,
}

impl LogFile {
    /// Begins a log. With `go_on`, a log that is there keeps its lines, but for a last one without an end, which a killed process
    /// has left; else it is replaced.
    pub fn open(path: &Path, go_on: bool) -> Result<Self, FileError> {
        let open = || {
            let mut options = OpenOptions::new();
            options.create(true).read(go_on).write(true);
            let mut file = options.truncate(!go_on).open(path)?;
            if go_on && file.metadata()?.is_file() {
                let end = end_of_lines(&mut file)?;
                file.set_len(end)?;
                file.seek(SeekFrom::Start(end))?;
            }
            Ok(file)
        };
        let file = open().map_err(|e| FileError::io(path, "cannot write", &e))?;
        let path = path.into();
        Ok(Self { path, file })
    }

    /// Adds a line.
    pub fn add(&mut self, event: &Event) -> Result<(), FileError> {
        let written = self.file.write_all(event.line().as_bytes());
        written.map_err(|e| FileError::io(&self.path, "cannot write", &e))
    }
}

/// The length of the file up to its last line break.
fn end_of_lines(file: &mut File) -> io::Result<u64> {
    const STEP: u64 = 4096;
    let mut end = file.metadata()?.len();
    let mut bytes = Vec::new();
    while end > 0 {
        let start = end.saturating_sub(STEP);
        file.seek(SeekFrom::Start(start))?;
        bytes.clear();
        file.take(end - start).read_to_end(&mut bytes)?;
        if let Some(at) = bytes.iter().rposition(|b| *b == b'\n') {
            return Ok(start + at as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Message, read};

    #[test]
    fn a_log_goes_on_where_a_killed_process_left_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.jsonl");
        let event = |text: &str| Event::Message(Message::of(text));
        let mut log = LogFile::open(&path, true).unwrap();
        log.add(&event("one")).unwrap();
        drop(log);
        let mut text = std::fs::read_to_string(&path).unwrap();
        for half in ["{\"event\":\"mess", &"x".repeat(9000)] {
            std::fs::write(&path, text.clone() + half).unwrap();
            let mut log = LogFile::open(&path, true).unwrap();
            log.add(&event("two")).unwrap();
            text += &event("two").line();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        assert!(read(&path).is_ok());
        // A new log replaces it.
        LogFile::open(&path, false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "");
        let full = LogFile::open(Path::new("/dev/full"), false);
        assert!(full.unwrap().add(&event("lost")).is_err());
    }
}
