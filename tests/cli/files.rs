//! No output takes the place of an input, or of another output: refused before any work, and nothing written.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use std::fs;

/// Names and contents of the folder.
fn contents(bench: &Bench) -> Vec<(String, Vec<u8>)> {
    let read = |name: String| {
        let bytes = fs::read(bench.path(&name)).unwrap_or_default();
        (name, bytes)
    };
    bench.names().into_iter().map(read).collect()
}

/// Runs each command, which must be refused with this text and leave everything as it was.
fn refused(bench: &Bench, commands: &[(&str, &str)]) {
    let before = contents(bench);
    for (command, text) in commands {
        bench
            .run(command)
            .code(2)
            .stdout("")
            .stderr(says("error: ").and(says(text)));
        assert!(contents(bench) == before, "{command} changed something");
    }
}

const LOST: &str = " would overwrite ";
const TWICE: &str = "are the same file; name two different files";

/// A scene with both kinds of rows, `rows.toml`.
fn with_rows(bench: &Bench) {
    fs::write(bench.path("p.csv"), "x,y,z,radius\n0,0.2,0.5,0.1\n").unwrap();
    let lamps = "x,y,z,nx,ny,nz,radius,r,g,b\n0,2,0,0,-1,0,0.1,1,1,1\n";
    fs::write(bench.path("l.csv"), lamps).unwrap();
    let rows =
        "[[spheres]]\nfile = \"p.csv\"\nmaterial = \"white\"\n[[lights]]\nfile = \"l.csv\"\n";
    fs::write(bench.path("rows.toml"), format!("{SCENE}\n{rows}")).unwrap();
}

#[test]
fn render_never_overwrites_its_scene() {
    let bench = Bench::new();
    with_rows(&bench);
    fs::copy(bench.path("box.toml"), bench.path("x.png")).unwrap();
    fs::copy(bench.path("box.toml"), bench.path("x.exr")).unwrap();
    let cpu = |rest: &str| format!("render {rest} --backend cpu --spp 1");
    let commands = [
        (cpu("box.toml --report box.toml -o a.png"), LOST),
        (cpu("box.toml --report ./box.toml -o a.png"), LOST),
        (cpu("box.toml --dump-wgsl box.toml -o a.png"), LOST),
        (cpu("box.toml --film box.toml -o a.png"), LOST),
        (cpu("rows.toml --report p.csv -o a.png"), LOST),
        (cpu("rows.toml --dump-wgsl l.csv -o a.png"), LOST),
        (cpu("x.png -o x.png"), LOST),
        (cpu("x.png -o a.png --watch x.png"), LOST),
        // By default.
        (
            cpu("x.png"),
            "the default picture (--output changes it) x.png would overwrite the scene",
        ),
        (cpu("x.exr"), "x.exr would overwrite the scene"),
    ];
    let commands: Vec<(&str, &str)> = commands.iter().map(|(c, t)| (c.as_str(), *t)).collect();
    refused(&bench, &commands);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("x.png", bench.path("link.png")).unwrap();
        refused(
            &bench,
            &[(
                &cpu("x.png -o link.png"),
                "link.png would overwrite the scene x.png",
            )],
        );
    }
}

#[test]
fn two_outputs_are_never_the_same_file() {
    let bench = Bench::new();
    bench.render("--spp 1 --film f.npz -o f.png");
    fs::create_dir(bench.path("sub")).unwrap();
    let cpu = |rest: &str| format!("render box.toml --backend cpu --spp 2 {rest}");
    let commands = [
        cpu("-o a.png --report a.png"),
        cpu("-o a.png --dump-wgsl a.png"),
        cpu("-o a.png --watch a.png"),
        cpu("-o a.png -o ./a.png"),
        cpu("-o a.png -o sub/../a.png"),
        cpu("--film f.npz --report f.npz -o a.png"),
        cpu("--film f.npz --dump-wgsl ./f.npz -o a.png"),
        cpu("-o a.png --report - --dump-wgsl -"),
    ];
    let commands: Vec<(&str, &str)> = commands.iter().map(|c| (c.as_str(), TWICE)).collect();
    refused(&bench, &commands);
    // An existing film is resumed.
    bench.render("--spp 2 --film f.npz -o a.png --report r.json --dump-wgsl k.wgsl --watch w.png");
    assert_eq!(bench.film("f.npz").coverage.samples(), (2, 2));
}

