//! The sources that this program was built of.

/// The commit that the program was built from.
pub(crate) const GIT: &str = env!("RADWALK_GIT");

/// Version and commit: workers join only coordinators of the same build.
pub(crate) const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("RADWALK_GIT"));
