//! What a file is, by its first bytes: for messages about a file that is not what it should be.

use super::FileError;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes that are looked at.
const LOOKED_AT: u64 = 1 << 20;

/// The first bytes of a PNG picture that has had its line ends changed. They end in CR LF, control-Z, LF to show this
/// (PNG specification, 5.2).
const CHANGED_PNG: [&[u8]; 4] = [
    b"\x89PNG\n\x1a\n",
    b"\x89PNG\r\n\x1a\r\n",
    b"\x89PNG\r\r\n\x1a\r\n",
    b"\x89PNG\r\x1a\r",
];

/// A kind of file that its first bytes tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A PNG picture.
    Png,
    /// An EXR picture.
    Exr,
    /// A ZIP archive, as films are.
    Zip,
    /// A JPEG picture.
    Jpeg,
    /// A TIFF picture.
    Tiff,
    /// A WebP picture.
    Webp,
    /// A Radiance HDR picture.
    Hdr,
    /// What git-lfs leaves in place of a file that it has not fetched.
    LfsPointer,
    /// Text.
    Text,
    /// No bytes at all.
    Empty,
}

impl FileKind {
    /// The kind of a file that begins with these bytes.
    pub fn of(start: &[u8]) -> Option<Self> {
        match start {
            [] => Some(Self::Empty),
            [0x89, b'P', b'N', b'G', ..] => Some(Self::Png),
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::Exr),
            [b'P', b'K', 3, 4, ..] => Some(Self::Zip),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => Some(Self::Tiff),
            [
                b'R',
                b'I',
                b'F',
                b'F',
                _,
                _,
                _,
                _,
                b'W',
                b'E',
                b'B',
                b'P',
                ..,
            ] => Some(Self::Webp),
            _ if start.starts_with(b"#?RADIANCE") || start.starts_with(b"#?RGBE") => {
                Some(Self::Hdr)
            }
            _ if start.starts_with(b"version https://git-lfs") => Some(Self::LfsPointer),
            _ if is_text(start) => Some(Self::Text),
            _ => None,
        }
    }

    /// Whether it is a picture of other programs, of the kinds that are only read.
    pub fn is_other_picture(self) -> bool {
        matches!(self, Self::Jpeg | Self::Tiff | Self::Webp | Self::Hdr)
    }

    /// The same for a file that should be text.
    pub fn of_no_text(start: &[u8]) -> Option<Self> {
        Self::of(start).filter(|kind| kind.is_no_text())
    }

    fn is_no_text(self) -> bool {
        !matches!(self, Self::Text | Self::Empty)
    }
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "a PNG picture",
            Self::Exr => "an EXR picture",
            Self::Zip => "a ZIP archive, such as a film",
            Self::Jpeg => "a JPEG picture",
            Self::Tiff => "a TIFF picture",
            Self::Webp => "a WebP picture",
            Self::Hdr => "a Radiance HDR picture",
            Self::LfsPointer => "a git-lfs pointer; `git lfs pull` fetches the file itself",
            Self::Text => "text, such as a scene file",
            Self::Empty => "an empty file",
        })
    }
}

