//! Errors of bytes that are not what the other end sent.

use thiserror::Error;

/// The reason why bytes are not what the other end sent, or the other end does not have the key.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Foreign {
    /// The bytes are no handshake.
    #[error("it does not speak radwalk's protocol")]
    Tongue,
    /// The handshake was made with another key.
    #[error("it does not know the key of this run")]
    Key,
    /// The other end answered that our key is not its own.
    #[error("it answered that it has another key")]
    NoEntry,
    /// A record has a length that no record can have.
    #[error("a record has the impossible length of {0} bytes (a foreign or faulty peer)")]
    Length(usize),
    /// A record does not open with the key of the connection.
    #[error("a record does not open: it was altered, replayed or moved on its way")]
    Altered,
}
