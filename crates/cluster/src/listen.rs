//! The address at which a process listens, and the one by which others reach it.

use std::io;
use std::net::{TcpListener, ToSocketAddrs};

use thiserror::Error;

/// The reason why a process cannot listen at an address.
#[derive(Debug, Error)]
pub enum ListenError {
    /// The system refuses the address.
    #[error(
        "cannot listen at {address} ({source}); write --listen HOST:PORT, with an address of this machine and a free port"
    )]
    Refused {
        /// The address as host:port.
        address: String,
        /// What the system says.
        source: io::Error,
    },
    /// The address stands for all addresses of the machine, and the machine's own name leads to none of them.
    #[error(
        "--listen {address} stands for every address of this machine (no other machine can connect to it), and this machine's own name leads to none of them; give the name or address by which others reach it, with --advertise HOST"
    )]
    NoName {
        /// The address as host:port.
        address: String,
    },
}

impl ListenError {
    /// Whether what was typed is no address at all, so that nothing was tried.
    pub fn is_usage(&self) -> bool {
        match self {
            ListenError::Refused { source, .. } => source.kind() == io::ErrorKind::InvalidInput,
            ListenError::NoName { .. } => true,
        }
    }
}

/// Listens at an address. Returns the listener and the address by which others reach it: `advertise`, or the address as
/// it was typed. An address that stands for all addresses of a machine is of no use to another machine, so the
/// machine's name replaces it.
///
/// # Errors
/// Where the system refuses, and where nothing tells other machines where this one is.
pub fn bind(address: &str, advertise: Option<&str>) -> Result<(TcpListener, String), ListenError> {
    let open = || {
        let listener = TcpListener::bind(address)?;
        let bound = listener.local_addr()?;
        Ok((listener, bound))
    };
    let refused = |source| ListenError::Refused { address: address.into(), source };
    let (listener, bound) = open().map_err(refused)?;
    let port = bound.port();
    let host = match advertise {
        Some(gate) if port_of(gate).is_some() => return Ok((listener, gate.into())),
        Some(host) if host.contains(':') && !host.starts_with('[') => format!("[{host}]"),
        Some(host) => host.into(),
        None if bound.ip().is_unspecified() => {
            own_name().ok_or_else(|| ListenError::NoName { address: address.into() })?
        }
        // A port of 0 was replaced by a free one; a host name stays as it was typed.
        None => address.rsplit_once(':').map_or(address, |(host, _)| host).into(),
    };
    Ok((listener, format!("{host}:{port}")))
}

/// The port behind a host name or an address, if there is one. IPv6 addresses have colons of their own.
fn port_of(address: &str) -> Option<u16> {
    let (host, port) = address.rsplit_once(':')?;
    let alone = !host.is_empty() && (!host.contains(':') || host.ends_with(']'));
    port.parse().ok().filter(|_| alone)
}

/// The name of this machine, if it leads others here.
fn own_name() -> Option<String> {
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let mut addresses = (&name[..], 0).to_socket_addrs().ok()?;
    addresses.any(|address| !address.ip().is_loopback()).then_some(name)
}
