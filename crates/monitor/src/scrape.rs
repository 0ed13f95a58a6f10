//! Pages over HTTP, for monitors and browsers: the metrics of a coordinator, and the page of its job.
//!
//! Each connection has a thread, two seconds to send its request, and a minute to read the answer. Such pages need no
//! more, and this is less code to trust than a web server; the crates that would do it (tiny_http, hyper) bring queues,
//! pools and an executor.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The longest time of a request, and the longest silence of a reader.
const PATIENCE: Duration = Duration::from_secs(2);

/// The longest time for reading an answer.
const LONGEST_ANSWER: Duration = Duration::from_secs(60);

/// The most bytes of a request.
const MOST_BYTES: usize = 8 << 10;

/// The most connections at once; others are closed.
const MOST_CONNECTIONS: usize = 32;

/// A request by GET or HEAD.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request<'a> {
    /// The path, from its slash on.
    pub(crate) path: &'a str,
    /// The query after the question mark.
    pub(crate) query: &'a str,
    head: &'a str,
}

impl Request<'_> {
    /// The value of a header, if the request has it.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let fields = self.head.lines().skip(1).filter_map(|line| line.split_once(':'));
        fields.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, value)| value.trim())
    }

    /// Whether the host that is asked for is this machine by one of its local names. A page from elsewhere may have given
    /// the loopback address a name of its own.
    pub(crate) fn is_to_here(&self) -> bool {
        self.header("host").is_none_or(is_here)
    }
}

/// Whether a host with its port is this machine by one of its local names.
fn is_here(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|letter| letter.is_ascii_digit()) => name,
        _ => host,
    };
    let name = name.trim_start_matches('[').trim_end_matches(']');
    name == "localhost" || name.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

/// An answer to a request.
#[derive(Clone, Debug)]
pub(crate) struct HttpResponse {
    /// The status: code and words.
    pub(crate) status: &'static str,
    /// The media type of the body.
    pub(crate) kind: &'static str,
    /// The tag that names this state of the body.
    pub(crate) tag: Option<String>,
    /// The bytes of the body.
    pub(crate) body: Arc<[u8]>,
}

impl HttpResponse {
    /// An answer that is one line of text.
    pub(crate) fn text(status: &'static str, line: &str) -> Self {
        let body = line.as_bytes().into();
        HttpResponse { status, kind: "text/plain; charset=utf-8", tag: None, body }
    }
}

/// A page of text, which its owner replaces when there is news.
#[derive(Clone, Default)]
pub struct TextPage(Arc<Mutex<String>>);

impl TextPage {
    /// Replaces the text of the page.
    pub(crate) fn set(&self, text: String) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = text;
    }

    /// Answers requests for the page at `/metrics`, in the format of Prometheus.
    pub(crate) fn answer(&self, request: &Request) -> HttpResponse {
        match request.path {
            "/metrics" | "/" => HttpResponse {
                status: "200 OK",
                kind: "text/plain; version=0.0.4; charset=utf-8",
                tag: None,
                body: self.0.lock().unwrap_or_else(PoisonError::into_inner).as_bytes().into(),
            },
            _ => HttpResponse::text("404 Not Found", "The page is /metrics.\n"),
        }
    }
}

/// Answers requests until the process ends, in threads of its own.
///
/// # Errors
/// If no thread can be started.
pub(crate) fn publish(
    listener: TcpListener,
    name: &str,
    answer: impl Fn(&Request) -> HttpResponse + Send + Sync + 'static,
) -> io::Result<()> {
    let answer = Arc::new(answer);
    let open = Arc::new(AtomicUsize::new(0));
    let answer_all = move || {
        for stream in listener.incoming() {
            // Too many files are open: this may be better soon.
            let Ok(stream) = stream else {
                std::thread::sleep(PATIENCE);
                continue;
            };
            if open.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
                open.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (answer, taken) = (answer.clone(), open.clone());
            let serve = move || {
                // A reader that is gone asks again.
                let _ = serve(stream, &*answer);
                taken.fetch_sub(1, Ordering::Relaxed);
            };
            if std::thread::Builder::new().spawn(serve).is_err() {
                open.fetch_sub(1, Ordering::Relaxed);
            }
        }
    };
    std::thread::Builder::new().name(name.into()).spawn(answer_all).map(drop)
}

