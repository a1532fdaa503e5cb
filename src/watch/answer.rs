//! Answers, and how they leave: in small parts, so that a slow client holds little.

use hyper::body::{Body, Bytes, Frame};
use hyper::header::{self, HeaderValue};
use hyper::{Response, StatusCode};
use std::fs::File;
use std::io::Read as _;
use std::pin::Pin;
use std::task::{Context, Poll};
use tokio::sync::{OwnedSemaphorePermit, mpsc};

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

/// An answer with its head.
pub type Reply = Response<Answer>;

/// An answer of this media type.
pub fn reply(kind: &'static str, body: Answer) -> Reply {
    let mut reply = Response::new(body);
    let headers = reply.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    reply
}

/// An answer that is there as a whole.
pub fn whole(kind: &'static str, bytes: Bytes) -> Reply {
    reply(kind, Answer::Whole(bytes, None))
}

/// A line of text.
pub fn plain(status: StatusCode, text: &'static str) -> Reply {
    let mut reply = whole(
        "text/plain; charset=utf-8",
        Bytes::from_static(text.as_bytes()),
    );
    *reply.status_mut() = status;
    reply
}

/// A status alone.
pub fn empty(status: StatusCode) -> Reply {
    let mut reply = Response::new(Answer::Whole(Bytes::new(), None));
    *reply.status_mut() = status;
    reply
}

/// The server has enough to do.
pub fn busy() -> Reply {
    let mut reply = plain(
        StatusCode::SERVICE_UNAVAILABLE,
        "too many requests at a time; try again",
    );
    let headers = reply.headers_mut();
    headers.insert(header::RETRY_AFTER, HeaderValue::from_static("2"));
    reply
}

/// There is nothing of this name.
pub fn not_found() -> Reply {
    plain(StatusCode::NOT_FOUND, "not found")
}
