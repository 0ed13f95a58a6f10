//! Messages over encrypted records, without sockets: bytes to messages, and messages to bytes.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::Arc;

use bincode::Decode;
use protocol::codec::{CodecError, first_message};

use crate::noise::{Opener, RECORD_CONTENT, Sealer};

/// A buffer whose bytes are taken from the front.
#[derive(Debug, Default)]
struct Backlog {
    bytes: Vec<u8>,
    taken: usize,
}

impl Backlog {
    fn rest(&self) -> &[u8] {
        &self.bytes[self.taken..]
    }

    fn take(&mut self, bytes: usize) {
        self.taken += bytes;
        if self.taken == self.bytes.len() {
            // Thousands of idle connections then hold no memory.
            *self = Backlog::default();
        }
    }

    /// The buffer to which more bytes are added.
    fn end(&mut self) -> &mut Vec<u8> {
        self.bytes.drain(..self.taken);
        self.taken = 0;
        &mut self.bytes
    }
}

/// The receiving side of a channel: it holds at most one frame and two records of it.
#[derive(Debug)]
pub struct Inbound {
    opener: Opener,
    wire: Backlog,
    content: Backlog,
}

impl Inbound {
    /// A receiving side that has not received anything.
    pub fn new(opener: Opener) -> Self {
        Inbound { opener, wire: Backlog::default(), content: Backlog::default() }
    }

    /// Takes bytes as they come from a socket. Call [`Inbound::next`] until it returns no message before taking more.
    pub fn arrived(&mut self, bytes: &[u8]) {
        self.wire.end().extend_from_slice(bytes);
    }

    /// The next message, of at most `cap` bytes; `None` if it is not complete yet.
    ///
    /// # Errors
    /// Where the bytes are not what the other end sent, or too many, or no message. Nothing more can be read then.
    pub fn next<T: Decode<()>>(&mut self, cap: usize) -> Result<Option<T>, CodecError> {
        loop {
            if let Some((message, used)) = first_message(self.content.rest(), cap)? {
                self.content.take(used);
                return Ok(Some(message));
            }
            let Some(used) = self.opener.open(self.wire.rest(), self.content.end())? else { return Ok(None) };
            self.wire.take(used);
        }
    }
}

/// The sending side of a channel: frames, sealed record by record when the socket takes them, so that a job on its way
/// to a thousand workers is held once.
#[derive(Debug)]
pub struct Outbound {
    sealer: Sealer,
    frames: VecDeque<Arc<[u8]>>,
    /// The number of bytes of the first frame that are sealed.
    sealed: usize,
    wire: Backlog,
}

impl Outbound {
    /// A sending side with nothing to send.
    pub fn new(sealer: Sealer) -> Self {
        Outbound { sealer, frames: VecDeque::new(), sealed: 0, wire: Backlog::default() }
    }

    /// Adds a frame to those that are to be sent.
    pub fn push(&mut self, frame: Arc<[u8]>) {
        self.frames.push_back(frame);
    }

    /// Whether everything is sent.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty() && self.wire.rest().is_empty()
    }

    /// Writes as much as `stream` takes. Returns the number of bytes.
    ///
    /// # Errors
    /// Where the stream fails; a stream that would block has not.
    pub fn write_to(&mut self, stream: &mut impl Write) -> io::Result<usize> {
        let mut written = 0;
        while self.fill() {
            match stream.write(self.wire.rest()) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(bytes) => {
                    self.wire.take(bytes);
                    written += bytes;
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(written)
    }

    /// Seals the next record once the one before is written. Returns whether there is anything to write.
    fn fill(&mut self) -> bool {
        while self.wire.rest().is_empty() {
            let Some(frame) = self.frames.front() else { return false };
            let content = &frame[self.sealed..];
            let content = &content[..content.len().min(RECORD_CONTENT)];
            self.sealer.seal(content, self.wire.end());
            self.sealed += content.len();
            if self.sealed == frame.len() {
                self.frames.pop_front();
                self.sealed = 0;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::Access;
    use crate::noise::{Greeting, answer};
    use protocol::codec::frame;
    use protocol::message::ToWorker;

    /// A stream that takes a few bytes and then would block.
    struct Narrow(Vec<u8>, usize);

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let bytes = &bytes[..bytes.len().min(self.1)];
            self.1 -= bytes.len();
            self.0.extend(bytes);
            if bytes.is_empty() { Err(io::ErrorKind::WouldBlock.into()) } else { Ok(bytes.len()) }
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn ends() -> (Outbound, Inbound) {
        let access = Access::new("nowhere:1".into(), "1.0", [7; 32]).unwrap();
        let (greeting, first) = Greeting::new(&access);
        let (coordinator, second) = answer(&access, &first).unwrap();
        let worker = greeting.finish(&second[2..]).unwrap();
        (Outbound::new(coordinator.sealer), Inbound::new(worker.opener))
    }

    fn messages() -> Vec<ToWorker> {
        let job: Vec<u8> = (0..100_000_u32).map(|n| (n % 251) as u8).collect();
        vec![
            ToWorker::Welcome { job: job.into(), stream_walks: 1, leases_per_thread: 2 },
            ToWorker::Lease { id: 1, first_walk: 2, walks: 3 },
            ToWorker::Done,
        ]
    }

    #[test]
    fn messages_pass_in_pieces_of_any_size() {
        for step in [1, 7, 1000, 16_402, 50_000] {
            let (mut outbound, mut inbound) = ends();
            messages().iter().for_each(|message| outbound.push(frame(message).unwrap().into()));
            let mut heard = Vec::new();
            while !outbound.is_empty() {
                let mut socket = Narrow(Vec::new(), step);
                let written = outbound.write_to(&mut socket).unwrap();
                assert!(written == socket.0.len() && written > 0);
                inbound.arrived(&socket.0);
                while let Some(message) = inbound.next::<ToWorker>(1 << 20).unwrap() {
                    heard.push(message);
                }
            }
            assert_eq!(heard, messages());
        }
    }

    #[test]
    fn what_is_too_long_is_refused_when_its_length_is_there() {
        let (mut outbound, mut inbound) = ends();
        outbound.push(frame(&messages()[0]).unwrap().into());
        let mut socket = Narrow(Vec::new(), 20_000);
        outbound.write_to(&mut socket).unwrap();
        inbound.arrived(&socket.0);
        let error = inbound.next::<ToWorker>(50_000).unwrap_err();
        assert!(matches!(error, CodecError::TooLong { length: 100_008, cap: 50_000 }), "{error}");
    }
}
