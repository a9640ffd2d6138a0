//! A time step as a value: its parts are called one after the other.

use nalgebra::{UnitQuaternion, Vector3};

use super::phases::check_slender;
use super::{
    IntegrationError, Outcome, PART_NAMES, PointStep, Run, Statistics, StepInterval, StepPart,
};
use crate::equilibrium::{Equilibrium, EquilibriumSolver};
use crate::error::ParameterError;
use crate::model::{GrowthLaw, Model};
use crate::scene::{Scene, after, before};
use crate::shoot::Shoot;
use crate::state::State;
use crate::support::{Joint, Support};

/// A time step that has begun, with the parts of which an integrator composes it.
///
/// [`TimeStepper::begin`](crate::integrator::TimeStepper::begin) has divided elements, moved the
/// tissue by the growth law to the end of the step, and appended the end to the history of the
/// laws. The other parts follow in this order:
///
/// | part | method | or your own |
/// |---|---|---|
/// | differential growth (4) | [`integrate_intrinsic`](Self::integrate_intrinsic) | [`change_intrinsic`][own] |
/// | shape | [`equilibrate`](Self::equilibrate) | the solver |
/// | stimuli | [`sense`](Self::sense) | |
/// | variables (5), (6) | [`integrate_variables`](Self::integrate_variables) | [`set_variables`](Self::set_variables) |
/// | end | [`finish`](Self::finish) | |
///
/// [own]: Self::change_intrinsic
///
/// Parts may be repeated, for example to correct the strain of an implicit step. A part before
/// which another one is missing returns [`Incomplete`](IntegrationError::Incomplete), and so does
/// `finish` after a part that failed and was not repeated with success. The order of the parts is
/// checked, not whether they are up to date: a strain that is set after `equilibrate` is kept
/// without a new equilibrium. A step that is dropped without `finish`, also after an error,
/// restores the shoot to its state before `begin`. A copy of [`shoot`](Self::shoot) during the step
/// is incomplete. [`MethodOfSteps`](crate::integrator::MethodOfSteps) and
/// [`Adaptive`](crate::integrator::Adaptive) make their steps by the same methods.
#[derive(Debug)]
#[must_use = "a step that is dropped is undone"]
pub struct TimeStep<'a, M, E> {
    run: Run<'a, M, E>,
    step: StepInterval,
    /// The last part that was made; the order of `StepPart` is that of the step.
    reached: StepPart,
    /// The parts that failed and were not repeated with success.
    failed: [bool; PART_NAMES.len()],
    /// State that is restored unless the step is finished; `None` if the caller restores it.
    undo: Option<&'a State>,
}

impl<M, E> Drop for TimeStep<'_, M, E> {
    fn drop(&mut self) {
        if let Some(before) = self.undo {
            self.run.shoot.state.copy_from(before);
        }
    }
}

impl<'a, M: Model, E: EquilibriumSolver> TimeStep<'a, M, E> {
    /// The step that [`Stepper::begin_step`] has begun.
    pub(in crate::integrator) fn new(
        run: Run<'a, M, E>,
        step: StepInterval,
        undo: Option<&'a State>,
    ) -> Self {
        Self {
            run,
            step,
            reached: StepPart::Growth,
            failed: [false; PART_NAMES.len()],
            undo,
        }
    }

    /// The shoot during the step: its lengths are those at the end, and the other quantities those
    /// that were set last.
    #[must_use]
    pub fn shoot(&self) -> &Shoot<M> {
        self.run.shoot
    }

    /// Start and end of the step, s.
    #[must_use]
    pub fn times(&self) -> [f64; 2] {
        [self.step.from, self.step.to]
    }

    /// The material points that are in the growth zone at the start of the step, as indices among
    /// all points of the rod.
    #[must_use]
    pub fn points(&self) -> std::ops::Range<usize> {
        self.run.shoot.state.rod.zone()
    }

    /// Whether the step is not longer than the shortest delay of the laws. The change of the
    /// intrinsic strain then depends only on what is known at the start of the step.
    #[must_use]
    pub fn is_explicit(&self) -> bool {
        self.run.stepper.is_explicit(self.step)
    }

