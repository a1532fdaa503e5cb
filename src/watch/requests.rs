//! What the server answers.

use super::board::{Board, Cursor, Run};
use super::layers::{Layer, View};
use super::snapshot::{Picture, Snapshot};
use crate::compare::html::{escape, fill};
use crate::film::coverage::Rect;
use crate::output::{Format, WriteOptions, entries, store};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use hyper::body::{Body, Bytes, Frame, Incoming};
use hyper::header::{self, HeaderName, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use serde_json::json;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::Read as _;
use std::net::IpAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

/// The page without its style and script.
const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = concat!(
    include_str!("page/text.js"),
    include_str!("page/picture.js"),
    include_str!("page/chart.js"),
    include_str!("page/page.js")
);

/// Pixels of a view at most; a larger one is answered with fewer.
const MOST_PIXELS: u64 = 2 << 20;

/// Megabytes of views that slow clients have not taken yet.
const MOST_MEGABYTES: usize = 128;

/// Files that are being downloaded at a time.
const MOST_DOWNLOADS: usize = 4;

/// How long a download waits for the newest picture at most.
const NEWEST: Duration = Duration::from_secs(5);

/// Shortest time between two updates to a client.
const PAUSE: Duration = Duration::from_millis(200);

/// Without news, this tells whether the client is still there, and keeps a proxy from giving up.
const HEARTBEAT: Duration = Duration::from_secs(15);

/// The page and all that it asks for.
pub struct Site {
    board: Arc<Board>,
    hosts: Vec<String>,
    page: Bytes,
    /// The policy that forbids the page all but its own script and style, and to speak to anyone else.
    policy: HeaderValue,
    megabytes: Arc<Semaphore>,
    downloads: Arc<Semaphore>,
}

/// The body of an answer.
pub enum Answer {
    /// Bytes, and the room that they take until they are sent.
    Whole(
        Bytes,
        #[expect(dead_code, reason = "it is given back when the answer is dropped")]
        Option<OwnedSemaphorePermit>,
    ),
    /// Server-sent events.
    Events(mpsc::Receiver<Bytes>),
    /// A file, and how many bytes of it are left.
    File(
        File,
        u64,
        #[expect(dead_code, reason = "it is given back when the answer is dropped")]
        OwnedSemaphorePermit,
    ),
}

impl Body for Answer {
    type Data = Bytes;
    type Error = std::io::Error;

    fn poll_frame(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        /// Bytes that are handed over at once: a slow client has no more than a few of these beyond its answer.
        const CHUNK: u64 = 1 << 18;
        let frame = match self.get_mut() {
            Self::Whole(bytes, _) if bytes.is_empty() => None,
            Self::Whole(bytes, _) => Some(Ok(bytes.split_to(bytes.len().min(CHUNK as usize)))),
            Self::Events(events) => {
                return events.poll_recv(cx).map(|e| e.map(|b| Ok(Frame::data(b))));
            }
            Self::File(_, 0, _) => None,
            Self::File(file, left, _) => {
                let mut chunk = Vec::new();
                let read = file.take(CHUNK.min(*left)).read_to_end(&mut chunk);
                let read = read.and_then(|n| match n {
                    0 => Err(std::io::ErrorKind::UnexpectedEof.into()),
                    n => Ok(n),
                });
                *left -= read.as_ref().map_or(0, |n| *n as u64);
                Some(read.map(|_| chunk.into()))
            }
        };
        Poll::Ready(frame.map(|f| f.map(Frame::data)))
    }

    fn is_end_stream(&self) -> bool {
        matches!(self, Self::Whole(bytes, _) if bytes.is_empty())
    }

    fn size_hint(&self) -> hyper::body::SizeHint {
        match self {
            Self::Whole(bytes, _) => hyper::body::SizeHint::with_exact(bytes.len() as u64),
            Self::File(_, left, _) => hyper::body::SizeHint::with_exact(*left),
            Self::Events(_) => hyper::body::SizeHint::default(),
        }
    }
}

type Reply = Response<Answer>;

impl Site {
    /// The site of a board. `hosts`: see [`super::Server::serve`].
    pub fn new(board: Arc<Board>, hosts: Vec<String>) -> Self {
        let hash = |text: &str| STANDARD.encode(Sha256::digest(text));
        let policy = format!(
            "default-src 'none'; connect-src 'self'; img-src data: blob:; script-src 'sha256-{}'; style-src 'sha256-{}'; \
             base-uri 'none'; form-action 'none'; frame-ancestors 'self'",
            hash(SCRIPT),
            hash(STYLE)
        );
        let values = [
            ("style", STYLE.to_owned()),
            ("script", SCRIPT.to_owned()),
            ("version", escape(env!("CARGO_PKG_VERSION"))),
        ];
        Self {
            board,
            hosts,
            page: fill(PAGE, &values).into(),
            policy: HeaderValue::try_from(policy)
                .unwrap_or(HeaderValue::from_static("default-src 'none'")),
            megabytes: Arc::new(Semaphore::new(MOST_MEGABYTES)),
            downloads: Arc::new(Semaphore::new(MOST_DOWNLOADS)),
        }
    }

    /// Answers a request. This never waits for a client, and makes nothing large on the thread that serves all of them.
    pub async fn respond(&self, request: Request<Incoming>) -> Reply {
        let mut reply = match self.refuse(&request) {
            Some(refusal) => refusal,
            None => {
                let query = Query(request.uri().query().unwrap_or(""));
                self.answer(request.uri().path(), query).await
            }
        };
        let headers = reply.headers_mut();
        for (name, value) in [
            (header::CACHE_CONTROL, "no-store"),
            (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
            (header::REFERRER_POLICY, "no-referrer"),
            (
                HeaderName::from_static("cross-origin-resource-policy"),
                "same-origin",
            ),
        ] {
            headers.insert(name, HeaderValue::from_static(value));
        }
        headers.insert(header::CONTENT_SECURITY_POLICY, self.policy.clone());
        reply
    }

    /// Requests that are not answered, whatever they ask for.
    fn refuse(&self, request: &Request<Incoming>) -> Option<Reply> {
        if request.method() != Method::GET {
            let mut reply = plain(StatusCode::METHOD_NOT_ALLOWED, "only GET");
            let headers = reply.headers_mut();
            headers.insert(header::ALLOW, HeaderValue::from_static("GET"));
            return Some(reply);
        }
        let mut hosts = request.headers().get_all(header::HOST).iter();
        let host = match (hosts.next().map(HeaderValue::to_str), hosts.next()) {
            (Some(Ok(host)), None) => host,
            _ => return Some(plain(StatusCode::BAD_REQUEST, "expected one Host header")),
        };
        let named = request.uri().authority().map(|a| a.as_str());
        let known = |host: &str| is_known_host(host, &self.hosts);
        if !known(host) || !named.is_none_or(known) {
            let why = "this host name is not known here; see --host";
            return Some(plain(StatusCode::MISDIRECTED_REQUEST, why));
        }
        None
    }

    async fn answer(&self, path: &str, query: Query<'_>) -> Reply {
        let parts: Vec<&str> = path.split('/').skip(1).collect();
        match parts[..] {
            [""] => whole("text/html; charset=utf-8", self.page.clone()),
            ["events"] => self.events(),
            ["runs", id, ref what @ ..] => {
                let run = id.parse().ok().and_then(|id| self.board.run(id));
                match (run, what) {
                    (Some(run), ["layers", "picture"]) => {
                        self.layer(run, Layer::Picture, query).await
                    }
                    (Some(run), ["layers", "error"]) => self.layer(run, Layer::Error, query).await,
                    (Some(run), ["layers", "samples"]) => {
                        self.layer(run, Layer::Samples, query).await
                    }
                    (Some(run), ["pixel"]) => self.pixel(run, query).await,
                    (Some(run), ["about"]) => about(&run),
                    (Some(run), ["picture.exr"]) => self.download(run, Download::Exr).await,
                    (Some(run), ["picture.png"]) => {
                        let stops = query.number("exposure").unwrap_or(0.0);
                        self.download(run, Download::Png(stops)).await
                    }
                    (Some(run), ["film.npz"]) => self.download(run, Download::Film).await,
                    _ => not_found(),
                }
            }
            _ => not_found(),
        }
    }

    /// A stream of updates: all there is, and then what changes. A slow client gets fewer, of which each says more.
    fn events(&self) -> Reply {
        let (to, events) = mpsc::channel(1);
        let board = self.board.clone();
        tokio::spawn(async move {
            let mut changes = board.changes();
            let mut cursors: Vec<Cursor> = Vec::new();
            let mut text = String::from("retry: 2000\n\n");
            loop {
                changes.mark_unchanged();
                for run in board.runs() {
                    if cursors.len() <= run.id {
                        cursors.resize(run.id + 1, Cursor::default());
                    }
                    // An update has only strings, numbers, lists and fixed keys.
                    let update = run.update(&mut cursors[run.id]);
                    if let Some(Ok(json)) = update.map(|u| serde_json::to_string(&u)) {
                        text += &format!("data: {json}\n\n");
                    }
                }
                if !text.is_empty() && to.send(std::mem::take(&mut text).into()).await.is_err() {
                    return;
                }
                tokio::time::sleep(PAUSE).await;
                tokio::select! {
                    changed = changes.changed() => {
                        if changed.is_err() {
                            return;
                        }
                    }
                    () = tokio::time::sleep(HEARTBEAT) => text += ": still here\n\n",
                    () = to.closed() => return,
                }
            }
        });
        let mut reply = reply("text/event-stream", Answer::Events(events));
        // nginx would otherwise keep events until there are many.
        let name = HeaderName::from_static("x-accel-buffering");
        reply
            .headers_mut()
            .insert(name, HeaderValue::from_static("no"));
        reply
    }

    /// A part of a layer, as six numbers of four bytes (the snapshot's number, the rectangle, and how many pixels have become one)
    /// and then its values.
    async fn layer(&self, run: Arc<Run>, layer: Layer, query: Query<'_>) -> Reply {
        let Some((version, picture)) = run.look() else {
            return empty(StatusCode::NO_CONTENT);
        };
        let Some(view) = query.view(run.about().size) else {
            return plain(
                StatusCode::BAD_REQUEST,
                "expected x0, y0, x1, y1 within the picture, and k",
            );
        };
        let size = view.size().map(u64::from);
        let megabytes = (size[0] * size[1] * 4).div_ceil(1 << 20).max(1) as u32;
        let Ok(room) = self.megabytes.clone().try_acquire_many_owned(megabytes) else {
            return busy();
        };
        made(run, picture, move |snapshot| {
            let View { rect, k } = view;
            let version = version as u32;
            let head = [version, rect.x0, rect.y0, rect.x1, rect.y1, k];
            let mut bytes: Vec<u8> = head.into_iter().flat_map(u32::to_le_bytes).collect();
            bytes.extend(snapshot.layers().bytes(layer, view));
            reply(
                "application/octet-stream",
                Answer::Whole(bytes.into(), Some(room)),
            )
        })
        .await
    }

    async fn pixel(&self, run: Arc<Run>, query: Query<'_>) -> Reply {
        let Some(picture) = run.latest() else {
            return empty(StatusCode::NO_CONTENT);
        };
        let [width, height] = run.about().size;
        let [x, y] = ["x", "y"].map(|key| query.whole(key));
        let (Some(x), Some(y)) = (x.filter(|x| *x < width), y.filter(|y| *y < height)) else {
            return plain(
                StatusCode::BAD_REQUEST,
                "expected x and y within the picture",
            );
        };
        made(run, picture, move |snapshot| {
            let layers = snapshot.layers();
            let value = match layers.at(x, y) {
                Some(e) => json!({
                    "x": x, "y": y, "samples": e.samples, "radiance": e.mean, "error": e.error,
                    "relative_error": layers.relative_error(&e),
                }),
                None => json!({"x": x, "y": y, "samples": 0}),
            };
            whole("application/json", value.to_string().into())
        })
        .await
    }

    async fn download(&self, run: Arc<Run>, what: Download) -> Reply {
        let Ok(place) = self.downloads.clone().try_acquire_owned() else {
            return busy();
        };
        let none = || plain(StatusCode::NOT_FOUND, "there is no picture yet");
        let Some(picture) = newest(&run).await else {
            return none();
        };
        let name = format!("{}.{}", plain_name(&run.name), what.extension());
        made(run, picture, move |snapshot| {
            if snapshot.film().coverage.is_empty() {
                return none();
            }
            // An error would name a temporary file, which is nobody's business.
            let Ok((file, length)) = what.file(snapshot) else {
                let why = "the file can't be made: is there room for temporary files?";
                return plain(StatusCode::INTERNAL_SERVER_ERROR, why);
            };
            let mut reply = reply(what.kind(), Answer::File(file, length, place));
            let value = format!("attachment; filename=\"{name}\"");
            if let Ok(value) = HeaderValue::try_from(value) {
                reply
                    .headers_mut()
                    .insert(header::CONTENT_DISPOSITION, value);
            }
            reply
        })
        .await
    }
}

/// The picture as it stands now. Who renders copies it only when someone asks, and then soon.
async fn newest(run: &Run) -> Option<Picture> {
    let mut changes = run.changes();
    let before = run.look().map(|(version, _)| version);
    let until = tokio::time::Instant::now() + NEWEST;
    while run.is_growing() && run.look().map(|(version, _)| version) == before {
        if tokio::time::timeout_at(until, changes.changed())
            .await
            .is_err()
        {
            break;
        }
    }
    run.look().map(|(_, picture)| picture)
}

/// A file's name without what a header or a file system may take amiss.
fn plain_name(name: &str) -> String {
    let plain = |c: char| match c {
        'a'..='z' | 'A'..='Z' | '0'..='9' | '-' | '_' | '.' => c,
        _ => '_',
    };
    name.chars().map(plain).collect()
}

/// A file that is made of a snapshot.
#[derive(Clone, Copy)]
enum Download {
    Exr,
    /// With so many stops of exposure.
    Png(f64),
    Film,
}

impl Download {
    fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png(_) => "png",
            Self::Film => "npz",
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::Exr => "image/x-exr",
            Self::Png(_) => "image/png",
            Self::Film => "application/zip",
        }
    }

    /// The file, which has no name any more, and its length.
    fn file(self, snapshot: &Snapshot) -> Result<(File, u64), crate::files::FileError> {
        let failed = |e: std::io::Error| {
            crate::files::FileError::io("temporary file".as_ref(), "cannot write", &e)
        };
        let dir = tempfile::tempdir().map_err(failed)?;
        let path = dir.path().join(format!("picture.{}", self.extension()));
        let (film, provenance) = (snapshot.film(), snapshot.provenance());
        match self {
            Self::Film => store::save(&path, film, &provenance)?,
            Self::Exr => Format::Exr.write(&path, film, &provenance, &WriteOptions::default())?,
            Self::Png(exposure_stops) => {
                let options = WriteOptions {
                    exposure_stops,
                    ..WriteOptions::default()
                };
                Format::Png.write(&path, film, &provenance, &options)?;
            }
        }
        let file = File::open(&path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        Ok((file, length))
    }
}

/// What a run is.
fn about(run: &Run) -> Reply {
    let about = run.about();
    let Some(provenance) = about.provenance.as_deref() else {
        return empty(StatusCode::NO_CONTENT);
    };
    let entries: Vec<(&str, String)> = entries(provenance)
        .into_iter()
        .map(|(key, value)| (key, value.to_string()))
        .collect();
    let value = json!({"entries": entries, "scene_text": provenance.scene_text});
    whole("application/json", value.to_string().into())
}

/// A query of numbers.
#[derive(Clone, Copy)]
struct Query<'a>(&'a str);

