//! Files that are no scene at all.

use super::FULL;
use etendue::scene::parse::{MAX_FILE_BYTES, ReadError, read};
use std::io::ErrorKind;
use std::path::Path;

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let missing = folder.path().join("missing.toml");
    for (path, kind) in [
        (missing.as_path(), ErrorKind::NotFound),
        (folder.path(), ErrorKind::IsADirectory),
    ] {
        match read(path) {
            Err(error @ ReadError::Io { .. }) => {
                let message = error.to_string();
                assert!(
                    message.starts_with(&path.display().to_string()),
                    "{message}"
                );
                let ReadError::Io { source, .. } = error else {
                    unreachable!("matched above");
                };
                assert_eq!(source.kind(), kind);
            }
            other => panic!("{other:?}"),
        }
    }
}

/// The message about a file with this content, without its path.
fn message_about(content: &[u8]) -> String {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("s.toml");
    std::fs::write(&path, content).expect("written");
    let Err(ReadError::Invalid(errors)) = read(&path) else {
        panic!("{content:?} passes");
    };
    let shown = errors[0].to_string();
    let name = path.display().to_string();
    shown
        .strip_prefix(&name)
        .expect("begins with the path")
        .to_owned()
}

#[test]
fn files_that_are_no_text() {
    let utf8 = "is not valid UTF-8; a scene file is UTF-8 text";
    assert_eq!(
        message_about(b"\xff\xfe[\0c\0"),
        format!(":1:1: byte 0xff {utf8}")
    );
    assert_eq!(
        message_about(b"title = \"x\"\r\n# \xc3\xb6 \xe9t\xe9\n"),
        format!(":2:5: byte 0xe9 {utf8}")
    );
    assert_eq!(
        message_about(b"\xef\xbb\xbf\xc3"),
        format!(":1:1: byte 0xc3 {utf8}")
    );
    let nul = "found a NUL character; a scene file is TOML text";
    assert_eq!(message_about(b"title\0 = 1"), format!(":1:6: {nul}"));
    for (content, kind) in [
        (&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], "a PNG picture"),
        (b"\x76\x2f\x31\x01\x02\0\0\0", "an EXR picture"),
        (b"PK\x03\x04\x14\x00\x06", "a ZIP archive, such as a film"),
        (b"\xff\xd8\xff\xe0\0\x10JFIF", "a JPEG picture"),
        (b"\x7fELF\0\xc3\x28", "binary data"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n",
            "a git-lfs pointer; `git lfs pull` fetches the file itself",
        ),
    ] {
        assert_eq!(message_about(content), format!(": not a scene ({kind})"));
    }
    assert!(message_about(b"").starts_with(": is empty"));
}

#[test]
fn files_of_absurd_size() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("large.toml");
    let file = std::fs::File::create(&path).expect("created");
    // Sparse: it takes no room.
    file.set_len(MAX_FILE_BYTES + 1).expect("grown");
    let error = read(&path).expect_err("too large").to_string();
    let expected = "the file has 67108865 bytes or more; a scene file has at most 64 MiB";
    assert!(error.ends_with(expected), "{error}");
    assert!(matches!(read(&path), Err(ReadError::Invalid(_))));

    file.set_len(MAX_FILE_BYTES).expect("cut");
    let error = read(&path).expect_err("NULs").to_string();
    assert!(
        error.contains("NUL"),
        "as large as allowed, and read: {error}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn endless_devices_end() {
    let error = read(Path::new("/dev/zero"))
        .expect_err("endless")
        .to_string();
    assert!(error.ends_with("at most 64 MiB"), "{error}");
}

#[test]
fn a_read_file_knows_its_path() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("full.toml");
    std::fs::write(&path, FULL).expect("written");
    let scene = read(&path).expect("valid");
    assert_eq!(scene.path, path);
}
