//! Pictures for tev, taken by a small receiver that speaks its protocol as tev's own documentation has it: packets of a length and
//! an operation, numbers in little endian, texts that end with 0.

use crate::client::Running;
use crate::program::{Bench, says};
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::net::{TcpListener, TcpStream};

const CREATE: u8 = 4;
const UPDATE: u8 = 6;

/// A picture as tev has it: names and values of its channels.
#[derive(Default)]
struct Shown {
    name: String,
    size: [u32; 2],
    channels: BTreeMap<String, Vec<f32>>,
    updates: usize,
}

struct Packet(Vec<u8>, usize);

impl Packet {
    /// The next packet; `None` at the end.
    fn read(stream: &mut TcpStream) -> Option<Self> {
        let mut length = [0; 4];
        match stream.read_exact(&mut length) {
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => return None,
            other => other.expect("a length"),
        }
        // The length counts itself.
        let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut bytes).expect("a packet");
        Some(Self(bytes, 0))
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.1 += N;
        self.0[self.1 - N..self.1].try_into().unwrap()
    }

    fn int(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn long(&mut self) -> usize {
        u64::from_le_bytes(self.take()) as usize
    }

    fn text(&mut self) -> String {
        let end = self.0[self.1..]
            .iter()
            .position(|b| *b == 0)
            .expect("an end");
        let text = String::from_utf8(self.0[self.1..self.1 + end].to_vec()).unwrap();
        self.1 += end + 1;
        text
    }
}

impl Shown {
    fn take(&mut self, mut packet: Packet) {
        let [operation, _grab_focus] = packet.take();
        match operation {
            CREATE => {
                self.name = packet.text();
                self.size = [packet.int(), packet.int()];
                let area = (self.size[0] * self.size[1]) as usize;
                let count = packet.int();
                self.channels = (0..count)
                    .map(|_| (packet.text(), vec![f32::NAN; area]))
                    .collect();
            }
            UPDATE => {
                assert_eq!(packet.text(), self.name);
                let count = packet.int() as usize;
                let names: Vec<String> = (0..count).map(|_| packet.text()).collect();
                let [x, y, width, height] = [(); 4].map(|()| packet.int() as usize);
                let offsets: Vec<usize> = (0..count).map(|_| packet.long()).collect();
                let strides: Vec<usize> = (0..count).map(|_| packet.long()).collect();
                let rest = packet.0[packet.1..].chunks_exact(4);
                let data: Vec<f32> = rest
                    .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
                    .collect();
                for (c, name) in names.iter().enumerate() {
                    let channel = self
                        .channels
                        .get_mut(name)
                        .expect("a channel that was created");
                    for i in 0..width * height {
                        let at = (y + i / width) * self.size[0] as usize + x + i % width;
                        channel[at] = data[offsets[c] + i * strides[c]];
                    }
                }
                self.updates += 1;
            }
            other => panic!("operation {other}"),
        }
    }
}

#[test]
fn tev_gets_what_is_in_the_exr() {
    let bench = Bench::new();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = listener.local_addr().unwrap();
    let tev = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut shown = Shown::default();
        while let Some(packet) = Packet::read(&mut stream) {
            shown.take(packet);
        }
        shown
    });
    bench.render(&format!("--spp 600 --size 48x32 -o a.exr --tev {at}"));
    let shown = tev.join().unwrap();
    assert_eq!((shown.name.as_str(), shown.size), ("box.toml", [48, 32]));
    assert!(shown.updates >= 2, "{}", shown.updates);
    let picture = bench.picture("a.exr");
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values: Vec<f32> = picture.rgb.iter().map(|p| p[c]).collect();
        assert_eq!(shown.channels[name], values, "{name}");
    }
    let samples: Vec<f32> = picture.samples.unwrap().iter().map(|n| *n as f32).collect();
    assert_eq!(shown.channels["samples"], samples);
    assert!(shown.channels["error.Y"].iter().all(|e| *e >= 0.0));
    assert!(shown.channels["A"].iter().all(|a| *a == 1.0));
}

#[test]
fn a_tev_that_is_not_there_is_named_and_one_that_goes_is_missed_by_nobody() {
    let bench = Bench::new();
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    bench
        .run(&format!(
            "render box.toml --backend cpu --spp 1 --tev {free}"
        ))
        .code(4)
        .stderr(says(&format!(
            "error: --tev {free}: connection refused; start tev first"
        )));
    assert_eq!(bench.names(), ["box.toml"]);

    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = listener.local_addr().unwrap();
    let running = Running::start(
        &bench,
        &format!("render box.toml --backend cpu --size 96x64 --time 4s -o a.exr --tev {at}"),
    );
    let (stream, _) = listener.accept().unwrap();
    drop((stream, listener));
    let (status, said) = running.end();
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(
        said.matches(&format!("warning: tev at {at}: ")).count(),
        1,
        "{said}"
    );
    assert!(bench.path("a.exr").exists());
}
