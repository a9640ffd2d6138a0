//! Cost and error estimates of a run.

use crate::equilibrium::Equilibrium;

/// Cost of a run, and estimates of its accuracy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Statistics {
    /// Number of time steps, not counting the extra equilibria at output times. A step that is
    /// divided where a contact begins or ends counts as one.
    pub steps: usize,
    /// Number of equilibria that were solved.
    pub equilibria: usize,
    /// Number of Newton iterations of all equilibria.
    pub iterations: usize,
    /// Number of factorisations of the Jacobian in all equilibria.
    pub factorisations: usize,
    /// Number of evaluations of energy and gradient without the Jacobian.
    pub evaluations: usize,
    /// Number of divisions of an element.
    pub splits: usize,
    /// Number of mergers of two elements.
    pub merges: usize,
    /// Number of intervals that were halved in the integration of the laws' variables.
    pub halvings: usize,
    /// Number of steps that were repeated with half their length after a recoverable error.
    pub retries: usize,
    /// Number of times at which a contact began or ended and which were located. They are ends of
    /// steps.
    pub contact_changes: usize,
    /// Number of steps that were made to locate these times and then undone.
    pub contact_trials: usize,
    /// Number of snaps: steps in which the shape jumped to another equilibrium
    /// ([`Equilibrium::jump`]). The quasi-static model does not resolve the motion in between. In a
    /// free rod a jump does not count if the unbalanced couples of the initial guess cause at least
    /// a fifth of the rotation, so that the number of snaps depends on the length of the steps. In a
    /// rod with supports a jump is resolved in increments of the motion of holds, base and
    /// obstacles. If nothing moves but the rod itself, it is judged for the whole step.
    pub snaps: usize,
    /// End of the step with the last snap, s; `None` without a snap.
    pub last_snap: Option<f64>,
    /// Largest displacement by a snap, m: that of the tip, or of any place of a shoot with
    /// supports; zero without a snap.
    pub largest_jump: f64,
    /// Number of steps of trial runs, and of steps to output times that are not ends of steps. The
    /// other costs of trial runs are included in the other counts.
    pub trial_steps: usize,
    /// Estimate of the largest distance between a place of the centre line and the place of the
    /// exact one at the same share of the length, at any time of the call, relative to the length
    /// at that time. It has a safety factor of two, and contains the estimates of earlier calls.
    /// `None` if the integrator does not estimate it, as [`MethodOfSteps`](super::MethodOfSteps).
    pub error: Option<f64>,
    /// Largest [error](Equilibrium::error) of an equilibrium, rad: that of the solver, without the
    /// errors of steps and elements. With obstacles it is at least the largest penetration relative
    /// to the length, and it contains the misplacement of nodes at contacts that
    /// [`Equilibrium::error`] describes. Equilibria of steps that were undone do not count.
    pub equilibrium_error: f64,
    /// Smallest merge tolerance that permits the same mergers, rad.
    pub(super) merge_loss: f64,
}

impl std::fmt::Display for Statistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} steps, {} trial steps, ",
            self.steps, self.trial_steps
        )?;
        write!(
            f,
            "{} equilibria, {} iterations, {} evaluations",
            self.equilibria, self.iterations, self.evaluations
        )?;
        if self.snaps > 0 {
            write!(
                f,
                ", {} snaps by up to {:.1e} m",
                self.snaps, self.largest_jump
            )?;
        }
        self.error.map_or(Ok(()), |error| {
            write!(f, ", estimated error {error:.1e} of the length")
        })
    }
}

/// Adds the statistics of a later run. Counts add, `last_snap` is the later one, and errors, losses
/// and the largest jump are the larger ones.
impl std::ops::AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        // The sums saturate, since an integrator or a solver of a user may report any counts.
        let counts = [
            (&mut self.steps, other.steps),
            (&mut self.equilibria, other.equilibria),
            (&mut self.iterations, other.iterations),
            (&mut self.factorisations, other.factorisations),
            (&mut self.evaluations, other.evaluations),
            (&mut self.splits, other.splits),
            (&mut self.merges, other.merges),
            (&mut self.halvings, other.halvings),
            (&mut self.retries, other.retries),
            (&mut self.contact_changes, other.contact_changes),
            (&mut self.contact_trials, other.contact_trials),
            (&mut self.snaps, other.snaps),
            (&mut self.trial_steps, other.trial_steps),
        ];
        counts
            .into_iter()
            .for_each(|(sum, count)| *sum = sum.saturating_add(count));
        self.last_snap = other.last_snap.or(self.last_snap);
        self.largest_jump = self.largest_jump.max(other.largest_jump);
        // Each estimate includes all calls since the beginning of the run.
        self.error = [self.error, other.error]
            .into_iter()
            .flatten()
            .reduce(f64::max);
        self.merge_loss = self.merge_loss.max(other.merge_loss);
        self.equilibrium_error = self.equilibrium_error.max(other.equilibrium_error);
    }
}

impl Statistics {
    /// Number of evaluations of the forces in the rod, with and without the Jacobian. It is the
    /// measure of work that the integrators limit.
    #[must_use]
    pub fn work(&self) -> usize {
        self.factorisations.saturating_add(self.evaluations)
    }

    /// Adds the cost and the error estimate of an equilibrium.
    pub(super) fn add_equilibrium(&mut self, found: &Equilibrium) {
        *self += Self {
            equilibria: 1,
            iterations: found.iterations,
            factorisations: found.factorisations,
            evaluations: found.evaluations,
            equilibrium_error: found.error,
            ..Self::default()
        };
    }

    /// Counts a snap in a step that ends at `time` (s), once for each step.
    pub(super) fn add_snap(&mut self, time: f64, jump: f64) {
        self.snaps += usize::from(self.last_snap.replace(time) != Some(time));
        self.largest_jump = self.largest_jump.max(jump);
    }

    /// Returns the statistics of a run whose result is discarded. The error of its equilibria is
    /// kept, since its shapes may have been shown.
    pub(super) fn as_trial(self) -> Self {
        let (trial_steps, equilibrium_error) = (
            self.trial_steps.saturating_add(self.steps),
            self.equilibrium_error,
        );
        Self {
            trial_steps,
            equilibrium_error,
            ..self.undone_since(Self::default())
        }
    }

    /// Returns the results that `then` counts, with the cost that `self` counts.
    pub(super) fn undone_since(self, then: Self) -> Self {
        let Self {
            steps,
            splits,
            merges,
            merge_loss,
            equilibrium_error,
            ..
        } = then;
        let Self {
            contact_changes,
            snaps,
            last_snap,
            largest_jump,
            ..
        } = then;
        let kept = Self {
            steps,
            splits,
            merges,
            merge_loss,
            equilibrium_error,
            ..self
        };
        Self {
            contact_changes,
            snaps,
            last_snap,
            largest_jump,
            ..kept
        }
    }
}
