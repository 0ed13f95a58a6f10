//! How a job is solved: the choices of `[method]`, and the digest that names an answer.

mod batches;
mod chains;
mod hash;
mod read;
pub(crate) mod table;
mod walks;

pub use self::batches::fewest_chain_rays;
pub use self::hash::job_hash;
pub(crate) use self::read::{PatchPurpose, read_method};
pub(crate) use self::table::BasisKey;
pub use self::table::{Beside, MethodTable, WalkKind};
pub(crate) use self::walks::read_patches;
