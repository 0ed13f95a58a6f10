//! `--watch`: the page of a running job, which follows the run while a browser looks at it.
//!
//! If a browser has asked for the page lately, the coordinator's loop now and then hands a copy of the tally to a
//! thread that makes the page; other threads answer the browsers ([`crate::scrape`]). Making pages takes at most a
//! twentieth of the time.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use protocol::{Checkpoint, Coordinator};
use radiosity::Experiment;
use results::{Identity, LivePage, Settings};
use tracing::debug;

use crate::address::{NoPage, listen};
use crate::scrape::{HttpResponse, Request, publish};

/// The least time between two pages.
const INTERVAL: Duration = Duration::from_secs(2);

/// The inverse of the part of the time that making pages may take.
const SHARE: u32 = 20;

/// The time without a request after which a browser counts as gone.
const LATELY: Duration = Duration::from_secs(20);

/// The number of letters in a key.
const KEY_LETTERS: usize = 32;

/// The page for a browser before there is anything to show. It asks again by itself.
const WAITING: &str = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"2\">\
    <title>radwalk</title></head><body><p>The run has begun. The page comes with its first walks.</p></body></html>\n";

/// The page of a running job, as the coordinator's loop sees it.
pub struct Showing {
    url: String,
    shared: Arc<ShownState>,
    tallies: SyncSender<Checkpoint>,
    /// The number of walks in the latest page.
    walks: u64,
}

/// The state that the threads share.
struct ShownState {
    /// The key without which no request is answered with data; `None` at the loopback address.
    key: Option<String>,
    state: Mutex<State>,
    /// Whether a page is being made now.
    busy: AtomicBool,
}

/// The latest pages, when the next is due, and when a browser last asked.
struct State {
    pages: Option<Pages>,
    due: Instant,
    asked: Option<Instant>,
}

/// The page in its two forms.
#[derive(Clone)]
struct Pages {
    tag: String,
    /// The whole page as HTML.
    page: Arc<[u8]>,
    /// The parts that change from one page to the next.
    news: Arc<[u8]>,
}

impl Showing {
    /// Opens the page of a job at an address: at the loopback address if only a port is given, elsewhere behind a key.
    /// `git` names the program's sources.
    ///
    /// # Errors
    /// If the system refuses to listen at the address, or has no random numbers or threads.
    pub fn open(
        address: &str,
        git: &'static str,
        experiment: &Experiment,
        settings: &Settings,
    ) -> Result<Self, NoPage> {
        let (listener, bound) = listen(address, "--watch")?;
        let key = (!bound.ip().is_loopback()).then(draw_key).transpose();
        let key = key.map_err(|source| NoPage::System { doing: "drawing a random key", source })?;
        let state = State { pages: None, due: Instant::now(), asked: None };
        let shared = Arc::new(ShownState { key, state: Mutex::new(state), busy: AtomicBool::new(false) });
        let (tallies, inbox) = sync_channel(1);
        let (experiment, settings) = (experiment.clone(), settings.clone());
        let maker = Maker { shared: shared.clone(), git, experiment, settings };
        let thread = std::thread::Builder::new().name("pages".into());
        let start = || {
            thread.spawn(move || maker.make_all(&inbox))?;
            let served = shared.clone();
            publish(listener, "watch", move |request| served.answer(request))
        };
        start().map_err(|source| NoPage::System { doing: "starting a thread", source })?;
        Ok(Showing { url: shared.url(bound), shared, tallies, walks: 0 })
    }

    /// The address of the page for a browser, with its key.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Hands over a copy of the tally if a page is due and a browser asks for it.
    pub fn supervise(&mut self, coordinator: &Coordinator, identity: &Identity) {
        let walks = coordinator.prefix().counts.walks;
        if walks == self.walks || self.shared.busy.load(Ordering::Acquire) || !self.shared.is_due() {
            return;
        }
        let checkpoint = identity.checkpoint(coordinator.snapshot());
        self.shared.busy.store(true, Ordering::Release);
        if self.tallies.try_send(checkpoint).is_ok() {
            self.walks = walks;
        }
    }
}

impl ShownState {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_due(&self) -> bool {
        let state = self.state();
        let asked = state.asked.is_some_and(|asked| asked.elapsed() < LATELY);
        // The first page is made without a request, so that the first browser finds one.
        (asked || state.pages.is_none()) && Instant::now() >= state.due
    }

    fn url(&self, bound: SocketAddr) -> String {
        let query = self.key.as_ref().map_or(String::new(), |key| format!("?key={key}"));
        match bound.ip() {
            ip if ip.is_unspecified() => {
                let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
                format!("http://{name}:{}/{query}", bound.port())
            }
            _ => format!("http://{bound}/{query}"),
        }
    }

    /// Answers the request of a browser.
    fn answer(&self, request: &Request) -> HttpResponse {
        if !self.lets_in(request) {
            let line = "This page has a key: open the address that radwalk printed when the run began.\n";
            return HttpResponse::text("403 Forbidden", line);
        }
        if !matches!(request.path, "/" | "/news") {
            return HttpResponse::text("404 Not Found", "The page is /.\n");
        }
        let mut state = self.state();
        state.asked = Some(Instant::now());
        let Some(pages) = state.pages.clone() else {
            return HttpResponse {
                kind: "text/html; charset=utf-8",
                ..HttpResponse::text("200 OK", WAITING)
            };
        };
        let body = if request.path == "/news" { pages.news } else { pages.page };
        HttpResponse { status: "200 OK", kind: "text/html; charset=utf-8", tag: Some(pages.tag), body }
    }

    /// Whether a request may see the page. If there is a key, the key decides. At the loopback address the host name in
    /// the request does: a page from elsewhere may have given that address a name of its own.
    fn lets_in(&self, request: &Request) -> bool {
        match &self.key {
            // Comparing hashes takes a time that tells nothing of the key.
            Some(key) => request
                .query
                .split('&')
                .filter_map(|part| part.strip_prefix("key="))
                .any(|typed| blake3::hash(typed.as_bytes()) == blake3::hash(key.as_bytes())),
            None => request.is_to_here(),
        }
    }
}

/// Draws a key from the operating system's generator.
fn draw_key() -> io::Result<String> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
    Ok(blake3::Hash::from(bytes).to_hex()[..KEY_LETTERS].to_owned())
}

/// The thread that makes pages of tallies.
struct Maker {
    shared: Arc<ShownState>,
    git: &'static str,
    experiment: Experiment,
    settings: Settings,
}

impl Maker {
    fn make_all(&self, tallies: &Receiver<Checkpoint>) {
        for checkpoint in tallies {
            let began = Instant::now();
            let made = self.make(&checkpoint);
            drop(checkpoint);
            let mut state = self.shared.state();
            state.due = Instant::now() + INTERVAL.max(began.elapsed() * SHARE);
            match made {
                Ok(pages) => state.pages = Some(pages),
                Err(error) => debug!("no page is made: {error}"),
            }
            drop(state);
            self.shared.busy.store(false, Ordering::Release);
        }
    }

    fn make(&self, checkpoint: &Checkpoint) -> io::Result<Pages> {
        let LivePage { paths, page, news } =
            LivePage::of(&self.settings, &self.experiment, checkpoint, self.git)?;
        Ok(Pages {
            tag: format!("\"{paths}\""),
            page: page.into_bytes().into(),
            news: news.into_bytes().into(),
        })
    }
}
