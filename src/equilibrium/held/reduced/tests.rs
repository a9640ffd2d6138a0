//! Tests of the contact problem.

use std::cell::Cell;

use approx::assert_relative_eq;

use super::*;

/// A sphere of unit radius about the origin.
struct Ball;

impl Surfaces for Ball {
    fn gap(&self, _: usize, place: &Vector3<f64>) -> Gap {
        let (norm, normal) = (place.norm(), place.normalize());
        let curvature = (Matrix3::identity() - normal * normal.transpose()) / norm;
        Gap {
            value: norm - 1.0,
            normal,
            curvature,
        }
    }
}

fn contact(first: usize, friction: f64, range: Option<[f64; 2]>) -> LinearContact {
    LinearContact {
        obstacle: 0,
        friction,
        force: Vector3::zeros(),
        travel: 0.0,
        range,
        bend: Vector3::new(0.1, 0.2, 0.3),
        curve: 1.5,
        turn_by_couple: 0.8,
        clearance: -0.01,
        anchor: (Vector3::new(0.5, 0.5, 0.5), Vector3::new(0.1, 0.0, 0.9)),
        first,
        rigid: 0.0,
        k: 1.3,
        status: Status::Open,
    }
}

/// The compliance and the free coordinates of a contact that moves along the rod and of one that
/// does not.
fn two_coupled_contacts() -> (DMatrix<f64>, DVector<f64>) {
    let n = 9;
    let factor = DMatrix::from_fn(n, n, |i, j| ((i * n + j) as f64 * 2.399_963).sin() * 0.2);
    let compliance = &factor * factor.transpose() + DMatrix::identity(n, n) * 0.3;
    (
        compliance,
        DVector::from_vec(vec![0.5, 0.4, 0.6, 0.6, -0.7, 0.1, -0.4, 0.5, 0.6]),
    )
}

#[test]
fn newton_step_has_the_derivatives_of_the_residuals() {
    let (compliance, free) = two_coupled_contacts();
    let problem = Reduced {
        surfaces: &Ball,
        compliance: &compliance,
        start: free.clone(),
        present: DVector::zeros(free.len()),
        free,
        scale: 0.0,
    };
    for friction in [0.0, 0.2, 5.0] {
        let mut contacts = vec![
            contact(0, friction, Some([-1.0, 1.0])),
            contact(6, friction, None),
        ];
        contacts[0].force = Vector3::new(0.2, 0.1, 0.25);
        contacts[0].travel = 0.05;
        contacts[1].force = Vector3::new(-0.1, 0.2, 0.2);
        let residuals = |contacts: &[LinearContact]| {
            let all = problem.evaluate_all(contacts);
            let mut values = Vec::new();
            for (contact, at) in contacts.iter().zip(&all) {
                assert_ne!(at.law.status, Status::Open);
                values.extend(at.law.residual.iter().copied());
                values.extend(at.slide.as_ref().map(|slide| slide.excess * contact.k));
            }
            DVector::from_vec(values)
        };
        let steps = problem
            .step(&contacts, &problem.evaluate_all(&contacts), 0.0)
            .unwrap();
        let moved = |h: f64| {
            let mut moved = contacts.clone();
            for (contact, (force, travel)) in moved.iter_mut().zip(&steps) {
                contact.force += force * h;
                contact.travel += travel * h;
            }
            residuals(&moved)
        };
        // The residuals decrease in proportion along the step. Central differences have errors of
        // order h².
        let h = 1e-5;
        let difference = (moved(h) - moved(-h)) / (2.0 * h);
        assert_relative_eq!(
            difference,
            -residuals(&contacts),
            epsilon = 1e-7,
            max_relative = 1e-7
        );
    }
}

#[test]
fn active_set_keeps_the_solution_and_approaches_it() {
    let (compliance, free) = two_coupled_contacts();
    let problem = Reduced {
        surfaces: &Ball,
        compliance: &compliance,
        start: free.clone(),
        present: DVector::zeros(free.len()),
        free,
        scale: 0.0,
    };
    let solution = problem
        .solve(
            &[contact(0, 0.0, Some([-1.0, 1.0])), contact(6, 0.0, None)],
            false,
        )
        .unwrap();
    assert!(solution.iter().all(|at| at.status != Status::Open));
    let distance = |contacts: &[LinearContact]| {
        let each = contacts
            .iter()
            .zip(&solution)
            .map(|(a, b)| (a.force - b.force).norm() + (a.travel - b.travel).abs());
        each.sum::<f64>()
    };
    let mut kept = solution.clone();
    assert!(problem.press(&mut kept));
    assert!(distance(&kept) < 1e-12, "{:e}", distance(&kept));
    // The convergence is linear, since each force keeps the normal at the place before.
    let mut contacts = solution.clone();
    contacts.iter_mut().for_each(|at| at.force *= 1.05);
    let mut last = distance(&contacts);
    for press in 0..6 {
        assert!(problem.press(&mut contacts));
        assert!(
            distance(&contacts) < 0.7 * last,
            "{press}: {:e} {last:e}",
            distance(&contacts)
        );
        last = distance(&contacts);
    }
}