impl Query<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        let pairs = self.0.split('&').filter_map(|pair| pair.split_once('='));
        pairs.filter(|(k, _)| *k == key).map(|(_, v)| v).next()
    }

    fn whole(&self, key: &str) -> Option<u32> {
        self.get(key)?.parse().ok()
    }

    fn number(&self, key: &str) -> Option<f64> {
        let number: f64 = self.get(key)?.parse().ok()?;
        (number.abs() <= 100.0).then_some(number)
    }

    /// The whole picture if nothing is said; `k` as large as it takes. `None` if it is not within the picture.
    fn view(&self, size: [u32; 2]) -> Option<View> {
        let side = |key, default| match self.get(key) {
            Some(_) => self.whole(key),
            None => Some(default),
        };
        let rect = Rect {
            x0: side("x0", 0)?,
            y0: side("y0", 0)?,
            x1: side("x1", size[0])?,
            y1: side("y1", size[1])?,
        };
        let within =
            rect.x0 < rect.x1 && rect.x1 <= size[0] && rect.y0 < rect.y1 && rect.y1 <= size[1];
        let k = side("k", 1)?.max(1);
        let area = |k: u32| {
            View { rect, k }
                .size()
                .map(u64::from)
                .iter()
                .product::<u64>()
        };
        let k = (k..=k.max(1 << 16)).find(|k| area(*k) <= MOST_PIXELS);
        within.then_some(View { rect, k: k? })
    }
}

