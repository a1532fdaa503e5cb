//! Open Image Denoise, loaded when it is asked for, from wherever it is. This program is neither built with it nor brings it.

use crate::stats::denoised::Rgb;
use libloading::{Library, Symbol};
use std::env;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::fs;
use std::path::{Path, PathBuf};

/// Its file names: of Linux, macOS and Windows.
const NAMES: [&str; 5] = [
    "libOpenImageDenoise.so.2",
    "libOpenImageDenoise.so",
    "libOpenImageDenoise.2.dylib",
    "libOpenImageDenoise.dylib",
    "OpenImageDenoise.dll",
];

/// Where it lies in the Python package `pyoidn`.
const IN_PACKAGE: &str = "pyoidn/oidn/lib";

/// The most memory that it takes, in MB. Larger pictures are denoised in tiles.
const MEMORY: c_int = 2048;

/// `OIDN_DEVICE_TYPE_CPU`: the same on every machine, and it reads our memory.
const CPU: c_int = 1;

/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

type Handle = *mut c_void;

/// The library and its device.
pub struct Oidn {
    library: Library,
    device: Handle,
    version: c_int,
}

impl Oidn {
    /// Loads it from `path`, a file or a folder; or else finds it. `threads` is the number that it uses; all if not given.
    pub fn load(path: Option<&Path>, threads: Option<u16>) -> Result<Self, String> {
        let named = path.map(Path::to_owned);
        let named = named.or_else(|| {
            env::var_os("ETENDUE_OIDN")
                .filter(|v| !v.is_empty())
                .map(Into::into)
        });
        let Some(named) = named else {
            let found = places().iter().find_map(|place| open(place).ok());
            let library = found.ok_or(
                "Open Image Denoise was not found: install the Python package pyoidn or the library itself, or say where it is \
                 with --oidn PATH or ETENDUE_OIDN",
            )?;
            return Self::of(library, threads);
        };
        let files: Vec<PathBuf> = if named.is_dir() {
            below(&named)
        } else {
            vec![named.clone()]
        };
        let shown = named.display();
        let [file, ..] = &files[..] else {
            return Err(format!(
                "{shown}: there is no library of Open Image Denoise in this folder, nor in its lib, oidn/lib or {IN_PACKAGE}"
            ));
        };
        let library = open(file)
            .map_err(|e| format!("{shown}: can't be loaded as Open Image Denoise: {e}"))?;
        Self::of(library, threads).map_err(|e| format!("{shown}: {e}"))
    }

    fn of(library: Library, threads: Option<u16>) -> Result<Self, String> {
        let mut this = Self {
            library,
            device: std::ptr::null_mut(),
            version: 0,
        };
        // SAFETY: the signatures are those of version 2 of the library's C interface, whose functions are found by name. The device is
        // released when this is dropped.
        unsafe {
            let new: Symbol<unsafe extern "C" fn(c_int) -> Handle> = this.find(c"oidnNewDevice")?;
            let set_int: Symbol<unsafe extern "C" fn(Handle, *const c_char, c_int)> =
                this.find(c"oidnSetDeviceInt")?;
            let set_bool: Symbol<unsafe extern "C" fn(Handle, *const c_char, bool)> =
                this.find(c"oidnSetDeviceBool")?;
            let get_int: Symbol<unsafe extern "C" fn(Handle, *const c_char) -> c_int> =
                this.find(c"oidnGetDeviceInt")?;
            let commit: Symbol<unsafe extern "C" fn(Handle)> = this.find(c"oidnCommitDevice")?;
            let device = new(CPU);
            if let Some(threads) = threads {
                set_int(device, c"numThreads".as_ptr(), threads.into());
            }
            // Other processes use the cores, too.
            set_bool(device, c"setAffinity".as_ptr(), false);
            commit(device);
            let version = get_int(device, c"version".as_ptr());
            (this.device, this.version) = (device, version);
        }
        this.check()?;
        Ok(this)
    }

    /// Name and version.
    pub fn name(&self) -> String {
        let v = self.version;
        format!(
            "Open Image Denoise {}.{}.{}",
            v / 10_000,
            v / 100 % 100,
            v % 100
        )
    }

