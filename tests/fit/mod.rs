//! Estimation of the parameters of a shoot from data.

mod bad_input;
mod confidence;
mod coverage;
mod data;
mod derivatives;
mod extreme;
mod oscillator;
mod plants;
mod recovery;
mod structure;
mod tables;
mod verdicts;