/// The plane z = 0.
struct Floor;

impl Surfaces for Floor {
    fn gap(&self, _: usize, place: &Vector3<f64>) -> Gap {
        Gap {
            value: place.z,
            normal: Vector3::z(),
            curvature: Matrix3::zeros(),
        }
    }
}

#[test]
fn point_on_two_springs_sticks_or_slides_by_coulombs_law() {
    // A point is pressed to the plane by a spring of compliance a and pulled along it by one of
    // compliance b. Without contact it would be at the depth d, displaced by t.
    let (a, b, depth) = (0.4, 0.7, 0.3);
    let compliance = DMatrix::from_diagonal(&DVector::from_vec(vec![b, b, a]));
    for (friction, pull) in [(0.0, 0.2), (0.5, 0.05), (0.5, 2.0), (2.0, 2.0), (0.5, -1.0)] {
        let free = DVector::from_vec(vec![pull, 0.0, -depth]);
        let problem = Reduced {
            surfaces: &Floor,
            compliance: &compliance,
            start: free.clone(),
            present: DVector::zeros(free.len()),
            free,
            scale: 0.0,
        };
        let mut point = contact(0, friction, None);
        (point.clearance, point.anchor) = (0.0, (Vector3::zeros(), Vector3::zeros()));
        let contacts = problem.solve(&[point], false).unwrap();
        let (force, normal): (_, f64) = (contacts[0].force, depth / a);
        assert_relative_eq!(force.z, normal, max_relative = 1e-12);
        let sticking = -pull / b;
        let expected = if sticking.abs() <= friction * normal {
            sticking
        } else {
            sticking.signum() * friction * normal
        };
        assert_relative_eq!(force.x, expected, epsilon = 1e-12);
        let sticks = sticking.abs() <= friction * normal;
        assert_eq!(
            contacts[0].status,
            if sticks {
                Status::Sticking
            } else {
                Status::Sliding
            }
        );
    }
}

#[test]
fn two_points_share_a_load_by_their_coupled_compliance() {
    // Two points have the compliance a, and a force on one displaces the other by c. Without
    // contact they are at the depth d; a third one is above the plane.
    let (a, c, depth) = (0.5, 0.2, 0.1);
    let mut compliance = DMatrix::from_diagonal_element(9, 9, 1.0);
    for (i, j, value) in [(2, 2, a), (5, 5, a), (2, 5, c), (5, 2, c), (8, 8, a)] {
        compliance[(i, j)] = value;
    }
    let free = DVector::from_vec(vec![0.0, 0.0, -depth, 0.0, 0.0, -depth, 0.0, 0.0, depth]);
    let problem = Reduced {
        surfaces: &Floor,
        compliance: &compliance,
        start: free.clone(),
        present: DVector::zeros(free.len()),
        free,
        scale: 0.0,
    };
    let contacts: Vec<LinearContact> = (0..3)
        .map(|i| LinearContact {
            clearance: 0.0,
            ..contact(3 * i, 0.0, None)
        })
        .collect();
    let contacts = problem.solve(&contacts, false).unwrap();
    for (point, expected) in contacts.iter().zip([depth / (a + c), depth / (a + c), 0.0]) {
        assert_relative_eq!(point.force, Vector3::z() * expected, epsilon = 1e-14);
    }
    assert_eq!(contacts[2].status, Status::Open);
}

/// A sphere of unit radius about (20, 30, 40), where the rounding of coordinates exceeds that of
/// the distance.
struct FarBall;

const FAR: Vector3<f64> = Vector3::new(20.0, 30.0, 40.0);

impl Surfaces for FarBall {
    fn gap(&self, obstacle: usize, place: &Vector3<f64>) -> Gap {
        Ball.gap(obstacle, &(place - FAR))
    }
}

