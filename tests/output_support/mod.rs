//! Films and provenances to write, and the independent reader.

#![allow(dead_code, reason = "every test binary uses its own part of it")]

use etendue::engine::{Counters, DeviceInfo};
use etendue::film::coverage::Rect;
use etendue::film::{BLOCK, Film, REPLICATES, Sums};
use etendue::provenance::{Provenance, SAMPLER_VERSION};
use etendue::settings::{Integrator, LightParts, Settings};
use std::ops::Range;
use std::path::Path;
use std::process::Command;

/// splitmix64: reproducible numbers without a dependency.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 <= x < n.
    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
}

/// What a run of the program on a small scene could have left.
pub fn provenance(size: [u32; 2]) -> Provenance {
    let mut p = Provenance {
        software: "etendue".into(),
        version: "0.1.0".into(),
        sampler_version: SAMPLER_VERSION,
        scene_title: Some("Kästchen – \"one\"".into()),
        scene_hash: "0123456789abcdef".repeat(4),
        scene_text: "title = \"Kästchen – \\\"one\\\"\"\n# λ\n".into(),
        settings: Settings {
            size,
            max_depth: 64,
            max_depth_is_default: true,
            strata: 2,
            seed: u32::MAX,
            shadow_rays: 1,
            light: LightParts::ALL,
            integrator: Integrator::Path,
            light_paths: true,
        },
        slice: None,
        samples: 0.0,
        replicates: 0,
        devices: Vec::new(),
        seconds: 0.0,
        counters: Counters::default(),
        relative_error: None,
        relative_error_uncertainty: None,
        relative_error_doubt: None,
        black: false,
    };
    let device = DeviceInfo {
        name: "llvmpipe (LLVM 15)".into(),
        driver: "Mesa 22.3.6".into(),
        backend: "gpu".into(),
        software: true,
    };
    let counters = Counters {
        paths: 12,
        rays: 34,
        ..Counters::default()
    };
    p.add_work(&device, counters, 1.5);
    p
}

/// Adds samples as a GPU does: block by block, going on with the unfinished one.
pub fn render(film: &mut Film, area: Rect, samples: Range<u64>) {
    let mut at = samples.start;
    while at < samples.end {
        let end = ((at / BLOCK + 1) * BLOCK).min(samples.end);
        let before = film.clone();
        film.put_block(area, at..end, |x, y| {
            let mut running = before.partial_at(x, y);
            for k in at..end {
                let replicate = (k / 4) as usize % REPLICATES;
                let seed = u64::from(y) << 40 | u64::from(x) << 20 | k;
                let h = Random(seed).below(1000) as f32 / 1000.0;
                let sample: Sums<f32> = [h, 0.5 * h, 0.25 * h, 0.3 * h * h];
                for (sum, s) in running[replicate].iter_mut().zip(sample) {
                    *sum += s;
                }
            }
            running
        });
        at = end;
    }
}

/// A film of 7 x 5 pixels, wholly covered, with an unfinished block.
pub fn whole_film() -> Film {
    let size = [7, 5];
    let mut film = Film::new(size, Rect::whole(size), 2);
    render(&mut film, Rect::whole(size), 0..300);
    film
}

/// Two overlapping regions of 7 x 5 pixels with different samples, in finished blocks.
pub fn region_film() -> Film {
    let bounds = Rect {
        x0: 1,
        y0: 1,
        x1: 6,
        y1: 4,
    };
    let mut film = Film::new([7, 5], bounds, 2);
    render(&mut film, Rect { x1: 4, ..bounds }, 0..256);
    render(&mut film, Rect { y0: 2, ..bounds }, 256..512);
    film
}

/// The provenance that goes with a film.
pub fn described(film: &Film) -> Provenance {
    let mut p = provenance(film.size);
    p.describe(film);
    p
}

/// Makes a film's JSON say `to` where it said `from`, of the same length or shorter, with every checksum right: what a
/// program gone wrong, not a disk, would leave.
pub fn forge(film: &mut [u8], from: &str, to: &str) {
    let padded = format!("{to:width$}", width = from.len());
    forge_bytes(film, from.as_bytes(), padded.as_bytes());
}

/// Puts `to`, which is as long, where `from` is first found, and makes the checksums right again.
pub fn forge_bytes(film: &mut [u8], from: &[u8], to: &[u8]) {
    let found = film.windows(from.len()).position(|w| w == from);
    let at = found.unwrap_or_else(|| panic!("{} is not in the file", from.escape_ascii()));
    film[at..at + from.len()].copy_from_slice(to);
    reseal(film);
}

/// Makes the first pixel's count -1, where it and its neighbours count `samples`.
pub fn negate_first_count(film: &mut [u8], samples: u64) {
    let counts = samples.to_le_bytes().repeat(3);
    let at = film.windows(24).position(|w| w == counts).expect("counts");
    film[at..at + 8].copy_from_slice(&(-1i64).to_le_bytes());
    reseal(film);
}

/// Makes all checksums of the archive right again.
fn reseal(bytes: &mut [u8]) {
    let mut at = 0;
    let mut sums = Vec::new();
    while bytes[at..at + 4] == *b"PK\x03\x04" {
        let name = usize::from(bytes[at + 26]);
        let size_at = at + 30 + name + 4;
        let size = u64::from_le_bytes(bytes[size_at..size_at + 8].try_into().unwrap()) as usize;
        let data = size_at + 16;
        let crc = crc32fast::hash(&bytes[data..data + size]).to_le_bytes();
        bytes[at + 14..at + 18].copy_from_slice(&crc);
        sums.push(crc);
        at = data + size;
    }
    for crc in sums {
        bytes[at + 16..at + 20].copy_from_slice(&crc);
        at += 46 + usize::from(bytes[at + 28]) + 28;
    }
}

/// What scripts/check_outputs.py, which shares no code with this program, sees in a file.
///
/// Without Python and its modules this fails, unless ETENDUE_SKIP_PYTHON=1 asks for the checks to be
/// left out: then it says so and returns `None`.
pub fn seen_from_python(path: &Path) -> Option<serde_json::Value> {
    if std::env::var_os("ETENDUE_SKIP_PYTHON").is_some_and(|v| v == "1") {
        eprintln!("ETENDUE_SKIP_PYTHON=1: not checked with the independent reader");
        return None;
    }
    let python = std::env::var("ETENDUE_PYTHON").unwrap_or("python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/check_outputs.py");
    let output = Command::new(&python)
        .arg(script)
        .arg(path)
        .output()
        .unwrap_or_else(|e| panic!("{python}: {e}; set ETENDUE_PYTHON, or ETENDUE_SKIP_PYTHON=1"));
    assert!(
        output.status.success(),
        "{python} scripts/check_outputs.py failed (it needs pip install OpenEXR numpy pillow; \
         ETENDUE_PYTHON names another Python, ETENDUE_SKIP_PYTHON=1 leaves it out):\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(serde_json::from_slice(&output.stdout).expect("JSON from check_outputs.py"))
}
