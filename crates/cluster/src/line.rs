//! The leader's end of a worker's connection.

use std::io::{self, Read};
use std::net::Shutdown;
use std::sync::Arc;
use std::time::Duration;

use mio::net::TcpStream;
use protocol::Now;
use protocol::codec::CodecError;
use protocol::message::ToCoordinator;

use crate::channel::{Inbound, Outbound};

/// The time after which a peer that reads nothing is cut off.
const WRITE_PATIENCE: Duration = Duration::from_secs(30);

/// The time after the last message to a peer in which its own messages are read and thrown away. A connection that is
/// closed with unread bytes is reset, and the reset may overtake the last message.
pub(crate) const LINGER: Duration = Duration::from_secs(2);

/// The most bytes that are read of one peer before the next one is served.
pub(crate) const TURN_BYTES: usize = 1 << 16;

/// The outcome of reading from a peer once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Heard {
    /// Everything was read: the next event tells of more.
    All,
    /// This number of bytes was read; there may be more.
    Part(usize),
}

/// A connection that was let in.
pub(crate) struct Connection {
    stream: TcpStream,
    inbound: Inbound,
    outbound: Outbound,
    /// The time at which the peer last took bytes; `None` if there are none to take.
    taken: Option<Now>,
    /// The time at which the connection was told to close.
    closing: Option<Now>,
    shut: bool,
}

impl Connection {
    /// A connection after its handshake.
    pub(crate) fn new(stream: TcpStream, inbound: Inbound, outbound: Outbound) -> Self {
        Connection { stream, inbound, outbound, taken: None, closing: None, shut: false }
    }

    /// Adds a frame to those that are to be sent.
    pub(crate) fn push(&mut self, frame: Arc<[u8]>) {
        self.outbound.push(frame);
    }

    /// Whether the connection may still be used for messages.
    pub(crate) fn is_open(&self) -> bool {
        self.closing.is_none()
    }

    /// Sends the frames that are left, then closes; reads no more messages.
    pub(crate) fn close(&mut self, now: Now) {
        self.closing.get_or_insert(now);
    }

    /// Writes what the socket takes. Returns the number of bytes.
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

    /// Reads once, as many bytes as `buffer` holds.
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

    /// The next message of those that were read.
    ///
    /// # Errors
    /// Where it is none or too long.
    pub(crate) fn next(&mut self, cap: usize) -> Result<Option<ToCoordinator>, CodecError> {
        if self.closing.is_some() { Ok(None) } else { self.inbound.next(cap) }
    }

    /// Whether a closing connection has been given its time.
    pub(crate) fn is_over(&self, now: Now) -> bool {
        self.closing.is_some_and(|since| now.saturating_sub(since) > LINGER)
    }
}