#[test]
fn inputs_are_never_overwritten() {
    let bench = Bench::new();
    bench.render("--spp 8 --film f.npz -o a.exr");
    fs::copy(bench.path("f.npz"), bench.path("film.png")).unwrap();
    fs::copy(bench.path("a.exr"), bench.path("b.exr")).unwrap();
    fs::create_dir(bench.path("golden")).unwrap();
    fs::copy(bench.path("a.exr"), bench.path("golden/box.exr")).unwrap();
    with_rows(&bench);
    refused(
        &bench,
        &[
            ("compare a.exr b.exr --html a.exr", LOST),
            ("compare a.exr b.exr --html ./b.exr", LOST),
            (
                "compare a.exr b.exr --html -",
                "--html can't be written to stdout",
            ),
            ("develop film.png -o film.png", LOST),
            ("develop f.npz -o c.png -o ./c.png", TWICE),
            (
                "render box.toml --backend cpu --spp 16 --film film.png -o film.png",
                TWICE,
            ),
            ("bench box.toml --engine cpu --json box.toml", LOST),
            ("bench rows.toml --engine cpu --json p.csv", LOST),
            (
                "bench box.toml --engine cpu --reference a.exr --json a.exr",
                LOST,
            ),
            (
                "bench box.toml --engine cpu --plot a.svg --plot ./a.svg",
                TWICE,
            ),
            (
                "bench box.toml --engine cpu --plot a.svg --json a.svg",
                TWICE,
            ),
            ("regress . --backend cpu --junit box.toml", LOST),
            ("regress . --backend cpu --html golden/box.exr", LOST),
            ("regress . --backend cpu --html p.csv", LOST),
            ("regress . --backend cpu --html r --junit r", TWICE),
            (
                "regress . --backend cpu --html -",
                "--html can't be written to stdout",
            ),
            (
                "make-scene spheres --count 1000 -o y.csv",
                "the name of a scene must end in .toml",
            ),
            (
                "make-scene lights --count 3 -o y",
                "the name of a scene must end in .toml",
            ),
            ("merge x.png f.npz", "its name ends in .npz"),
            (
                "render box.toml --backend cpu --film x.exr -o a.png",
                "its name ends in .npz",
            ),
        ],
    );
}

#[test]
fn a_dash_means_stdout_for_every_text_output() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 1 -o a.png --dump-wgsl - --quiet")
        .success()
        .stdout(says("@compute"));
    fs::create_dir(bench.path("scenes")).unwrap();
    fs::copy(bench.path("box.toml"), bench.path("scenes/box.toml")).unwrap();
    bench
        .run("regress scenes --backend cpu --junit -")
        .code(1)
        .stdout(predicate::str::starts_with("<?xml").and(says("</testsuites>")))
        .stderr(says("1 scene: 1 new"));
    assert_eq!(bench.names(), ["a.png", "box.toml", "scenes"]);
}

/// A film may have any name that says nothing else, and is known by its content.
#[test]
fn films_of_other_names() {
    let bench = Bench::new();
    bench.render("--spp 16 --film f -o a.exr");
    bench.run("compare a.exr f").success().stdout(says(
        "the same samples, equal but for the rounding of files",
    ));
}

#[cfg(unix)]
#[test]
fn read_only_files_are_not_replaced() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Bench::new();
    bench.render("--spp 1 --film f.npz -o a.png");
    let before = fs::read(bench.path("f.npz")).unwrap();
    fs::set_permissions(bench.path("f.npz"), fs::Permissions::from_mode(0o444)).unwrap();
    bench
        .run("render box.toml --backend cpu --spp 4 --film f.npz -o a.png")
        .code(4)
        .stderr("error: f.npz: cannot write: it is read-only\n");
    assert!(fs::read(bench.path("f.npz")).unwrap() == before);
    bench.run("develop f.npz -o b.png").success();
    // Pictures and reports too.
    for name in ["a.png", "r.json"] {
        fs::write(bench.path(name), "kept").unwrap();
        fs::set_permissions(bench.path(name), fs::Permissions::from_mode(0o444)).unwrap();
    }
    for flags in ["-o a.png", "-o b.png --report r.json"] {
        bench
            .run(&format!("render box.toml --backend cpu --spp 1 {flags}"))
            .code(4)
            .stderr(says("cannot write: it is read-only"));
    }
    assert_eq!(fs::read(bench.path("a.png")).unwrap(), b"kept");
}

