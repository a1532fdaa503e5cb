//! What the page's server answers, and to whom.

use crate::client::{Running, until};
use crate::program::{Bench, says};
use std::net::TcpListener;

#[test]
fn a_render_shows_its_numbers_and_its_picture() {
    let bench = Bench::new();
    let running = Running::endless(&bench, "--region 4,2,20,12");
    let page = running.get("");
    assert_eq!(page.status, 200);
    for header in [
        "content-type: text/html; charset=utf-8",
        "cache-control: no-store",
        "x-content-type-options: nosniff",
        "content-security-policy: default-src 'none'",
    ] {
        assert!(page.head.contains(header), "{}", page.head);
    }
    // Nothing comes from elsewhere, and no address begins at the root.
    let text = page.text().replace("http://www.w3.org/2000/svg", "");
    for outside in [
        "http:",
        "https:",
        "@import",
        "url(",
        "src=",
        "fetch(\"/",
        "fetch(`/",
        "{{",
    ] {
        assert!(!text.contains(outside), "{outside} in the page");
    }

    let mut events = running.events();
    let update = events.next(|u| u["now"]["relative_error"].is_f64());
    assert_eq!(
        update["now"]["relative_error_doubt"],
        serde_json::Value::Null
    );
    let (first, picture) = running.layer("picture");
    assert_eq!(picture.len(), 24 * 16 * 4);
    let (_, part) = running.layer("picture?x0=4&y0=2&x1=20&y1=12&k=2");
    assert_eq!(part.len(), 8 * 5 * 4);
    // Who looks gets newer ones.
    until("newer picture", || {
        (running.layer("samples").0 > first).then_some(())
    });

    let pixel = running.get("runs/0/pixel?x=8&y=8").json();
    assert!(pixel["samples"].as_u64().unwrap() > 0 && pixel["error"][3].as_f64().unwrap() > 0.0);
    assert_eq!(running.get("runs/0/pixel?x=0&y=0").json()["samples"], 0);
    let about = running.get("runs/0/about").json();
    assert!(about["scene_text"].as_str().unwrap().contains("vfov"));
    for (path, kind, start) in [
        ("picture.exr", "image/x-exr", &b"\x76\x2f\x31\x01"[..]),
        ("picture.png?exposure=1", "image/png", b"\x89PNG"),
        ("film.npz", "application/zip", b"PK"),
    ] {
        let file = running.get(&format!("runs/0/{path}"));
        assert!(
            file.head.contains(&format!("content-type: {kind}")),
            "{}",
            file.head
        );
        assert!(file.head.contains("filename=\"box."), "{}", file.head);
        assert!(file.body.starts_with(start), "{path}");
        std::fs::write(bench.path("downloaded.npz"), file.body).unwrap();
    }
    // A film that was downloaded can be resumed.
    bench.film("downloaded.npz");
    running.interrupt();
    let ended = events.next(|u| !u["ended"].is_null());
    assert_eq!(ended["ended"], "interrupted");
    assert_eq!(running.end().0, Some(130));
}

