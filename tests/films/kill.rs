//! What befalls long runs, to real processes: SIGKILL at any moment, a write that stalls, a full disk. The film on disk
//! stays whole, and what comes after has the bits of a run that nothing befell.

use crate::output_support::Random;
use crate::program::{Bench, NAMESPACE, SCENE, says};
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::output::store;
use etendue::provenance::Provenance;
use etendue::scene::parse;
use etendue::settings::{Overrides, Settings};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// What `--checkpoint` says.
const INTERVAL: Duration = Duration::from_millis(100);

/// Samples that no run here comes to.
const FOR_EVER: &str = "4000000";

/// Starts `etendue render box.toml ARGS`.
fn start(bench: &Bench, args: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(bench.dir.path())
        .args(["render", "box.toml", "--quiet", "-o", "a.png"])
        .args(args.split_whitespace())
        .stdin(Stdio::null())
        .spawn()
        .expect("the program starts")
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill").success());
}

/// Temporary files beside a film, with their lengths.
fn leftovers(bench: &Bench) -> Vec<(PathBuf, u64)> {
    fs::read_dir(bench.dir.path())
        .expect("our own folder")
        .flatten()
        .filter(|e| e.file_name().to_string_lossy().ends_with(".partial"))
        .filter_map(|e| Some((e.path(), e.metadata().ok()?.len())))
        .collect()
}

/// When a file was written; long ago if it is not there.
fn written(path: &Path) -> SystemTime {
    let meta = fs::metadata(path);
    meta.and_then(|m| m.modified())
        .unwrap_or(SystemTime::UNIX_EPOCH)
}

/// Kills a render `kills` times, each within `most` of its start, or of its first save, then lets it come to its end.
fn killed_at_random(backend: &str, kills: usize, most: Duration, after_a_save: bool) {
    let bench = Bench::new();
    let path = bench.path("f.npz");
    let mut random = Random(7);
    let mut held = 0;
    // The age of the film when its process was killed, which is the time lost.
    let mut lost = Vec::new();
    for _ in 0..kills {
        let started = SystemTime::now();
        let mut child = start(
            &bench,
            &format!(
                "--backend {backend} --threads 1 --film f.npz --checkpoint 100ms --spp {FOR_EVER}"
            ),
        );
        while after_a_save && written(&path) <= started {
            let running = started.elapsed().is_ok_and(|t| t < Duration::from_secs(60));
            assert!(running, "no save");
            sleep(Duration::from_millis(5));
        }
        sleep(most.mul_f64(random.below(1 << 20) as f64 / (1 << 20) as f64));
        assert_eq!(
            child.try_wait().expect("its state"),
            None,
            "it ended by itself"
        );
        let killed = SystemTime::now();
        child.kill().expect("it can be killed");
        child.wait().expect("its end");
        assert!(
            leftovers(&bench).len() <= 1,
            "those of earlier kills are removed"
        );
        if !path.exists() {
            continue;
        }
        let (film, provenance) = store::load(&path).expect("a whole film");
        let samples = film.coverage.samples().0;
        assert!(samples >= held, "{samples} samples after {held}");
        assert_eq!(provenance.samples, samples as f64);
        held = samples;
        if written(&path) > started {
            lost.push(killed.duration_since(written(&path)).unwrap_or_default());
        }
    }
    lost.sort();
    let median = lost.get(lost.len() / 2);
    println!(
        "{backend}: {held} samples per pixel; {} of {kills} had saved: lost {median:?}, at most {:?}",
        lost.len(),
        lost.last()
    );
    assert!(
        lost.len() >= kills / 3,
        "only {} of {kills} runs ever saved",
        lost.len()
    );
    // That it is an interval at most follows from the rule, which has a test of its own without a clock (`saver.rs`). A clock
    // adds the time of a save and every wait for a processor, so here it is half of the kills: 46 ms where seven processes
    // wanted each core.
    assert!(median <= Some(&INTERVAL), "{median:?} lost");

    let spp = held + 3;
    let rest = format!("render box.toml --backend {backend} --spp {spp} -o a.png");
    bench.run(&format!("{rest} --film f.npz")).success();
    bench.run(&format!("{rest} --film once.npz")).success();
    assert!(bench.film("f.npz") == bench.film("once.npz"), "other bits");
    assert_eq!(bench.names(), ["a.png", "box.toml", "f.npz", "once.npz"]);
}

#[test]
fn a_film_killed_a_hundred_times_ends_with_the_same_bits() {
    killed_at_random("cpu", 100, Duration::from_millis(500), false);
}

/// The unfinished block of f32 sums is saved too.
#[test]
fn kills_on_the_adapter_end_with_the_same_bits() {
    killed_at_random("gpu", 10, Duration::from_millis(500), true);
}

