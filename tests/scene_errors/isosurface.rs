//! Isosurfaces, and the files of their volumes.

use etendue::files::npy::header;
use etendue::scene::parse::parse_str;
use etendue::settings::{Overrides, Settings};
use std::fs;

/// What a scene says of a surface of the array in `bytes`, in the folder that is returned too.
fn with(bytes: &[u8], keys: &str) -> (tempfile::TempDir, Result<etendue::Scene, Vec<String>>) {
    let folder = tempfile::tempdir().expect("temporary folder");
    fs::write(folder.path().join("d.npy"), bytes).expect("written");
    let text = format!(
        "[camera]\neye = [0, 1, 4]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n\
         [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n[material.glass]\ntype = 'dielectric'\n\
         [[light]]\ncenter = [0, 4, 0]\nnormal = [0, -1, 0]\nradius = 0.5\nradiance = [9, 9, 9]\n\
         [[isosurface]]\n{keys}\n"
    );
    let scene = parse_str(&folder.path().join("s.toml"), &text);
    let lines = |all: Vec<etendue::scene::Diagnostic>| all.iter().map(|d| d.to_string()).collect();
    (folder, scene.map_err(lines))
}

const REST: &str = "origin = [0, 0, 0]\nspacing = [1, 1, 1]\nmaterial = 'white'";

fn array(descr: &str, shape: &[u64], numbers: &[u8]) -> Vec<u8> {
    [&header(descr, shape), numbers].concat()
}

/// A NIfTI file of 2 x 2 x 2 numbers.
fn nifti(numbers: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    bytes[..4].copy_from_slice(&348i32.to_le_bytes());
    for (k, n) in [3u8, 2, 2, 2].into_iter().enumerate() {
        bytes[40 + 2 * k] = n;
    }
    bytes[70] = 2;
    bytes[108..112].copy_from_slice(&352f32.to_le_bytes());
    bytes[344..348].copy_from_slice(b"n+1\0");
    bytes.extend(numbers);
    bytes
}

fn one(bytes: &[u8], keys: &str, message: &str) {
    let (_folder, found) = with(bytes, keys);
    let found = found.err().unwrap_or_default();
    assert!(
        found.len() == 1 && found[0].contains(message),
        "{keys}: {found:?} lacks {message}"
    );
}

#[test]
fn files_that_are_no_volume() {
    let keys = &format!("file = 'd.npy'\nlevel = 3\n{REST}");
    one(b"", keys, "d.npy: not a NumPy array (.npy)");
    one(b"x,y,z\n1,2,3\n", keys, "17:8: ");
    one(
        &array("|u1", &[8, 8], &[0; 64]),
        keys,
        "d.npy: the array has 2 dimensions, but must have 3",
    );
    one(
        &array("<i4", &[2, 2, 2], &[0; 32]),
        keys,
        "the array's type is '<i4', but must be uint8, uint16, float32 or float64",
    );
    one(
        &array("|u1", &[2, 2, 2], &[0; 7]),
        keys,
        "the file ends before the last of its 8 numbers",
    );
    one(
        &array("|u1", &[2, 1, 2], &[0; 4]),
        keys,
        "the volume has 1 point along y, but must have from 2 to 2048",
    );
    let mut floats = [0.5f32; 12];
    floats[7] = f32::INFINITY;
    one(
        &array("<f4", &[2, 2, 3], bytemuck::cast_slice(&floats)),
        keys,
        "the number at x = 1, y = 0, z = 1 is inf, but all must be finite",
    );
    let missing = format!("file = 'e.npy'\nlevel = 3\n{REST}");
    one(b"", &missing, "cannot read ");
    one(b"", &missing, "e.npy: no such file");
    one(
        b"",
        &format!("file = '.'\nlevel = 3\n{REST}"),
        "is a directory",
    );
}

