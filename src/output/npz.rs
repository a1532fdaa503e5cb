//! Reads and writes uncompressed `.npz` archives, as `numpy.load` opens them.
//!
//! An archive is a ZIP file of `.npy` members. Names, types, shapes and contents determine every byte here: there are no
//! times and no options, and ZIP64 records are always used, so that all sizes have the same form. So the reader
//! compares instead of interpreting, and detects every flipped bit.
//!
//! Sources: PKWARE APPNOTE.TXT 6.3.10, sections 4.3.7 to 4.3.16 and 4.5.3; NumPy NEP 1 (format 1.0).

use crate::files::npy;
use std::io::{self, Read, Write};

// Numbers are copied as they lie in memory, and stand in the file with the lowest byte first.
const _: () = assert!(cfg!(target_endian = "little"));

/// Version 4.5 of the ZIP format: the first with ZIP64.
const ZIP_VERSION: u16 = 45;
/// Made on Unix (upper byte), so that the permission bits below count.
const MADE_BY: u16 = 3 << 8 | ZIP_VERSION;
const PERMISSIONS: u32 = 0o100_644 << 16;
/// 1980-01-01, the first day a ZIP file can name.
const DATE: u16 = 1 << 5 | 1;
/// "See the ZIP64 record".
const SEE_64: u32 = u32::MAX;
/// Message for differences that also appear when NumPy or an archiver has rewritten the file.
const NOT_OURS: &str =
    "was not written by etendue: the film is damaged, or another program has rewritten it";
/// Bytes of a local header before the name.
const LOCAL_FIXED: usize = 30;

/// An array to be written.
pub struct Array<'a> {
    /// Key in the archive.
    pub name: &'static str,
    /// NumPy's type: `<f8`, `|S12`.
    pub descr: String,
    /// Lengths; empty for a single item.
    pub shape: Vec<u64>,
    /// The items, last index fastest.
    pub data: &'a [u8],
}

/// Why an archive could not be read.
#[derive(Debug)]
pub enum Damage {
    /// Reading failed, or the file ends too early ([`io::ErrorKind::UnexpectedEof`]).
    Io(io::Error),
    /// Its content is invalid.
    Wrong(String),
    /// It is another kind of file.
    Alien(String),
}

impl From<io::Error> for Damage {
    fn from(e: io::Error) -> Self {
        Self::Io(e)
    }
}

/// The directory entry of a member.
struct Member {
    name: &'static str,
    crc32: u32,
    size: u64,
    offset: u64,
}

/// Writes the arrays as one archive.
pub fn write(mut to: impl Write, arrays: &[Array]) -> io::Result<()> {
    let mut members = Vec::new();
    let mut offset = 0;
    for array in arrays {
        let npy = npy::header(&array.descr, &array.shape);
        let mut crc = crc32fast::Hasher::new();
        crc.update(&npy);
        crc.update(array.data);
        let member = Member {
            name: array.name,
            crc32: crc.finalize(),
            size: (npy.len() + array.data.len()) as u64,
            offset,
        };
        let local = local_header(member.name, member.crc32, member.size);
        to.write_all(&local)?;
        to.write_all(&npy)?;
        to.write_all(array.data)?;
        offset += local.len() as u64 + member.size;
        members.push(member);
    }
    to.write_all(&directory(&members, offset))
}

/// Reads an archive of known arrays in known order.
pub struct Reader<R> {
    from: R,
    /// Bytes of the whole file; bounds every allocation.
    length: u64,
    at: u64,
    members: Vec<Member>,
}

impl<R: Read> Reader<R> {
    /// `length`: how many bytes `from` holds.
    pub fn new(from: R, length: u64) -> Self {
        Self {
            from,
            length,
            at: 0,
            members: Vec::new(),
        }
    }

    /// The next member, a single string of bytes of any length (NumPy's `|S`).
    pub fn string(&mut self, name: &'static str) -> Result<Vec<u8>, Damage> {
        let (crc32, size) = self.local(name)?;
        let mut data = self.allocate::<u8>(size)?;
        self.from.read_exact(&mut data)?;
        // The header is padded: its length is the same for any number of digits.
        let length = size.saturating_sub(npy::header("|S1", &[]).len() as u64);
        let npy = npy::header(&format!("|S{length}"), &[]);
        if !data.starts_with(&npy) {
            return Err(Damage::Wrong(format!("\"{name}\" is not a string")));
        }
        check_crc(name, crc32, &[&data])?;
        self.passed(name, crc32, size);
        data.drain(..npy.len());
        Ok(data)
    }