    /// The time in the step during which a point is in the growth zone, s: from the start to its
    /// exit, or to the end. `None` for a point that is outside already.
    #[must_use]
    pub fn growth_interval(&self, point: usize) -> Option<[f64; 2]> {
        let index = point.checked_sub(self.points().start)?;
        let distance = self.run.stepper.places.get(index)?.apex_distance;
        let [from, to] = self.times();
        let [start, end] = self.step.growth;
        let leaves = index < self.step.leaving * self.run.shoot.state.rod.order().points();
        let exit = leaves
            .then(|| {
                self.run
                    .shoot
                    .model
                    .growth()
                    .exit_time(distance, start, end)
            })
            .flatten();
        Some([from, exit.unwrap_or(to)])
    }

    /// The rate of the intrinsic strain of a point, ∂u*/∂t = REGR · gradient, 1/(m s), at a time in
    /// its [interval](Self::growth_interval). Its components are along the directors. The delayed
    /// variables are interpolated in the history. A law may read variables or present stimuli of
    /// the step itself. Until they are set, the variables increase at their rates at the start, and
    /// the stimuli are those at the start.
    ///
    /// # Errors
    /// [`Parameter`](IntegrationError::Parameter) for a point outside the growth zone, and a time
    /// outside the interval; [`NotFinite`](IntegrationError::NotFinite) for a law that returns NaN
    /// or infinity.
    pub fn intrinsic_rate(&mut self, point: usize, time: f64) -> Outcome<Vector3<f64>> {
        let requirement = "that of a point in the growth zone";
        let outside =
            || ParameterError::refused("index of a material point", point as f64, requirement);
        let [from, to] = self.growth_interval(point).ok_or_else(outside)?;
        let requirement = "in the step, before the exit of the point from the growth zone (s)";
        ParameterError::unless(
            time >= from && time <= to,
            "time of a rate of the strain",
            time,
            requirement,
        )?;
        self.run
            .stepper
            .intrinsic_rate(self.run.shoot, self.step, point, time)
    }

    /// Integrates the intrinsic strain over the step, to fourth order. The
    /// [rates](Self::intrinsic_rate) are those at three Gauss points. A step in which a delayed
    /// time passes more than one level of the history is divided at these levels. Returns the
    /// largest change relative to the present intrinsic strain, as an angle over the length of the
    /// shoot, rad.
    ///
    /// # Errors
    /// [`NotFinite`](IntegrationError::NotFinite); [`NotSlender`](IntegrationError::NotSlender) in
    /// an explicit step.
    pub fn integrate_intrinsic(&mut self) -> Outcome<f64> {
        self.make(StepPart::Strain, |this| {
            let change = this
                .run
                .stepper
                .integrate_intrinsic(this.run.shoot, this.step)?;
            this.check_explicit(change)
        })
    }

    /// Sets the intrinsic strain of the points in the growth zone: that at the start of the step
    /// plus the given changes, 1/m, components along the directors, one for each of
    /// [`points`](Self::points). Returns the same change as
    /// [`integrate_intrinsic`](Self::integrate_intrinsic), rad.
    ///
    /// # Errors
    /// [`Parameter`](IntegrationError::Parameter) for another number of changes, and the errors of
    /// [`integrate_intrinsic`](Self::integrate_intrinsic).
    pub fn change_intrinsic(&mut self, changes: &[Vector3<f64>]) -> Outcome<f64> {
        let (counts, requirement) = (
            [changes.len(), self.points().len()],
            "that of the points in the growth zone",
        );
        ParameterError::count("number of changes of strain", counts, requirement)?;
        let finite = changes.iter().all(|change| change.sum().is_finite());
        IntegrationError::finite(finite, "change of the intrinsic strain", self.step.to)?;
        self.run.stepper.changes.clear();
        self.run.stepper.changes.extend_from_slice(changes);
        self.make(StepPart::Strain, |this| {
            let change = this.run.stepper.apply_changes(this.run.shoot);
            this.check_explicit(change)
        })
    }

    /// Returns the change of the strain, or an error if the rod is not slender at the end of an
    /// explicit step. The strain of an implicit step may be corrected later.
    fn check_explicit(&self, change: f64) -> Outcome<f64> {
        if self.is_explicit() {
            check_slender(self.run.shoot, self.step.to)?;
        }
        Ok(change)
    }

