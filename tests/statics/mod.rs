//! Tests of equilibrium shapes.

mod any_load_any_tilt;
mod bad_static_input;
mod bad_supports;
mod bodies;
mod classic_rods;
mod contact;
mod elastica;
mod extreme_shapes;
mod general_rods;
mod greenhill;
mod held;
mod held_joints;
mod held_profile;
mod held_stability;
mod helix;
mod horizontal_base;
mod point_force;
mod potentials;
mod random_contacts;
mod reported_errors;
mod shear_and_stretch;
mod snaps;
mod static_symmetries;
mod thin_obstacles;
mod varying_material;
mod yielding;
