//! Programs that go on while a test looks at them, and a client of their page that speaks HTTP by hand.

use crate::program::Bench;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A program that is running.
pub struct Running {
    child: Child,
    said: Arc<Mutex<String>>,
    reader: Option<std::thread::JoinHandle<()>>,
    /// Host and port of its page.
    pub at: String,
}

/// Waits until `known` knows something.
pub fn until<T>(what: &str, mut known: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(known) = known() {
            return known;
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "no {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

impl Running {
    /// `etendue ARGS`, words separated by blanks.
    pub fn start(bench: &Bench, args: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .args(args.split_whitespace())
            .current_dir(bench.dir.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let said = Arc::<Mutex<String>>::default();
        let stderr = BufReader::new(child.stderr.take().expect("its stderr"));
        let to = said.clone();
        let reader = std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                *to.lock().unwrap() += &format!("{line}\n");
            }
        });
        let reader = Some(reader);
        Self {
            child,
            said,
            reader,
            at: String::new(),
        }
    }

    /// The same, and its page.
    pub fn serve(bench: &Bench, args: &str) -> Self {
        let mut running = Self::start(bench, &format!("{args} --listen 127.0.0.1:0"));
        running.at = until("page", || {
            let said = running.said();
            let rest = said.split("http://").nth(1)?;
            Some(rest.split('/').next()?.to_owned())
        });
        running
    }

    /// A render on the CPU that would go on for a day, and its page.
    pub fn endless(bench: &Bench, args: &str) -> Self {
        Self::serve(
            bench,
            &format!("render box.toml --backend cpu --threads 1 --spp 4000000000 -o a.png {args}"),
        )
    }

    pub fn said(&self) -> String {
        self.said.lock().unwrap().clone()
    }

    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("its status").is_none()
    }

    /// Its exit status, and all that it has said.
    pub fn end(mut self) -> (Option<i32>, String) {
        let status = self.child.wait().expect("its end").code();
        self.reader.take().map(std::thread::JoinHandle::join);
        (status, self.said())
    }

    /// Asks it to end.
    pub fn interrupt(&self) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &id]).status();
        assert!(sent.expect("kill").success());
    }

    /// Seconds of the processor that the server's threads have used so far.
    #[cfg(target_os = "linux")]
    pub fn server_seconds(&self) -> f64 {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", self.child.id()));
        let used = tasks.expect("it is running").flatten().map(|task| {
            let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
            // The thread's name stands in parentheses; user and system time are the 12th and 13th number after it.
            let Some((_, rest)) = stat.split_once("(watch) ") else {
                return 0.0;
            };
            let ticks = rest.split(' ').skip(11).take(2);
            ticks.map(|t| t.parse::<f64>().unwrap()).sum::<f64>() / 100.0
        });
        used.sum()
    }

    /// Its threads.
    #[cfg(target_os = "linux")]
    pub fn threads(&self) -> usize {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", self.child.id()));
        tasks.expect("it is running").count()
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.at).expect("a connection");
        stream
            .set_read_timeout(Some(Duration::from_secs(30)))
            .unwrap();
        stream
    }

    /// The answer to lines as they are.
    pub fn raw(&self, request: &str) -> Answer {
        let mut stream = self.connect();
        stream
            .write_all(request.as_bytes())
            .expect("it takes a request");
        let mut bytes = Vec::new();
        // A connection that is closed early leaves what has come.
        let _ = stream.read_to_end(&mut bytes);
        Answer::new(&bytes)
    }

    /// The answer to GET `/path`.
    pub fn get(&self, path: &str) -> Answer {
        let at = &self.at;
        self.raw(&format!(
            "GET /{path} HTTP/1.1\r\nHost: {at}\r\nConnection: close\r\n\r\n"
        ))
    }

    /// A layer of the first run, once there is one: the picture's number, and the values.
    pub fn layer(&self, query: &str) -> (u32, Vec<u8>) {
        let answer = until("picture", || {
            let answer = self.get(&format!("runs/0/layers/{query}"));
            (answer.status == 200).then_some(answer)
        });
        let version = u32::from_le_bytes(answer.body[..4].try_into().unwrap());
        (version, answer.body[24..].to_vec())
    }

    /// A client of the events.
    pub fn events(&self) -> Events {
        let mut stream = self.connect();
        let at = &self.at;
        write!(stream, "GET /events HTTP/1.1\r\nHost: {at}\r\n\r\n").expect("it takes a request");
        Events(BufReader::new(stream))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    fn new(bytes: &[u8]) -> Self {
        let end = bytes.windows(4).position(|w| w == b"\r\n\r\n");
        let end = end.map_or(bytes.len(), |e| e + 4);
        let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok());
        Self {
            status: status.unwrap_or(0),
            head: head.to_lowercase(),
            body: bytes[end..].to_vec(),
        }
    }

    pub fn text(&self) -> String {
        String::from_utf8(self.body.clone()).expect("text")
    }

    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }
}

/// Updates as the page gets them.
pub struct Events(BufReader<TcpStream>);

impl Events {
    pub fn into_stream(self) -> TcpStream {
        self.0.into_inner()
    }

    /// The next update that `fits`.
    pub fn next(&mut self, fits: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        let mut line = String::new();
        loop {
            assert!(begun.elapsed() < Duration::from_secs(60), "no such event");
            line.clear();
            assert!(
                self.0.read_line(&mut line).expect("an event") > 0,
                "it is closed"
            );
            // Between the lines of events are the lengths of their pieces.
            if let Some(json) = line.trim().strip_prefix("data: ") {
                let update: Value = serde_json::from_str(json).expect("JSON");
                if fits(&update) {
                    return update;
                }
            }
        }
    }
}
