//! `--layers`, `--folds`, `--denoised` and `--denoise`.

use crate::oidn;
use crate::program::{Bench, says};
use etendue::output::{read_exr_header, read_png_header};
use predicates::prelude::*;
use std::fs;

const PAIRS: [&str; 6] = ["01", "02", "03", "12", "13", "23"];

/// A denoiser that does nothing.
fn copy_halves(bench: &Bench, folder: &str) {
    for pair in PAIRS {
        let of = |what: &str| bench.path(&format!("{folder}/{what}{pair}.pfm"));
        fs::copy(of("half"), of("denoised")).unwrap();
    }
}

#[test]
fn layers_are_beside_the_picture_and_compare_leaves_them_out() {
    let bench = Bench::new();
    bench.render("--spp 16 --film f.npz -o plain.exr");
    let layers = "--layers albedo,normal,position,depth,id,material";
    bench
        .run(&format!("develop f.npz -o all.exr {layers}"))
        .success();
    let header = read_exr_header(&bench.path("all.exr")).unwrap();
    for name in [
        "albedo.A",
        "albedo.B",
        "normal.X",
        "position.Z",
        "depth.Z",
        "id.I",
        "material.I",
        "R",
        "error.Y",
    ] {
        assert!(
            header.channels.contains(&format!("{name} (float)")),
            "{name}: {:?}",
            header.channels
        );
    }
    let names = r#"["","glass","steel","white","light"]"#;
    assert_eq!(header.attributes["material_names"], names);
    // The rest of the picture is as it was.
    let (a, b) = (bench.picture("plain.exr"), bench.picture("all.exr"));
    assert_eq!((a.rgb, a.error), (b.rgb, b.error));
    bench.run("compare plain.exr all.exr").success();
    // `render` writes the same.
    bench.render(&format!("--spp 16 -o rendered.exr {layers}"));
    bench
        .run(&format!("compare all.exr rendered.exr {layers}"))
        .success();
    bench
        .run("compare plain.exr all.exr --layers id,depth")
        .code(2)
        .stderr(says("plain.exr: it has no layer id"));

    // Another picture: the ball has moved, and the light is the same up to its noise at best.
    let text = fs::read_to_string(bench.path("box.toml")).unwrap();
    fs::write(
        bench.path("moved.toml"),
        text.replace("[0.6, 0.5, 0.0]", "[0.61, 0.5, 0.0]"),
    )
    .unwrap();
    bench
        .run(&format!(
            "render moved.toml --backend cpu --spp 16 -o moved.exr {layers}"
        ))
        .success();
    bench
        .run("compare all.exr moved.exr --layers position,id")
        .code(1)
        .stdout(says("layer position: differs"));

    for (flags, text) in [
        (
            "-o x.png --layers id",
            "--layers needs a picture that can hold them",
        ),
        (
            "-o x.exr --exr rgb --layers id",
            "--layers can't be used with --exr rgb",
        ),
        ("-o x.exr --layers colour", "invalid value 'colour'"),
    ] {
        bench
            .run(&format!("develop f.npz {flags}"))
            .code(2)
            .stderr(says(text));
    }
}

#[test]
fn films_of_scenes_with_tables_find_them_or_say_so() {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.path("box.toml")).unwrap();
    let rows = "\n[[spheres]]\nfile = \"rows.csv\"\n";
    fs::write(bench.path("rows.toml"), text + rows).unwrap();
    let csv = "x,y,z,radius,r,g,b\n0,0.2,0.5,0.1,0.5,0.1,0.1\n";
    fs::write(bench.path("rows.csv"), csv).unwrap();
    bench
        .run("render rows.toml --backend cpu --spp 16 --film f.npz -o a.png")
        .success();
    bench
        .run("develop f.npz -o a.exr --layers material")
        .success();
    fs::create_dir(bench.path("far")).unwrap();
    fs::rename(bench.path("f.npz"), bench.path("far/f.npz")).unwrap();
    bench
        .run("develop far/f.npz -o a.exr --layers id")
        .code(4)
        .stderr(says("rows.csv"));
    bench
        .run("develop far/f.npz -o a.exr --layers id --scene rows.toml")
        .success();
    fs::write(bench.path("rows.csv"), csv.replace("0.2", "0.3")).unwrap();
    bench
        .run("develop far/f.npz -o a.exr --layers id --scene rows.toml")
        .code(2)
        .stderr(says("not the scene that the film was rendered from"));
}