/// Whether the first bytes are UTF-8 without control characters. Fewer than four may be the beginning of anything.
fn is_text(start: &[u8]) -> bool {
    const FEWEST: usize = 4;
    const ENOUGH: usize = 512;
    let start = &start[..start.len().min(ENOUGH)];
    let text = match std::str::from_utf8(start) {
        Ok(text) => text,
        // The last character may be cut.
        Err(e) if e.error_len().is_none() => {
            std::str::from_utf8(&start[..e.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => return false,
    };
    let is_control = |c: char| c.is_control() && !c.is_whitespace();
    start.len() >= FEWEST && !text.contains(is_control)
}

/// Whether line ends of binary data have been changed: every LF follows a CR, or none does though chance alone would put
/// many there.
fn has_changed_line_ends(bytes: &[u8]) -> bool {
    /// LFs behind a CR that are no chance: it has the probability 256⁻⁴.
    const FEW: usize = 4;
    /// Pairs of CR and LF to be expected. There are none by chance with the probability exp(-12).
    const MANY: f64 = 12.0;
    if CHANGED_PNG.iter().any(|start| bytes.starts_with(start)) {
        return true;
    }
    let lf = bytes.iter().filter(|b| **b == b'\n').count();
    let pairs = bytes.windows(2).filter(|pair| pair == b"\r\n").count();
    (lf >= FEW && pairs == lf) || (pairs == 0 && pairs_by_chance(bytes) > MANY)
}

/// How many pairs of CR and LF there would be if each stood by chance where it stands in numbers of up to eight bytes.
fn pairs_by_chance(bytes: &[u8]) -> f64 {
    const WIDTH: usize = 8;
    let in_chunk = |chunk: &[u8]| -> f64 {
        let count = |byte: u8, first: usize| {
            let all = chunk.iter().skip(first).step_by(WIDTH);
            all.filter(|b| **b == byte).count() as f64
        };
        let pairs = |k| count(b'\r', k) * count(b'\n', (k + 1) % WIDTH);
        (0..WIDTH).map(pairs).sum::<f64>() * WIDTH as f64 / chunk.len() as f64
    };
    // Neighbouring numbers are alike, distant ones may be of another array.
    bytes.chunks(4096).map(in_chunk).sum()
}

/// The error of a reader of `wanted` files (`what` in words), or a better one: that the file is of another kind, or that its line
/// ends have been changed.
pub fn explain(error: FileError, what: &str, wanted: Option<FileKind>) -> FileError {
    let FileError::Content { path, message } = error else {
        return error;
    };
    let start = start_of(&path);
    let start = start.as_deref();
    let message = match start.and_then(FileKind::of) {
        Some(found) if Some(found) != wanted => format!("not {what} ({found})"),
        Some(_) if start.is_some_and(has_changed_line_ends) => {
            "damaged: its line ends were changed, as git does with text; mark such files as binary in .gitattributes, and \
             check them out or make them again"
                .into()
        }
        _ => message,
    };
    FileError::Content { path, message }
}

/// Refuses a file at `path` whose first bytes tell that it is no text, for one that should be `what`. A file that is not there, or no
/// file, is for others to refuse.
pub fn check_text(path: &Path, what: &str) -> Result<(), FileError> {
    match of_file(path).filter(|kind| kind.is_no_text()) {
        Some(kind) => Err(FileError::content(path, format!("not {what} ({kind})"))),
        None => Ok(()),
    }
}

/// The kind of the file at `path`, if it is known.
pub fn of_file(path: &Path) -> Option<FileKind> {
    FileKind::of(&start_of(path)?)
}

/// Whether git-lfs has left a pointer in place of the file.
pub fn is_lfs_pointer(path: &Path) -> bool {
    of_file(path) == Some(FileKind::LfsPointer)
}

/// The first bytes of a file. Not of a pipe: it has given them away already, and opening it again may wait for ever.
fn start_of(path: &Path) -> Option<Vec<u8>> {
    if !std::fs::metadata(path).ok()?.is_file() {
        return None;
    }
    let mut start = Vec::new();
    let mut file = File::open(path).ok()?.take(LOOKED_AT);
    file.read_to_end(&mut start).ok()?;
    Some(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of all values, as compressed data has them.
    fn noise(count: u64) -> Vec<u8> {
        let hash = |i: u64| {
            let h = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (h ^ (h >> 32)).wrapping_mul(0xbf58_476d_1ce4_e5b9)
        };
        (0..count).map(|i| (hash(i) >> 56) as u8).collect()
    }

    fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut rest = bytes;
        while let Some(first) = rest.first() {
            if rest.starts_with(from) {
                out.extend(to);
                rest = &rest[from.len()..];
            } else {
                out.push(*first);
                rest = &rest[1..];
            }
        }
        out
    }

    #[test]
    fn kinds_are_known_by_their_first_bytes() {
        for (start, kind) in [
            (&b"\x89PNG\r\n\x1a\n"[..], Some(FileKind::Png)),
            (b"II*\0\x08\0\0\0", Some(FileKind::Tiff)),
            (b"MM\0*\0\0\0\x08", Some(FileKind::Tiff)),
            (b"RIFF\x10\0\0\0WEBPVP8L", Some(FileKind::Webp)),
            (b"#?RADIANCE\n", Some(FileKind::Hdr)),
            (b"\x76\x2f\x31\x01\x02", Some(FileKind::Exr)),
            (b"PK\x03\x04", Some(FileKind::Zip)),
            (b"\xff\xd8\xff\xe0", Some(FileKind::Jpeg)),
            (
                b"version https://git-lfs.github.com/spec/v1\noid",
                Some(FileKind::LfsPointer),
            ),
            ("[camera] # ö".as_bytes(), Some(FileKind::Text)),
            (b"cut: \xc3", Some(FileKind::Text)),
            (b"PK", None),
            (b"", Some(FileKind::Empty)),
            (b"\x00\x01", None),
            (b"caf\xe9 au lait", None),
        ] {
            assert_eq!(FileKind::of(start), kind, "{start:?}");
        }
    }

    #[test]
    fn changed_line_ends_are_told_from_other_damage() {
        for count in [3000, 1 << 20] {
            let good = noise(count);
            assert!(!has_changed_line_ends(&good), "{count}");
            assert!(has_changed_line_ends(&replaced(&good, b"\n", b"\r\n")));
        }
        let good = noise(1 << 20);
        assert!(has_changed_line_ends(&replaced(&good, b"\r\n", b"\n")));
        // Too little to tell.
        assert!(!has_changed_line_ends(&replaced(
            &good[..3000],
            b"\r\n",
            b"\n"
        )));
        assert!(!has_changed_line_ends(&[0; 5000]));
        // Counts of 10 and 13 samples.
        let counts = b"\n\0\0\0\0\0\0\0\r\0\0\0\0\0\0\0".repeat(1000);
        assert!(!has_changed_line_ends(&counts));
        assert!(!has_changed_line_ends(b""));
        let png = b"\x89PNG\r\n\x1a\n";
        assert!(!has_changed_line_ends(png));
        assert!(has_changed_line_ends(&replaced(png, b"\r\n", b"\n")));
        assert!(has_changed_line_ends(&replaced(png, b"\n", b"\r\n")));
    }

    #[test]
    fn a_reader_s_words_stay_where_nothing_better_is_known() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("x");
        let said = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let error = FileError::content(&path, "its array is short");
            let error = explain(error, "a film", Some(FileKind::Zip));
            assert!(error.is_content());
            error.to_string().rsplit_once("x: ").unwrap().1.to_owned()
        };
        assert_eq!(said(b"PK\x03\x04..."), "its array is short");
        assert_eq!(said(b"\x00..."), "its array is short");
        assert_eq!(said(b"\x89PNG"), "not a film (a PNG picture)");
        let film = [b"PK\x03\x04", &noise(4000)[..]].concat();
        assert!(said(&replaced(&film, b"\n", b"\r\n")).starts_with("damaged: its line ends"));
    }
}
