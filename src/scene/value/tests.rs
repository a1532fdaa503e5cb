use super::*;

fn read<T: Value>(text: &str) -> Option<T> {
    T::read(&DeValue::parse(text).expect("TOML")).ok()
}

#[test]
fn numbers_in_every_notation() {
    for (text, value) in [
        ("3", 3.0),
        ("0x10", 16.0),
        ("1_000.5", 1000.5),
        ("+1e-3", 1e-3),
        ("1_0", 10.0),
    ] {
        let radius = read::<Radius>(text).map(|r| r.0);
        assert_eq!(radius, Some(value), "{text}");
    }
    let bad = [
        "0",
        "-1",
        "inf",
        "nan",
        "1e400",
        "2e15",
        "1e-16",
        "true",
        "\"1\"",
        "[1]",
        "99999999999999999999999999999999999999999999999",
    ];
    for text in bad {
        assert!(read::<Radius>(text).is_none(), "{text}");
    }
}

#[test]
fn open_ends_are_outside_and_closed_ones_inside() {
    assert!(read::<Angle>("0").is_none() && read::<Angle>("180.0").is_none());
    assert!(read::<Angle>("179.9").is_some());
    assert!(read::<Share>("[0, 1, 0.5]").is_some());
    assert!(read::<Share>("[0, 1.0000001, 0.5]").is_none());
    assert!(read::<Count<1, 4>>("4").is_some() && read::<Count<1, 4>>("5").is_none());
    assert!(read::<Count<0, { u32::MAX }>>("4294967296").is_none());
    assert!(read::<Resolution>("[65536, 1]").is_some());
    assert!(read::<Resolution>("[65537, 1]").is_none());
    assert!(read::<Resolution>("[512.0, 384]").is_none());
}

#[test]
fn directions_of_any_length_become_unit_vectors() {
    for text in [
        "[0, 0, 5e-324]",
        "[1e308, 1e308, -1e308]",
        "[3e-200, 4e-200, 0]",
        "[0, 1, 1e-300]",
    ] {
        let d = read::<Direction>(text).expect(text).0;
        // Two roundings of a normalisation in f64.
        assert!((d.length() - 1.0).abs() < 1e-15, "{text}: {d}");
    }
    let d = read::<Direction>("[3e-320, 4e-320, 0]")
        .expect("denormal")
        .0;
    // Denormals near 1e-320 have three digits.
    assert!((d - DVec3::new(0.6, 0.8, 0.0)).length() < 1e-3, "{d}");
    assert!(read::<Direction>("[0, 0.0, -0.0]").is_none());
    assert!(read::<Direction>("[0, inf, 0]").is_none());
}

#[test]
fn the_offending_element_is_named() {
    let found = DeValue::parse("[0.1, 2, 0.3]").expect("TOML");
    let Err(wrong) = Share::read(&found) else {
        panic!("2 is above 1");
    };
    assert_eq!((wrong.index, wrong.span), (Some(1), 6..7));
}