    /// The next member, an array of `items` whose type and shape NumPy calls `descr` and `shape`.
    pub fn array<T: bytemuck::Pod>(
        &mut self,
        name: &'static str,
        descr: &str,
        shape: &[u64],
        items: u64,
    ) -> Result<Vec<T>, Damage> {
        let (crc32, size) = self.local(name)?;
        let expected = npy::header(descr, shape);
        let bytes = items.saturating_mul(size_of::<T>() as u64);
        let header = expected.len() as u64;
        let numbers = || {
            let shape: Vec<String> = shape.iter().map(u64::to_string).collect();
            format!("{} numbers of type {}", shape.join(" x "), type_name(descr))
        };
        if size != bytes.saturating_add(header) {
            return Err(Damage::Wrong(format!(
                "array \"{name}\" has {} bytes of numbers, but {} need {bytes}",
                size.saturating_sub(header),
                numbers()
            )));
        }
        let mut npy = vec![0; expected.len()];
        self.from.read_exact(&mut npy)?;
        if npy != expected {
            return Err(Damage::Wrong(format!(
                "array \"{name}\" does not hold {}",
                numbers()
            )));
        }
        let mut data = self.allocate::<T>(items)?;
        let view: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        self.from.read_exact(view)?;
        check_crc(name, crc32, &[&npy, view])?;
        self.passed(name, crc32, size);
        Ok(data)
    }

    /// Checks the end of the archive: only the directory of the members that were read may follow.
    pub fn finish(mut self) -> Result<(), Damage> {
        let expected = directory(&self.members, self.at);
        let mut found = Vec::new();
        let most = expected.len() as u64;
        self.from.by_ref().take(most).read_to_end(&mut found)?;
        if found.len() < expected.len() && expected.starts_with(&found) {
            return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
        }
        if found != expected {
            return Err(Damage::Wrong(format!("its directory {NOT_OURS}")));
        }
        if self.from.read(&mut [0])? != 0 {
            return Err(Damage::Wrong("it has extra bytes at the end".into()));
        }
        Ok(())
    }

    /// Reads a local header; returns CRC and size of what follows.
    fn local(&mut self, name: &'static str) -> Result<(u32, u64), Damage> {
        let mut found = vec![0; local_header(name, 0, 0).len()];
        if self.members.is_empty() {
            self.check_start(&mut found[..4])?;
            self.from.read_exact(&mut found[4..])?;
        } else {
            self.from.read_exact(&mut found)?;
        }
        let crc32 = u32::from_le_bytes(found[14..18].try_into().expect("four bytes"));
        let end = found.len();
        let size = u64::from_le_bytes(found[end - 8..].try_into().expect("eight bytes"));
        if found != local_header(name, crc32, size) {
            let stored = &found[LOCAL_FIXED..LOCAL_FIXED + name.len()];
            let first = self.members.is_empty();
            return Err(match stored == name.as_bytes() {
                true => Damage::Wrong(format!("the header of its array \"{name}\" {NOT_OURS}")),
                false if first => Damage::Alien(format!(
                    "it is a ZIP archive, but its first array is not \"{name}\""
                )),
                false => Damage::Wrong(format!("its array \"{name}\" is not where it should be")),
            });
        }
        if size > self.length {
            return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
        }
        Ok((crc32, size))
    }

    /// Reads the first bytes of the file into `start`: those of an archive, or it is none.
    fn check_start(&mut self, start: &mut [u8]) -> Result<(), Damage> {
        self.from.read_exact(start)?;
        if start == b"PK\x03\x04" {
            return Ok(());
        }
        Err(Damage::Alien("it is not a NumPy archive (.npz)".into()))
    }

    fn passed(&mut self, name: &'static str, crc32: u32, size: u64) {
        let offset = self.at;
        self.at += local_header(name, crc32, size).len() as u64 + size;
        self.members.push(Member {
            name,
            crc32,
            size,
            offset,
        });
    }