    /// Denoises a picture of `size` pixels. The features have no noise.
    pub fn denoise(
        &self,
        color: &Rgb,
        albedo: &Rgb,
        normal: &Rgb,
        size: [u32; 2],
    ) -> Result<Rgb, String> {
        let [width, height] = size.map(|n| n as usize);
        assert!(
            [color, albedo, normal]
                .iter()
                .all(|p| p.len() == width * height)
        );
        let mut output = vec![[0.0f32; 3]; width * height];
        // SAFETY: as above. Each image has width x height pixels of three floats, and outlives the filter, which is released here. Inputs are
        // only read.
        unsafe {
            let new: Symbol<unsafe extern "C" fn(Handle, *const c_char) -> Handle> =
                self.find(c"oidnNewFilter")?;
            type SetImage = unsafe extern "C" fn(
                Handle,
                *const c_char,
                *mut c_void,
                c_int,
                usize,
                usize,
                usize,
                usize,
                usize,
            );
            let set_image: Symbol<SetImage> = self.find(c"oidnSetSharedFilterImage")?;
            let set_bool: Symbol<unsafe extern "C" fn(Handle, *const c_char, bool)> =
                self.find(c"oidnSetFilterBool")?;
            let set_int: Symbol<unsafe extern "C" fn(Handle, *const c_char, c_int)> =
                self.find(c"oidnSetFilterInt")?;
            let commit: Symbol<unsafe extern "C" fn(Handle)> = self.find(c"oidnCommitFilter")?;
            let execute: Symbol<unsafe extern "C" fn(Handle)> = self.find(c"oidnExecuteFilter")?;
            let release: Symbol<unsafe extern "C" fn(Handle)> = self.find(c"oidnReleaseFilter")?;
            let filter = new(self.device, c"RT".as_ptr());
            for (name, data) in [
                (c"color", color.as_ptr().cast_mut()),
                (c"albedo", albedo.as_ptr().cast_mut()),
                (c"normal", normal.as_ptr().cast_mut()),
                (c"output", output.as_mut_ptr()),
            ] {
                set_image(
                    filter,
                    name.as_ptr(),
                    data.cast(),
                    FLOAT3,
                    width,
                    height,
                    0,
                    0,
                    0,
                );
            }
            set_bool(filter, c"hdr".as_ptr(), true);
            set_bool(filter, c"cleanAux".as_ptr(), true);
            set_int(filter, c"maxMemoryMB".as_ptr(), MEMORY);
            commit(filter);
            execute(filter);
            release(filter);
        }
        self.check()?;
        if output.as_flattened().iter().all(|v| v.is_finite()) {
            Ok(output)
        } else {
            Err("Open Image Denoise has made values that are not finite".into())
        }
    }

    /// The first error since the last call, if there is one.
    fn check(&self) -> Result<(), String> {
        let mut message: *const c_char = std::ptr::null();
        // SAFETY: as above. The message is the library's own, and valid until the next call.
        let (code, text) = unsafe {
            let get: Symbol<unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int> =
                self.find(c"oidnGetDeviceError")?;
            let code = get(self.device, &raw mut message);
            let text = (!message.is_null()).then(|| CStr::from_ptr(message).to_string_lossy());
            (code, text)
        };
        if code == 0 {
            return Ok(());
        }
        let text = text.unwrap_or_default();
        Err(format!("Open Image Denoise failed: {text}"))
    }

    /// A function of the library.
    ///
    /// # Safety
    /// T must be its signature.
    unsafe fn find<T>(&self, name: &CStr) -> Result<Symbol<'_, T>, String> {
        // SAFETY: the caller's promise.
        unsafe { self.library.get(name.to_bytes_with_nul()) }.map_err(|_| {
            let name = name.to_string_lossy();
            format!("it has no function {name}, so it is not Open Image Denoise 2")
        })
    }
}

impl Drop for Oidn {
    fn drop(&mut self) {
        // SAFETY: as above; the handle is not used again.
        unsafe {
            if let Ok(release) = self.find::<unsafe extern "C" fn(Handle)>(c"oidnReleaseDevice")
                && !self.device.is_null()
            {
                release(self.device);
            }
        }
    }
}

fn open(path: &Path) -> Result<Library, libloading::Error> {
    // A file of this name may be anything. Its first lines run when it is loaded, as those of every library of this system do.
    // SAFETY: loading Open Image Denoise has no requirements; that it is this library is what its name says.
    unsafe { Library::new(path) }
}

/// Where it may be, without being told: the loader's own places, usual folders, and Python's packages.
fn places() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = ["/usr/local/lib", "/opt/oidn/lib", "/opt/homebrew/lib"]
        .map(Into::into)
        .into();
    let mut roots: Vec<PathBuf> = Vec::new();
    roots.extend(
        ["VIRTUAL_ENV", "CONDA_PREFIX"]
            .iter()
            .filter_map(env::var_os)
            .map(Into::into),
    );
    // A program that pip has installed lies in the same environment.
    let program = env::current_exe().ok();
    roots.extend(
        program
            .iter()
            .filter_map(|p| Some(p.parent()?.parent()?.to_owned())),
    );
    roots.extend(env::var_os("HOME").map(|home| Path::new(&home).join(".local")));
    roots.extend(["/usr/local", "/usr"].map(PathBuf::from));
    for root in roots {
        for packages in ["site-packages", "dist-packages"] {
            folders.push(root.join("Lib").join(packages).join(IN_PACKAGE));
            folders.extend(pythons(&root).map(|p| p.join(packages).join(IN_PACKAGE)));
        }
    }
    let in_folders = folders
        .iter()
        .flat_map(|f| NAMES.iter().map(|name| f.join(name)));
    let of_loader = NAMES.iter().map(PathBuf::from);
    of_loader.chain(in_folders.filter(|f| f.exists())).collect()
}

/// The libraries in a folder: its own, those of an installation that has it as its root, and those of a Python package or of a folder of
/// packages.
fn below(folder: &Path) -> Vec<PathBuf> {
    let folders = ["", "lib", "oidn/lib", IN_PACKAGE].map(|inner| folder.join(inner));
    let files = folders
        .iter()
        .flat_map(|f| NAMES.iter().map(|name| f.join(name)));
    files.filter(|f| f.exists()).collect()
}

/// The folders lib/python3* of an environment, the newest first.
fn pythons(root: &Path) -> impl Iterator<Item = PathBuf> {
    let is_python = |p: &PathBuf| {
        let name = p.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("python3")
    };
    let all = fs::read_dir(root.join("lib"))
        .into_iter()
        .flatten()
        .flatten();
    let mut all: Vec<PathBuf> = all.map(|e| e.path()).filter(is_python).collect();
    all.sort();
    all.into_iter().rev()
}
