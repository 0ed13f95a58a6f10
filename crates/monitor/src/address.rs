//! Where pages are opened, and why one cannot be.

use std::io;
use std::net::{SocketAddr, TcpListener};

use thiserror::Error;

/// Why a page cannot be opened.
#[derive(Debug, Error)]
pub enum NoPage {
    /// The address cannot be listened at.
    #[error("cannot listen at {address} ({source})")]
    Listen {
        /// host:port.
        address: String,
        /// What the system says.
        source: io::Error,
    },
    /// The system refused something that it should not.
    #[error("{doing} failed ({source})")]
    System {
        /// What was done.
        doing: &'static str,
        /// What the system says.
        source: io::Error,
    },
}

/// Listens at an address. A port alone is one of the loopback address.
pub(crate) fn listen(address: &str) -> Result<(TcpListener, SocketAddr), NoPage> {
    let address = at_loopback(address);
    let open = || {
        let listener = TcpListener::bind(&address)?;
        let bound = listener.local_addr()?;
        Ok((listener, bound))
    };
    open().map_err(|source| NoPage::Listen { address: address.clone(), source })
}

/// The address itself; a port alone is that of the loopback address.
fn at_loopback(address: &str) -> String {
    match address.trim_start_matches(':').parse::<u16>() {
        Ok(port) => format!("127.0.0.1:{port}"),
        Err(_) => address.to_owned(),
    }
}
