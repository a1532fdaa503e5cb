//! NumPy arrays in files: the header of `.npy` files, and the array of numbers behind one.
//!
//! Source: NumPy NEP 1 (formats 1.0, 2.0 and 3.0).

use super::reason;
use std::io::Read;

// Numbers are copied as they lie in memory, and stand in the file with the lowest byte first.
const _: () = assert!(cfg!(target_endian = "little"));

/// How every file begins.
const MAGIC: &[u8] = b"\x93NUMPY";

/// The longest header that is read, in bytes. NumPy's own have some hundred.
const MAX_HEADER: usize = 1 << 16;

/// Numbers of one of the types that are read.
#[derive(Debug, Clone, PartialEq)]
pub enum Numbers {
    /// Whole numbers from 0 to 255.
    U8(Vec<u8>),
    /// Whole numbers from 0 to 65535.
    U16(Vec<u16>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// What a header says.
#[derive(Debug, Clone, PartialEq)]
struct Header {
    descr: String,
    fortran_order: bool,
    shape: Vec<u64>,
}

/// An array as it lies in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// How many there are along each index.
    pub shape: Vec<usize>,
    /// Whether the first index runs fastest, and not the last.
    pub first_fastest: bool,
    /// The numbers.
    pub numbers: Numbers,
}

/// Header of a `.npy` file of format 1.0, padded to 64 bytes as NumPy pads it. The last index runs fastest.
pub fn header(descr: &str, shape: &[u64]) -> Vec<u8> {
    let shape = match shape {
        [one] => format!("({one},)"),
        many => {
            let all: Vec<String> = many.iter().map(u64::to_string).collect();
            format!("({})", all.join(", "))
        }
    };
    let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let total = (10 + dict.len() + 1).next_multiple_of(64);
    let mut header = MAGIC.to_vec();
    header.extend([1, 0]);
    header.extend(((total - 10) as u16).to_le_bytes());
    header.extend(dict.bytes());
    header.resize(total - 1, b' ');
    header.push(b'\n');
    header
}

/// Reads an array of `dimensions` indices with at most `most` numbers.
///
/// # Errors
/// What is wrong with it, or what the system said.
pub fn read(mut from: impl Read, dimensions: usize, most: u64) -> Result<Array, String> {
    let header = read_header(&mut from)?;
    if header.shape.len() != dimensions {
        let (found, s) = (
            header.shape.len(),
            if header.shape.len() == 1 { "" } else { "s" },
        );
        return Err(format!(
            "the array has {found} dimension{s}, but must have {dimensions}"
        ));
    }
    let count = header.shape.iter().try_fold(1u64, |n, k| n.checked_mul(*k));
    let count = count.filter(|n| *n <= most).ok_or_else(|| {
        format!(
            "the array has {:?} numbers, which are too many; it must have at most {most}",
            header.shape
        )
    })?;
    let shape = header.shape.iter().map(|n| *n as usize).collect();
    let swapped = header.descr.starts_with('>');
    let kind = header.descr.trim_start_matches(['<', '>', '|', '=']);
    let n = count as usize;
    let numbers = match kind {
        "u1" => Numbers::U8(numbers(&mut from, n, |x| x)?),
        "u2" if swapped => Numbers::U16(numbers(&mut from, n, u16::swap_bytes)?),
        "u2" => Numbers::U16(numbers(&mut from, n, |x| x)?),
        "f4" if swapped => Numbers::F32(numbers(&mut from, n, |x: f32| {
            f32::from_bits(x.to_bits().swap_bytes())
        })?),
        "f4" => Numbers::F32(numbers(&mut from, n, |x| x)?),
        "f8" if swapped => Numbers::F64(numbers(&mut from, n, |x: f64| {
            f64::from_bits(x.to_bits().swap_bytes())
        })?),
        "f8" => Numbers::F64(numbers(&mut from, n, |x| x)?),
        _ => {
            return Err(format!(
                "the array's type is '{}', but must be uint8, uint16, float32 or float64",
                header.descr
            ));
        }
    };
    let mut more = [0];
    match from.read(&mut more) {
        Ok(0) => {}
        Ok(_) => return Err("there is more in the file than its array".into()),
        Err(e) => return Err(reason(&e)),
    }
    Ok(Array {
        shape,
        first_fastest: header.fortran_order,
        numbers,
    })
}

/// So many numbers, each changed by `convert`. Memory grows with what is really there.
fn numbers<T: bytemuck::Pod>(
    from: &mut impl Read,
    count: usize,
    convert: impl Fn(T) -> T,
) -> Result<Vec<T>, String> {
    const AT_ONCE: usize = 1 << 20;
    let mut all: Vec<T> = Vec::new();
    while all.len() < count {
        let before = all.len();
        let after = count.min(before + AT_ONCE);
        if all.capacity() < after {
            all.reserve_exact((count - before).min(before.max(AT_ONCE)));
        }
        all.resize(after, T::zeroed());
        let bytes = bytemuck::cast_slice_mut(&mut all[before..]);
        from.read_exact(bytes).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                format!("the file ends before the last of its {count} numbers")
            }
            _ => reason(&e),
        })?;
        all[before..].iter_mut().for_each(|x| *x = convert(*x));
    }
    Ok(all)
}

