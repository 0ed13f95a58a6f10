//! The program's output: results on stdout, everything else on stderr as `tracing` events, in the form that was asked
//! for.
//!
//! If the reader of the output goes away, the run goes on. Results that cannot be written are remembered, and the
//! command fails at its end.

#![warn(unreachable_pub, unnameable_types)]

use std::fmt::{self, Write as _};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget};
use serde_json::{Map, Value, json};
use time::OffsetDateTime;
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Level, Subscriber, info};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

/// The environment variable that sets the level of messages, whatever `--quiet` says.
pub const LOG_VARIABLE: &str = "RADWALK_LOG";

/// The error of the first line on stdout that could not be written.
static UNSAID: Mutex<Option<io::Error>> = Mutex::new(None);

/// The form of lines on stderr.
static FORM: OnceLock<LineForm> = OnceLock::new();

/// The progress bar on the terminal; lines go above it.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// The form of lines on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineForm {
    /// Lines are sentences without time and level.
    Plain,
    /// Lines begin with the time and the level: logs of long runs.
    Stamped,
    /// Each line is a JSON object, and nothing else is written.
    Json,
}

/// The form and the level of messages.
#[derive(Clone, Copy, Debug)]
pub struct Voice {
    /// The form of lines on stderr.
    pub form: LineForm,
    /// The least level of messages that are written.
    pub level: LevelFilter,
}

impl Voice {
    /// The voice of a command. `long` commands stamp their lines if stderr is no terminal.
    pub fn new(json: bool, quiet: bool, long: bool) -> Self {
        let form = match () {
            () if json => LineForm::Json,
            () if long && !io::stderr().is_terminal() => LineForm::Stamped,
            () => LineForm::Plain,
        };
        Voice { form, level: if quiet { LevelFilter::ERROR } else { LevelFilter::INFO } }
    }

    /// Writes the messages of this process with this voice from now on.
    ///
    /// # Errors
    /// If the environment asks for an unknown level.
    pub fn begin(self) -> Result<(), String> {
        // Quiet workers inherit the environment of the coordinator that started them, and leave messages to it.
        let asked = std::env::var(LOG_VARIABLE).ok().filter(|_| self.level != LevelFilter::OFF);
        let level = asked.as_deref().map(|word| word.parse().map_err(|_| word.to_owned())).transpose();
        let _ = FORM.set(self.form);
        let printer = Printer { form: self.form };
        let voice = |level| tracing_subscriber::registry().with(level).with(printer);
        // It is set once, before any message.
        let set = |level| tracing::subscriber::set_global_default(voice(level));
        let _ = set(level.clone().ok().flatten().unwrap_or(self.level));
        level.map(|_| ())
    }
}

/// The time before the first message on a long phase, and between two messages on a terminal and in JSON.
const PULSE: Duration = Duration::from_secs(2);

/// The longest time between two messages if lines stay.
const LONGEST_PULSE: Duration = Duration::from_secs(30);

/// A phase that may take long, with messages while it lasts.
pub struct Phase {
    state: Arc<(Mutex<Doing>, Condvar)>,
    teller: Option<JoinHandle<()>>,
}

/// The phase of the moment, and its start.
struct Doing {
    what: &'static str,
    since: Instant,
    part: Option<f64>,
    over: bool,
}

impl Phase {
    /// Begins the first phase.
    pub fn begin(what: &'static str) -> Self {
        let doing = Doing { what, since: Instant::now(), part: None, over: false };
        let state = Arc::new((Mutex::new(doing), Condvar::new()));
        let shared = Arc::clone(&state);
        // Without a thread there are no messages; the work itself goes on.
        let teller = std::thread::Builder::new().spawn(move || tell_phases(&shared)).ok();
        Phase { state, teller }
    }

    /// Ends the phase and begins another.
    pub fn now(&self, what: &'static str) {
        let mut doing = held(&self.state.0);
        (doing.what, doing.since, doing.part) = (what, Instant::now(), None);
        self.state.1.notify_all();
    }

    /// Notes the part of the phase that is done.
    pub fn done(&self, part: f64) {
        held(&self.state.0).part = Some(part);
    }

    /// Goes on with what has no part that is known to be done.
    pub fn goes_on(&self) {
        held(&self.state.0).part = None;
    }
}

impl Drop for Phase {
    fn drop(&mut self) {
        held(&self.state.0).over = true;
        self.state.1.notify_all();
        let _ = self.teller.take().map(JoinHandle::join);
    }
}

/// Writes messages while a phase takes long: on a terminal in a line that is replaced, else in lines at growing
/// intervals.
fn tell_phases((state, changed): &(Mutex<Doing>, Condvar)) {
    let lasts = FORM.get() != Some(&LineForm::Plain) || !io::stderr().is_terminal();
    let steps = FORM.get() == Some(&LineForm::Json) || !lasts;
    let (mut announced, mut wait) = (None, PULSE);
    let spinner = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if !lasts {
        keep_below(Some(spinner.clone()));
    }
    let mut doing = held(state);
    while !doing.over {
        if announced != Some(doing.since) {
            (announced, wait) = (Some(doing.since), PULSE);
        }
        let (next, waited) = changed.wait_timeout(doing, wait).unwrap_or_else(PoisonError::into_inner);
        doing = next;
        if !waited.timed_out() || doing.over {
            continue;
        }
        let part = doing.part.map_or(String::new(), |part| format!(", {:.0} % done", 100.0 * part));
        let seconds = doing.since.elapsed().as_secs();
        if lasts {
            info!(event = "phase", seconds, "{}: {seconds} s so far{part}", doing.what);
        } else if tracing::enabled!(Level::INFO) {
            spinner.set_message(format!("{}: {seconds} s so far{part}", doing.what));
            spinner.tick();
        }
        if !steps {
            wait = (2 * wait).min(LONGEST_PULSE);
        }
    }
    if !lasts {
        keep_below(None);
        spinner.finish_and_clear();
    }
}

