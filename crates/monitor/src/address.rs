//! The addresses of pages, and the errors of opening one.

use std::io;
use std::net::{SocketAddr, TcpListener};

use thiserror::Error;

/// The reason why a page cannot be opened.
#[derive(Debug, Error)]
pub enum NoPage {
    /// The system refuses to listen at the address.
    #[error(
        "cannot listen at {address} ({source}); write {option} HOST:PORT, with an address of this machine and a free port"
    )]
    Listen {
        /// The address as host:port.
        address: String,
        /// The option that says where.
        option: &'static str,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The system refused something that it should not.
    #[error("{doing} failed ({source}); this is a fault of the system, not of the job")]
    System {
        /// The step that the system refused.
        doing: &'static str,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl NoPage {
    /// Whether what was typed is no address at all, so that nothing was tried.
    pub fn is_usage(&self) -> bool {
        matches!(self, NoPage::Listen { source, .. } if source.kind() == io::ErrorKind::InvalidInput)
    }
}

/// Listens at an address that an option gives; a port alone means the loopback address.
pub(crate) fn listen(address: &str, option: &'static str) -> Result<(TcpListener, SocketAddr), NoPage> {
    let address = at_loopback(address);
    let open = || {
        let listener = TcpListener::bind(&address)?;
        let bound = listener.local_addr()?;
        Ok((listener, bound))
    };
    open().map_err(|source| NoPage::Listen { address: address.clone(), option, source })
}

/// The address itself, or a port at the loopback address.
fn at_loopback(address: &str) -> String {
    match address.trim_start_matches(':').parse::<u16>() {
        Ok(port) => format!("127.0.0.1:{port}"),
        Err(_) => address.to_owned(),
    }
}
