//! Solution of the problem by `morphorod`, from the straight shape.

use std::f64::consts::FRAC_PI_2;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};

use crate::problem::{Candidate, DENSITY, LENGTH, MODULUS, POISSON, RADIUS, load_of};

/// Name of the program in tables.
pub const NAME: &str = "morphorod";
/// Numbers of elements.
const ELEMENTS: [usize; 10] = [1, 2, 3, 4, 5, 6, 8, 16, 32, 64];

/// Candidates of all orders and numbers of elements for a load q̂.
pub fn candidates(load: f64) -> Vec<Candidate> {
    let each = |order: Order| ELEMENTS.map(|elements| candidate(load, order, elements));
    Order::ALL.into_iter().flat_map(each).collect()
}

/// One candidate, with the default tolerance of the solver.
pub fn candidate(load: f64, order: Order, elements: usize) -> Candidate {
    let scene = Still::tilted(FRAC_PI_2);
    let environment = scene.environment(0.0);
    let tissue = LinearElastic {
        youngs_modulus: MODULUS,
        poissons_ratio: POISSON,
    };
    let weight = Weight {
        density: DENSITY * load / load_of(DENSITY),
    };
    let straight =
        Rod::uniform(LENGTH, RADIUS, scene.base, elements, order).expect("valid parameters");
    let mut solver = NewtonSolver::default();
    let solve = move || {
        let mut rod = straight.clone();
        let found = solver.solve(&mut rod, &tissue, &weight, &environment);
        found.is_ok().then(|| rod.tip() / LENGTH)
    };
    let setting = format!("order {}, elements {elements}", order.exponent());
    Candidate {
        peer: NAME.into(),
        setting,
        solve: Box::new(solve),
    }
}
