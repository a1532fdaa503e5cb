//! What the server answers.

use super::answer::{Answer, Reply, busy, empty, not_found, plain, reply, whole};
use super::board::{Board, Cursor, Pace, Run};
use super::download::{Download, plain_name};
use super::layers::{Layer, View};
use super::query::{Query, is_known_host};
use super::snapshot::{Picture, Snapshot};
use crate::compare::html::{escape, fill};
use crate::output::entries;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderName, HeaderValue};
use hyper::{Method, Request, StatusCode};
use serde_json::json;
use sha2::{Digest, Sha256};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{Semaphore, mpsc};

/// The page without its style and script.
const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = concat!(
    include_str!("page/text.js"),
    include_str!("page/picture.js"),
    include_str!("page/chart.js"),
    include_str!("page/page.js")
);

/// Megabytes of views that slow clients have not taken yet.
const MOST_MEGABYTES: usize = 128;

/// Files that are being downloaded at a time.
const MOST_DOWNLOADS: usize = 4;

/// How long a download waits for the newest picture at most.
const NEWEST: Duration = Duration::from_secs(5);

/// Shortest time between two updates to a client, so that a hundred of them cost nothing.
const PAUSE: Duration = Duration::from_secs(1);

/// The same when the end is near.
const SHORT_PAUSE: Duration = Duration::from_millis(50);

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
                    (Some(run), ["picture.png"]) => match query.exposure() {
                        Some(stops) => self.download(run, Download::Png(stops)).await,
                        None => plain(
                            StatusCode::BAD_REQUEST,
                            "expected an exposure from -100 to 100",
                        ),
                    },
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
            let (mut changes, mut pace) = (board.changes(), board.pace());
            let mut cursors: Vec<Cursor> = Vec::new();
            let mut text = String::from("retry: 2000\n\n");
            loop {
                changes.mark_unchanged();
                let now = *pace.borrow_and_update();
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
                let pause = match now {
                    Pace::Calm => PAUSE,
                    Pace::Hurried => SHORT_PAUSE,
                    Pace::Last => return,
                };
                tokio::select! {
                    () = tokio::time::sleep(pause) => {}
                    _ = pace.changed() => continue,
                }
                tokio::select! {
                    _ = changes.changed() => {}
                    _ = pace.changed() => {}
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
        made(run, picture, true, move |snapshot| {
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
        made(run, picture, true, move |snapshot| {
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
        made(run, picture, false, move |snapshot| {
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

/// What a run is: all that does not change while it goes on.
fn about(run: &Run) -> Reply {
    /// These are on the page already, as they are now.
    const GROWING: [&str; 3] = ["samples", "replicates", "seconds"];
    let about = run.about();
    let Some(provenance) = about.provenance.as_deref() else {
        return empty(StatusCode::NO_CONTENT);
    };
    let entries: Vec<(&str, String)> = entries(provenance)
        .into_iter()
        .filter(|(key, _)| !GROWING.contains(key) && !key.starts_with("relative_error"))
        .map(|(key, value)| (key, value.to_string()))
        .collect();
    let value = json!({"entries": entries, "scene_text": provenance.scene_text});
    whole("application/json", value.to_string().into())
}

/// Makes an answer of a picture on another thread. Time that is `counted` makes the next picture of the run come later.
async fn made(
    run: Arc<Run>,
    picture: Picture,
    counted: bool,
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
        if counted {
            run.spend(begun.elapsed());
        }
        reply
    });
    // It fails only while the process ends.
    made.await.unwrap_or_else(|_| busy())
}
