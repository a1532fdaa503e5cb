use super::*;
use glam::DVec3;

const PLACE: Place = Place { line: 3, column: 1 };

fn read_as(
    kind: RowKind,
    text: &str,
    named: impl Fn(&str) -> Result<usize, String>,
) -> Result<Vec<Primitive>, Wrong> {
    let palette = &mut Palette::new(9);
    surfaces(
        "x.csv".as_ref(),
        text,
        PLACE,
        kind,
        &Keys::default(),
        named,
        palette,
    )
}

fn faults(text: &str) -> Vec<String> {
    let named = |name: &str| {
        if name == "red" {
            Ok(7)
        } else {
            Err(format!("no {name}"))
        }
    };
    match read_as(RowKind::Sphere, text, named) {
        Ok(_) => Vec::new(),
        Err(Wrong::Unreadable(message) | Wrong::Key(_, message)) => vec![message],
        Err(Wrong::Content(all)) => all
            .iter()
            .map(|d| format!("{}:{}: {}", d.line, d.column, d.message))
            .collect(),
    }
}

#[test]
fn columns_may_stand_in_any_order() {
    let text = "radius, z,y,x ,material\n 2,3,4,5, red \n\n1e-3,0,-1,+2.5,red\r\n";
    let all = read_as(RowKind::Sphere, text, |_| Ok(7))
        .ok()
        .expect("spheres");
    let center = DVec3::new(5.0, 4.0, 3.0);
    assert_eq!(
        all[0].shape,
        Shape::Sphere {
            center,
            radius: 2.0
        }
    );
    assert_eq!((all.len(), all[1].material, all[1].line), (2, 7, 3));
    let text = "x,y,z,nx,ny,nz,radius,r,g,b\n1,2,3,0,-2,0,0.5,9,8,7\n";
    let all = lights("x.csv".as_ref(), text, PLACE).ok().expect("lights");
    assert_eq!(
        (all[0].normal, all[0].radiance),
        (DVec3::NEG_Y, DVec3::new(9.0, 8.0, 7.0))
    );
}

#[test]
fn rows_may_have_colors_and_be_cylinders() {
    let text = "x1,y1,z1,x2,y2,z2,radius,r,g,b\n0,0,0,0,1,0,0.1,1,0,0.5\n1,0,0,1,1,0,0.2,0,1,0\n2,0,0,2,1,0,0.3,1,0,0.5\n";
    let mut palette = Palette::new(9);
    let unnamed = |_: &str| -> Result<usize, String> { unreachable!("there is no such column") };
    let kind = RowKind::Cylinder;
    let all = surfaces(
        "x.csv".as_ref(),
        text,
        PLACE,
        kind,
        &Keys::default(),
        unnamed,
        &mut palette,
    );
    let all = all.ok().expect("cylinders");
    let materials: Vec<usize> = all.iter().map(|p| p.material).collect();
    assert_eq!(materials, [9, 10, 9]);
    assert_eq!(palette.colors, [DVec3::new(1.0, 0.0, 0.5), DVec3::Y]);
    let (base, top) = (DVec3::X, DVec3::new(1.0, 1.0, 0.0));
    let radius = 0.2;
    assert_eq!(all[1].shape, Shape::Cylinder { base, top, radius });
    assert_eq!(
        faults("x,y,z,radius,r,g,b\n0,0,0,1,1,1.5,0\n"),
        ["2:11: g is \"1.5\"; g must be a number from 0 to 1"]
    );
    assert_eq!(
        faults("x,y,z,radius,r,g\n"),
        ["1:0: no column b; the first row must name the columns x, y, z, radius, r, g, b"]
    );
    let Err(Wrong::Content(flat)) = read_as(
        RowKind::Cylinder,
        "x1,y1,z1,x2,y2,z2,radius,material\n1,2,3,1,2,3,1,red\n",
        |_| Ok(7),
    ) else {
        panic!("no cylinder");
    };
    assert_eq!((flat[0].line, flat[0].column), (2, 7));
    assert!(flat[0].message.starts_with("x2, y2, z2 equal x1, y1, z1"));
}

