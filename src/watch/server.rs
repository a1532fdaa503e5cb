//! The thread that serves the page.

use super::address::Address;
use super::board::{Board, Pace};
use super::connection::{Clock, Connection};
use super::requests::Site;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use std::convert::Infallible;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::{Semaphore, oneshot};

/// Clients at a time. More are sent away.
const MOST_CONNECTIONS: usize = 256;

/// A client sends a request within this time, or is sent away.
const REQUEST_TIME: Duration = Duration::from_secs(30);

/// Bytes of a request, without a body.
const LONGEST_REQUEST: usize = 16 << 10;

/// Threads that make pictures for clients.
const MAKERS: usize = 2;

/// After the end, those who look at a picture have so long to get the last one.
const LAST_LOOK: Duration = Duration::from_secs(3);

/// How long clients get to take the last events.
const LAST_EVENTS: Duration = Duration::from_secs(1);

/// How long what they have taken gets to leave.
const FLUSH: Duration = Duration::from_millis(100);

/// An address that is taken, but not yet served.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    at: SocketAddr,
}

impl Server {
    /// Takes the address, so that nobody else can.
    pub fn bind(address: &Address) -> io::Result<Self> {
        let listener = TcpListener::bind(&address.resolve()?[..])?;
        listener.set_nonblocking(true)?;
        let at = listener.local_addr()?;
        Ok(Self { listener, at })
    }

    /// Where it is.
    pub fn at(&self) -> SocketAddr {
        self.at
    }

    /// Whether other machines can reach it.
    pub fn is_public(&self) -> bool {
        !self.at.ip().to_canonical().is_loopback()
    }

    /// The address for a browser on this machine.
    pub fn url(&self) -> String {
        let mut at = self.at;
        if at.ip().is_unspecified() {
            match at {
                SocketAddr::V4(_) => at.set_ip([127, 0, 0, 1].into()),
                SocketAddr::V6(_) => at.set_ip(std::net::Ipv6Addr::LOCALHOST.into()),
            }
        }
        format!("http://{at}/")
    }

    /// Serves the board from a thread of its own. `hosts` are names that requests may call this server by, besides its addresses
    /// and `localhost`.
    pub fn serve(self, board: Arc<Board>, hosts: Vec<String>) -> io::Result<Stopped> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .max_blocking_threads(MAKERS)
            .thread_name("watch")
            .build()?;
        let (stop, stopped) = oneshot::channel();
        let site = Arc::new(Site::new(board.clone(), hosts));
        let thread = std::thread::Builder::new().name("watch".into());
        let thread = thread.spawn(move || {
            runtime.block_on(async {
                let accepting = accept(self.listener, site);
                tokio::select! {
                    _ = stopped => {}
                    () = accepting => {}
                }
            });
            // A download that is being made does not keep the process.
            runtime.shutdown_background();
        })?;
        Ok(Stopped {
            board,
            thread: Some(thread),
            stop: Some(stop),
        })
    }
}

async fn accept(listener: TcpListener, site: Arc<Site>) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else {
        return;
    };
    let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // Too many open files, or a client that has gone already.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let Ok(place) = places.clone().try_acquire_owned() else {
            continue;
        };
        let site = site.clone();
        tokio::spawn(async move {
            let service = service_fn(move |request| {
                let site = site.clone();
                async move { Ok::<_, Infallible>(site.respond(request).await) }
            });
            let mut http = http1::Builder::new();
            http.timer(Clock)
                .header_read_timeout(REQUEST_TIME)
                .max_buf_size(LONGEST_REQUEST);
            // An error is a client that has gone, or does not speak HTTP.
            let _ = http
                .serve_connection(Connection::new(stream), service)
                .await;
            drop(place);
        });
    }
}

/// A server that is running. It stops when this is dropped.
#[derive(Debug)]
pub struct Stopped {
    board: Arc<Board>,
    thread: Option<JoinHandle<()>>,
    stop: Option<oneshot::Sender<()>>,
}

impl Stopped {
    /// Stops it once those who look have seen the last picture, or do not fetch it.
    pub fn after_last_look(self) {
        let wait = |time: Duration, waits: &dyn Fn() -> bool| {
            let until = Instant::now() + time;
            while waits() && Instant::now() < until {
                std::thread::sleep(Duration::from_millis(10));
            }
        };
        self.board.set_pace(Pace::Hurried);
        let runs = self.board.runs();
        wait(LAST_LOOK, &|| {
            runs.iter().any(|r| r.is_looked_at() && !r.is_seen())
        });
        if self.board.clients() > 0 {
            self.board.set_pace(Pace::Last);
            wait(LAST_EVENTS, &|| self.board.clients() > 0);
            std::thread::sleep(FLUSH);
        }
    }
}

impl Drop for Stopped {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
