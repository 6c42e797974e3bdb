//! A small file server for looking at the page on this machine; any static host serves the same files.

use crate::failure::{Explain, Result, fail};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// The port that is tried first.
pub const PORT: u16 = 8137;
const LONGEST_LINE: u64 = 16 * 1024;
const LONGEST_BODY: u64 = 64 << 20;

/// What a browser asks for.
pub struct Request {
    /// `GET`, `HEAD`, `POST`, ...
    pub method: String,
    /// The path as sent, with its query.
    pub target: String,
    /// The body, empty for most methods.
    pub body: Vec<u8>,
}

/// What it gets.
pub struct Response {
    status: &'static str,
    kind: &'static str,
    location: Option<String>,
    body: Vec<u8>,
}

impl Response {
    /// A body of this media type.
    pub fn ok(kind: &'static str, body: Vec<u8>) -> Self {
        Self { status: "200 OK", kind, location: None, body }
    }

    fn refused(status: &'static str) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", location: None, body: format!("{status}\n").into_bytes() }
    }
}

/// Listen on this machine only, on `port` or on the next free one.
///
/// # Errors
///
/// None of a hundred ports is free.
pub fn listen(port: u16) -> Result<TcpListener> {
    for offset in 0..100 {
        let Some(port) = port.checked_add(offset) else { break };
        if let Ok(listener) = TcpListener::bind((Ipv4Addr::LOCALHOST, port)) {
            return Ok(listener);
        }
    }
    fail(format!("no port is free from {port} on: name another one with --port"))
}

/// The address to type into a browser.
///
/// # Errors
///
/// The system does not say which port it gave.
pub fn address(listener: &TcpListener) -> Result<String> {
    Ok(format!("http://{}/", listener.local_addr().when(|| "read the server's address".into())?))
}

/// Answer until the listener fails.
pub fn answer(listener: &TcpListener, handler: impl Fn(&Request) -> Response + Send + Sync + 'static) {
    let handler = Arc::new(handler);
    for stream in listener.incoming().flatten() {
        let handler = Arc::clone(&handler);
        thread::spawn(move || {
            // A browser that goes away in the middle is no error of ours.
            let _ = converse(&stream, handler.as_ref());
        });
    }
}

/// The file that a request names below `root`.
pub fn file(root: &Path, request: &Request) -> Response {
    if !matches!(request.method.as_str(), "GET" | "HEAD") {
        return Response::refused("405 Method Not Allowed");
    }
    let Some(path) = locate(root, &request.target) else { return Response::refused("404 Not Found") };
    let asked = request.target.split(['?', '#']).next().unwrap_or_default();
    if path.is_dir() && !asked.ends_with('/') {
        let location = Some(format!("/{}/", asked.trim_matches('/')));
        return Response { location, ..Response::refused("301 Moved Permanently") };
    }
    let path = if path.is_dir() { path.join("index.html") } else { path };
    match std::fs::read(&path) {
        Ok(body) => Response::ok(media_type(&path), body),
        Err(_) => Response::refused("404 Not Found"),
    }
}

fn converse(stream: &TcpStream, handler: &dyn Fn(&Request) -> Response) -> std::io::Result<()> {
    stream.set_read_timeout(Some(Duration::from_secs(30)))?;
    stream.set_nodelay(true)?;
    let mut reader = BufReader::new(stream);
    let mut writer = stream;
    loop {
        let (request, keep) = match receive(&mut reader)? {
            Received::Request(request, keep) => (request, keep),
            Received::Nothing => return Ok(()),
            Received::Nonsense => {
                return send(&mut writer, &Response::refused("400 Bad Request"), true, false);
            }
        };
        let response = handler(&request);
        send(&mut writer, &response, request.method != "HEAD", keep)?;
        if !keep {
            return Ok(());
        }
    }
}

enum Received {
    Request(Request, bool),
    Nothing,
    Nonsense,
}

fn receive(reader: &mut impl BufRead) -> std::io::Result<Received> {
    let mut line = String::new();
    if reader.by_ref().take(LONGEST_LINE).read_line(&mut line)? == 0 {
        return Ok(Received::Nothing);
    }
    let mut words = line.split_whitespace();
    let (Some(method), Some(target), Some(version)) = (words.next(), words.next(), words.next()) else {
        return Ok(Received::Nonsense);
    };
    let mut request = Request { method: method.into(), target: target.into(), body: Vec::new() };
    let mut keep = version == "HTTP/1.1";
    let mut length = 0;
    for _ in 0..100 {
        let mut header = String::new();
        reader.by_ref().take(LONGEST_LINE).read_line(&mut header)?;
        let header = header.trim();
        if header.is_empty() {
            if length > LONGEST_BODY {
                return Ok(Received::Nonsense);
            }
            reader.by_ref().take(length).read_to_end(&mut request.body)?;
            return Ok(Received::Request(request, keep));
        }
        let (name, value) = header.split_once(':').unwrap_or((header, ""));
        if name.eq_ignore_ascii_case("connection") && value.trim().eq_ignore_ascii_case("close") {
            keep = false;
        }
        if name.eq_ignore_ascii_case("content-length") {
            let Ok(bytes) = value.trim().parse() else { return Ok(Received::Nonsense) };
            length = bytes;
        }
    }
    Ok(Received::Nonsense)
}

fn send(writer: &mut impl Write, response: &Response, with_body: bool, keep: bool) -> std::io::Result<()> {
    let mut head = format!(
        "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nCache-Control: no-cache\r\n",
        response.status,
        response.kind,
        response.body.len()
    );
    if let Some(location) = &response.location {
        head.push_str(&format!("Location: {location}\r\n"));
    }
    head.push_str(if keep { "\r\n" } else { "Connection: close\r\n\r\n" });
    writer.write_all(head.as_bytes())?;
    if with_body {
        writer.write_all(&response.body)?;
    }
    writer.flush()
}

/// The existing file or folder that a request's path names, never outside `root`.
fn locate(root: &Path, target: &str) -> Option<PathBuf> {
    let root = root.canonicalize().ok()?;
    let mut path = root.clone();
    for part in target.split(['?', '#']).next()?.split('/') {
        let part = percent_decoded(part)?;
        match part.as_str() {
            "" | "." => {}
            ".." => return None,
            part if part.contains(['/', '\\', ':', '\0']) => return None,
            part => path.push(part),
        }
    }
    // A link inside the folder may still lead out of it.
    path.canonicalize().ok().filter(|path| path.starts_with(&root))
}

fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let high = char::from(rest.next()?).to_digit(16)?;
            let low = char::from(rest.next()?).to_digit(16)?;
            bytes.push(u8::try_from(high * 16 + low).ok()?);
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

fn media_type(path: &Path) -> &'static str {
    match path.extension().and_then(|kind| kind.to_str()).unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "webmanifest" => "application/manifest+json",
        "wasm" => "application/wasm",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "csv" => "text/csv; charset=utf-8",
        "txt" | "md" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
#[path = "serve_tests.rs"]
mod tests;
