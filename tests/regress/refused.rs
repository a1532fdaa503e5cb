//! Scenes and goldens that can't be used, and what is said of them.

use super::*;

/// Something is in the way of the film that a failure leaves: it is a failure all the same.
#[test]
fn a_failure_whose_evidence_cannot_be_saved_is_a_failure() {
    let f = Folder::new(&["ball"]);
    f.bless();
    let (film, mut provenance) = render(&BALL.replace("[20.0", "[30.0"), 0, 64);
    // The golden is of brighter light, under the hash of the scene as it is.
    provenance.scene_hash = render(BALL, 0, 4).1.scene_hash;
    write_exr(&f.golden("ball.exr"), &film, &provenance, ExrChannels::All).expect("written");
    std::fs::create_dir_all(f.golden("ball.actual.npz").join("in the way")).expect("made");
    f.run(&[])
        .code(1)
        .stdout(contains("FAILED  ball").and(contains("its film and page could not be saved: ")));
}

#[test]
fn bad_input_never_passes() {
    let f = Folder::new(&[]);
    f.run(&[]).code(2).stderr(contains("nothing to compare"));
    f.run(&["--bless"])
        .code(2)
        .stderr(contains("nothing to compare"));
    let f = Folder::new(&["ball", "other"]);
    f.bless();
    f.run(&["--filter", "cube"])
        .code(2)
        .stderr(contains("whose name contains \"cube\""));

    f.put(
        "ball",
        &BALL.replace("radius = 0.5\nmaterial", "radius = 0.4\nmaterial"),
    );
    f.run(&[])
        .code(2)
        .stdout(contains("is of another scene than").and(contains("1 passed, 1 unusable")));
    f.put("ball", "nonsense");
    f.run(&[])
        .code(2)
        .stdout(contains("unusable  ball").and(contains("ball.toml")));
    f.put("ball", BALL);
    std::fs::write(f.golden("ball.exr"), "no picture").expect("written");
    f.run(&[])
        .code(2)
        .stdout(contains("unusable  ball").and(contains("ball.exr")));
    std::fs::remove_file(f.path("other.toml")).expect("it was there");
    std::fs::remove_file(f.golden("ball.exr")).expect("it was there");
    f.run(&[])
        .code(1)
        .stdout(contains("new  ball").and(contains("orphaned  other")));
    Command::new(assert_cmd::cargo::cargo_bin!("etendue"))
        .args(["regress", "/nowhere"])
        .assert()
        .code(4);
}

#[test]
fn invalid_scenes_are_named_even_without_a_golden() {
    let f = Folder::new(&["good"]);
    f.put("bad", "nonsense");
    f.run(&[])
        .code(2)
        .stdout(contains("unusable  bad: ").and(contains("bad.toml:1:")))
        .stdout(
            contains("good.exr does not exist; create it: etendue regress ")
                .and(contains("2 scenes: 1 new, 1 unusable")),
        );
    // Each stands in one list alone, and a quiet run says nothing else.
    let done = f.run(&["--quiet"]);
    let done = done.get_output();
    let out = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(out.matches("good: ").count(), 1, "{out}");
    assert!(done.stderr.is_empty());
}

#[test]
fn hidden_files_and_folders_are_no_scenes() {
    let f = Folder::new(&["good"]);
    f.put(".hidden", "nonsense");
    f.put("._good", "nonsense");
    std::fs::create_dir(f.path("folder.toml")).expect("made");
    std::fs::write(f.path("LOUD.TOML"), "nonsense").expect("written");
    f.run(&["--bless"])
        .code(0)
        .stdout(contains("1 scene: 1 blessed"))
        .stderr(contains(
            "LOUD.TOML is ignored: the name of a scene ends in .toml",
        ));
    std::fs::write(f.path("golden/._good.exr"), "nonsense").expect("written");
    f.run(&[]).code(0).stdout(contains("1 scene: 1 passed"));
}

/// A golden that git-lfs has not fetched is no regression, and says what to do.
#[test]
fn goldens_that_git_has_not_fetched_or_has_changed_are_named() {
    let f = Folder::new(&["one"]);
    f.run(&["--bless", "--max-spp", "64"]).code(0);
    let golden = f.path("golden/one.exr");
    let good = std::fs::read(&golden).expect("there");
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n";
    std::fs::write(&golden, pointer).expect("written");
    f.run(&[])
        .code(2)
        .stdout(contains("unusable  one: ").and(contains(
            "not an EXR picture (a git-lfs pointer; `git lfs pull`",
        )));
    // Whether it still passes is not known, so it is not replaced.
    f.run(&["--bless"])
        .code(2)
        .stdout(contains("unusable  one: ").and(contains("run `git lfs pull` first")));
    f.run(&["--review"])
        .code(2)
        .stderr(contains("accept it as the golden").not());
    assert_eq!(std::fs::read(&golden).expect("there"), pointer.as_bytes());
    let mut changed = Vec::new();
    for byte in good {
        changed.extend((byte == b'\n').then_some(b'\r'));
        changed.push(byte);
    }
    std::fs::write(&golden, changed).expect("written");
    f.run(&[])
        .code(2)
        .stdout(contains("one.exr: damaged: its line ends were changed"));
}