fn serve(mut stream: TcpStream, answer: &impl Fn(&Request) -> HttpResponse) -> io::Result<()> {
    let head = read_head(&mut stream)?;
    let mut words = head.split_whitespace();
    let answered = match (words.next(), words.next()) {
        (Some("GET" | "HEAD"), Some(target)) => {
            let (path, query) = target.split_once('?').unwrap_or((target, ""));
            let request = Request { path, query, head: &head };
            let answered = answer(&request);
            match (&answered.tag, request.header("if-none-match")) {
                (Some(tag), Some(known)) if tag == known => {
                    HttpResponse { status: "304 Not Modified", body: [].into(), ..answered }
                }
                _ => answered,
            }
        }
        _ => HttpResponse::text("405 Method Not Allowed", "Pages are read with GET.\n"),
    };
    let HttpResponse { status, kind, tag, body } = answered;
    let tag = tag.map_or(String::new(), |tag| format!("ETag: {tag}\r\n"));
    let sent: &[u8] = if head.starts_with("HEAD") { &[] } else { &body };
    stream.set_write_timeout(Some(PATIENCE))?;
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n{tag}Cache-Control: no-store\r\n\
         Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    )?;
    let began = Instant::now();
    for part in sent.chunks(1 << 16) {
        if began.elapsed() > LONGEST_ANSWER {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.write_all(part)?;
    }
    Ok(())
}

/// Reads a request line with its headers.
fn read_head(stream: &mut TcpStream) -> io::Result<String> {
    let began = Instant::now();
    let (mut head, mut buffer) = (Vec::new(), [0; 1024]);
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let left = PATIENCE.saturating_sub(began.elapsed());
        if left.is_zero() || head.len() > MOST_BYTES {
            return Err(io::ErrorKind::InvalidData.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut buffer)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            read => head.extend(&buffer[..read]),
        }
    }
    Ok(String::from_utf8_lossy(&head).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function that sends a request and returns the whole answer.
    fn asked(answer: impl Fn(&Request) -> HttpResponse + Send + Sync + 'static) -> impl Fn(&str) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        publish(listener, "pages", answer).unwrap();
        move |request: &str| {
            let mut stream = TcpStream::connect(address).unwrap();
            let mut answer = String::new();
            // A connection that is closed early may be reset.
            let _ = stream.write_all(request.as_bytes()).and_then(|()| stream.read_to_string(&mut answer));
            answer
        }
    }

    #[test]
    fn hosts_are_here_by_their_own_names() {
        for host in ["localhost", "localhost:7600", "127.0.0.1:80", "[::1]:7600", "127.3.2.1"] {
            assert!(is_here(host), "{host}");
        }
        for host in
            ["evil.example", "evil.example:80", "10.0.0.1:80", "localhost.evil.example", "[::2]:1", ""]
        {
            assert!(!is_here(host), "{host}");
        }
    }

    #[test]
    fn the_page_is_read_and_nothing_else_is() {
        let page = TextPage::default();
        page.set("radwalk_workers 2\n".into());
        let ask = asked(move |request| page.answer(request));
        let answer = ask("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
        assert!(
            answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.ends_with("\r\n\r\nradwalk_workers 2\n"),
            "{answer}"
        );
        assert!(ask("HEAD / HTTP/1.1\r\n\r\n").ends_with("\r\n\r\n"));
        assert!(ask("GET /../etc/passwd HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404"));
        assert!(ask("DELETE /metrics HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 405"));
        // A reader that sends nothing of use is dropped, and the next one is served.
        assert_eq!(ask(&"x".repeat(2 * MOST_BYTES)), "");
        assert!(ask("GET /metrics HTTP/1.0\r\n\r\n").contains("radwalk_workers 2"));
    }

    #[test]
    fn what_a_reader_has_is_not_sent_again() {
        let ask = asked(|request| HttpResponse {
            status: "200 OK",
            kind: "text/html",
            tag: Some("\"7\"".into()),
            body: format!("{} {}", request.path, request.query).into_bytes().into(),
        });
        let first = ask("GET /news?key=a HTTP/1.1\r\n\r\n");
        assert!(first.contains("\r\nETag: \"7\"\r\n") && first.ends_with("\r\n\r\n/news key=a"), "{first}");
        let again = ask("GET /news HTTP/1.1\r\nif-none-match: \"7\"\r\n\r\n");
        assert!(again.starts_with("HTTP/1.1 304") && again.ends_with("\r\n\r\n"), "{again}");
        assert!(ask("GET /news HTTP/1.1\r\nIf-None-Match: \"6\"\r\n\r\n").starts_with("HTTP/1.1 200"));
    }

    /// A reader that connects and sends nothing holds up no other one.
    #[test]
    fn silent_readers_hold_up_no_other() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        publish(listener, "pages", |_| HttpResponse::text("200 OK", "here\n")).unwrap();
        let _silent: Vec<TcpStream> = (0..8).map(|_| TcpStream::connect(address).unwrap()).collect();
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.ends_with("here\n"), "{answer}");
    }
}