#[test]
fn contact_that_bears_almost_no_force_is_solved_to_the_rounding_of_its_place() {
    // A weightless rod touches a ball: no other force gives the residual a scale.
    let compliance = DMatrix::from_row_slice(
        3,
        3,
        &[1.4, -0.03, -5.3, -0.03, 21.0, -0.007, -5.3, -0.007, 19.6],
    );
    let compliance = &compliance * compliance.transpose();
    for i in 0..20 {
        let direction = Vector3::new(0.3 + 0.05 * f64::from(i), 0.7, 0.2).normalize();
        let free = DVector::from_row_slice((FAR + direction * (1.0 - 1e-12)).as_slice());
        let problem = Reduced {
            surfaces: &FarBall,
            compliance: &compliance,
            start: free.clone(),
            present: DVector::zeros(free.len()),
            free,
            scale: 1e-27,
        };
        let contacts = problem
            .solve(
                &[LinearContact {
                    clearance: 0.0,
                    ..contact(0, 0.0, None)
                }],
                false,
            )
            .unwrap_or_else(|| panic!("{i}"));
        let place = Reduced::place(&contacts[0], &problem.coordinates(&contacts)).0;
        let gap = problem.surfaces.gap(0, &place).value;
        assert!(gap.abs() <= 4.0 * f64::EPSILON * FAR.norm(), "{i}: {gap:e}");
    }
}

/// The plane z = 0, whose gap is rounded to odd multiples of 5e-12, so that it is never zero.
/// Evaluations are counted.
#[derive(Default)]
struct RoughFloor(Cell<usize>);

impl Surfaces for RoughFloor {
    fn gap(&self, _: usize, place: &Vector3<f64>) -> Gap {
        self.0.set(self.0.get() + 1);
        let value = 1e-11 * ((1e11 * place.z).floor() + 0.5);
        Gap {
            value,
            normal: Vector3::z(),
            curvature: Matrix3::zeros(),
        }
    }
}

#[test]
fn solution_whose_residual_is_hidden_by_rounding_needs_no_second_guess() {
    // A second guess could lead to a solution far from the present forces.
    let (a, depth, floor) = (0.4, 0.3, RoughFloor::default());
    let compliance = DMatrix::identity(3, 3) * a;
    let free = DVector::from_vec(vec![0.0, 0.0, -depth]);
    let problem = Reduced {
        surfaces: &floor,
        compliance: &compliance,
        start: free.clone(),
        present: DVector::zeros(free.len()),
        free,
        scale: 0.0,
    };
    let contacts = problem
        .solve(
            &[LinearContact {
                clearance: 0.0,
                ..contact(0, 0.0, None)
            }],
            false,
        )
        .unwrap();
    assert_relative_eq!(
        contacts[0].force,
        Vector3::z() * (depth / a),
        max_relative = 1e-9
    );
    // One guess takes 36 evaluations of the gap, and two take 73.
    assert!(floor.0.get() < 50, "{}", floor.0.get());
}

#[test]
fn problems_of_many_close_stations_are_solved_to_rounding() {
    // Stations along a beam of unit length and stiffness, on a hinge of the compliance 1e3, have
    // the compliance s² (3 t − s)/6 + 1e3 s t for s ≤ t, without friction. The gaps are those to a
    // wavy obstacle.
    let count = 30;
    let places: Vec<f64> = (1..=count).map(|i| 0.4 + 0.02 * i as f64).collect();
    let mut compliance = DMatrix::zeros(3 * count, 3 * count);
    for i in 0..count {
        for j in 0..count {
            let (s, t) = (places[i].min(places[j]), places[i].max(places[j]));
            for axis in 0..3 {
                compliance[(3 * i + axis, 3 * j + axis)] =
                    s * s * (3.0 * t - s) / 6.0 + 1e3 * s * t;
            }
        }
    }
    for phase in 0..20 {
        let mut free = DVector::zeros(3 * count);
        for (i, s) in places.iter().enumerate() {
            free[3 * i + 2] = 0.02 * (9.0 * s + f64::from(phase)).sin() - 0.03 * s * s;
        }
        let problem = Reduced {
            surfaces: &Floor,
            compliance: &compliance,
            start: free.clone(),
            present: DVector::zeros(free.len()),
            free,
            scale: 0.0,
        };
        let at_rest = (Vector3::zeros(), Vector3::zeros());
        let each = (0..count).map(|i| LinearContact {
            clearance: 0.0,
            anchor: at_rest,
            ..contact(3 * i, 0.0, None)
        });
        let contacts = problem
            .solve(&each.collect::<Vec<_>>(), false)
            .unwrap_or_else(|| panic!("{phase}"));
        let coordinates = problem.coordinates(&contacts);
        for point in &contacts {
            let gap = coordinates[point.first + 2];
            let touches = point.status != Status::Open;
            assert!(point.force.z >= 0.0 && gap >= -1e-13, "{phase}: {gap:e}");
            assert!(!touches || gap <= 1e-13, "{phase}: {gap:e}");
        }
    }
}