/// Whether a request may call this server so. A page of someone else, whose name was made to lead here, would be read by its own
/// script; so names must be known. A number is no name, and leads where it says.
fn is_known_host(host: &str, names: &[String]) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split_once(']').map(|(inside, _)| inside),
        None => host.split(':').next(),
    };
    let Some(name) = name else {
        return false;
    };
    let same =
        |known: &String| known.eq_ignore_ascii_case(name) || known.eq_ignore_ascii_case(host);
    name.parse::<IpAddr>().is_ok()
        || name.eq_ignore_ascii_case("localhost")
        || names.iter().any(same)
}

/// Makes an answer of a picture on another thread, and counts the time for its run.
async fn made(
    run: Arc<Run>,
    picture: Picture,
    make: impl FnOnce(&Snapshot) -> Reply + Send + 'static,
) -> Reply {
    let made = tokio::task::spawn_blocking(move || {
        let begun = Instant::now();
        let reply = match picture.open() {
            Ok(snapshot) => make(&snapshot),
            Err(e) => {
                run.problem(Some(e.message().into()));
                empty(StatusCode::NO_CONTENT)
            }
        };
        run.spend(begun.elapsed());
        reply
    });
    // It fails only while the process ends.
    made.await.unwrap_or_else(|_| busy())
}

