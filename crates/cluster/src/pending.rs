//! Connections whose other end has not proved that it knows the key. They share one thread; each costs a file
//! descriptor and the few bytes that it has sent, and their number is bounded. A stranger that sends nothing, or not
//! what a worker would send, is turned away.

use std::collections::{BTreeMap, HashSet};
use std::io::{self, Read, Write};
use std::time::Duration;

use mio::net::TcpStream;
use protocol::codec::{CodecError, SHORT_FRAME};
use protocol::message::ToCoordinator;
use protocol::{Foreign, Now, PeerId};

use crate::access::Access;
use crate::channel::{Inbound, Outbound};
use crate::line::Connection;
use crate::noise::{self, HANDSHAKE_RECORD, NO_ENTRY};

/// The most strangers at once; the one that came first is dropped when another comes.
const STRANGERS: usize = 1024;

/// The time after which a stranger that was not let in is dropped.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// The most bytes that are read of a connection before it has proved that it knows the key.
const MOST_BYTES: usize = SHORT_FRAME;

/// The number of workers' first messages that are remembered, so that none is taken twice.
const REMEMBERED: usize = 1 << 16;

/// A connection that has not proved that it knows the key.
struct Stranger {
    stream: TcpStream,
    since: Now,
    bytes: usize,
    stage: HandshakeStage,
}

enum HandshakeStage {
    /// The stranger has sent this part of its first record.
    Silent(Vec<u8>),
    /// The stranger was answered; its next message shows whether it can read the answer.
    Answered(Box<(Inbound, Outbound)>),
}

/// All connections that have not proved that they know the key.
#[derive(Default)]
pub(crate) struct PendingHandshakes {
    /// The strangers in their order of arrival.
    strangers: BTreeMap<PeerId, Stranger>,
    greetings: HashSet<[u8; HANDSHAKE_RECORD]>,
}

/// The outcome of serving a stranger.
pub(crate) enum Served {
    /// The stranger has not sent enough yet.
    Waits,
    /// The stranger is a worker, and this is its first message.
    Admitted(Box<Connection>, ToCoordinator),
    /// The stranger was turned away, for this reason.
    Gone(String),
}

impl PendingHandshakes {
    /// Whether there are no strangers.
    pub(crate) fn is_empty(&self) -> bool {
        self.strangers.is_empty()
    }

    /// Whether a connection is a stranger's.
    pub(crate) fn holds(&self, id: PeerId) -> bool {
        self.strangers.contains_key(&id)
    }

    /// Takes in a new connection. Returns false if the oldest one was dropped for it.
    pub(crate) fn arrived(&mut self, id: PeerId, stream: TcpStream, now: Now) -> bool {
        let room = self.strangers.len() < STRANGERS || !self.drop_first();
        let stage = HandshakeStage::Silent(Vec::new());
        self.strangers.insert(id, Stranger { stream, since: now, bytes: 0, stage });
        room
    }

    /// Drops the stranger that came first. Returns whether there was one.
    pub(crate) fn drop_first(&mut self) -> bool {
        self.strangers.pop_first().is_some()
    }

    /// Drops the strangers that have been here for too long. Returns their number.
    pub(crate) fn tidy(&mut self, now: Now) -> usize {
        let mut gone = 0;
        while let Some(first) = self.strangers.first_entry()
            && now.saturating_sub(first.get().since) > PATIENCE
        {
            first.remove();
            gone += 1;
        }
        gone
    }

    /// Reads what a stranger has sent.
    pub(crate) fn serve(&mut self, id: PeerId, access: &Access) -> Served {
        let Some(mut stranger) = self.strangers.remove(&id) else { return Served::Waits };
        match stranger.listen(access, &mut self.greetings) {
            Ok(None) => {
                self.strangers.insert(id, stranger);
                Served::Waits
            }
            Ok(Some((message, inbound, outbound))) => {
                Served::Admitted(Box::new(Connection::new(stranger.stream, inbound, outbound)), message)
            }
            Err(reason) => Served::Gone(reason),
        }
    }
}

impl Stranger {
    /// Reads until the stream would block or the stranger has sent a worker's first message.
    fn listen(
        &mut self,
        access: &Access,
        greetings: &mut HashSet<[u8; HANDSHAKE_RECORD]>,
    ) -> Result<Option<(ToCoordinator, Inbound, Outbound)>, String> {
        loop {
            // Bytes after the first record are not read before that record is answered.
            let most = match &self.stage {
                HandshakeStage::Silent(record) => HANDSHAKE_RECORD - record.len(),
                HandshakeStage::Answered(_) => MOST_BYTES - self.bytes,
            };
            let mut buffer = [0; MOST_BYTES];
            let bytes = match self.stream.read(&mut buffer[..most]) {
                Ok(0) if most == 0 => {
                    return Err(format!("it sent {MOST_BYTES} bytes without introducing itself"));
                }
                Ok(0) => return Err("the connection was closed".into()),
                Ok(bytes) => bytes,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(CodecError::from(error).to_string()),
            };
            self.bytes += bytes;
            match &mut self.stage {
                HandshakeStage::Silent(record) => {
                    record.extend_from_slice(&buffer[..bytes]);
                    if !noise::speaks(record) {
                        return Err(Foreign::Tongue.to_string());
                    }
                    if let Ok(record) = <[u8; HANDSHAKE_RECORD]>::try_from(&record[..]) {
                        self.stage =
                            HandshakeStage::Answered(Box::new(self.answer(access, &record, greetings)?));
                    }
                }
                HandshakeStage::Answered(channel) => {
                    channel.0.arrived(&buffer[..bytes]);
                    let said = channel.0.next(SHORT_FRAME).map_err(|error| error.to_string())?;
                    if let Some(message) = said {
                        let stage = std::mem::replace(&mut self.stage, HandshakeStage::Silent(Vec::new()));
                        let HandshakeStage::Answered(channel) = stage else { unreachable!("matched above") };
                        return Ok(Some((message, channel.0, channel.1)));
                    }
                }
            }
        }
    }

    fn answer(
        &mut self,
        access: &Access,
        record: &[u8; HANDSHAKE_RECORD],
        greetings: &mut HashSet<[u8; HANDSHAKE_RECORD]>,
    ) -> Result<(Inbound, Outbound), String> {
        if greetings.contains(record) {
            return Err("it repeats a worker's first message".into());
        }
        let (session, answer) = noise::answer(access, record).map_err(|foreign| {
            // The stranger may be a worker with another run's access file. Its connection ends even if it does not read
            // this.
            let _ = self.stream.write(&NO_ENTRY);
            format!("{foreign}; use this run's access file")
        })?;
        if greetings.len() == REMEMBERED {
            // Accepting a replay costs some time and does no harm.
            greetings.clear();
        }
        greetings.insert(*record);
        // The send buffer of a new connection always has room for the answer.
        match self.stream.write(&answer) {
            Ok(HANDSHAKE_RECORD) => Ok((Inbound::new(session.opener), Outbound::new(session.sealer))),
            _ => Err("it did not take the answer to its first message".into()),
        }
    }
}
