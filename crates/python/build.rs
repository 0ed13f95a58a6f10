//! Puts the commit into the Python package.

fn main() {
    stamp::stamp();
}
