//! Files of another kind than is expected, or with changed line ends: what they are is said, wherever they are read.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use std::fs;

const POINTER: &str = "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 12345\n";

/// A folder with a film, its pictures, and files that are neither.
fn with_all_kinds() -> Bench {
    let bench = Bench::new();
    bench.render("--spp 16 --film f.npz -o a.exr -o a.png");
    fs::write(bench.path("lfs.exr"), POINTER).unwrap();
    fs::write(bench.path("lfs.npz"), POINTER).unwrap();
    fs::write(bench.path("lfs.png"), POINTER).unwrap();
    fs::write(bench.path("a.jpg"), b"\xff\xd8\xff\xe0\0\x10JFIF").unwrap();
    fs::write(bench.path("junk"), b"\x7fELF\0\xc3\x28\x01").unwrap();
    fs::create_dir(bench.path("folder")).unwrap();
    for (from, to) in [
        ("a.png", "png.exr"),
        ("a.exr", "exr.npz"),
        ("f.npz", "film.png"),
    ] {
        fs::copy(bench.path(from), bench.path(to)).unwrap();
    }
    bench
}

#[test]
fn what_is_no_scene_is_named() {
    let bench = with_all_kinds();
    for (name, status, kind) in [
        ("a.png", 2, "a PNG picture"),
        ("a.exr", 2, "an EXR picture"),
        ("f.npz", 2, "a ZIP archive, such as a film"),
        ("a.jpg", 2, "a JPEG picture"),
        ("junk", 2, "binary data"),
        (
            "lfs.exr",
            2,
            "a git-lfs pointer; `git lfs pull` fetches the file itself",
        ),
        ("folder", 4, "a directory"),
    ] {
        let text = format!("error: {name}: not a scene ({kind})\n");
        bench
            .run(&format!("check {name}"))
            .code(status)
            .stderr(text.clone());
        let render = format!("render {name} --backend cpu --spp 1 -o b.png");
        bench.run(&render).code(status).stderr(text.clone());
        // Not that its picture would overwrite the scene.
        let render = format!("render {name} --backend cpu --spp 1");
        bench.run(&render).code(status).stderr(text);
    }
}

#[test]
fn what_is_no_table_of_a_scene_is_named() {
    let bench = with_all_kinds();
    let rows = "[[spheres]]\nfile = \"lfs.exr\"\nmaterial = \"white\"\n";
    fs::write(bench.path("rows.toml"), format!("{SCENE}\n{rows}")).unwrap();
    bench
        .run("check rows.toml")
        .code(2)
        .stderr(says("error: lfs.exr: not a CSV file (a git-lfs pointer"));
}

#[test]
fn what_is_no_picture_or_film_is_named() {
    let bench = with_all_kinds();
    for (command, text) in [
        (
            "compare a.exr box.toml",
            "box.toml: not a picture or a film (text, such as a scene file)",
        ),
        ("compare a.exr a.jpg", "a.jpg: invalid picture: "),
        (
            "compare a.exr png.exr",
            "png.exr: not an EXR picture (a PNG picture)",
        ),
        (
            "compare a.exr exr.npz",
            "exr.npz: not a film (an EXR picture)",
        ),
        (
            "compare a.exr film.png",
            "film.png: not a PNG picture (a ZIP archive, such as a film)",
        ),
        (
            "compare a.exr lfs.exr",
            "lfs.exr: not an EXR picture (a git-lfs pointer; `git lfs pull` fetches",
        ),
        (
            "compare lfs.png a.exr",
            "lfs.png: not a PNG picture (a git-lfs pointer",
        ),
        (
            "develop a.png -o b.png",
            "a.png: not a film (a PNG picture)",
        ),
        (
            "develop box.toml -o b.png",
            "box.toml: not a film (text, such as a scene file)",
        ),
        (
            "develop lfs.npz -o b.png",
            "lfs.npz: not a film (a git-lfs pointer",
        ),
        (
            "merge b.npz f.npz lfs.npz",
            "lfs.npz: not a film (a git-lfs pointer",
        ),
        (
            "bench box.toml --engine cpu --reference lfs.exr",
            "lfs.exr: not an EXR picture (a git-lfs",
        ),
        (
            "render box.toml --backend cpu --spp 1 --film lfs.npz",
            "lfs.npz: not a film (a git-lfs",
        ),
    ] {
        bench
            .run(command)
            .code(2)
            .stderr(says(&format!("error: {text}")));
    }
}

/// As a checkout on Windows does to files that .gitattributes calls text.
#[test]
fn changed_line_ends_are_named() {
    let bench = with_all_kinds();
    for name in ["a.exr", "a.png", "f.npz"] {
        let bytes = fs::read(bench.path(name)).unwrap();
        let mut changed = Vec::new();
        for (i, byte) in bytes.iter().enumerate() {
            if *byte == b'\n' && (i == 0 || bytes[i - 1] != b'\r') {
                changed.push(b'\r');
            }
            changed.push(*byte);
        }
        assert_ne!(changed, bytes);
        let text =
            format!("error: {name}: damaged: its line ends were changed, as git does with text");
        fs::write(bench.path(name), changed).unwrap();
        bench
            .run(&format!("compare {name} {name} --max-flip 1"))
            .code(2)
            .stderr(says(&text).and(says(".gitattributes")));
    }
    bench
        .run("develop f.npz -o b.png")
        .code(2)
        .stderr(says("its line ends were changed"));
}

#[test]
fn a_picture_equals_itself_without_limits() {
    let bench = with_all_kinds();
    fs::copy(bench.path("a.png"), bench.path("b.png")).unwrap();
    let same_file = "note: both names lead to the same file";
    for name in ["a.exr", "a.png", "f.npz"] {
        bench
            .run(&format!("compare {name} ./{name}"))
            .success()
            .stdout(says("bit-identical").and(says(same_file)))
            .stderr("");
    }
    bench
        .run("compare a.png b.png --html c.html")
        .success()
        .stdout(says("bit-identical").and(says(same_file).not()));
    // Others need a limit.
    bench.render("--spp 16 --seed 5 -o c.png");
    bench
        .run("compare a.png c.png")
        .code(2)
        .stderr(says("a limit is needed: use --max-flip"));
    bench
        .run("compare a.png c.png --max-flip 1")
        .success()
        .stdout(says("within the limits"));
}

/// A pipe can be read only once, so that nothing can be looked up in it.
#[cfg(target_os = "linux")]
#[test]
fn a_pipe_is_not_opened_twice() {
    let bench = Bench::new();
    let script = "mkfifo pipe && { printf 'no film at all' > pipe & } && timeout 20 \"$0\" develop pipe -o b.png";
    assert_eq!(bench.shell(&[], script), 2, "{}", bench.said());
    assert!(
        bench.said().contains("pipe: not a film: "),
        "{}",
        bench.said()
    );
}