    /// Zeros to read into; at most as many bytes as the file has.
    fn allocate<T: bytemuck::Pod>(&self, items: u64) -> Result<Vec<T>, Damage> {
        if items.saturating_mul(size_of::<T>() as u64) > self.length {
            return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
        }
        let mut data = Vec::new();
        let items = items as usize;
        data.try_reserve_exact(items)
            .map_err(|_| Damage::Io(io::ErrorKind::OutOfMemory.into()))?;
        data.resize(items, T::zeroed());
        Ok(data)
    }
}

/// What Rust calls a type of NumPy's.
fn type_name(descr: &str) -> &str {
    match descr {
        "<u8" => "u64",
        "<f8" => "f64",
        "<f4" => "f32",
        other => other,
    }
}

fn check_crc(name: &str, expected: u32, parts: &[&[u8]]) -> Result<(), Damage> {
    let mut crc = crc32fast::Hasher::new();
    parts.iter().for_each(|p| crc.update(p));
    if crc.finalize() == expected {
        Ok(())
    } else {
        Err(Damage::Wrong(format!(
            "the content of \"{name}\" does not match its checksum"
        )))
    }
}

/// Local file header (4.3.7) of `NAME.npy`, the ZIP64 field (4.5.3) included.
fn local_header(name: &str, crc32: u32, size: u64) -> Vec<u8> {
    let name = format!("{name}.npy");
    let mut h = Vec::new();
    h.extend(0x0403_4b50_u32.to_le_bytes());
    for x in [ZIP_VERSION, 0, 0, 0, DATE] {
        h.extend(x.to_le_bytes());
    }
    for x in [crc32, SEE_64, SEE_64] {
        h.extend(x.to_le_bytes());
    }
    for x in [name.len() as u16, 20] {
        h.extend(x.to_le_bytes());
    }
    debug_assert_eq!(h.len(), LOCAL_FIXED);
    h.extend(name.bytes());
    for x in [1_u16, 16] {
        h.extend(x.to_le_bytes());
    }
    for x in [size, size] {
        h.extend(x.to_le_bytes());
    }
    h
}

/// Central directory (4.3.12), which begins at byte `start`, and the three records that end the file
/// (4.3.14 to 4.3.16).
fn directory(members: &[Member], start: u64) -> Vec<u8> {
    let mut d = Vec::new();
    for m in members {
        let name = format!("{}.npy", m.name);
        d.extend(0x0201_4b50_u32.to_le_bytes());
        for x in [MADE_BY, ZIP_VERSION, 0, 0, 0, DATE] {
            d.extend(x.to_le_bytes());
        }
        for x in [m.crc32, SEE_64, SEE_64] {
            d.extend(x.to_le_bytes());
        }
        for x in [name.len() as u16, 28, 0, 0, 0] {
            d.extend(x.to_le_bytes());
        }
        for x in [PERMISSIONS, SEE_64] {
            d.extend(x.to_le_bytes());
        }
        d.extend(name.bytes());
        for x in [1_u16, 24] {
            d.extend(x.to_le_bytes());
        }
        for x in [m.size, m.size, m.offset] {
            d.extend(x.to_le_bytes());
        }
    }
    let (count, length) = (members.len() as u64, d.len() as u64);
    d.extend(0x0606_4b50_u32.to_le_bytes());
    d.extend(44_u64.to_le_bytes());
    for x in [MADE_BY, ZIP_VERSION] {
        d.extend(x.to_le_bytes());
    }
    d.extend([0; 8]);
    for x in [count, count, length, start] {
        d.extend(x.to_le_bytes());
    }
    d.extend(0x0706_4b50_u32.to_le_bytes());
    d.extend(0_u32.to_le_bytes());
    d.extend((start + length).to_le_bytes());
    d.extend(1_u32.to_le_bytes());
    d.extend(0x0605_4b50_u32.to_le_bytes());
    for x in [0, 0, u16::MAX, u16::MAX] {
        d.extend(x.to_le_bytes());
    }
    for x in [SEE_64, SEE_64] {
        d.extend(x.to_le_bytes());
    }
    d.extend(0_u16.to_le_bytes());
    d
}
