//! Shoots that are advanced in time.

mod allocations;
mod bad_dynamic_input;
mod bad_runs;
mod capstan;
mod contact;
mod contact_changes;
mod discontinuities;
mod dynamic_symmetries;
mod ensembles;
mod extreme;
mod extreme_scales;
mod failures;
mod growing_shoot;
mod ladder;
mod long_growth;
mod order_in_time;
mod random_scenes;
mod righting;
mod shoots_that_stretch;
mod short_events;
mod stops;
mod supports;
mod tolerance;
mod tolerance_events;
mod tolerance_inside;
mod tolerance_random;