    /// Makes a part of the step. One that fails is missing until it is repeated with success.
    fn make<R>(
        &mut self,
        part: StepPart,
        work: impl FnOnce(&mut Self) -> Outcome<R>,
    ) -> Outcome<R> {
        let result = work(self);
        self.failed[part as usize] = result.is_err();
        if result.is_ok() {
            self.reached = self.reached.max(part);
        }
        result
    }

    /// Moves the base to its place at the end of the step, and solves the equilibrium under the
    /// load of that time. The initial guess is extrapolated from earlier equilibria; if no
    /// equilibrium is next to it, the last shape is tried.
    ///
    /// # Errors
    /// [`Incomplete`](IntegrationError::Incomplete) without strain,
    /// [`Equilibrium`](IntegrationError::Equilibrium), and
    /// [`NotFinite`](IntegrationError::NotFinite) for a scene that returns NaN or infinity, and
    /// [`Parameter`](IntegrationError::Parameter) for a frame of the base that is no unit
    /// quaternion.
    pub fn equilibrate(&mut self) -> Outcome<Equilibrium> {
        self.require(StepPart::Strain)?;
        self.make(StepPart::Shape, Self::find_equilibrium)
    }

    fn find_equilibrium(&mut self) -> Outcome<Equilibrium> {
        let first = self.reached < StepPart::Shape;
        let Self { run, step, .. } = self;
        let time = step.end.before();
        if first {
            let state = &mut run.shoot.state;
            state
                .predictor
                .extrapolate(&mut state.rod, &step.moments, step.from, step.to);
        }
        // The first search starts from an extrapolated shape and does not descend to a distant
        // equilibrium, since a snap starts from the last one.
        let omitted = run.stepper.omits_descent;
        run.stepper.omits_descent |= first;
        run.stepper.is_extrapolated = first;
        let found = run.solve_equilibrium(time);
        run.stepper.is_extrapolated = false;
        run.stepper.omits_descent = omitted;
        let found = match found {
            // The last equilibrium is a safer initial guess. A step that locates a change of
            // contact is divided instead.
            Err(error) if error.is_recoverable() && first && !omitted => {
                run.shoot
                    .state
                    .predictor
                    .take_last(&mut run.shoot.state.rod);
                run.solve_equilibrium(time)?
            }
            found => found?,
        };
        run.stepper.record(&found, run.shoot)?;
        Ok(found)
    }

    /// Evaluates the stimuli of the laws at the points in the growth zone, in the shape of the last
    /// equilibrium.
    ///
    /// # Errors
    /// [`Incomplete`](IntegrationError::Incomplete) without an equilibrium in this step, and
    /// [`NotFinite`](IntegrationError::NotFinite).
    pub fn sense(&mut self) -> Outcome {
        self.require(StepPart::Shape)?;
        self.make(StepPart::Stimuli, |this| {
            this.run.stepper.sense(this.run.shoot)
        })
    }

    /// Integrates the variables of the laws over the step, to fourth order, by exponential
    /// collocation with stimuli that are interpolated in time.
    ///
    /// # Errors
    /// [`Incomplete`](IntegrationError::Incomplete) without stimuli,
    /// [`Variables`](IntegrationError::Variables), and [`Parameter`](IntegrationError::Parameter)
    /// for rates that contradict the declaration of the laws.
    pub fn integrate_variables(&mut self) -> Outcome {
        self.require(StepPart::Stimuli)?;
        self.make(StepPart::Variables, |this| {
            this.run
                .stepper
                .integrate_variables(this.run.shoot, this.step)
        })
    }

    /// Sets the variables of the laws at the end of the step: `integrate` is called with each point
    /// of the growth zone, and with its variables, to be changed from those at the start to those
    /// at the end. The rates at the end are those of the laws.
    ///
    /// # Errors
    /// [`Incomplete`](IntegrationError::Incomplete) without stimuli,
    /// [`Variables`](IntegrationError::Variables) for variables or rates that are not finite, and
    /// [`Parameter`](IntegrationError::Parameter) for rates that contradict the declaration of the
    /// laws.
    pub fn set_variables(&mut self, integrate: impl FnMut(&PointStep, &mut [f64])) -> Outcome {
        self.require(StepPart::Stimuli)?;
        self.make(StepPart::Variables, |this| {
            this.run
                .stepper
                .set_variables(this.run.shoot, this.step, integrate)
        })
    }