/// A film of a large picture with one black sample per pixel, which `render box.toml --size 1200x900` would resume.
fn large_film(path: &Path) -> Film {
    let size = [1200, 900];
    let scene = parse::parse_str(Path::new("box.toml"), SCENE).expect("a scene");
    let flags = Overrides {
        size: Some(size),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let whole = Rect::whole(size);
    let mut film = Film::new(size, whole, settings.strata);
    film.coverage.add(whole, 0..1);
    let mut provenance = Provenance::new(&scene, SCENE, &settings);
    provenance.describe(&film);
    store::save(path, &film, &provenance).expect("saved");
    film
}

/// Simulates a stalled disk: stops the process during a save (SIGSTOP when part of the new film is written), and never
/// continues it.
#[test]
fn a_stalled_write_loses_only_its_own_samples() {
    let bench = Bench::new();
    let path = bench.path("f.npz");
    let film = large_film(&path);
    let whole = fs::metadata(&path).expect("the film").len();
    // Few pixels of the large film are rendered: what takes time is saving it.
    let args = "--backend cpu --size 1200x900 --region 0,0,8,8 --film f.npz";
    let mut child = start(&bench, &format!("{args} --spp {FOR_EVER} --checkpoint 1ms"));
    let begun = Instant::now();
    loop {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "no save was caught"
        );
        let half = |l: &(PathBuf, u64)| (1..whole).contains(&l.1);
        if leftovers(&bench).iter().any(half) {
            signal(&child, "-STOP");
            // The stop waits for the system call in progress.
            sleep(Duration::from_millis(200));
            if leftovers(&bench).iter().any(half) {
                break;
            }
            signal(&child, "-CONT");
        }
    }
    println!("stopped with {:?} of {whole} bytes", leftovers(&bench));
    let before = fs::read(&path).expect("the film");
    let held = bench.film("f.npz");
    assert_eq!(held.sums().len(), film.sums().len());
    bench.run("develop f.npz -o b.png").success();

    child.kill().expect("it can be killed");
    child.wait().expect("its end");
    assert!(
        fs::read(&path).expect("the film") == before,
        "the film was touched"
    );
    assert_eq!(leftovers(&bench).len(), 1);

    let spp = held.coverage.samples().1 + 2;
    bench
        .run(&format!("render box.toml {args} --spp {spp} -o a.png"))
        .success();
    assert_eq!(bench.film("f.npz").coverage.samples(), (1, spp));
    assert!(leftovers(&bench).is_empty());
}

/// A film of 10 samples, and the command that resumes it at `PATH`.
fn small_film(bench: &Bench) -> Vec<u8> {
    bench.render("--spp 10 --film f.npz -o a.png");
    fs::read(bench.path("f.npz")).expect("the film")
}

#[test]
fn a_limit_on_file_sizes_is_an_error_and_the_film_stays() {
    let bench = Bench::new();
    let before = small_film(&bench);
    // The pictures are small enough, the film of 52 KiB is not.
    let script =
        "ulimit -f 40; \"$0\" render box.toml --backend cpu --spp 20 --film f.npz -o b.png";
    assert_eq!(bench.shell(&[], script), 4);
    let said = bench.said();
    assert!(
        said.contains("error: f.npz: cannot write: file too large"),
        "{said}"
    );
    assert_eq!(fs::read(bench.path("f.npz")).expect("the film"), before);
    assert!(leftovers(&bench).is_empty());
    assert!(bench.path("b.png").exists(), "what can be saved is");
}

/// A disk with room for one film and half of another: a tmpfs in a mount namespace of its own.
#[test]
fn a_full_disk_is_an_error_and_the_film_stays() {
    let bench = Bench::new();
    let before = small_film(&bench);
    let mount =
        "mkdir -p disk && mount -t tmpfs -o size=96k tmpfs disk || exit 77; cp f.npz disk/;";
    if bench.shell(NAMESPACE, mount) != 0 {
        let said = bench.said();
        eprintln!("SKIPPED, no tmpfs can be mounted here: {said}");
        return;
    }
    let render = "\"$0\" render box.toml --backend cpu --film disk/f.npz";
    let script = format!(
        "{mount} {render} --spp 20 -o b.png; status=$?; cp disk/f.npz after; ls -A disk >&2; exit $status"
    );
    assert_eq!(bench.shell(NAMESPACE, &script), 4);
    let said = bench.said();
    assert!(
        said.contains("error: disk/f.npz: cannot write: no space left"),
        "{said}"
    );
    assert!(
        said.ends_with("\nf.npz\n"),
        "something was left behind: {said}"
    );
    assert_eq!(fs::read(bench.path("after")).expect("the film"), before);
    assert!(bench.path("b.png").exists(), "what can be saved is");
    // The film is saved where there is room.
    let names = bench.names();
    let rescued = names.iter().find(|n| n.starts_with("f.rescued-"));
    let rescued = rescued.unwrap_or_else(|| panic!("no film in {names:?}: {said}"));
    assert!(
        said.contains(&format!(
            "warning: disk/f.npz: the film can't be saved there; it is in {rescued}, with all samples"
        )),
        "{said}"
    );
    assert_eq!(bench.film(rescued).coverage.samples(), (20, 20));

    // Full for some checkpoints only: they are warned of, and nothing is lost.
    let script = format!(
        "{mount} head -c 20k /dev/zero > disk/filler; (sleep 1; rm disk/filler; mount -o remount,size=1m disk) & \
         {render} --time 3s --checkpoint 200ms -o b.png; status=$?; cp disk/f.npz after; exit $status"
    );
    assert_eq!(bench.shell(NAMESPACE, &script), 0);
    let said = bench.said();
    assert!(
        said.contains("warning: disk/f.npz: cannot write: no space left"),
        "{said}"
    );
    let warnings = said.lines().filter(|l| l.contains("cannot write"));
    let warnings: Vec<&str> = warnings.collect();
    assert!(
        warnings.len() == 1 && warnings[0].ends_with(" UTC); it is tried again until the end"),
        "{said}"
    );
    let samples = bench.film("after").coverage.samples().0;
    assert!(samples > 10, "{samples}");
    bench
        .run("develop after -o c.png")
        .success()
        .stderr(says("wrote"));
}