#[test]
fn the_page_is_only_for_reading_and_only_under_its_own_name() {
    let bench = Bench::new();
    let running = Running::endless(&bench, "--host render.example.org");
    let at = running.at.clone();
    let ask = |method: &str, path: &str, hosts: &[&str]| {
        let hosts: String = hosts.iter().map(|h| format!("Host: {h}\r\n")).collect();
        running.raw(&format!(
            "{method} {path} HTTP/1.1\r\n{hosts}Connection: close\r\n\r\n"
        ))
    };
    for host in [
        &at,
        "localhost",
        "render.example.org",
        "RENDER.example.org:443",
        "10.0.0.1:80",
        "[::1]:1",
    ] {
        assert_eq!(ask("GET", "/", &[host]).status, 200, "{host}");
    }
    for host in [
        "evil.example",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "",
    ] {
        let refused = ask("GET", "/events", &[host]);
        assert_eq!(refused.status, 421, "{host}");
        assert!(!refused.text().contains("data:"));
    }
    assert_eq!(ask("GET", "/", &[]).status, 400);
    assert_eq!(ask("GET", "/", &[&at, "evil.example"]).status, 400);
    assert_eq!(ask("GET", "http://evil.example/", &[&at]).status, 421);
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PATCH"] {
        let refused = ask(method, "/", &[&at]);
        assert_eq!(refused.status, 405, "{method}");
        assert!(refused.head.contains("allow: get"));
    }
    let get = |path: &str| ask("GET", path, &[&at]).status;
    for path in [
        "/../Cargo.toml",
        "/box.toml",
        "/..%2fbox.toml",
        "/runs",
        "/runs/1/about",
        "/runs/-1/about",
        "/runs/0/",
        "/runs/0/../about",
        "//",
        "/index.html",
        "/runs/99999999999999999999/about",
    ] {
        assert_eq!(get(path), 404, "{path}");
    }
    running.layer("picture");
    for path in [
        "layers/picture?x1=25",
        "layers/picture?x0=3&x1=3",
        "layers/error?k=x",
        "pixel?x=24&y=0",
        "pixel?x=1",
        "pixel",
        "picture.png?exposure=bright",
        "picture.png?exposure=nan",
        "picture.png?exposure=101",
        "picture.png?exposure=",
    ] {
        assert_eq!(get(&format!("/runs/0/{path}")), 400, "{path}");
    }
    // What is no HTTP, or too much of it, ends its own connection.
    for nonsense in [
        "\u{16}\u{3}\u{1}",
        "GET\r\n\r\n",
        &format!("GET / HTTP/1.1\r\nX: {}\r\n\r\n", "x".repeat(100_000)),
    ] {
        assert_ne!(running.raw(nonsense).status, 200);
    }
    assert_eq!(get("/"), 200);
}

/// Folders are nobody's business: not of the scene, of outputs, or of temporary files.
#[test]
fn no_path_of_the_machine_is_told() {
    let bench = Bench::new();
    let folder = bench.dir.path().to_str().unwrap().to_owned();
    let args = format!(
        "render {folder}/box.toml --backend cpu --threads 1 --spp 4000000000 -o {folder}/a.png --film {folder}/a.npz --checkpoint 1s"
    );
    let running = Running::serve(&bench, &args);
    let mut events = running.events();
    let update = events.next(|u| u["picture"] == 0);
    running.layer("picture");
    running.interrupt();
    let said = [update, events.next(|u| !u["ended"].is_null())]
        .map(|u| u.to_string())
        .concat();
    let (_, stderr) = running.end();
    assert!(stderr.contains(&folder), "{stderr}");
    assert!(!said.contains(&folder), "{said}");
}

#[test]
fn addresses_are_checked_before_anything_is_rendered() {
    let bench = Bench::new();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = taken.local_addr().unwrap();
    for command in [
        format!("render box.toml --backend cpu --listen {at}"),
        format!("watch . --listen {at}"),
    ] {
        let said = format!("error: --listen {at}: address already in use");
        bench.run(&command).code(4).stderr(says(&said));
    }
    for (bad, rule) in [
        ("8080", "expected an address and a port"),
        ("127.0.0.1:99999", "0 to 65535"),
        ("http://localhost:80", "expected an address and a port"),
        ("127.0.0.256:80", "expected an address and a port"),
    ] {
        let args = format!("render box.toml --backend cpu --listen {bad}");
        bench.run(&args).code(2).stderr(says(rule));
    }
    bench
        .run("render box.toml --backend cpu --host a.example")
        .code(2)
        .stderr(says("--listen"));
    bench
        .run("watch . --listen no-such-host.invalid:80")
        .code(4)
        .stderr(says("--listen no-such-host.invalid:80"));
    assert_eq!(bench.names(), ["box.toml"]);
}

#[test]
fn other_machines_see_it_only_when_that_is_asked_for() {
    let bench = Bench::new();
    let run = |address: &str| {
        let args = format!("render box.toml --backend cpu --spp 1 -o a.png --listen {address}");
        let done = bench.run(&args).success();
        String::from_utf8(done.get_output().stderr.clone()).unwrap()
    };
    assert!(
        run("0.0.0.0:0")
            .contains("warning: --listen 0.0.0.0:0: everyone who can reach this address")
    );
    assert!(!run("127.0.0.1:0").contains("warning"));
}
