//! The page in a real browser, which is driven by the Chrome DevTools Protocol over a pipe.

use crate::client::{Running, until};
use crate::program::Bench;
use base64::Engine as _;
use image::RgbImage;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use tempfile::TempDir;

struct Browser {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: Option<String>,
    calls: u32,
    /// What its console had to say.
    complaints: Vec<String>,
    _profile: TempDir,
}

impl Browser {
    /// Without a browser this fails, unless ETENDUE_SKIP_BROWSER=1 asks for the check to be left out.
    fn open() -> Option<Self> {
        if std::env::var_os("ETENDUE_SKIP_BROWSER").is_some_and(|v| v == "1") {
            eprintln!("ETENDUE_SKIP_BROWSER=1: not looked at in a browser");
            return None;
        }
        let program = std::env::var("ETENDUE_BROWSER").unwrap_or("chromium".into());
        let profile = tempfile::tempdir().expect("a temporary folder");
        // It reads calls from file 3 and writes answers to file 4.
        let mut child = Command::new("sh")
            .args([
                "-c",
                "exec \"$0\" \"$@\" 3<&0 4>&1 >/dev/null 2>&1 </dev/null",
                &program,
            ])
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--remote-debugging-pipe",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let to = child.stdin.take().expect("a pipe");
        let from = BufReader::new(child.stdout.take().expect("a pipe"));
        let mut browser = Self {
            child,
            to,
            from,
            session: None,
            calls: 0,
            complaints: Vec::new(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        let session = browser.call("Target.attachToTarget", attach);
        browser.session = session["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.calls += 1;
        let mut call = json!({"id": self.calls, "method": method, "params": params});
        if let Some(session) = &self.session {
            call["sessionId"] = session.clone().into();
        }
        let missing = "no browser: set ETENDUE_BROWSER, or ETENDUE_SKIP_BROWSER=1";
        self.to
            .write_all(format!("{call}\0").as_bytes())
            .expect(missing);
        loop {
            let mut bytes = Vec::new();
            self.from.read_until(0, &mut bytes).expect(missing);
            assert_eq!(bytes.pop(), Some(0), "{missing}");
            let answer: Value = serde_json::from_slice(&bytes).expect("JSON");
            if answer["id"] == self.calls {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
            if [
                "Runtime.exceptionThrown",
                "Runtime.consoleAPICalled",
                "Log.entryAdded",
            ]
            .iter()
            .any(|m| answer["method"] == *m)
            {
                self.complaints.push(answer.to_string());
            }
        }
    }

    fn eval(&mut self, script: &str) -> Value {
        let params = json!({"expression": script, "returnByValue": true, "awaitPromise": true});
        let answer = self.call("Runtime.evaluate", params);
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    fn text(&mut self, id: &str) -> String {
        let text = self.eval(&format!("document.getElementById('{id}').textContent"));
        text.as_str().expect("text").to_owned()
    }

    fn key(&mut self, key: &str) {
        let text = if key.len() == 1 { key } else { "" };
        self.call(
            "Input.dispatchKeyEvent",
            json!({"type": "keyDown", "key": key, "text": text}),
        );
        self.call(
            "Input.dispatchKeyEvent",
            json!({"type": "keyUp", "key": key}),
        );
    }

    fn window(&mut self, width: u32, height: u32, dark: bool) {
        let metrics = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500});
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let scheme = if dark { "dark" } else { "light" };
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        self.call("Emulation.setEmulatedMedia", features);
    }

    /// A picture of the window. With `ETENDUE_KEEP_SHOTS` a folder, it stays there to be looked at.
    fn shot(&mut self, name: &str) -> RgbImage {
        let data = self.call("Page.captureScreenshot", json!({}));
        let data = data["data"].as_str().expect("a picture");
        let png = base64::engine::general_purpose::STANDARD
            .decode(data)
            .expect("base64");
        if let Some(folder) = std::env::var_os("ETENDUE_KEEP_SHOTS") {
            std::fs::write(std::path::Path::new(&folder).join(name), &png).expect("it is kept");
        }
        image::load_from_memory(&png).expect("a PNG").to_rgb8()
    }

    /// What the canvas shows.
    fn canvas(&mut self) -> String {
        let url = self.eval("document.getElementById('picture').toDataURL()");
        url.as_str().expect("a picture").to_owned()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_picture_grows_in_a_browser() {
    let bench = Bench::new();
    let Some(mut browser) = Browser::open() else {
        return;
    };
    let running = Running::endless(&bench, "--size 96x64 --error 0.01% --report a.json");
    browser.window(1280, 900, false);
    browser.call(
        "Page.navigate",
        json!({"url": format!("http://{}/", running.at)}),
    );
    until("picture", || {
        let drawn = browser.eval("typeof view === 'object' && Boolean(view.whole)");
        (drawn == true).then_some(())
    });
    let (first, samples) = (browser.canvas(), browser.text("samples"));
    until("growth", || {
        (browser.canvas() != first && browser.text("samples") != samples).then_some(())
    });
    // What is on the canvas is on the screen a moment later.
    let light = until("picture on the screen", || {
        let shot = browser.shot("light.png");
        let row = (100..800).map(|x| *shot.get_pixel(x, 440));
        let colours: std::collections::BTreeSet<_> = row.map(|p| p.0).collect();
        (colours.len() > 10).then_some(shot)
    });

    // Controls, by keyboard.
    browser.eval("document.getElementById('picture').focus()");
    browser.key("e");
    until("error map", || {
        (browser.eval("view.layer === 'error' && view.range !== null") == true).then_some(())
    });
    assert_eq!(
        browser.eval("document.getElementById('legend').hidden"),
        false
    );
    assert!(browser.text("high").ends_with(" %"));
    browser.key("s");
    until("samples", || {
        (browser.eval("view.layer === 'samples' && view.range !== null") == true).then_some(())
    });
    browser.key("p");
    browser.key("]");
    browser.key("]");
    assert_eq!(browser.text("ev"), "+1 EV");
    browser.key("+");
    assert_eq!(browser.eval("view.zoomed > view.fitting * 1.5"), true);
    browser.key("0");
    assert_eq!(browser.eval("view.zoomed === view.fitting"), true);
    browser.key("ArrowRight");
    browser.key("ArrowDown");
    let readout = until("readout", || {
        Some(browser.text("readout")).filter(|r| r.starts_with("Pixel "))
    });
    assert!(
        readout.contains("radiance") && readout.contains("relative error"),
        "{readout}"
    );
    until("curve", || {
        (browser.eval("document.querySelector('#chart path.line') !== null") == true).then_some(())
    });
    assert!(browser.eval("document.querySelector('#chart .target') !== null") == true);

    // Dark paper; and on a phone nothing hangs over the right edge.
    browser.window(1280, 900, true);
    let dark = browser.shot("dark.png");
    let paper = |shot: &RgbImage| {
        shot.get_pixel(5, 500)
            .0
            .iter()
            .map(|c| u32::from(*c))
            .sum::<u32>()
    };
    assert!(
        paper(&light) > 600 && paper(&dark) < 150,
        "{} {}",
        paper(&light),
        paper(&dark)
    );
    browser.window(390, 844, false);
    browser.shot("phone.png");
    let width = browser.eval("document.documentElement.scrollWidth");
    assert_eq!(width, 390, "something is wider than a phone");

    // At the end, the numbers are those of the report.
    running.interrupt();
    until("end", || {
        (browser.text("state") == "interrupted").then_some(())
    });
    let [error, samples] = ["error", "samples"].map(|id| browser.text(id));
    assert_eq!(running.end().0, Some(130));
    let report = std::fs::read_to_string(bench.path("a.json")).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    let stated: f64 = error.split(' ').next().unwrap().parse().unwrap();
    let reported = 100.0 * report["relative_error"].as_f64().unwrap();
    assert!(
        (stated / reported - 1.0).abs() < 0.006,
        "{error} {reported}"
    );
    let shown: f64 = samples.replace(',', "").parse().unwrap();
    assert!(
        (shown - report["spp"].as_f64().unwrap()).abs() <= 0.5,
        "{samples}"
    );
    // The server has gone, which the browser notes; nothing else is amiss.
    browser.complaints.retain(|c| !c.contains("net::ERR"));
    assert_eq!(browser.complaints, [""; 0]);
}

/// What is seen of the picture: the point in the middle, and screen pixels of one of its own.
fn seen(browser: &mut Browser) -> [f64; 3] {
    let seen = browser.eval("[...view.center, view.zoomed]");
    [0, 1, 2].map(|k| seen[k].as_f64().expect("a number"))
}

#[test]
fn mouse_and_fingers_move_the_picture() {
    let bench = Bench::new();
    let Some(mut browser) = Browser::open() else {
        return;
    };
    // Of several tiles.
    let running = Running::endless(&bench, "--size 512x384");
    browser.window(1280, 900, false);
    browser.call(
        "Emulation.setTouchEmulationEnabled",
        json!({"enabled": true, "maxTouchPoints": 2}),
    );
    let address = json!({"url": format!("http://{}/", running.at)});
    browser.call("Page.navigate", address);
    until("picture", || {
        (browser.eval("typeof view === 'object' && Boolean(view.whole)") == true).then_some(())
    });
    let middle = browser.eval(
        "(() => { const b = view.canvas.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()",
    );
    let [x, y] = [0, 1].map(|k| middle[k].as_f64().expect("a number"));
    let mouse = |browser: &mut Browser, kind: &str, dx: f64, dy: f64, buttons: u32| {
        let event = json!({"type": kind, "x": x + dx, "y": y + dy, "button": "left", "buttons": buttons, "clickCount": 1});
        browser.call("Input.dispatchMouseEvent", event);
    };
    // The wheel zooms in, about the pointer.
    let whole = seen(&mut browser);
    let wheel = json!({"type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": -500});
    browser.call("Input.dispatchMouseEvent", wheel);
    until("zoom", || {
        let now = seen(&mut browser);
        (now[2] > 3.9 * whole[2] && (now[0] - whole[0]).abs() < 1.0).then_some(())
    });
    // What is dragged stays under the pointer.
    let before = seen(&mut browser);
    mouse(&mut browser, "mousePressed", 0.0, 0.0, 1);
    mouse(&mut browser, "mouseMoved", 40.0, -20.0, 1);
    mouse(&mut browser, "mouseReleased", 40.0, -20.0, 0);
    let now = seen(&mut browser);
    assert!(
        (before[0] - now[0] - 40.0 / now[2]).abs() < 0.01,
        "{before:?} {now:?}"
    );
    assert!(
        (now[1] - before[1] - 20.0 / now[2]).abs() < 0.01,
        "{before:?} {now:?}"
    );
    mouse(&mut browser, "mouseMoved", 90.0, 90.0, 0);
    assert_eq!(seen(&mut browser), now, "the button is up");

    // A finger drags, two pinch.
    let touch = |browser: &mut Browser, kind: &str, fingers: &[[f64; 2]]| {
        let each = fingers.iter().enumerate();
        let points: Vec<Value> = each
            .map(|(id, [dx, dy])| json!({"x": x + dx, "y": y + dy, "id": id}))
            .collect();
        browser.call(
            "Input.dispatchTouchEvent",
            json!({"type": kind, "touchPoints": points}),
        );
    };
    let before = seen(&mut browser);
    touch(&mut browser, "touchStart", &[[0.0, 0.0]]);
    touch(&mut browser, "touchMove", &[[-30.0, 10.0]]);
    touch(&mut browser, "touchEnd", &[]);
    let now = until("a finger's way", || {
        Some(seen(&mut browser)).filter(|now| now[0] != before[0])
    });
    assert!(
        (now[0] - before[0] - 30.0 / now[2]).abs() < 0.01,
        "{before:?} {now:?}"
    );
    let before = now;
    touch(&mut browser, "touchStart", &[[-50.0, 0.0]]);
    touch(&mut browser, "touchStart", &[[-50.0, 0.0], [50.0, 0.0]]);
    touch(&mut browser, "touchMove", &[[-100.0, 0.0], [50.0, 0.0]]);
    touch(&mut browser, "touchMove", &[[-100.0, 0.0], [100.0, 0.0]]);
    touch(&mut browser, "touchEnd", &[]);
    until("twice as large", || {
        let now = seen(&mut browser);
        ((now[2] / before[2] - 2.0).abs() < 0.01).then_some(())
    });
    touch(&mut browser, "touchStart", &[[0.0, 0.0]]);
    touch(&mut browser, "touchEnd", &[]);
    assert_eq!(browser.eval("view.pointers.size"), 0, "no finger is left");

    // The tile that is rendered moves on.
    let first = until("tile", || {
        Some(browser.text("tile")).filter(|t| t.contains(" to "))
    });
    until("the next tile", || {
        (browser.text("tile") != first).then_some(())
    });
    browser.eval("view.fit()");
    browser.shot("tile.png");
    running.interrupt();
    until("end", || {
        (browser.eval("document.getElementById('tilebox').hidden") == true).then_some(())
    });
    browser.complaints.retain(|c| !c.contains("net::ERR"));
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
fn a_night_is_seen_at_a_glance() {
    let bench = Bench::new();
    let Some(mut browser) = Browser::open() else {
        return;
    };
    std::fs::create_dir(bench.path("night")).unwrap();
    for (seed, spp) in [(1, 64), (2, 256), (3, 1024)] {
        bench.render(&format!(
            "--size 48x32 --seed {seed} --spp {spp} --film night/{seed}.npz -o a.png"
        ));
    }
    std::fs::write(bench.path("night/4.npz"), "not a film").unwrap();
    let running = Running::serve(&bench, "watch night --error 1%");
    browser.window(1000, 700, false);
    browser.call(
        "Page.navigate",
        json!({"url": format!("http://{}/", running.at)}),
    );
    until("cards", || {
        (browser.eval("document.querySelectorAll('#cards li').length") == 4).then_some(())
    });
    until("pictures", || {
        (browser.eval("runs.slice(0, 3).every((r) => r.drawn > 0)") == true).then_some(())
    });
    browser.shot("night.png");
    let cards = browser.text("cards");
    assert!(
        cards.contains("Test box") && cards.contains("4.npz: not a film"),
        "{cards}"
    );
    browser.eval("document.querySelector('#cards button').click()");
    until("film", || {
        (browser.eval("Boolean(view.whole)") == true).then_some(())
    });
    browser.shot("film.png");
    assert_eq!(browser.text("title"), "Test box \u{b7} 1.npz");
    browser.key("Escape");
    until("way back", || {
        (browser.eval("document.getElementById('overview').hidden") == false).then_some(())
    });
    assert_eq!(browser.complaints, [""; 0]);
}
