//! Clients that are many, slow, or gone do not hold up anyone, and change no bit.

use crate::client::{Running, until};
use crate::program::Bench;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The sums of all samples, and thereby every picture, are the same with and without clients.
#[test]
fn clients_change_no_bit() {
    let bench = Bench::new();
    let args = "render box.toml --backend cpu --size 48x32 --spp 600 -o a.png --film";
    bench.run(&format!("{args} alone.npz")).success();
    let mut running = Running::serve(&bench, &format!("{args} watched.npz --log a.jsonl"));
    let mut looks = 0;
    while running.is_running() {
        for path in ["layers/picture", "layers/error?k=2", "pixel?x=3&y=4"] {
            if let Ok(mut stream) = TcpStream::connect(&running.at) {
                let at = &running.at;
                let request = format!(
                    "GET /runs/0/{path} HTTP/1.1\r\nHost: {at}\r\nConnection: close\r\n\r\n"
                );
                let _ = stream.write_all(request.as_bytes());
                let mut answer = Vec::new();
                let _ = stream.read_to_end(&mut answer);
                looks += usize::from(answer.starts_with(b"HTTP/1.1 200"));
            }
        }
    }
    assert_eq!(running.end().0, Some(0));
    assert!(looks > 3, "{looks} answers");
    assert_eq!(bench.film("alone.npz"), bench.film("watched.npz"));
}

#[test]
fn slow_and_vanished_clients_hold_up_nobody() {
    let bench = Bench::new();
    let running = Running::endless(&bench, "--size 1024x768");
    running.layer("picture");
    let at = running.at.clone();
    // They ask for megabytes and take nothing.
    let slow: Vec<_> = (0..40)
        .map(|n| {
            let mut stream = running.connect();
            let what = ["runs/0/layers/error", "events", "runs/0/film.npz"][n % 3];
            write!(stream, "GET /{what} HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
            stream
        })
        .collect();
    // They go in the middle of a request, or of an answer.
    for n in 0..40 {
        let mut stream = running.connect();
        let request = format!("GET /runs/0/layers/picture HTTP/1.1\r\nHost: {at}\r\n\r\n");
        let end = if n % 2 == 0 { 20 } else { request.len() };
        stream.write_all(&request.as_bytes()[..end]).unwrap();
        if n % 4 == 1 {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
    std::thread::sleep(Duration::from_millis(500));
    let begun = Instant::now();
    assert_eq!(running.get("").status, 200);
    assert!(
        begun.elapsed() < Duration::from_secs(2),
        "{:?}",
        begun.elapsed()
    );
    let mut events = running.events();
    let now = |u: &serde_json::Value| u["now"]["samples"].as_f64().unwrap_or(0.0);
    let samples = now(&events.next(|u| now(u) > 0.0));
    events.next(|u| now(u) > samples);
    // Views wait for room, at worst.
    until("view", || {
        (running.get("runs/0/layers/samples?k=8").status == 200).then_some(())
    });
    running.interrupt();
    assert_eq!(running.end().0, Some(130));
    drop(slow);
}

#[cfg(target_os = "linux")]
#[test]
fn connections_and_threads_are_bounded() {
    let bench = Bench::new();
    let running = Running::endless(&bench, "");
    let mut idle: Vec<_> = (0..256).map(|_| running.connect()).collect();
    std::thread::sleep(Duration::from_millis(500));
    // One more is sent away at once.
    let mut more = running.connect();
    let begun = Instant::now();
    assert!(matches!(more.read(&mut [0; 1]), Ok(0) | Err(_)));
    assert!(begun.elapsed() < Duration::from_secs(5));
    assert!(running.threads() < 20, "{}", running.threads());
    idle.truncate(10);
    until("room", || (running.get("").status == 200).then_some(()));
    // A client that sends no request is sent away in the end.
    let begun = Instant::now();
    idle[0]
        .set_read_timeout(Some(Duration::from_secs(60)))
        .unwrap();
    assert!(matches!(idle[0].read(&mut [0; 1]), Ok(0) | Err(_)));
    assert!(begun.elapsed() < Duration::from_secs(45));
}

/// What a hundred clients cost that only listen: the time that the server takes of one core, all of which a render of one thread
/// would have on a quiet machine.
#[cfg(target_os = "linux")]
#[test]
fn a_hundred_idle_clients_cost_less_than_a_hundredth() {
    let bench = Bench::new();
    let running = Running::endless(&bench, "--size 256x192");
    running
        .events()
        .next(|u| u["now"]["samples"].as_f64() > Some(0.0));
    let mut clients: Vec<_> = (0..100).map(|_| running.events().into_stream()).collect();
    clients
        .iter()
        .for_each(|c| c.set_nonblocking(true).unwrap());
    // They read, as a browser does.
    let mut bytes = vec![0; 1 << 16];
    let mut read = |clients: &mut [TcpStream], seconds: u64| {
        let until = Instant::now() + Duration::from_secs(seconds);
        let mut events = 0;
        while Instant::now() < until {
            for client in clients.iter_mut() {
                let count = client.read(&mut bytes).unwrap_or(0);
                events += bytes[..count].windows(6).filter(|w| w == b"data: ").count();
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        events
    };
    read(&mut clients, 2);
    let begun = Instant::now();
    let before = running.server_seconds();
    let events = read(&mut clients, 15);
    let used = running.server_seconds() - before;
    let core = begun.elapsed().as_secs_f64();
    println!("{used:.2} s of {core:.1} s of a core for {events} events");
    assert!(events > 200, "{events} events");
    assert!(used < 0.01 * core, "{used} s of {core} s");
}