/// A device that is always full stands for a full disk.
#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_takes_no_other_with_it() {
    let bench = Bench::new();
    std::os::unix::fs::symlink("/dev/full", bench.path("full.exr")).unwrap();
    let full = || says("full.exr: cannot write: no space left on device");
    bench
        .run("render box.toml --backend cpu --spp 2 --film f.npz -o full.exr -o ok.png --report r.json")
        .code(4)
        .stderr(full().and(says("wrote f.npz, ok.png")));
    for name in ["f.npz", "ok.png", "r.json"] {
        assert!(bench.path(name).exists(), "{name}");
    }
    bench
        .run("develop f.npz -o full.exr -o later.png")
        .code(4)
        .stderr(full().and(says("wrote later.png")));
    assert!(bench.path("later.png").exists());
    bench
        .run("develop f.npz -o full.exr")
        .code(4)
        .stderr(full().and(says("wrote").not()));
}

#[test]
fn the_scene_of_a_film_is_the_one_that_is_given() {
    let bench = Bench::new();
    bench.render("--spp 1 --film f.npz -o a.png");
    let other = SCENE.replace("radius   = 0.45", "radius   = 0.4");
    fs::write(bench.path("other.toml"), other).unwrap();
    for what in ["-o b.exr --layers id", "-o b.exr"] {
        let develop = format!("develop f.npz {what} --scene");
        bench.run(&format!("{develop} box.toml")).success();
        bench
            .run(&format!("{develop} none.toml"))
            .code(4)
            .stderr(says("error: none.toml: cannot read the scene: "));
        bench
            .run(&format!("{develop} other.toml"))
            .code(2)
            .stderr(says(
                "error: other.toml: this is not the scene that the film was rendered from",
            ));
    }
}

/// An edited scene is a person's own work.
#[test]
fn make_scene_does_not_replace_an_edited_file() {
    let bench = Bench::new();
    for (name, command) in [
        ("few.toml", "make-scene spheres --count 3 -o few.toml"),
        ("many.csv", "make-scene spheres --count 300 -o many.toml"),
        ("cloud.csv", "make-scene cloud --count 300"),
        ("particles.xyz", "make-scene particles --count 3"),
    ] {
        bench.run(command).success();
        let made = fs::read(bench.path(name)).unwrap();
        // The same again changes nothing.
        bench.run(command).success();
        fs::write(bench.path(name), "mine").unwrap();
        bench
            .run(command)
            .code(4)
            .stderr(says(name).and(says("--force replaces it")));
        assert_eq!(fs::read(bench.path(name)).unwrap(), b"mine");
        bench.run(&format!("{command} --force")).success();
        assert_eq!(fs::read(bench.path(name)).unwrap(), made);
    }
}

#[test]
fn a_film_that_has_everything_says_so() {
    let bench = Bench::new();
    bench.render("--spp 8 --film f.npz -o a.png");
    bench
        .run("render box.toml --backend cpu --spp 8 --film f.npz -o b.png")
        .success()
        .stderr(says(
            "the film already holds 8 samples per pixel; nothing rendered",
        ));
    assert!(bench.path("b.png").exists());
}

#[cfg(unix)]
#[test]
fn a_link_to_nothing_leads_there_and_a_pipe_is_refused() {
    use std::os::unix::fs::symlink;
    let bench = Bench::new();
    fs::create_dir(bench.path("far")).unwrap();
    for name in ["a.png", "f.npz", "r.json"] {
        symlink(format!("far/{name}"), bench.path(name)).unwrap();
    }
    bench.render("--spp 1 -o a.png --film f.npz --report r.json");
    for name in ["a.png", "f.npz", "r.json"] {
        assert!(bench.path(name).is_symlink(), "{name}");
        assert!(bench.path(&format!("far/{name}")).is_file(), "{name}");
    }
    // It is resumed through the link.
    bench.render("--spp 2 -o a.png --film f.npz");
    assert_eq!(bench.film("far/f.npz").coverage.samples(), (2, 2));

    assert_eq!(bench.shell(&[], "mkfifo pipe.png"), 0);
    let refused = bench.run("render box.toml --backend cpu --spp 1 -o pipe.png");
    refused
        .code(4)
        .stderr(says("pipe.png: cannot write: it is a pipe; name a file"));
}

/// A pipe that the shell opens for the program has no name, and is written.
#[cfg(unix)]
#[test]
fn open_pipes_are_written() {
    let bench = Bench::new();
    let script = r#""$0" render box.toml --backend cpu --quiet --spp 1 -o a.png --report /dev/stdout | grep -q '"spp"'"#;
    assert_eq!(bench.shell(&[], script), 0, "{}", bench.said());
}
