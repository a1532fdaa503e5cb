//! Sends pictures to tev, an image viewer, which shows them as they grow.

use super::address::Address;
use super::snapshot::Snapshot;
use crate::output::pixels::Pixels;
use crate::output::{CHANNELS, channel_values};
use std::io;
use std::net::TcpStream;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// How long tev may take to answer a call, or to take a part of a picture.
const PATIENCE: Duration = Duration::from_secs(10);

/// Time between two tries to find tev again.
const RETRY: Duration = Duration::from_secs(5);

/// Values in one packet, about. tev shows each packet when it has all of it.
const PACKET: usize = 4 << 20;

/// A thread that sends pictures. It takes the next one when it is done with the last, so who renders never waits.
#[derive(Debug)]
pub struct Tev {
    desk: Arc<Desk>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Desk {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    next: Option<Arc<Snapshot>>,
    busy: bool,
    closed: bool,
    problem: Option<String>,
}

impl Desk {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Tev {
    /// Finds tev. It will show pictures under `name`.
    pub fn connect(address: &Address, name: &str) -> io::Result<Self> {
        let connection = connect(address)?;
        let desk = Arc::<Desk>::default();
        let mut sender = Sender {
            desk: desk.clone(),
            address: address.clone(),
            name: name.into(),
            connection: Some(connection),
            created: false,
            tried: Instant::now(),
        };
        let thread = std::thread::Builder::new().name("tev".into());
        let thread = Some(thread.spawn(move || sender.run())?);
        Ok(Self { desk, thread })
    }

    /// Whether it waits for a picture.
    pub fn is_ready(&self) -> bool {
        let state = self.desk.lock();
        state.next.is_none() && !state.busy
    }

    /// Sends a picture, once the last one is sent.
    pub fn send(&self, picture: Arc<Snapshot>) {
        self.desk.lock().next = Some(picture);
        self.desk.changed.notify_all();
    }

    /// What went wrong since this was last asked.
    pub fn problem(&self) -> Option<String> {
        self.desk.lock().problem.take()
    }

    /// Waits until the last picture is sent, but not long.
    pub fn finish(mut self) -> Option<String> {
        let until = Instant::now() + PATIENCE;
        let mut state = self.desk.lock();
        state.closed = true;
        self.desk.changed.notify_all();
        while (state.busy || state.next.is_some()) && Instant::now() < until {
            let waited = self.desk.changed.wait_timeout(state, RETRY);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let done = !state.busy && state.next.is_none();
        let problem = state.problem.take();
        drop(state);
        if let Some(thread) = self.thread.take().filter(|_| done) {
            let _ = thread.join();
        }
        problem
    }
}

/// The thread's own.
struct Sender {
    desk: Arc<Desk>,
    address: Address,
    name: String,
    connection: Option<TevClient>,
    /// Whether tev has the image.
    created: bool,
    /// When it was last connected to.
    tried: Instant,
}

impl Sender {
    fn run(&mut self) {
        loop {
            let mut state = self.desk.lock();
            let picture = loop {
                if let Some(picture) = state.next.take() {
                    break picture;
                }
                if state.closed {
                    return;
                }
                let waited = self.desk.changed.wait(state);
                state = waited.unwrap_or_else(PoisonError::into_inner);
            };
            state.busy = true;
            drop(state);
            let sent = self.send(&picture);
            let mut state = self.desk.lock();
            state.busy = false;
            if let Err(e) = sent {
                let reason = crate::files::reason(&e);
                state.problem = Some(format!(
                    "tev at {}: {reason}; the render goes on without it",
                    self.address
                ));
            }
            drop(state);
            self.desk.changed.notify_all();
        }
    }

    /// Sends a picture, to a tev that has come back too. While there is none, it does nothing.
    fn send(&mut self, picture: &Snapshot) -> io::Result<()> {
        if self.connection.is_none() && self.tried.elapsed() >= RETRY {
            self.tried = Instant::now();
            self.connection = connect(&self.address).ok();
            self.created = false;
        }
        let Some(connection) = &mut self.connection else {
            return Ok(());
        };
        let sent = send(connection, &self.name, picture, !self.created);
        self.created = true;
        if sent.is_err() {
            self.connection = None;
        }
        sent
    }
}

fn connect(address: &Address) -> io::Result<TevClient> {
    let mut failed = io::ErrorKind::NotFound.into();
    for at in address.resolve()? {
        match TcpStream::connect_timeout(&at, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                stream.set_nodelay(true)?;
                return Ok(TevClient::wrap(stream));
            }
            Err(e) => failed = e,
        }
    }
    Err(failed)
}

/// Sends the part of the picture that the film holds, in bands of rows. Pixels without samples are 0, also in alpha.
fn send(
    connection: &mut TevClient,
    name: &str,
    picture: &Snapshot,
    create: bool,
) -> io::Result<()> {
    let film = picture.film();
    let [width, height] = film.size;
    if create {
        connection.send(PacketCreateImage {
            image_name: name,
            grab_focus: true,
            width,
            height,
            channel_names: &CHANNELS,
        })?;
    }
    let pixels = Pixels::new(film);
    let bounds = film.bounds;
    let offsets: Vec<u64> = (0..CHANNELS.len() as u64).collect();
    let strides = vec![CHANNELS.len() as u64; CHANNELS.len()];
    let rows = (PACKET / CHANNELS.len() / bounds.width() as usize).max(1);
    for y0 in (bounds.y0..bounds.y1).step_by(rows) {
        let y1 = bounds.y1.min(y0.saturating_add(rows as u32));
        let places = (y0..y1).flat_map(|y| (bounds.x0..bounds.x1).map(move |x| (x, y)));
        let data: Vec<f32> = places
            .flat_map(|(x, y)| channel_values(pixels.at(x, y)))
            .collect();
        connection.send(PacketUpdateImage {
            image_name: name,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &offsets,
            channel_strides: &strides,
            x: bounds.x0,
            y: y0,
            width: bounds.width(),
            height: y1 - y0,
            data: &data,
        })?;
    }
    Ok(())
}