#[test]
fn errors_have_their_places() {
    assert_eq!(
        faults("x,y,z,radius,material\n1,2,3,1,red\n1,two,3,1,red\n1,2,3,-1,blue\n"),
        [
            "3:3: y is \"two\"; y must be a number from -1e15 to 1e15",
            "4:7: radius is \"-1\"; radius must be a number from 1e-15 to 1e15 (limits of f32 kernels)"
        ]
    );
    assert_eq!(
        faults("x,y,z,radius,material\n0,0,0,1, blue\n"),
        ["2:10: no blue"]
    );
    let short = faults("x,y,z,radius,material\n0,0,0,1\n");
    assert_eq!(
        short,
        ["2:0: found 4 fields, but the first row names 5 columns"]
    );
    for (header, mark) in [
        ("x;y;z;radius;material", "semicolons"),
        ("x\ty\tz\tradius\tmaterial", "tabs"),
    ] {
        let message = format!("1:2: columns are separated by {mark} here; separate them by commas");
        assert_eq!(faults(&format!("{header}\n1;2;3;1;red\n")), [message]);
    }
    let rule = "the first row must name the columns x, y, z, radius, material";
    assert_eq!(
        faults("x,y,z,radios,material\n"),
        [
            format!("1:7: unknown column \"radios\"; {rule}; did you mean \"radius\"?"),
            format!("1:0: no column radius; {rule}")
        ]
    );
    assert_eq!(
        faults("x,y,z,radius,material,radius\n"),
        [format!(
            "1:23: duplicate column \"radius\"; {rule}, each once"
        )]
    );
    assert_eq!(faults(""), [format!("0:0: the file is empty; {rule}")]);
    assert_eq!(faults("x,y,z,radius,material\n0,0,0,nan,red\n").len(), 1);
    let dark = "x,y,z,nx,ny,nz,radius,r,g,b\n1,2,3,0,0,0,0.5,9,8,7\n1,2,3,0,inf,1,1,1,1,1\n";
    let Err(Wrong::Content(all)) = lights("x.csv".as_ref(), dark, PLACE) else {
        panic!("no direction");
    };
    let all: Vec<_> = all.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(
        all,
        [
            "nx, ny, nz are 0, 0, 0; they must be three finite numbers, not all 0",
            "ny is \"inf\"; ny must be a finite number"
        ]
    );
}

#[test]
fn invalid_utf8_has_its_place() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), b"x,y,z,radius,material\n0,0,\xe9,1,red\n").expect("written");
    let Err(Wrong::Content(all)) = read(file.path()) else {
        panic!("no text");
    };
    assert_eq!((all[0].line, all[0].column), (2, 5));
    assert!(all[0].message.starts_with("byte 0xe9 is not valid UTF-8"));
}

/// The surfaces of an XYZ file that is drawn so, or what is wrong.
fn atoms(keys: &Keys, text: &str) -> Result<(Vec<Primitive>, Vec<DVec3>), Vec<String>> {
    let mut palette = Palette::new(9);
    let named = |name: &str| match name {
        "red" => Ok(7),
        _ => Err(format!("no {name}")),
    };
    let kind = RowKind::Sphere;
    match surfaces(
        "a.xyz".as_ref(),
        text,
        PLACE,
        kind,
        keys,
        named,
        &mut palette,
    ) {
        Ok(all) => Ok((all, palette.colors)),
        Err(Wrong::Key(key, message)) => Err(vec![format!("{key}: {message}")]),
        Err(Wrong::Unreadable(message)) => Err(vec![message]),
        Err(Wrong::Content(all)) => Err(all
            .iter()
            .map(|d| format!("{}:{}: {}", d.line, d.column, d.message))
            .collect()),
    }
}

fn by_species() -> Keys {
    let of = |name: &str, radius: f64, look: SpeciesLook| {
        let radius = Some(radius);
        let look = Some(look);
        (name.to_owned(), Species { radius, look })
    };
    let species = vec![
        of(
            "Si",
            1.1,
            SpeciesLook::Reflectance(DVec3::new(0.8, 0.7, 0.5)),
        ),
        of("O", 0.66, SpeciesLook::Material("red".into())),
    ];
    Keys {
        species: Some(species),
        ..Keys::default()
    }
}

#[test]
fn atoms_look_as_their_species() {
    let text = "3\nLattice=\"9 0 0 0 9 0 0 0 9\" Properties=species:S:1:pos:R:3:forces:R:3 energy=-3\n\
                Si 0 0 0 1 1 1\n  O   1.5e0\t2 -3   0 0 0\r\nSi 4 4 4 0 0 0\n\n";
    let (all, colors) = atoms(&by_species(), text).expect("atoms");
    let materials: Vec<usize> = all.iter().map(|p| p.material).collect();
    assert_eq!(
        (materials, colors),
        (vec![9, 7, 9], vec![DVec3::new(0.8, 0.7, 0.5)])
    );
    let (center, radius) = (DVec3::new(1.5, 2.0, -3.0), 0.66);
    assert_eq!(all[1].shape, Shape::Sphere { center, radius });
    // Plain XYZ, without properties.
    let (plain, _) = atoms(&by_species(), "1\nwater\nO 1.5 2 -3").expect("an atom");
    assert_eq!(plain[0].shape, all[1].shape);
}

#[test]
fn atoms_may_bring_their_radii_and_colors() {
    let text = "2\nProperties=pos:R:3:radius:R:1:color:R:3\n0 0 0 0.5 1 0 0\n1 1 1 0.25 0 1 0\n";
    let (all, colors) = atoms(&Keys::default(), text).expect("atoms");
    assert_eq!(colors, [DVec3::X, DVec3::Y]);
    assert_eq!(
        all[1].shape,
        Shape::Sphere {
            center: DVec3::ONE,
            radius: 0.25
        }
    );
    let keys = Keys {
        material: Some("red".into()),
        radius: Some(2.0),
        ..Keys::default()
    };
    let (all, _) = atoms(&keys, text).expect("atoms");
    assert_eq!(
        all[0].shape,
        Shape::Sphere {
            center: DVec3::ZERO,
            radius: 2.0
        }
    );
    assert_eq!(all[1].material, 7);
}

