//! The parts of the program `sweep`: which shoots there are ([`grid`]), what is asked of each ([`point`]), how the work is shared
//! among threads ([`threads`]), how a row of the grid becomes a file and comes back ([`row`], [`store`]), and the picture of
//! all ([`picture`]).

pub mod grid;
pub mod picture;
pub mod point;
pub mod row;
pub mod store;
pub mod threads;
