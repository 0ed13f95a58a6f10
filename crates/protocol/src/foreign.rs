//! Bytes that are not what the other end sent.

use thiserror::Error;

/// Why bytes are not what the other end sent, or do not come from an end that has the key.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Foreign {
    /// They are no handshake.
    #[error("it does not speak as radwalk does")]
    Tongue,
    /// The handshake was not made with our key.
    #[error("it does not know the key of this run")]
    Key,
    /// The answer says so of us.
    #[error("it says that our key is not its own")]
    NoEntry,
    /// A record has an impossible length.
    #[error("a record of {0} bytes, which none can have (a foreign or faulty peer)")]
    Length(usize),
    /// A record does not open.
    #[error("a record does not open: it was altered, replayed or moved on its way")]
    Altered,
}
