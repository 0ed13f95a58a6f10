//! Tests of `--watch`: the page of a running job, as a plain HTTP client reads it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{finish, path, radwalk, signal, wait_for};

/// A run that does not end by itself, and the URL that it prints.
fn watched(out: &Path, log: &Path, address: &str) -> (Child, String) {
    let child = radwalk()
        .args(["run", "tests/data/cube54.toml", "--paths", "1e15", "--json", "--watch", address, "--out"])
        .arg(out)
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(log).unwrap())
        .spawn()
        .unwrap();
    let url = wait_for("the address of the page", || {
        let text = std::fs::read_to_string(log).ok()?;
        let events = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let event = events.into_iter().find(|event| event["event"] == "watch")?;
        Some(event["text"].as_str()?.split_whitespace().last()?.to_owned())
    });
    (child, url)
}

/// An answer's head and its body.
fn ask(port: u16, target: &str, headers: &str) -> (String, String) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    write!(stream, "GET {target} HTTP/1.1\r\n{headers}\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    (head.to_owned(), body.to_owned())
}

fn port(url: &str) -> u16 {
    let rest = url.strip_prefix("http://").unwrap();
    rest.split('/').next().unwrap().rsplit(':').next().unwrap().parse().unwrap()
}

fn facts(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"facts\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn tag(head: &str) -> String {
    head.lines().find_map(|line| line.strip_prefix("ETag: ")).unwrap().to_owned()
}

#[test]
fn a_running_job_has_a_page_that_follows_it() {
    let folder = tempdir().unwrap();
    let [out, log] = ["out", "log"].map(|name| path(&folder, name));
    let (child, url) = watched(&out, &log, "0");
    assert!(url.starts_with("http://127.0.0.1:") && !url.contains("key="), "{url}");
    let port = port(&url);
    let here = format!("Host: localhost:{port}\r\n");
    let (head, page) = wait_for("the first page", || {
        let (head, page) = ask(port, "/", &here);
        page.contains("id=\"facts\"").then_some((head, page))
    });
    assert!(head.starts_with("HTTP/1.1 200 OK") && head.contains("text/html"), "{head}");
    assert!(page.contains("id=\"corners\"") && page.contains("<style>") && page.contains("id=\"live\""));
    let first = facts(&page);
    assert_eq!(first["live"]["paths_total"], 1_000_000_000_000_000_u64);
    assert_eq!(first["summary"]["model"]["patches"], 54);
    // News are of a later state, and hold only what changes.
    let (head, news) = wait_for("news", || {
        let (head, news) = ask(port, "/news", &format!("{here}If-None-Match: {}\r\n", tag(&head)));
        head.starts_with("HTTP/1.1 200").then_some((head, news))
    });
    let later = facts(&news);
    assert!(later["summary"]["paths"].as_u64() > first["summary"]["paths"].as_u64(), "{later}");
    assert!(news.contains("id=\"table\"") && !news.contains("id=\"corners\"") && !news.contains("<style>"));
    assert_ne!(tag(&head), format!("\"{}\"", first["summary"]["paths"]));
    // The page shows a prefix of the walks: its camera and scene are those of the first page.
    assert_eq!(
        (&later["view"]["eye"], &later["summary"]["scene_hash"]),
        (&first["view"]["eye"], &first["summary"]["scene_hash"])
    );
    assert!(ask(port, "/etc/passwd", &here).0.starts_with("HTTP/1.1 404"));
    // A name that another page gave to this address does not lead to the page.
    assert!(ask(port, "/", "Host: evil.example\r\n").0.starts_with("HTTP/1.1 403"));
    signal("INT", child.id());
    assert_eq!(finish(child).0, 130);
    assert!(TcpStream::connect(("127.0.0.1", port)).is_err(), "the page ends with the run");
}

#[test]
fn elsewhere_the_page_has_a_key() {
    let folder = tempdir().unwrap();
    let [out, log] = ["out", "log"].map(|name| path(&folder, name));
    let (child, url) = watched(&out, &log, "0.0.0.0:0");
    let (port, (_, key)) = (port(&url), url.split_once("?key=").expect("a key"));
    assert!(key.len() == 32 && key.bytes().all(|letter| letter.is_ascii_hexdigit()), "{url}");
    for target in ["/".to_owned(), "/news".into(), "/?key=".into(), format!("/?key={}0", &key[1..])] {
        let (head, body) = ask(port, &target, "");
        assert!(head.starts_with("HTTP/1.1 403") && !body.contains(key), "{target}: {head}");
    }
    let (head, _) = ask(port, &format!("/?key={key}"), "Host: node7\r\n");
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    signal("INT", child.id());
    assert_eq!(finish(child).0, 130);
}

/// A port or a key that was drawn is known from nowhere else, so it is a result: `--quiet` does not silence it.
#[test]
fn a_quiet_run_tells_where_its_page_is() {
    let folder = tempdir().unwrap();
    let [out, said] = ["out", "said"].map(|name| path(&folder, name));
    let child = radwalk()
        .args([
            "run",
            "tests/data/cube54.toml",
            "--paths",
            "1e15",
            "--quiet",
            "--watch",
            "0.0.0.0:0",
            "--out",
        ])
        .arg(&out)
        .stdout(std::fs::File::create(&said).unwrap())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let line = wait_for("the address of the page", || {
        std::fs::read_to_string(&said).ok().filter(|text| text.ends_with('\n'))
    });
    let url = line.trim().strip_prefix("the result so far is at ").expect("one line, and no other");
    assert_eq!(url.split_once("?key=").expect("a key").1.len(), 32);
    signal("INT", child.id());
    assert_eq!(finish(child).0, 130);
}
