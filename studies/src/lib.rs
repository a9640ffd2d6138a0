//! Studies with `morphorod` that need more than its examples do, in a package of their own, so that whoever runs an example
//! compiles none of it.
//!
//! - `sweep` (`src/bin/sweep.rs`): thousands of shoots over a grid of two parameters, on all cores of one machine or of many; it
//!   can be stopped at any moment and goes on where it was. What it is made of is in [`sweep`].
//! - `peers` (`benches/peers.rs`): the shape of a rod at rest, by `morphorod` and by others, error against run time. It is a
//!   benchmark, so that the others are compiled for it alone.
//!
//! ```sh
//! cargo run --release -p morphorod-studies --bin sweep -- --help
//! cargo bench -p morphorod-studies --bench peers -- --help
//! ```

#[path = "../../examples/common/mod.rs"]
pub mod common;
pub mod sweep;