#[test]
fn first_step_solves_laws_that_are_linear_at_the_start_of_the_step() {
    // The laws at a plane are linear in the place. A rod that starts along the plane would turn by
    // a slope, so that the place of least gap is at minus the slope over the second derivative of
    // the gap.
    let (a, depth, slope) = (0.7, 0.3, 0.2);
    let compliance = DMatrix::identity(6, 6) * a;
    let free = DVector::from_vec(vec![0.0, 0.0, -depth, 1.0, 0.0, slope]);
    let start = DVector::from_vec(vec![0.0, 0.0, -1e-3, 1.0, 0.0, 0.0]);
    let problem = Reduced {
        surfaces: &Floor,
        compliance: &compliance,
        present: DVector::zeros(free.len()),
        free,
        start,
        scale: 0.0,
    };
    let at_rest = (Vector3::zeros(), Vector3::zeros());
    // With this force the point would be open at the place that the rod reaches with it.
    let lifted = LinearContact {
        force: Vector3::z(),
        k: 3.0,
        ..contact(0, 0.0, Some([-1.0, 1.0]))
    };
    let mut point = LinearContact {
        clearance: 0.0,
        anchor: at_rest,
        ..lifted
    };
    for curve in [2.0, 5.0] {
        (point.curve, point.bend) = (curve, Vector3::z() * curve);
        let steps = problem.first_step(&[point], 0.0).unwrap();
        assert_relative_eq!(
            steps[0].0,
            Vector3::z() * (depth / a - 1.0),
            max_relative = 1e-12
        );
        assert_relative_eq!(steps[0].1, -slope / (curve + a), max_relative = 1e-12);
    }
}

#[test]
fn step_of_a_displaced_force_has_no_error_of_second_order_in_the_slope() {
    // The slope is s + (c λ + g″) ξ with the compliance c of the slope against a couple. At a flat
    // point the couple changes it by more than the displacement.
    let (turn_by_couple, slope) = (40.0, 1e-3);
    for (curve, before, after, travel) in [
        (0.5, 0.2, 0.9, 0.01),
        (1e-6, 1.0, 0.3, 0.0),
        (0.5, 0.9, 0.0, -0.02),
    ] {
        let force = Vector3::z() * before;
        let mut point = LinearContact {
            force,
            travel,
            turn_by_couple,
            curve,
            ..contact(0, 0.0, Some([-1.0, 1.0]))
        };
        let change = Vector3::z() * (after - before);
        // The linear step removes the slope.
        let linear = slope + turn_by_couple * after * travel + curve * travel;
        let step = -linear / (turn_by_couple * before + curve);
        point.advance((change, step), 1.0);
        assert_relative_eq!(point.force, force + change, max_relative = 1e-15);
        assert_relative_eq!(
            (turn_by_couple * after + curve) * point.travel,
            -slope,
            max_relative = 1e-12
        );
    }
}