#[test]
fn any_denoiser_is_judged_by_six_halves() {
    let bench = Bench::new();
    bench.render("--spp 64 --film f.npz -o a.png");
    bench.run("develop f.npz --folds halves").success();
    // Nothing is denoised yet.
    bench
        .run("develop f.npz --denoised halves -o d.exr")
        .code(4)
        .stderr(says("denoised01.pfm").and(says("a denoiser makes it")));
    copy_halves(&bench, "halves");
    bench
        .run("develop f.npz --denoised halves -o d.exr -o d.png --report d.json")
        .success()
        .stderr(says("denoised by another program: ").and(says("RMS error ")));
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("d.json")).unwrap()).unwrap();
    let (raw, mean) = (&report["raw"]["rms_error"], &report["mean"]["rms_error"]);
    // What does nothing has the raw picture's error.
    match (raw.as_f64(), mean.as_f64()) {
        (Some(raw), Some(mean)) => assert!((raw / mean - 1.0).abs() < 1e-4, "{report}"),
        _ => assert_eq!(report["raw"]["not_known"], report["mean"]["not_known"]),
    }
    assert!(report["mean_light"].as_f64().unwrap().abs() < 1e-5);
    let header = read_exr_header(&bench.path("d.exr")).unwrap();
    for name in [
        "denoised.R",
        "denoised.mean.G",
        "denoised.weight",
        "denoised.indication.Y",
    ] {
        assert!(
            header.channels.contains(&format!("{name} (float)")),
            "{:?}",
            header.channels
        );
    }
    assert!(header.attributes["denoised"].contains("RMS error"));
    // The picture itself is the film's.
    bench.run("develop f.npz -o plain.exr").success();
    assert_eq!(bench.picture("plain.exr").rgb, bench.picture("d.exr").rgb);
    // The PNG says what it is, by its name and in its text.
    let text = |name: &str| read_png_header(&bench.path(name)).unwrap().texts;
    assert!(format!("{:?}", text("d.denoised.png")).contains("denoised by another program"));
    assert!(!format!("{:?}", text("d.png")).contains("denoised by"));

    // A file of another size, and a folder of another film.
    fs::write(
        bench.path("halves/denoised12.pfm"),
        "PF\n1 1\n-1.0\n000011112222",
    )
    .unwrap();
    bench
        .run("develop f.npz --denoised halves -o d.exr")
        .code(2)
        .stderr(says(
            "denoised12.pfm: it has 1x1 pixels, but the film has 24x16",
        ));
    bench.render("--spp 64 --seed 5 --film g.npz -o a.png");
    bench
        .run("develop g.npz --denoised halves -o d.exr")
        .code(2)
        .stderr(says("these halves are of another film"));
    bench
        .run("develop g.npz --folds halves")
        .code(2)
        .stderr(says("this is there already, from other halves"));
    // EXR in place of PFM.
    bench
        .run("develop g.npz --folds exr --folds-as exr")
        .success();
    for pair in PAIRS {
        let of = |what: &str| bench.path(&format!("exr/{what}{pair}.exr"));
        fs::copy(of("half"), of("denoised")).unwrap();
    }
    bench.run("develop g.npz --denoised exr -o g.exr").success();
}