#[test]
fn goldens_respect_max_spp_and_warn_if_they_are_noisy() {
    let f = Folder::new(&["one"]);
    f.run(&["--bless", "--max-spp", "8"])
        .code(0)
        .stdout(contains("8 samples per pixel"))
        .stderr(
            contains("warning: one: ").and(contains("--power asks for 1.00 %; raise --max-spp")),
        );
    let picture = read_exr(&f.golden("one.exr")).expect("a golden");
    assert_eq!(picture.samples.expect("counts")[0], 8);
    f.run(&[]).code(0);
    f.run(&["--bless", "--max-spp", "7"])
        .code(2)
        .stdout(contains(
            "a golden of this scene needs at least 8 samples per pixel",
        ));
    // Flags for creating goldens need --bless.
    for flags in [["--max-spp", "8"], ["--power", "2%"], ["--size", "8x8"]] {
        f.run(&flags).code(2).stderr(contains("--bless"));
    }
}

/// The lamp is turned away, so that the picture stays black; or it is off, so that it must be black.
#[test]
fn a_golden_without_light_is_no_evidence() {
    let dark = BALL.replace("normal = [0.0, -1.0, 0.0]", "normal = [0.0, 1.0, 0.0]");
    let f = Folder::new(&[]);
    f.put("one", &dark);
    f.run(&["--bless", "--max-spp", "64"])
        .code(2)
        .stdout(contains("holds next to no light").and(contains("no evidence")));
    assert!(!f.golden("one.exr").exists());
    // A golden that an earlier version has made.
    let (film, mut provenance) = render(&dark, 0, 64);
    provenance.describe(&film);
    std::fs::create_dir_all(f.path("golden")).expect("made");
    write_exr(&f.golden("one.exr"), &film, &provenance, ExrChannels::All).expect("written");
    f.run(&[])
        .code(2)
        .stdout(contains("unusable  one").and(contains("no evidence")));

    f.put(
        "one",
        &dark.replace("[20.0, 20.0, 20.0]", "[0.0, 0.0, 0.0]"),
    );
    f.run(&["--bless", "--max-spp", "64"]).code(0);
    f.run(&[]).code(0);
}

#[test]
fn without_an_adapter_there_is_no_verdict() {
    let f = Folder::new(&["one"]);
    f.bless();
    let regress = |flags: &[&str]| {
        Command::new(assert_cmd::cargo::cargo_bin!("etendue"))
            .arg("regress")
            .arg(f.0.path())
            .args(flags)
            // As if there were no driver.
            .env("VK_DRIVER_FILES", "/nowhere")
            .env("VK_ICD_FILENAMES", "/nowhere")
            .assert()
    };
    regress(&["--backend", "gpu"])
        .code(3)
        .stdout("")
        .stderr(contains("no Vulkan adapter"));
    regress(&["--adapter", "x"]).code(3);
    regress(&[])
        .code(0)
        .stderr(contains("rendering on the CPU reference"));
}

/// Headers that have been damaged, or written by hand.
#[test]
fn a_header_that_does_not_fit_the_pixels_is_damage() {
    let f = Folder::new(&["one"]);
    f.run(&["--bless", "--max-spp", "64"]).code(0);
    let path = f.golden("one.exr");
    let good = std::fs::read(&path).expect("a golden");
    for (name, value, told) in [
        (
            "samples",
            80i32,
            "its header says samples = 80, but its pixels have 64 on average",
        ),
        (
            "strata",
            3,
            "64 samples per pixel are no whole rounds of 3 x 3 strata",
        ),
        (
            "strata",
            8,
            "64 samples per pixel are 1 rounds of 8 x 8 strata, but it has 4 replicates",
        ),
        (
            "strata",
            0,
            "64 samples per pixel are no whole rounds of 0 x 0 strata",
        ),
    ] {
        let mark = format!("{name}\0int\0\x04\0\0\0");
        let at = good.windows(mark.len()).position(|w| w == mark.as_bytes());
        let at = at.expect("the attribute") + mark.len();
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        std::fs::write(&path, bytes).expect("written");
        f.run(&[])
            .code(2)
            .stdout(contains("unusable  one: ").and(contains(told)));
    }
}

/// The exit status tells a full disk from a scene that can't be compared.
#[cfg(unix)]
#[test]
fn a_golden_that_cannot_be_written_is_no_fault_of_the_scene() {
    let f = Folder::new(&["one"]);
    // Something is in the way, for those whom rights do not bind too.
    std::fs::create_dir_all(f.golden("one.exr").join("in the way")).expect("made");
    let junit = f.path("r.xml");
    f.run(&[
        "--bless",
        "--max-spp",
        "16",
        "--junit",
        junit.to_str().expect("a name"),
    ])
    .code(4)
    .stdout(
        contains("no access  one: ")
            .and(contains("one.exr: cannot write: "))
            .and(contains("1 scene: 1 no access")),
    );
    let xml = std::fs::read_to_string(junit).expect("written");
    assert!(
        xml.contains("errors=\"1\"") && xml.contains("<error type=\"no access\""),
        "{xml}"
    );
}
