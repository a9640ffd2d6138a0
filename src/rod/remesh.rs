//! Splitting and merging of elements.