#[test]
fn flat_point_is_clamped_by_a_couple() {
    // A point of a plane is pressed to it by a spring of compliance a, and turns by a couple with
    // the compliance c. Its displacement ξ removes the slope, unless it reaches the end of its
    // range.
    let (a, c, depth, end) = (0.4, 30.0, 0.3, 0.05);
    let compliance = DMatrix::from_diagonal(&DVector::from_vec(vec![a, a, a, c, c, c]));
    for curve in [1.0, 1e-3, 1e-9] {
        for slope in [1e-6, 1e-3, -0.2, 10.0] {
            let start = DVector::from_vec(vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
            let free = DVector::from_vec(vec![0.0, 0.0, -depth, 1.0, 0.0, slope]);
            let problem = Reduced {
                surfaces: &Floor,
                compliance: &compliance,
                present: DVector::zeros(free.len()),
                free,
                start,
                scale: 0.0,
            };
            let bend = Vector3::z() * curve;
            let flat = LinearContact {
                turn_by_couple: c,
                curve,
                bend,
                clearance: 0.0,
                ..contact(0, 0.0, Some([-end, end]))
            };
            let contacts = problem
                .solve(&[flat], false)
                .unwrap_or_else(|| panic!("{curve:e} {slope:e}"));
            let (travel, force) = (contacts[0].travel, contacts[0].force.z);
            let exact =
                (depth - slope * travel - 0.5 * curve * travel.powi(2)) / (a + c * travel.powi(2));
            assert_relative_eq!(force, exact, max_relative = 1e-12);
            let remaining = slope + (curve + c * force) * travel;
            let at_end = travel.abs() == end && remaining * travel <= 0.0;
            assert!(
                at_end || remaining.abs() < 1e-12,
                "{curve:e} {slope:e}: {travel:e} {remaining:e}"
            );
            assert_eq!(at_end, slope == 10.0);
        }
    }
}

#[test]
fn contact_that_friction_presses_into_the_floor_sticks() {
    // A tip that slides by x = 0.1 along the floor meets it with the gap −0.004. The matrix of
    // compliances couples both directions by 5.2: friction against the sliding presses the tip down
    // by 0.3 × 5.2 per normal force, more than the normal force lifts it, 0.9. No sliding force
    // satisfies the laws; one sticking force within the cone does.
    let (along, across, normal) = (50.0, 5.2, 0.9);
    let compliance = DMatrix::from_row_slice(
        3,
        3,
        &[along, 0.0, across, 0.0, along, 0.0, across, 0.0, normal],
    );
    for (slip, depth) in [(0.1, 4e-3), (1e-3, 1e-5)] {
        let free = DVector::from_vec(vec![slip, 0.0, -depth]);
        let problem = Reduced {
            surfaces: &Floor,
            compliance: &compliance,
            start: free.clone(),
            present: DVector::zeros(free.len()),
            free,
            scale: 0.0,
        };
        let anchor = (Vector3::zeros(), Vector3::zeros());
        let contacts = problem
            .solve(
                &[LinearContact {
                    anchor,
                    clearance: 0.0,
                    ..contact(0, 0.3, None)
                }],
                false,
            )
            .unwrap_or_else(|| panic!("{slip}"));
        let determinant = along * normal - across * across;
        let force = Vector3::new(
            -across * depth - normal * slip,
            0.0,
            along * depth + across * slip,
        ) / determinant;
        assert_eq!(contacts[0].status, Status::Sticking);
        assert_relative_eq!(contacts[0].force, force, max_relative = 1e-12);
        assert!(force.x.abs() < 0.3 * force.z);
    }
}

#[test]
fn apex_that_slides_along_an_inclined_shoot_is_found_from_its_present_force() {
    // The apex of a shoot hardly moves along the shoot, which is inclined to the plane. The
    // friction across the motion nearly cancels the effect of the normal force, so that small
    // changes of the forces change the direction of the motion much. The compliance is that of a
    // growing shoot. The iteration does not converge from the other guesses.
    let compliance = DMatrix::from_row_slice(
        3,
        3,
        &[
            26.7033421,
            -0.56740237,
            -1.26755737,
            -0.56740237,
            13.9857147,
            12.3449067,
            -1.26755737,
            12.3449067,
            10.9343211,
        ],
    );
    let start = DVector::from_vec(vec![0.0, 0.0, 1.78e-9]);
    let (present, friction) = (Vector3::new(0.3, 0.0, 1.0) * 1.9281008e-3, 0.3);
    // With the present force the apex would move by these distances.
    let free =
        &start + DVector::from_vec(vec![-9.7255e-5, -3.2686e-6, -2.973e-7]) - &compliance * present;
    let problem = Reduced {
        surfaces: &Floor,
        compliance: &compliance,
        start,
        present: DVector::zeros(free.len()),
        free,
        scale: 2e-3,
    };
    let at = LinearContact {
        force: present,
        clearance: 0.0,
        anchor: (Vector3::zeros(), Vector3::zeros()),
        status: Status::Sliding,
        ..contact(0, friction, None)
    };
    let contacts = problem.solve(&[at], false).unwrap();
    // The angle of the friction by bisection: the motion is opposite to it.
    let pushed = |angle: f64| {
        let direction = Vector3::new(friction * angle.cos(), friction * angle.sin(), 1.0);
        let (by, free) = (&compliance * direction, &problem.free);
        let force = direction * (-free[2] / by[2]);
        (
            force,
            free[1] + by[1] * force.z - (free[0] + by[0] * force.z) * angle.tan(),
        )
    };
    let (mut low, mut high) = (0.0, 0.1);
    assert!(pushed(low).1 * pushed(high).1 < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if pushed(middle).1 * pushed(low).1 > 0.0 {
            &mut low
        } else {
            &mut high
        }) = middle;
    }
    // The near-singular compliance amplifies rounding by 1e3.
    assert_relative_eq!(
        contacts[0].force,
        pushed(low).0,
        epsilon = 0.0,
        max_relative = 1e-12
    );
    assert_eq!(contacts[0].status, Status::Sliding);
}
