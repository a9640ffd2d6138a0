//! The rod by `morphorod`: a straight rod is copied and let sag.

use std::f64::consts::FRAC_PI_2;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};

use crate::problem::{Candidate, DENSITY, LENGTH, MODULUS, POISSON, RADIUS, load_of};

/// What the peer is called in tables.
pub const NAME: &str = "morphorod";
/// Elements of a rod that are tried.
const ELEMENTS: [usize; 10] = [1, 2, 3, 4, 5, 6, 8, 16, 32, 64];

/// All orders and numbers of elements under a load q̂.
pub fn candidates(load: f64) -> Vec<Candidate> {
    let each = |order: Order| ELEMENTS.map(|elements| candidate(load, order, elements));
    Order::ALL.into_iter().flat_map(each).collect()
}

/// One of them, at the solver's own tolerance.
pub fn candidate(load: f64, order: Order, elements: usize) -> Candidate {
    let scene = Still::tilted(FRAC_PI_2);
    let environment = scene.environment(0.0);
    let tissue = LinearElastic { youngs_modulus: MODULUS, poissons_ratio: POISSON };
    let weight = Weight { density: DENSITY * load / load_of(DENSITY) };
    let straight = Rod::uniform(LENGTH, RADIUS, scene.base, elements, order).expect("a rod");
    let mut solver = NewtonSolver::default();
    let solve = move || {
        let mut rod = straight.clone();
        let found = solver.solve(&mut rod, &tissue, &weight, &environment);
        found.is_ok().then(|| rod.tip() / LENGTH)
    };
    let setting = format!("order {}, elements {elements}", order.exponent());
    Candidate { peer: NAME.into(), setting, solve: Box::new(solve) }
}