fn read_header(from: &mut impl Read) -> Result<Header, String> {
    let alien = || "not a NumPy array (.npy)".to_owned();
    let exact = |from: &mut dyn Read, bytes: &mut [u8]| {
        from.read_exact(bytes).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => alien(),
            _ => reason(&e),
        })
    };
    let mut start = [0; 8];
    exact(from, &mut start)?;
    if &start[..6] != MAGIC {
        return Err(alien());
    }
    let length = match start[6] {
        1 => {
            let mut bytes = [0; 2];
            exact(from, &mut bytes)?;
            u16::from_le_bytes(bytes).into()
        }
        2 | 3 => {
            let mut bytes = [0; 4];
            exact(from, &mut bytes)?;
            u32::from_le_bytes(bytes) as usize
        }
        version => return Err(format!("the .npy format {version} is not known")),
    };
    if length > MAX_HEADER {
        return Err(alien());
    }
    let mut text = vec![0; length];
    exact(from, &mut text)?;
    let text = String::from_utf8_lossy(&text);
    parse(&text).ok_or_else(|| {
        format!(
            "the header of the NumPy array is not understood: {}",
            text.trim().chars().take(80).collect::<String>()
        )
    })
}

/// What the header's dictionary says. Its values are simple in all arrays of numbers; those of records are not understood.
fn parse(text: &str) -> Option<Header> {
    let after = |key: &str| {
        let at = text.find(&format!("'{key}'"))? + key.len() + 2;
        Some(text[at..].trim_start().strip_prefix(':')?.trim_start())
    };
    let descr = after("descr")?.strip_prefix('\'')?.split_once('\'')?.0;
    let order = after("fortran_order")?;
    let fortran_order = order.starts_with("True");
    if !fortran_order && !order.starts_with("False") {
        return None;
    }
    let shape = after("shape")?.strip_prefix('(')?.split_once(')')?.0;
    let shape: Option<Vec<u64>> = shape
        .split(',')
        .map(str::trim)
        .filter(|n| !n.is_empty())
        .map(|n| n.trim_end_matches('L').parse().ok())
        .collect();
    Some(Header {
        descr: descr.to_owned(),
        fortran_order,
        shape: shape?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(descr: &str, shape: &[u64], bytes: &[u8]) -> Vec<u8> {
        [&header(descr, shape), bytes].concat()
    }

    #[test]
    fn arrays_of_each_type_and_byte_order() {
        let read = |descr: &str, bytes: &[u8]| {
            read(&file(descr, &[1, 1, 2], bytes)[..], 3, 100).map(|a| a.numbers)
        };
        assert_eq!(read("|u1", &[3, 200]), Ok(Numbers::U8(vec![3, 200])));
        assert_eq!(
            read("<u2", &[1, 2, 3, 4]),
            Ok(Numbers::U16(vec![513, 1027]))
        );
        assert_eq!(read(">u2", &[1, 2, 3, 4]), Ok(Numbers::U16(vec![258, 772])));
        let floats = [1.5f32, -2.0];
        let big: Vec<u8> = floats.iter().flat_map(|x| x.to_be_bytes()).collect();
        assert_eq!(
            read("<f4", bytemuck::cast_slice(&floats)),
            Ok(Numbers::F32(floats.to_vec()))
        );
        assert_eq!(read(">f4", &big), Ok(Numbers::F32(floats.to_vec())));
        let doubles = [0.1, 1e300];
        let big: Vec<u8> = doubles.iter().flat_map(|x: &f64| x.to_be_bytes()).collect();
        assert_eq!(
            read("<f8", bytemuck::cast_slice(&doubles)),
            Ok(Numbers::F64(doubles.to_vec()))
        );
        assert_eq!(read(">f8", &big), Ok(Numbers::F64(doubles.to_vec())));
        let refused = read("<i4", &[0; 8]).unwrap_err();
        assert!(refused.contains("type is '<i4'"), "{refused}");
    }

    #[test]
    fn damaged_and_unfit_files_are_refused() {
        let refused = |bytes: &[u8]| read(bytes, 3, 100).unwrap_err();
        assert!(refused(b"").contains("not a NumPy array"));
        assert!(refused(b"PK\x03\x04aaaaaaaaaaa").contains("not a NumPy array"));
        let whole = file("|u1", &[2, 2, 2], &[0; 8]);
        assert!(refused(&whole[..whole.len() - 1]).contains("ends before"));
        assert!(refused(&[&whole[..], &[0]].concat()).contains("more in the file"));
        assert!(refused(&file("|u1", &[8], &[0; 8])).contains("1 dimension, but"));
        assert!(refused(&file("|u1", &[2, 2], &[0; 4])).contains("2 dimensions, but"));
        assert!(refused(&file("|u1", &[9, 9, 9], &[0; 729])).contains("too many"));
        let huge = file("|u1", &[1 << 32, 1 << 32, 2], &[]);
        assert!(refused(&huge).contains("too many"));
        let mut odd = whole;
        odd[6] = 9;
        assert!(refused(&odd).contains("format 9"));
    }

    #[test]
    fn headers_as_numpy_writes_them() {
        let text = "{'descr': '<f4', 'fortran_order': True, 'shape': (3, 4, 5), }   \n";
        let header = parse(text).expect("a header");
        assert_eq!(header.descr, "<f4");
        assert!(header.fortran_order);
        assert_eq!(header.shape, [3, 4, 5]);
        let records = "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (3,), }";
        assert_eq!(parse(records), None);
    }
}