/// Writes a line of results on stdout.
pub fn say(line: &str) {
    let write = || writeln!(io::stdout(), "{}", harmless(line));
    let written = match held(&BAR).as_ref() {
        Some(bar) => bar.suspend(write),
        None => write(),
    };
    if let Err(error) = written
        && error.kind() != ErrorKind::BrokenPipe
    {
        held(&UNSAID).get_or_insert(error);
    }
}

/// The error of the first result that could not be written, if there is one.
pub fn unsaid() -> Option<io::Error> {
    held(&UNSAID).take()
}

/// Writes a JSON line on stderr.
pub fn emit(event: &Value) {
    // A reader that is gone needs no message.
    let _ = writeln!(io::stderr(), "{event}");
}

/// Keeps lines above this progress bar from now on; `None` ends that.
pub fn keep_below(bar: Option<ProgressBar>) {
    *held(&BAR) = bar;
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Text without control characters, which could command a terminal: names in files may hold any.
fn harmless(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() || matches!(c, '\n' | '\t')).collect()
}

/// The current time in UTC to the second, as 2026-01-31T23:59:59Z.
fn stamp() -> String {
    let now = OffsetDateTime::now_utc();
    let (date, time) = (now.date(), now.time());
    format!(
        "{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z",
        date.year(),
        u8::from(date.month()),
        date.day(),
        time.hour(),
        time.minute(),
        time.second()
    )
}

/// The JSON object of a line of a log.
pub fn record(level: &str, event: &str, text: &str) -> Map<String, Value> {
    let line = json!({"event": event, "level": level, "time": stamp(), "text": text});
    let Value::Object(line) = line else { unreachable!("it was written as an object") };
    line
}

/// The subscriber that writes events to stderr.
struct Printer {
    form: LineForm,
}

/// The parts of an event: its text and its fields.
#[derive(Default)]
struct EventParts {
    text: String,
    fields: Map<String, Value>,
}

impl Visit for EventParts {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            // Writing to a string cannot fail.
            let _ = write!(self.text, "{value:?}");
        } else {
            self.fields.insert(field.name().into(), format!("{value:?}").into());
        }
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.fields.insert(field.name().into(), value.into());
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.fields.insert(field.name().into(), value.into());
    }
}

impl<S: Subscriber> Layer<S> for Printer {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let mut parts = EventParts::default();
        event.record(&mut parts);
        let line = self.line(*event.metadata().level(), &parts);
        let write = || {
            // A reader that is gone is no error, as in `emit`.
            let _ = writeln!(io::stderr(), "{line}");
        };
        match held(&BAR).as_ref() {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }
}

impl Printer {
    fn line(&self, level: Level, EventParts { text, fields }: &EventParts) -> String {
        let word = level.as_str().to_lowercase();
        let prefix = if level <= Level::WARN { "radwalk: " } else { "" };
        let text = harmless(text);
        match self.form {
            LineForm::Json => {
                let event = match level {
                    Level::ERROR => "error",
                    Level::WARN => "warning",
                    _ => "note",
                };
                let mut line = record(&word, event, &text);
                line.extend(fields.clone());
                Value::Object(line).to_string()
            }
            // The last line of a command is its message alone.
            LineForm::Stamped if level > Level::ERROR => format!("{} {word:<5} {text}", stamp()),
            LineForm::Stamped | LineForm::Plain => format!("{prefix}{text}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(form: LineForm, level: Level, text: &str) -> String {
        let parts = EventParts {
            text: text.into(),
            fields: [("worker".to_owned(), "w\u{7}1".into())].into_iter().collect(),
        };
        Printer { form }.line(level, &parts)
    }

    #[test]
    fn lines_have_their_form() {
        assert_eq!(
            line(LineForm::Plain, Level::INFO, "a\u{1b}[31m"),
            "a[31m",
            "nothing commands the terminal"
        );
        assert_eq!(line(LineForm::Plain, Level::WARN, "a"), "radwalk: a");
        assert_eq!(line(LineForm::Stamped, Level::ERROR, "a"), "radwalk: a");
        let stamped = line(LineForm::Stamped, Level::INFO, "a");
        assert!(stamped.starts_with("20") && stamped.ends_with("Z info  a"), "{stamped}");
        let json: Value = serde_json::from_str(&line(LineForm::Json, Level::WARN, "a \"b\"\n")).unwrap();
        assert_eq!((&json["event"], &json["level"]), (&json!("warning"), &json!("warn")));
        assert_eq!((&json["text"], &json["worker"]), (&json!("a \"b\"\n"), &json!("w\u{7}1")));
    }
}