    /// Ends the step: the tissue outside the growth zone is mature from now on. If a law or the
    /// scene has a discontinuity at the end of the step, the equilibrium and the stimuli after it
    /// are computed. Returns the cost of the step.
    ///
    /// # Errors
    /// [`Incomplete`](IntegrationError::Incomplete) if a part is missing: strain and equilibrium
    /// are needed always, [`sense`](Self::sense) for laws with stimuli, and the variables for laws
    /// with variables. [`NotSlender`](IntegrationError::NotSlender), and the errors of
    /// [`equilibrate`](Self::equilibrate) and [`sense`](Self::sense) at a discontinuity.
    pub fn finish(mut self) -> Outcome<Statistics> {
        let size = self.run.stepper.laws.size();
        self.require(match (size.variables, size.stimuli) {
            (0, 0) => StepPart::Shape,
            (0, _) => StepPart::Stimuli,
            _ => StepPart::Variables,
        })?;
        if let Some((part, _)) = PART_NAMES
            .into_iter()
            .zip(self.failed)
            .find(|(_, failed)| *failed)
        {
            return Err(self.lacks(part));
        }
        if !self.is_explicit() {
            check_slender(self.run.shoot, self.step.to)?;
        }
        let Self { run, step, .. } = &mut self;
        run.stepper.end_step(run.shoot, *step);
        if step.end.discontinuity {
            run.pass_discontinuity(step.end.generation)?;
        }
        self.undo = None;
        Ok(self.run.stepper.statistics)
    }

    /// Returns an error unless a part of the step was made.
    fn require(&self, part: StepPart) -> Outcome {
        if self.reached >= part {
            Ok(())
        } else {
            Err(self.lacks(PART_NAMES[part as usize]))
        }
    }

    /// The error of a step without a part, given by its name.
    fn lacks(&self, missing: &'static str) -> IntegrationError {
        IntegrationError::Incomplete {
            time: self.step.to,
            missing,
        }
    }
}

/// Change of the length of the growth zone by which a law contradicts itself, relative to the
/// length of the shoot. Exit times that are integrated numerically change it by up to 3e-8.
pub(super) const CHANGED_ZONE: f64 = 1e-4;

/// Largest rotation of the base in a step, rad: a third of a turn, rounded down. More is an error
/// of input. The tip of a shoot on a clinostat is accurate with steps of a twentieth of a turn, as
/// the test `clinostat_needs_steps_of_a_twentieth_of_a_rotation` shows.
const LARGEST_BASE_TURN: f64 = 2.0;
/// Times in a step at which the frame of the base is compared, as shares of the step. With them all
/// uniform rotations from a third of a turn to 60 turns in a step are noticed:
/// `steps_in_which_the_base_makes_turns_are_refused`.
const SHARES: [f64; 3] = [0.186, 0.86, 0.993];

/// Returns an error if the scene rotates the base too far in a step between two times (s). A scene
/// does not rotate a base that rotates freely, and of one with a hinge only the axis.
pub(super) fn check_base_turn(shoot: &Shoot<impl Model>, [from, to]: [f64; 2]) -> Outcome {
    let (scene, joint) = (shoot.model.scene(), shoot.model.support().base());
    let turn = |a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>| match joint {
        None => a.angle_to(b),
        Some(Joint::Hinge(axis)) => (a * axis).angle(&(b * axis)),
        Some(Joint::Ball | Joint::Free) => 0.0,
    };
    let [a, b, c] = SHARES.map(|share| scene.base(from + share * (to - from)));
    let frames = [scene.base(after(from)), a, b, c, scene.base(before(to))];
    let angle = frames
        .windows(2)
        .map(|pair| turn(&pair[0], &pair[1]))
        .sum::<f64>();
    // A frame that is not finite is an error of its own.
    if angle > LARGEST_BASE_TURN {
        Err(IntegrationError::BaseTurns { time: to, angle })
    } else {
        Ok(())
    }
}
