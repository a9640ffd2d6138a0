//! Branches that are refused, or that end with an error of their family.

use super::branches::{CROSSING, Keen, ONSET, circle, sensing, swing_solver};
use super::{family, mode};
use morphorod::cycle::{Continuation, CycleError, RotatingWaveSolver};
use morphorod::tropism::SettledStatoliths;

fn assert_refused(answer: Result<(), CycleError>) {
    assert!(
        matches!(answer, Err(CycleError::Parameter(_))),
        "{answer:?}"
    );
}

#[test]
fn invalid_ranges_and_amplitudes_of_a_branch_from_the_onset_are_refused() {
    let from = |parameter, amplitude, within| {
        let mut onset = *CROSSING;
        onset.parameters = [parameter];
        Continuation::from_onset(
            RotatingWaveSolver::default(),
            sensing(Keen, 4),
            &onset,
            amplitude,
            within,
        )
        .map(|_| ())
    };
    assert_refused(from(ONSET, 0.0, 0.06..=0.07));
    assert_refused(from(ONSET, f64::NAN, 0.06..=0.07));
    assert_refused(from(ONSET, 2e-3, 0.07..=0.06));
    assert_refused(from(ONSET, 2e-3, 0.06..=0.065));
    assert_refused(from(ONSET, 2e-3, 0.06..=f64::INFINITY));
    assert_refused(from(f64::NAN, 2e-3, 0.06..=0.07));
    // Circles with this perception exist below the onset. The first one lies outside this range.
    assert_refused(from(ONSET, 2e-3, ONSET..=0.066));
    // The exponents of such a small circle cannot be distinguished from those that vanish by
    // symmetry.
    assert_refused(from(ONSET, 1e-4, 0.06..=0.066));
    // Far below the onset no root is next to that of the crossing.
    assert!(from(0.05, 2e-3, 0.05..=0.051).is_err());
}

#[test]
fn invalid_steps_and_elements_of_a_branch_from_an_orbit_are_refused() {
    let (_, orbit) = circle(4);
    let branch = |elements, step| {
        let shoots = sensing(SettledStatoliths, elements);
        Continuation::from_orbit(
            RotatingWaveSolver::default(),
            shoots,
            &orbit,
            0.067,
            step,
            0.066..=0.068,
        )
    };
    assert_refused(branch(4, 0.0).map(|_| ()));
    assert_refused(branch(4, f64::NAN).map(|_| ()));
    assert_refused(branch(5, 1e-4).map(|_| ()));
    let mut valid = branch(4, 1e-4).unwrap();
    assert!(valid.next().unwrap().is_ok());
    assert!(valid.largest_step(0.0).is_err());
}

/// Family without shoots in a part of the range. The branch ends with the error that the family
/// returns.
#[test]
fn errors_of_the_family_end_the_branch() {
    let (_, orbit) = circle(3);
    let ends = family(|length| {
        if length < 0.0675 {
            sensing(SettledStatoliths, 3)(length)
        } else {
            Err(CycleError::Elongates)
        }
    });
    let branch = Continuation::from_orbit(
        RotatingWaveSolver::default(),
        ends,
        &orbit,
        0.067,
        1e-4,
        0.066..=0.068,
    );
    let answers: Vec<_> = branch.unwrap().collect();
    assert!(matches!(answers.last(), Some(Err(CycleError::Elongates))));
    assert!(answers.iter().rev().skip(1).all(Result::is_ok) && answers.len() > 2);
}

/// Families whose number of material points changes. The change occurs either at the finite
/// difference of the first point or farther along the branch.
#[test]
fn families_that_change_their_number_of_points_are_refused() {
    let first = sensing(SettledStatoliths, 3)(0.067).unwrap();
    let swing = swing_solver()
        .from_mode(&first, &mode(&first), 0.03)
        .unwrap();
    for change in [0.067 + 1e-9, 0.0672] {
        let growing = family(move |length| {
            sensing(SettledStatoliths, if length > change { 4 } else { 3 })(length)
        });
        let last =
            Continuation::from_orbit(swing_solver(), growing, &swing, 0.067, 1e-4, 0.066..=0.068);
        let last = last.map_or_else(
            |error| error,
            |branch| branch.filter_map(Result::err).last().unwrap(),
        );
        assert!(
            matches!(last, CycleError::Parameter(_)),
            "{change}: {last:?}"
        );
    }
}