fn reply(kind: &'static str, body: Answer) -> Reply {
    let mut reply = Response::new(body);
    let headers = reply.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    reply
}

fn whole(kind: &'static str, bytes: Bytes) -> Reply {
    reply(kind, Answer::Whole(bytes, None))
}

fn plain(status: StatusCode, text: &'static str) -> Reply {
    let mut reply = whole(
        "text/plain; charset=utf-8",
        Bytes::from_static(text.as_bytes()),
    );
    *reply.status_mut() = status;
    reply
}

fn empty(status: StatusCode) -> Reply {
    let mut reply = Response::new(Answer::Whole(Bytes::new(), None));
    *reply.status_mut() = status;
    reply
}

fn busy() -> Reply {
    let mut reply = plain(
        StatusCode::SERVICE_UNAVAILABLE,
        "too many requests at a time; try again",
    );
    let headers = reply.headers_mut();
    headers.insert(header::RETRY_AFTER, HeaderValue::from_static("2"));
    reply
}

fn not_found() -> Reply {
    plain(StatusCode::NOT_FOUND, "not found")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_names_are_answered() {
        let names = ["render.example.org".to_owned()];
        for known in [
            "localhost",
            "localhost:8080",
            "LocalHost:1",
            "127.0.0.1:8080",
            "10.1.2.3",
            "[::1]:8080",
            "[::1]",
            "render.example.org",
            "Render.Example.org:443",
        ] {
            assert!(is_known_host(known, &names), "{known}");
        }
        for unknown in [
            "evil.example",
            "localhost.evil.example:8080",
            "127.0.0.1.evil.example",
            "",
            ":8080",
            "[evil]:80",
            "[::1",
            "example.org",
            "127.0.0.256",
        ] {
            assert!(!is_known_host(unknown, &names), "{unknown}");
        }
    }

    #[test]
    fn views_lie_within_the_picture_and_are_not_too_large() {
        let view = |query: &str, size| Query(query).view(size);
        let whole = view("", [512, 384]).unwrap();
        assert_eq!((whole.rect, whole.k), (Rect::whole([512, 384]), 1));
        let part = view("x0=1&y0=2&x1=3&y1=4&k=0", [512, 384]).unwrap();
        assert_eq!((part.size(), part.k), ([2, 2], 1));
        let large = view("k=2", [65536, 65536]).unwrap();
        assert!(large.k >= 46 && large.size()[0] < 1450, "{large:?}");
        for bad in [
            "x0=-1",
            "x1=513",
            "x0=5&x1=5",
            "y0=one",
            "k=x",
            "x1=99999999999",
        ] {
            assert_eq!(view(bad, [512, 384]), None, "{bad}");
        }
    }
}
