//! The server of the page: HTTP/1.1, GET, one answer a connection.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use super::request::{MAX_HEAD_BYTES, Refusal, Route, route};
use super::shared::Shared;

/// Connections at one time.
const MAX_CONNECTIONS: usize = 16;
/// A browser that takes or sends nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(5);

const HTML: &str = include_str!("live.html");
const SCRIPT: &str = include_str!("live.js");
const STYLE: &str = include_str!("live.css");

/// What every answer says: nobody may frame, sniff, keep or load it from elsewhere, and the page loads nothing from elsewhere.
const HEADERS: &str = "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
    X-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self'; \
    frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n";

/// Counts a browser that looks, while it does.
struct Looking(Arc<Shared>);

/// Takes connections until the page is dropped.
pub(super) fn serve(listener: &TcpListener, shared: &Arc<Shared>) {
    let Ok(port) = listener.local_addr().map(|address| address.port()) else { return };
    let open = Arc::new(());
    for stream in listener.incoming() {
        if shared.is_stopped.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            // such as too many open files: it may pass
            thread::sleep(Duration::from_millis(50));
            continue;
        };
        if Arc::strong_count(&open) > MAX_CONNECTIONS {
            continue;
        }
        let (shared, open) = (Arc::clone(shared), Arc::clone(&open));
        let answered = thread::Builder::new().name("browser".into()).spawn(move || {
            // a browser that goes away is no fault
            let _ = answer(stream, port, &shared);
            drop(open);
        });
        drop(answered);
    }
}

/// The head of a request, to its empty line.
fn head(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    let mut buffer = [0; 1024];
    loop {
        let count = stream.read(&mut buffer)?;
        head.extend(&buffer[..count]);
        if let Some(end) = head.windows(4).position(|four| four == b"\r\n\r\n") {
            head.truncate(end);
            return Ok(head);
        }
        if count == 0 || head.len() > MAX_HEAD_BYTES {
            return Err(io::ErrorKind::InvalidData.into());
        }
    }
}

fn answer(mut stream: TcpStream, port: u16, shared: &Arc<Shared>) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let head = head(&mut stream)?;
    let (kind, body) = match route(&head, port) {
        Ok(Route::Page) => ("text/html; charset=utf-8", HTML),
        Ok(Route::Script) => ("text/javascript; charset=utf-8", SCRIPT),
        Ok(Route::Style) => ("text/css; charset=utf-8", STYLE),
        Ok(Route::Events) => return events(stream, shared),
        Err(Refusal(code, phrase)) => {
            let text = format!("HTTP/1.1 {code} {phrase}\r\n{HEADERS}Content-Length: 0\r\n\r\n");
            return stream.write_all(text.as_bytes());
        }
    };
    let length = body.len();
    let text =
        format!("HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{HEADERS}\r\n{body}");
    stream.write_all(text.as_bytes())
}

impl Looking {
    fn new(shared: &Arc<Shared>) -> Self {
        shared.browsers.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(shared))
    }
}

impl Drop for Looking {
    fn drop(&mut self) {
        self.0.browsers.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Sends the newest picture, again and again.
fn events(mut stream: TcpStream, shared: &Arc<Shared>) -> io::Result<()> {
    let looking = Looking::new(shared);
    let text = format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{HEADERS}\r\nretry: 500\n\n");
    stream.write_all(text.as_bytes())?;
    let mut last = 0;
    while !shared.is_stopped.load(Ordering::Relaxed) {
        match shared.event.newer(last, Duration::from_secs(1)) {
            Some((number, event)) => {
                last = number;
                stream.write_all(b"data: ")?;
                stream.write_all(event.as_bytes())?;
                stream.write_all(b"\n\n")?;
            }
            // shows a browser that is gone
            None => stream.write_all(b": still here\n\n")?,
        }
    }
    drop(looking);
    Ok(())
}
