//! Puts the commit into the binary, for the pages that it makes.

fn main() {
    stamp::stamp();
}
