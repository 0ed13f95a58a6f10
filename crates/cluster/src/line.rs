//! The coordinator's side of a worker's connection.

use std::io::{self, Read};
use std::net::Shutdown;
use std::sync::Arc;
use std::time::Duration;

use mio::net::TcpStream;

use crate::channel::{Inbound, Outbound};
use crate::codec::CodecError;
use crate::lead::Now;
use crate::message::ToCoordinator;

/// A peer that does not take what it is sent for so long is cut off.
const WRITE_PATIENCE: Duration = Duration::from_secs(30);

/// After the last message to a peer, its own are read and thrown away for so long: a connection that is
/// closed with bytes unread is reset, and the reset may overtake the message.
pub(crate) const LINGER: Duration = Duration::from_secs(2);

/// Bytes that are read of one peer before it is the next one's turn.
pub(crate) const TURN_BYTES: usize = 1 << 16;

/// Whether a peer may have more to say now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Heard {
    /// Wait for an event.
    All,
    /// So many bytes; its turn is over, but it may have said more.
    Part(usize),
}

/// A connection that is let in.
pub(crate) struct Line {
    stream: TcpStream,
    inbound: Inbound,
    outbound: Outbound,
    /// When the peer last took something, or had nothing to take.
    taken: Option<Now>,
    /// When nothing more was to be sent, and nothing heard.
    closing: Option<Now>,
    shut: bool,
}

impl Line {
    /// A connection after its handshake.
    pub(crate) fn new(stream: TcpStream, inbound: Inbound, outbound: Outbound) -> Self {
        Line { stream, inbound, outbound, taken: None, closing: None, shut: false }
    }

    /// Adds a frame to what is to be sent.
    pub(crate) fn push(&mut self, frame: Arc<[u8]>) {
        self.outbound.push(frame);
    }

    /// Whether anything may still be said.
    pub(crate) fn is_open(&self) -> bool {
        self.closing.is_none()
    }

    /// Sends what is still to be sent, then closes; hears nothing more.
    pub(crate) fn close(&mut self, now: Now) {
        self.closing.get_or_insert(now);
    }

    /// Writes what the socket takes. Returns how many bytes.
    ///
    /// # Errors
    /// Where the connection fails, or the peer has not taken anything for too long.
    pub(crate) fn flush(&mut self, now: Now) -> Result<usize, CodecError> {
        let written = self.outbound.write_to(&mut self.stream)?;
        if self.outbound.is_empty() {
            self.taken = None;
            if self.closing.is_some() && !self.shut {
                self.shut = true;
                self.stream.shutdown(Shutdown::Write)?;
            }
        } else if written > 0 || self.taken.is_none() {
            self.taken = Some(now);
        }
        match self.taken {
            Some(taken) if now.saturating_sub(taken) > WRITE_PATIENCE => Err(CodecError::Silent),
            _ => Ok(written),
        }
    }

    /// Reads once, at most `buffer`.
    ///
    /// # Errors
    /// Where the connection ended or fails.
    pub(crate) fn hear(&mut self, buffer: &mut [u8]) -> Result<Heard, CodecError> {
        match self.stream.read(buffer) {
            Ok(0) => Err(CodecError::Closed),
            Ok(bytes) => {
                if self.closing.is_none() {
                    self.inbound.arrived(&buffer[..bytes]);
                }
                Ok(Heard::Part(bytes))
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(Heard::Part(0)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(Heard::All),
            Err(error) => Err(error.into()),
        }
    }

    /// The next message of what was heard.
    ///
    /// # Errors
    /// Where it is none or too long.
    pub(crate) fn next(&mut self, cap: usize) -> Result<Option<ToCoordinator>, CodecError> {
        if self.closing.is_some() { Ok(None) } else { self.inbound.next(cap) }
    }

    /// Whether a connection that is closing has had its time.
    pub(crate) fn is_over(&self, now: Now) -> bool {
        self.closing.is_some_and(|since| now.saturating_sub(since) > LINGER)
    }
}