#[test]
fn keys_that_are_wrong() {
    let good = array("|u1", &[2, 2, 2], &[0, 1, 2, 3, 4, 5, 6, 7]);
    let with_key = |key: &str| format!("file = 'd.npy'\nlevel = 3\n{REST}\n{key}");
    for (key, message) in [
        ("order = 'zxy'", "order must be \"zyx\" or \"xyz\""),
        ("inside = 'up'", "inside must be \"above\" or \"below\""),
        ("closed = 1", "closed must be true or false"),
        ("normals = 'flat'", "normals must be \"cell\" or \"smooth\""),
        ("scale = 2", "unknown key \"scale\" in [[isosurface]]"),
    ] {
        one(&good, &with_key(key), message);
    }
    let keys = |spacing: &str, material: &str| {
        format!(
            "file = 'd.npy'\nlevel = 3\norigin = [0, 0, 0]\nspacing = {spacing}\nmaterial = '{material}'"
        )
    };
    one(
        &good,
        &keys("[1, 0, 1]", "white"),
        "spacing[1] is 0; spacing must be three numbers from 1e-15",
    );
    one(
        &good,
        &(keys("[1, 1, 1]", "glass") + "\nclosed = false"),
        "an open surface is not solid",
    );
    one(
        &good,
        &format!("level = 3\n{REST}"),
        "missing key file in [[isosurface]]",
    );
    let many = vec![keys("[1, 1, 1]", "white"); 9].join("\n[[isosurface]]\n");
    one(&good, &many, "more than 8 [[isosurface]]");
}

#[test]
fn nifti_files_that_are_no_volume() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let found = |bytes: &[u8], name: &str, keys: &str| {
        fs::write(folder.path().join(name), bytes).expect("written");
        let path = folder.path().join(name);
        let keys = format!("file = '{}'\nlevel = 3\n{REST}\n{keys}", path.display());
        with(b"", &keys).1.err().unwrap_or_default().join("\n")
    };
    let good = nifti(&[0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(found(&good, "d.nii", ""), "");
    assert_eq!(found(&good, "D.NII", "order = 'zyx'"), "");
    for (bytes, name, keys, message) in [
        (
            &good[..],
            "d.nii",
            "order = 'xyz'",
            "`order` must be left out",
        ),
        (&good[..], "d.nii.gz", "", "not a NIfTI file"),
        (&good[..], "d.npy", "", "not a NumPy array"),
        (&good[..355], "d.nii", "", "ends after 3 of 8 bytes"),
    ] {
        let found = found(bytes, name, keys);
        assert!(found.contains(message), "{name}: {found}");
    }
}

#[test]
fn the_hash_covers_the_numbers_and_not_the_name() {
    let hash = |bytes: &[u8], name: &str, keys: &str| {
        let folder = tempfile::tempdir().expect("temporary folder");
        fs::write(folder.path().join(name), bytes).expect("written");
        let text = format!(
            "[camera]\neye = [0, 1, 4]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n\
             [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
             [[light]]\ncenter = [0, 4, 0]\nnormal = [0, -1, 0]\nradius = 0.5\nradiance = [9, 9, 9]\n\
             [[isosurface]]\nfile = '{name}'\n{REST}\n{keys}\n"
        );
        let path = folder.path().join("s.toml");
        let scene = parse_str(&path, &text).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(scene.row_files[0].path, folder.path().join(name));
        let settings = Settings::resolve(&scene, &Overrides::default());
        etendue::provenance::hash::scene_hash(&scene, &settings)
    };
    let numbers = [0, 1, 2, 3, 4, 5, 6, 7];
    let bytes = array("|u1", &[2, 2, 2], &numbers);
    let first = hash(&bytes, "a.npy", "level = 3");
    assert_eq!(hash(&bytes, "b.npy", "level = 3.0\norder = 'zyx'"), first);
    assert_eq!(hash(&nifti(&numbers), "a.nii", "level = 3"), first);
    let mut other = numbers;
    other[5] = 9;
    let other = array("|u1", &[2, 2, 2], &other);
    let changed = [
        hash(&other, "a.npy", "level = 3"),
        hash(&bytes, "a.npy", "level = 4"),
        hash(&bytes, "a.npy", "level = 3\ninside = 'below'"),
        hash(&bytes, "a.npy", "level = 3\norder = 'xyz'"),
        hash(&bytes, "a.npy", "level = 3\nclosed = false"),
        hash(&bytes, "a.npy", "level = 3\nnormals = 'smooth'"),
    ];
    for (i, one) in changed.iter().enumerate() {
        assert!(*one != first && !changed[..i].contains(one), "{i}");
    }
}