/// What is held beside the film, which has some 340 bytes a pixel itself. The denoiser's own memory is not in it.
#[cfg(target_os = "linux")]
#[test]
fn the_memory_of_a_pixel_is_bounded() {
    let bench = Bench::new();
    let peak = |size: &str| {
        bench.render(&format!(
            "--spp 4 --strata 1 --size {size} --film {size}.npz -o a.png"
        ));
        bench
            .run(&format!("develop {size}.npz --folds {size}"))
            .success();
        copy_halves(&bench, size);
        bench.peak(&format!(
            "develop {size}.npz --denoised {size} -o a.exr --quiet"
        )) as f64
    };
    let (few, many) = (peak("24x16"), peak("480x320"));
    let of_pixel = (many - few) / f64::from(480 * 320 - 24 * 16);
    println!("{of_pixel:.0} bytes a pixel");
    // What is held for certain: the film, four replicates, six denoised pictures.
    assert!(of_pixel > 400.0 && of_pixel < 700.0, "{of_pixel}");
}

#[test]
fn films_without_four_replicates_are_refused() {
    let bench = Bench::new();
    bench.render("--spp 12 --film f.npz -o a.png");
    bench
        .run("develop f.npz --folds halves")
        .code(2)
        .stderr(says("f.npz: ").and(says("take at least 16 samples per pixel")));
    bench.render("--spp 16 --region 0,0,8,8 --region 10,10,24,16 --film h.npz -o a.png");
    bench
        .run("develop h.npz --folds halves")
        .code(2)
        .stderr(says("have no samples"));
    assert!(!bench.path("halves").exists());
    // A part of the picture is a picture, and an adaptive film has replicates as good as any.
    for (name, flags) in [("part", "--region 2,2,20,14"), ("adaptive", "--adaptive")] {
        bench.render(&format!("--spp 64 {flags} --film {name}.npz -o a.png"));
        bench
            .run(&format!("develop {name}.npz --folds {name}"))
            .success();
        copy_halves(&bench, name);
        bench
            .run(&format!(
                "develop {name}.npz --denoised {name} -o {name}.exr"
            ))
            .success();
    }
}

#[test]
fn without_the_library_nothing_is_done() {
    let bench = Bench::new();
    fs::write(bench.path("not.so"), "no library").unwrap();
    fs::create_dir(bench.path("empty")).unwrap();
    for (path, text) in [
        ("not.so", "can't be loaded as Open Image Denoise"),
        (
            "empty",
            "there is no library of Open Image Denoise in this folder",
        ),
        ("missing", "can't be loaded as Open Image Denoise"),
    ] {
        bench
            .run(&format!(
                "render box.toml --backend cpu --spp 16 -o a.exr --denoise --oidn {path}"
            ))
            .code(3)
            .stderr(says(text));
    }
    assert_eq!(bench.names(), ["box.toml", "empty", "not.so"]);
    bench
        .run("render box.toml --backend cpu --spp 16 -o a.denoised.png")
        .code(2)
        .stderr(says("add --denoise or give another name"));
}

#[test]
fn open_image_denoise_in_one_step() {
    if oidn().is_none() {
        return;
    }
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 64 --denoise --film f.npz --report r.json")
        .success()
        .stderr(says("denoised by Open Image Denoise 2."));
    let names = [
        "box.denoised.png",
        "box.exr",
        "box.png",
        "box.toml",
        "f.npz",
        "r.json",
    ];
    assert_eq!(bench.names(), names);
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("r.json")).unwrap()).unwrap();
    assert!(
        report["denoised"]["mixture_light"].as_f64().unwrap().abs() < 0.1,
        "{report}"
    );
    // `develop` says the same, and the same as the six halves do.
    bench.run("develop f.npz --denoise -o d.exr").success();
    bench.run("develop f.npz -o plain.exr").success();
    assert_eq!(bench.picture("plain.exr").rgb, bench.picture("d.exr").rgb);
    bench
        .run("render box.toml --backend cpu --spp 12 --denoise -o x.exr")
        .code(2)
        .stderr(says("take at least 16 samples per pixel"));
}
