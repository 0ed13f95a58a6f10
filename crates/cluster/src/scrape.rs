//! A page of text by HTTP, for monitors that come and ask: the metrics of a coordinator.
//!
//! One thread answers one request after the other, and gives each two seconds. That is all such a page needs, and less code
//! to trust than a web server; the crates that would do it (tiny_http, hyper) bring queues, pools and an executor.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What a request may take.
const PATIENCE: Duration = Duration::from_secs(2);

/// What a request may say.
const MOST_BYTES: usize = 8 << 10;

/// The page, which its owner replaces when there is news.
#[derive(Clone, Default)]
pub struct Page(Arc<Mutex<String>>);

impl Page {
    /// Replaces the text.
    pub fn set(&self, text: String) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = text;
    }

    fn get(&self) -> String {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Answers requests for the page at `/metrics` until the process ends, in a thread of its own.
///
/// # Errors
/// Where no thread can be started.
pub fn publish(listener: TcpListener, page: Page) -> io::Result<()> {
    let answer_all = move || {
        for stream in listener.incoming() {
            match stream {
                // A monitor that is gone asks again.
                Ok(stream) => drop(answer(stream, &page)),
                // Too many files are open: it may be better soon.
                Err(_) => std::thread::sleep(PATIENCE),
            }
        }
    };
    std::thread::Builder::new().name("metrics".into()).spawn(answer_all).map(drop)
}

fn answer(mut stream: TcpStream, page: &Page) -> io::Result<()> {
    let head = read_head(&mut stream)?;
    let mut words = head.split_whitespace();
    let (status, text) = match (words.next(), words.next()) {
        (Some("GET" | "HEAD"), Some("/metrics" | "/")) => ("200 OK", page.get()),
        (Some("GET" | "HEAD"), Some(_)) => ("404 Not Found", "The page is /metrics.\n".into()),
        _ => ("405 Method Not Allowed", "Pages are read with GET.\n".into()),
    };
    let body = if head.starts_with("HEAD") { "" } else { &text };
    stream.set_write_timeout(Some(PATIENCE))?;
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\nContent-Length: {}\r\n\
         Connection: close\r\n\r\n{body}",
        text.len()
    )
}

/// What is asked for, with its headers.
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

    #[test]
    fn the_page_is_read_and_nothing_else_is() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let page = Page::default();
        publish(listener, page.clone()).unwrap();
        page.set("radwalk_workers 2\n".into());
        let ask = |request: &str| {
            let mut stream = TcpStream::connect(address).unwrap();
            let mut answer = String::new();
            // A connection that is let go early may be reset.
            let _ = stream.write_all(request.as_bytes()).and_then(|()| stream.read_to_string(&mut answer));
            answer
        };
        let answer = ask("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
        assert!(
            answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.ends_with("\r\n\r\nradwalk_workers 2\n"),
            "{answer}"
        );
        assert!(ask("HEAD / HTTP/1.1\r\n\r\n").ends_with("\r\n\r\n"));
        assert!(ask("GET /../etc/passwd HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404"));
        assert!(ask("DELETE /metrics HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 405"));
        // Who says nothing of use is let go, and the next is heard.
        assert_eq!(ask(&"x".repeat(2 * MOST_BYTES)), "");
        assert!(ask("GET /metrics HTTP/1.0\r\n\r\n").contains("radwalk_workers 2"));
    }
}
