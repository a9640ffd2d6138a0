//! Tests of the contact problem.

use approx::assert_relative_eq;

use super::*;

/// A sphere of unit radius about the origin.
struct Ball;

impl Surfaces for Ball {
    fn gap(&self, _: usize, place: &Vector3<f64>) -> Gap {
        let (norm, normal) = (place.norm(), place.normalize());
        let curvature = (Matrix3::identity() - normal * normal.transpose()) / norm;
        Gap { value: norm - 1.0, normal, curvature }
    }
}

fn contact(first: usize, friction: f64, range: Option<[f64; 2]>) -> Contact {
    Contact {
        obstacle: 0,
        friction,
        force: Vector3::zeros(),
        shift: 0.0,
        range,
        bend: Vector3::new(0.1, 0.2, 0.3),
        curve: 1.5,
        clearance: -0.01,
        anchor: (Vector3::new(0.5, 0.5, 0.5), Vector3::new(0.1, 0.0, 0.9)),
        first,
        rigid: 0.0,
        k: 1.3,
        status: Status::Open,
    }
}

#[test]
fn newton_step_has_the_derivatives_of_the_residuals() {
    let n = 9;
    let mut compliance = DMatrix::from_fn(n, n, |i, j| ((i * n + j) as f64 * 2.399_963).sin() * 0.2);
    compliance = &compliance * compliance.transpose() + DMatrix::identity(n, n) * 0.3;
    let free = DVector::from_vec(vec![0.5, 0.4, 0.6, 0.6, -0.7, 0.1, -0.4, 0.5, 0.6]);
    let problem = Reduced { surfaces: &Ball, compliance: &compliance, free, scale: 0.0 };
    for friction in [0.0, 0.2, 5.0] {
        let mut contacts = vec![contact(0, friction, Some([-1.0, 1.0])), contact(6, friction, None)];
        contacts[0].force = Vector3::new(0.2, 0.1, 0.25);
        contacts[0].shift = 0.05;
        contacts[1].force = Vector3::new(-0.1, 0.2, 0.2);
        let residuals = |contacts: &[Contact]| {
            let all = problem.evaluate_all(contacts, Smoothing::default());
            let mut values = Vec::new();
            for (contact, at) in contacts.iter().zip(&all) {
                assert_ne!(at.law.status, Status::Open);
                values.extend(at.law.residual.iter().copied());
                values.extend(at.slide.map(|(moved, ..)| moved * contact.k));
            }
            DVector::from_vec(values)
        };
        let steps = problem.step(&contacts, &problem.evaluate_all(&contacts, Smoothing::default()), 0.0).unwrap();
        let moved = |h: f64| {
            let mut moved = contacts.clone();
            for (contact, (force, shift)) in moved.iter_mut().zip(&steps) {
                contact.force += force * h;
                contact.shift += shift * h;
            }
            residuals(&moved)
        };
        // The residuals decrease in proportion along the step. Central differences have errors of order h².
        let h = 1e-5;
        let difference = (moved(h) - moved(-h)) / (2.0 * h);
        assert_relative_eq!(difference, -residuals(&contacts), epsilon = 1e-7, max_relative = 1e-7);
    }
}

/// The plane z = 0.
struct Floor;

impl Surfaces for Floor {
    fn gap(&self, _: usize, place: &Vector3<f64>) -> Gap {
        Gap { value: place.z, normal: Vector3::z(), curvature: Matrix3::zeros() }
    }
}

#[test]
fn point_on_two_springs_sticks_or_slides_by_coulombs_law() {
    // A point is pressed to the plane by a spring of compliance a and pulled along it by one of compliance b. Without
    // contact it would be at the depth d, displaced by t.
    let (a, b, depth) = (0.4, 0.7, 0.3);
    let compliance = DMatrix::from_diagonal(&DVector::from_vec(vec![b, b, a]));
    for (friction, pull) in [(0.0, 0.2), (0.5, 0.05), (0.5, 2.0), (2.0, 2.0), (0.5, -1.0)] {
        let free = DVector::from_vec(vec![pull, 0.0, -depth]);
        let problem = Reduced { surfaces: &Floor, compliance: &compliance, free, scale: 0.0 };
        let mut point = contact(0, friction, None);
        (point.clearance, point.anchor) = (0.0, (Vector3::zeros(), Vector3::zeros()));
        let mut contacts = vec![point];
        assert!(problem.solve(&mut contacts));
        let (force, normal): (_, f64) = (contacts[0].force, depth / a);
        assert_relative_eq!(force.z, normal, max_relative = 1e-12);
        let sticking = -pull / b;
        let expected =
            if sticking.abs() <= friction * normal { sticking } else { sticking.signum() * friction * normal };
        assert_relative_eq!(force.x, expected, epsilon = 1e-12);
        let sticks = sticking.abs() <= friction * normal;
        assert_eq!(contacts[0].status, if sticks { Status::Sticking } else { Status::Sliding });
    }
}

#[test]
fn two_points_share_a_load_by_their_coupled_compliance() {
    // Two points have the compliance a, and a force on one displaces the other by c. Without contact they are at the
    // depth d; a third one is above the plane.
    let (a, c, depth) = (0.5, 0.2, 0.1);
    let mut compliance = DMatrix::from_diagonal_element(9, 9, 1.0);
    for (i, j, value) in [(2, 2, a), (5, 5, a), (2, 5, c), (5, 2, c), (8, 8, a)] {
        compliance[(i, j)] = value;
    }
    let free = DVector::from_vec(vec![0.0, 0.0, -depth, 0.0, 0.0, -depth, 0.0, 0.0, depth]);
    let problem = Reduced { surfaces: &Floor, compliance: &compliance, free, scale: 0.0 };
    let mut contacts: Vec<Contact> = (0..3).map(|i| Contact { clearance: 0.0, ..contact(3 * i, 0.0, None) }).collect();
    assert!(problem.solve(&mut contacts));
    for (point, expected) in contacts.iter().zip([depth / (a + c), depth / (a + c), 0.0]) {
        assert_relative_eq!(point.force, Vector3::z() * expected, epsilon = 1e-14);
    }
    assert_eq!(contacts[2].status, Status::Open);
}
