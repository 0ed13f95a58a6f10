//! Connections of nobody knows whom. They share one thread; each costs a file descriptor and what it has sent, which
//! is little; and there are only so many. Whoever says nothing, or not what a worker would say, is turned away.

use std::collections::{BTreeMap, HashSet};
use std::io::{self, Read, Write};
use std::time::Duration;

use mio::net::TcpStream;

use crate::access::Access;
use crate::channel::{Inbound, Outbound};
use crate::codec::{CodecError, SHORT_FRAME};
use crate::foreign::Foreign;
use crate::lead::{Now, PeerId};
use crate::line::Line;
use crate::message::ToCoordinator;
use crate::noise::{self, HANDSHAKE_RECORD, NO_ENTRY};

/// So many may be here at once; the one that came first goes when another comes.
const STRANGERS: usize = 1024;

/// Whoever is not let in after so long goes.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// All that is read of anybody before it has proved to know the key.
const MOST_BYTES: usize = SHORT_FRAME;

/// First messages of workers that are remembered, so that none is taken twice.
const REMEMBERED: usize = 1 << 16;

/// A connection that has not proved to know the key.
struct Stranger {
    stream: TcpStream,
    since: Now,
    bytes: usize,
    stage: Stage,
}

enum Stage {
    /// The part of its first record that is here.
    Silent(Vec<u8>),
    /// It was answered. What it says next shows whether it can read the answer.
    Answered(Box<(Inbound, Outbound)>),
}

/// Who stands at the door.
#[derive(Default)]
pub(crate) struct Doorstep {
    /// By the order of arrival.
    strangers: BTreeMap<PeerId, Stranger>,
    greetings: HashSet<[u8; HANDSHAKE_RECORD]>,
}

/// What came of serving a stranger.
pub(crate) enum Served {
    /// It has more to say.
    Waits,
    /// It is a worker; this is what it said first.
    Admitted(Box<Line>, ToCoordinator),
    /// It was turned away.
    Gone(String),
}

impl Doorstep {
    /// Whether nobody is here.
    pub(crate) fn is_empty(&self) -> bool {
        self.strangers.is_empty()
    }

    /// Whether a connection is a stranger's.
    pub(crate) fn holds(&self, id: PeerId) -> bool {
        self.strangers.contains_key(&id)
    }

    /// Somebody connected. Returns false where the one that came first had to go.
    pub(crate) fn arrived(&mut self, id: PeerId, stream: TcpStream, now: Now) -> bool {
        let room = self.strangers.len() < STRANGERS || !self.drop_first();
        let stage = Stage::Silent(Vec::new());
        self.strangers.insert(id, Stranger { stream, since: now, bytes: 0, stage });
        room
    }

    /// Turns away whoever came first. Returns whether there was anybody.
    pub(crate) fn drop_first(&mut self) -> bool {
        self.strangers.pop_first().is_some()
    }

    /// Turns away those that have been here for too long. Returns how many.
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

    /// Reads what a stranger says.
    pub(crate) fn serve(&mut self, id: PeerId, access: &Access) -> Served {
        let Some(mut stranger) = self.strangers.remove(&id) else { return Served::Waits };
        match stranger.listen(access, &mut self.greetings) {
            Ok(None) => {
                self.strangers.insert(id, stranger);
                Served::Waits
            }
            Ok(Some((message, inbound, outbound))) => {
                Served::Admitted(Box::new(Line::new(stranger.stream, inbound, outbound)), message)
            }
            Err(reason) => Served::Gone(reason),
        }
    }
}

impl Stranger {
    /// Reads until it would block or the stranger has said what a worker says first.
    fn listen(
        &mut self,
        access: &Access,
        greetings: &mut HashSet<[u8; HANDSHAKE_RECORD]>,
    ) -> Result<Option<(ToCoordinator, Inbound, Outbound)>, String> {
        loop {
            // What follows a first record is not read before that is answered.
            let most = match &self.stage {
                Stage::Silent(record) => HANDSHAKE_RECORD - record.len(),
                Stage::Answered(_) => MOST_BYTES - self.bytes,
            };
            let mut buffer = [0; MOST_BYTES];
            let bytes = match self.stream.read(&mut buffer[..most]) {
                Ok(0) if most == 0 => {
                    return Err(format!("it said more than {MOST_BYTES} bytes but not who it is"));
                }
                Ok(0) => return Err("the connection was closed".into()),
                Ok(bytes) => bytes,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(CodecError::from(error).to_string()),
            };
            self.bytes += bytes;
            match &mut self.stage {
                Stage::Silent(record) => {
                    record.extend_from_slice(&buffer[..bytes]);
                    if !noise::speaks(record) {
                        return Err(Foreign::Tongue.to_string());
                    }
                    if let Ok(record) = <[u8; HANDSHAKE_RECORD]>::try_from(&record[..]) {
                        self.stage = Stage::Answered(Box::new(self.answer(access, &record, greetings)?));
                    }
                }
                Stage::Answered(channel) => {
                    channel.0.arrived(&buffer[..bytes]);
                    let said = channel.0.next(SHORT_FRAME).map_err(|error| error.to_string())?;
                    if let Some(message) = said {
                        let stage = std::mem::replace(&mut self.stage, Stage::Silent(Vec::new()));
                        let Stage::Answered(channel) = stage else { unreachable!("matched above") };
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
            return Err("it repeats what a worker said before".into());
        }
        let (session, answer) = noise::answer(access, record).map_err(|foreign| {
            // It may be a worker with another run's access file. If it does not hear, its connection ends all the same.
            let _ = self.stream.write(&NO_ENTRY);
            format!("{foreign}; use this run's access file")
        })?;
        if greetings.len() == REMEMBERED {
            // To take a replay costs some time, no more.
            greetings.clear();
        }
        greetings.insert(*record);
        // A new connection has room for so little.
        match self.stream.write(&answer) {
            Ok(HANDSHAKE_RECORD) => Ok((Inbound::new(session.opener), Outbound::new(session.sealer))),
            _ => Err("it does not take an answer".into()),
        }
    }
}