#[test]
fn a_column_is_mapped_to_colors() {
    let map = ColorMap {
        column: "velo".into(),
        map: Map(0),
        low: None,
        high: None,
    };
    let mut keys = Keys {
        radius: Some(1.0),
        color: Some(map),
        ..Keys::default()
    };
    let text = "3\nProperties=species:S:1:pos:R:3:velo:R:3\nA 0 0 0 3 4 0\nA 0 0 9 0 0 0\nB 9 0 0 0 -5 0\n";
    let (all, colors) = atoms(&keys, text).expect("atoms");
    let materials: Vec<usize> = all.iter().map(|p| p.material).collect();
    assert_eq!((materials, colors.len()), (vec![9, 10, 9], 2));
    keys.color.as_mut().expect("a map").column = "vel".into();
    let wrong = atoms(&keys, text).expect_err("another name");
    assert_eq!(
        wrong,
        ["color: the file has no property \"vel\"; did you mean \"velo\"?"]
    );

    // The same of a CSV file.
    keys.color.as_mut().expect("a map").column = "charge".into();
    let mut palette = Palette::new(0);
    let text = "x,y,z,charge\n0,0,0,-1\n1,1,1,1\n";
    let unnamed = |_: &str| Err(String::new());
    let kind = RowKind::Sphere;
    let all = surfaces(
        "a.csv".as_ref(),
        text,
        PLACE,
        kind,
        &keys,
        unnamed,
        &mut palette,
    );
    assert_eq!(all.ok().expect("spheres")[1].material, 1);
}

#[test]
fn frames_are_chosen() {
    let text = "1\na\nO 0 0 0\n2\nb\nO 1 0 0\nO 2 0 0\n1\nc\nO 3 0 0\n\n";
    let first = |frame: Option<u32>| {
        let keys = Keys {
            frame,
            ..by_species()
        };
        atoms(&keys, text).map(|(all, _)| match all[0].shape {
            Shape::Sphere { center, .. } => (all.len(), center.x),
            _ => unreachable!("a sphere"),
        })
    };
    assert_eq!(first(Some(0)), Ok((1, 0.0)));
    assert_eq!(first(Some(1)), Ok((2, 1.0)));
    assert_eq!(first(Some(2)), Ok((1, 3.0)));
    let none = |frame| first(frame).expect_err("no such frame").remove(0);
    assert_eq!(
        none(Some(3)),
        "0:0: frame is 3, but there are 3 whole frames, numbered from 0"
    );
    assert_eq!(
        none(None),
        "4:1: another frame begins here; the key frame chooses one: frame = 0 is the first"
    );
}

#[test]
fn errors_in_atoms_have_their_places() {
    let wrong = |text: &str| atoms(&by_species(), text).expect_err(text).remove(0);
    for (text, message) in [
        (
            "",
            "0:0: the file is empty; a frame of an XYZ file begins with the number of its atoms",
        ),
        (
            "x,y,z\n",
            "1:1: found \"x,y,z\"; a frame of an XYZ file begins with the number of its atoms, a whole number",
        ),
        (
            "2\n\nO 0 0 0\n",
            "1:1: this line announces 2 atoms, but the file ends after 1",
        ),
        ("9", "1:1: the file ends before the line of properties"),
        (
            "1\n\nO 0 0 0\nO 1 1 1\n",
            "4:1: line 1 announces 1 atom, but there are more lines",
        ),
        (
            "1\n\nO 0 0\n",
            "3:0: found 3 fields, but line 2 has properties of 4 columns",
        ),
        (
            "1\n\nO 0 zero 0\n",
            "3:5: pos is \"zero\"; pos must be a number from -1e15 to 1e15",
        ),
        (
            "1\n\n S 0 0 0\n",
            "3:2: species is \"S\", which the table species does not have; it has Si, O",
        ),
        (
            "1\na=b Properties=species:S:1:pos:R:2\nO 0 0\n",
            "2:28: property \"pos\" is R:2, but must be R:3",
        ),
        (
            "1\nProperties=pos:R:3\n0 0 0\n",
            "species: the file has no property species:S:1",
        ),
    ] {
        assert!(
            wrong(text).starts_with(message),
            "{text:?}: {}",
            wrong(text)
        );
    }
    let bare = atoms(&Keys::default(), "1\n\nO 0 0 0\n").expect_err("nothing known");
    assert!(
        bare[0].starts_with("file: the file has no property radius:R:1, and this table"),
        "{bare:?}"
    );
    let keys = Keys {
        radius: Some(1.0),
        ..Keys::default()
    };
    let bare = atoms(&keys, "1\n\nO 0 0 0\n").expect_err("no look");
    assert!(
        bare[0].starts_with("file: the file has no property color:R:3, and this table"),
        "{bare:?}"
    );
    // However large the number is.
    let keys = Keys {
        frame: Some(1),
        ..by_species()
    };
    let huge = atoms(&keys, "18446744073709551615\n\nO 0 0 0\n").expect_err("one atom");
    assert!(huge[0].contains("0 whole frames"), "{huge:?}");
}
