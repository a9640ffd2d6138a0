//! Phases of a step: differential growth, equilibrium, sensing, and the laws' variables. The motion of tissue
//! is in `elongation`.

use nalgebra::Vector3;

use super::collocation::Levels;
use super::transient::smooth_levels;
use super::{IntegrationError, Outcome, PointStep, ROUNDING, StepInterval, Stepper};
use crate::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, HeldRod, IncrementStart, check_balance};
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::{Environment, Scene};
use crate::sensing;
use crate::shoot::Shoot;
use crate::state::{LEVELS, Nodes, State};
use crate::support::{Joint, Support};
use crate::tropism::{Declaration, Growing, Site, TropismLaw};

/// Name of the rates of variables in errors. The default of [`TropismLaw::rates`] is NaN.
pub(super) const RATE: &str = "rate of a variable of the tropism laws, which `TropismLaw::rates` writes,";

/// Name of the gradients of the laws in errors.
const GRADIENT: &str = "growth gradient";

impl Stepper {
    /// Integrates the intrinsic strain of every point of the zone over the step, up to the exit of the point.
    /// Returns the largest difference from the present intrinsic strain of a point, as an angle over the length
    /// of the shoot, rad.
    pub(super) fn integrate_intrinsic(&mut self, shoot: &mut Shoot<impl Model>, step: StepInterval) -> Outcome<f64> {
        let (growth, tropism, state) = (shoot.model.growth(), shoot.model.tropism(), &mut shoot.state);
        check_size(&self.laws, tropism)?;
        let StepInterval { from, to, leaving, growth: [start, end] } = step;
        let history = &state.history;
        let (smooth, transient) = smooth_levels(state, &self.laws, to - from);
        let (zone, leaving) = (state.rod.zone(), leaving * state.rod.order().points());
        self.gradient_integral.prepare(history, &self.laws, (&smooth, transient), [from, to]);
        let points = &state.rod.points()[zone];
        self.places.clear();
        let places = points.iter().zip(&self.starts);
        self.places.extend(places.map(|(point, (_, distance))| Growing::of(point, start, *distance)));
        self.changes.clear();
        self.changes.resize(points.len(), Vector3::zeros());
        let laws = (growth, tropism);
        // The points that leave the zone come first, and each has an end of its own.
        let leaving = leaving.min(points.len());
        for i in 0..leaving {
            let (place, change) = (&self.places[i..=i], &mut self.changes[i..=i]);
            match growth.exit_time(place[0].apex_distance, start, end) {
                Some(exit) => {
                    self.exit_integral.prepare(history, &self.laws, (&smooth, transient), [from, exit]);
                    self.exit_integral.add(laws, history, (i, start), place, change);
                }
                None => self.gradient_integral.add(laws, history, (i, start), place, change),
            }
        }
        let (places, changes) = (&self.places[leaving..], &mut self.changes[leaving..]);
        self.gradient_integral.add(laws, history, (leaving, start), places, changes);
        if let Some(i) = self.changes.iter().position(|change| !change.sum().is_finite()) {
            // A point that leaves the zone in the step is examined at all times of the step.
            let point = (&self.places[i], state.rod.length());
            let undefined = self.gradient_integral.undefined(laws, history, (i, start), point);
            return Err(undefined.unwrap_or(IntegrationError::NotFinite { what: GRADIENT, time: to }));
        }
        Ok(self.apply_changes(shoot))
    }

    /// Sets the intrinsic strain of the points of the zone to that at the start of the step plus the changes. Returns
    /// the largest difference from the present one as an angle over the length of the shoot, rad.
    pub(super) fn apply_changes(&self, shoot: &mut Shoot<impl Model>) -> f64 {
        let rod = &mut shoot.state.rod;
        let (length, zone) = (rod.length(), rod.zone());
        let mut largest = 0.0_f64;
        for ((point, (intrinsic, _)), change) in rod.points[zone].iter_mut().zip(&self.starts).zip(&self.changes) {
            let new = intrinsic + change;
            largest = largest.max((new - point.intrinsic).norm());
            point.intrinsic = new;
        }
        largest * length
    }

    /// Evaluates the rate of the intrinsic strain of a point of the zone, given by its index among all points, at a
    /// `time` (s) in a step, 1/(m s).
    pub(super) fn intrinsic_rate(
        &mut self,
        shoot: &Shoot<impl Model>,
        step: StepInterval,
        point: usize,
        time: f64,
    ) -> Outcome<Vector3<f64>> {
        let (growth, tropism, state) = (shoot.model.growth(), shoot.model.tropism(), &shoot.state);
        check_size(&self.laws, tropism)?;
        let StepInterval { from, to, growth: [start, end], .. } = step;
        let (smooth, transient) = smooth_levels(state, &self.laws, to - from);
        // Laws are evaluated after a discontinuity at the start, and before one at the end.
        let time = time.clamp(start, end);
        self.gradient_integral.prepare_rate(&state.history, &self.laws, (&smooth, transient), time);
        let index = point - state.rod.zone().start;
        let place = [Growing::of(&state.rod.points()[point], start, self.starts[index].1)];
        let mut rate = [Vector3::zeros()];
        self.gradient_integral.add((growth, tropism), &state.history, (index, start), &place, &mut rate);
        if rate[0].sum().is_finite() {
            return Ok(rate[0]);
        }
        let (laws, point) = ((growth, tropism), (&place[0], state.rod.length()));
        let undefined = self.gradient_integral.undefined(laws, &state.history, (index, start), point);
        Err(undefined.unwrap_or(IntegrationError::NotFinite { what: GRADIENT, time }))
    }

    /// Moves the base to its position and frame at `time` (s), and solves the equilibrium under the load and the
    /// environment of that time.
    pub fn solve_equilibrium(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        time: f64,
    ) -> Outcome<Equilibrium> {
        let environment = self.move_base(shoot, time)?;
        let (model, rod) = (&shoot.model, &mut shoot.state.rod);
        if !model.support().is_absent() {
            return self.solve_held(shoot, solver, &environment);
        }
        let material = model.constitutive();
        self.force.update(rod, model.load(), &environment);
        let examined = !solver.is_trusted();
        if examined {
            // A solver that changes material points does so from the start: later comparisons would cost time.
            self.unshaped.keep(rod, self.statistics.equilibria == 0);
        }
        let found = solver.equilibrate(rod, material, &self.force).and_then(|found| {
            if examined {
                // The history belongs to these elements, and the scene determines the base.
                self.unshaped.changed(rod).map_or(Ok(()), |what| Err(EquilibriumError::Changed { what }))?;
                found.check()?;
                check_balance(rod, material, &self.force, found.error)?;
            }
            Ok(found)
        });
        found.map_err(|error| IntegrationError::Equilibrium { time, error })
    }

    /// Moves the base to its position and frame at `time` (s), and returns the environment of that time.
    pub(super) fn move_base(&self, shoot: &mut Shoot<impl Model>, time: f64) -> Outcome<Environment> {
        // Until the first equilibrium, a base with a joint is where the scene has it.
        let started = shoot.state.history.levels() > 0 || !shoot.state.rod.reactions().is_empty();
        let model = &shoot.model;
        let scene = model.scene();
        let (base, position, environment) = (scene.base(time), scene.position(time), scene.environment(time));
        if !base.norm().is_finite() {
            return Err(IntegrationError::NotFinite { what: "frame of the base", time });
        }
        ParameterError::unit("norm of the base frame's quaternion", base.norm())?;
        if !environment.gravity.norm().is_finite() {
            return Err(IntegrationError::NotFinite { what: "gravity", time });
        }
        shoot.state.gravity = environment.gravity;
        let base_joint = model.support().base().filter(|_| started);
        let rod = &mut shoot.state.rod;
        if base_joint != Some(Joint::Free) && !position.sum().is_finite() {
            return Err(IntegrationError::NotFinite { what: "position of the base", time });
        }
        rod.place_base((base, position), base_joint)?;
        Ok(environment)
    }

    /// Solves the equilibrium of a shoot with a support.
    fn solve_held(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        environment: &Environment,
    ) -> Outcome<Equilibrium> {
        let (model, State { rod, contact, .. }) = (&shoot.model, &mut shoot.state);
        let (material, load, support) = (model.constitutive(), model.load(), model.support());
        let (reactions, patches) = contact.predicted(rod.reactions(), environment.time);
        let earlier = (&reactions[..], &patches[..]);
        let (shape, start, omits_descent) = (contact.shape.as_ref(), self.increment_start.as_ref(), self.omits_descent);
        let held =
            solver.hold(&HeldRod { rod, material, load, support, environment, earlier, shape, start, omits_descent });
        let held = held.map_err(|error| IntegrationError::Equilibrium { time: environment.time, error })?;
        self.force.update(&held.rod, load, environment);
        self.force.react(&held.rod, &held.reactions);
        contact.take(held.patches, [rod.reactions(), &held.reactions], environment.time);
        if held.rod.elements() == rod.elements() {
            rod.copy_shape(&held.rod);
            contact.shape = None;
        } else {
            rod.sample_shape(&held.rod);
            contact.shape = Some(held.rod);
        }
        Ok(held.equilibrium)
    }

    /// Keeps shape and reactions at the start of an increment, from which the search for contacts begins and friction
    /// counts displacements.
    pub(in crate::integrator) fn begin_increment(&mut self, shoot: &Shoot<impl Model>) {
        let touches = !shoot.model.support().contacts().is_empty();
        self.increment_start = touches.then(|| IncrementStart {
            rod: shoot.state.shape().clone(),
            time: shoot.state.time,
            reactions: shoot.reactions().to_vec(),
            patches: shoot.state.contact.patches.clone(),
        });
    }

    /// Writes the stimuli in the present equilibrium to the last level.
    pub(super) fn sense(&mut self, shoot: &mut Shoot<impl Model>) -> Outcome {
        if self.laws.size().stimuli == 0 {
            return Ok(());
        }
        check_size(&self.laws, shoot.model.tropism())?;
        let State { rod, history, contact, .. } = &mut shoot.state;
        let time = self.force.environment().time;
        let last = history.levels() - 1;
        self.visit_stimuli((rod, contact.shape.as_ref()), &shoot.model, time, |i, _, stimuli| {
            history.at_mut(last, i).stimuli.copy_from_slice(stimuli);
        })
    }

    /// Evaluates the stimuli at all points of the zone in the present equilibrium, as
    /// [`sensing::visit_stimuli`]. Returns an error with the given `time` (s) if one is not finite.
    pub(super) fn visit_stimuli(
        &mut self,
        rod: (&Rod, Option<&Rod>),
        model: &impl Model,
        time: f64,
        mut visit: impl FnMut(usize, &Site, &[f64]),
    ) -> Outcome {
        let (laws, position, mut finite) = ((model.constitutive(), model.tropism()), self.laws.reads_position(), true);
        sensing::visit_stimuli(rod, laws, &self.force, position, &mut self.stimuli, |i, site, stimuli| {
            finite &= stimuli.iter().all(|x| x.is_finite());
            visit(i, site, stimuli);
        });
        let what = "stimulus of a tropism law (a law that reads its position must declare `with_position`)";
        if finite { Ok(()) } else { Err(IntegrationError::NotFinite { what, time }) }
    }

    /// Integrates the laws' variables from the last level but one to the last. In an explicit step nothing depends on
    /// those of the points that leave the zone in it.
    pub(super) fn integrate_variables(&mut self, shoot: &mut Shoot<impl Model>, step: StepInterval) -> Outcome {
        if self.laws.size().variables == 0 {
            return Ok(());
        }
        let (tropism, state) = (shoot.model.tropism(), &mut shoot.state);
        check_size(&self.laws, tropism)?;
        let size = step.to - step.from;
        let (smooth, transient) = smooth_levels(state, &self.laws, size);
        let count = smooth.len();
        // Times in units of the step, from its start.
        let mut times = [0.0; LEVELS];
        for (time, level) in times.iter_mut().zip(smooth.iter()) {
            *time = (state.history.time(*level) - step.from) / size;
        }
        times[count - 1] = 1.0;
        let transient = transient.map(|tau| tau / size);
        self.collocation.prepare(&self.laws, size, Levels { count, times, transient });
        let unread = if self.is_explicit(step) { step.leaving * state.rod.order().points() } else { 0 };
        let collocation = &mut self.collocation;
        integrate_points(
            (state, tropism),
            &self.laws,
            (&smooth, unread),
            step.to,
            |_, [_, rates], stimuli, variables| collocation.integrate(tropism, stimuli, variables, rates),
        )
    }

    /// Sets the variables at the last level by a function of those at the level before and of the stimuli at both, for
    /// each point of the zone, and evaluates their rates.
    pub(super) fn set_variables(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        step: StepInterval,
        mut integrate: impl FnMut(&PointStep, &mut [f64]),
    ) -> Outcome {
        let (tropism, state) = (shoot.model.tropism(), &mut shoot.state);
        check_size(&self.laws, tropism)?;
        if self.laws.size().variables == 0 {
            return Ok(());
        }
        let levels = state.history.smooth(2, f64::NEG_INFINITY, 0.0);
        let set = |point: usize, [before, rates]: [&[f64]; 2], stimuli: &[&[f64]; LEVELS], variables: &mut [f64]| {
            let stimuli = [stimuli[0], stimuli[1]];
            integrate(&PointStep { point, variables: before, rates, stimuli, law: tropism }, variables);
            variables.iter().all(|number| number.is_finite())
        };
        integrate_points((state, tropism), &self.laws, (&levels, 0), step.to, set)
    }

    /// Returns whether a step is not longer than the shortest delay, and depends only on the past.
    pub(super) fn is_explicit(&self, step: StepInterval) -> bool {
        step.to - step.from <= self.laws.shortest_delay() * (1.0 + ROUNDING)
    }

    /// Evaluates the rates of the variables at the last level.
    pub(super) fn evaluate_rates(&self, shoot: &mut Shoot<impl Model>) {
        let tropism = shoot.model.tropism();
        for point in shoot.state.history.each_present() {
            // A rate that a law does not write is NaN, and is detected later.
            point.rates.fill(f64::NAN);
            tropism.rates(point.variables, point.stimuli, point.rates);
        }
    }
}

/// Returns an error if laws have changed their declaration.
fn check_size(laws: &Declaration, tropism: &impl TropismLaw) -> Result<(), ParameterError> {
    let (now, before) = (tropism.size(), laws.size());
    let requirement = "the same throughout a call";
    for (name, counts) in [
        ("number of variables that the tropism laws declare", [now.variables, before.variables]),
        ("number of stimuli that the tropism laws declare", [now.stimuli, before.stimuli]),
        ("number of reads of present stimuli", [now.reads_present.into(), before.reads_present.into()]),
    ] {
        ParameterError::count(name, counts, requirement)?;
    }
    Ok(())
}

/// Sets the variables at the last level, at the time `to` (s), for each point of the zone but the first `unread` ones,
/// and evaluates their rates. `integrate` is called with the index of the point in the rod, its variables and their
/// rates at the level before, its stimuli at `levels`, and the variables to be changed, which are those before. It
/// returns whether it succeeds.
fn integrate_points<T: TropismLaw>(
    (state, tropism): (&mut State, &T),
    laws: &Declaration,
    (levels, unread): (&Nodes, usize),
    to: f64,
    mut integrate: impl FnMut(usize, [&[f64]; 2], &[&[f64]; LEVELS], &mut [f64]) -> bool,
) -> Outcome {
    let (first, last) = (state.rod.zone().start, levels.len() - 1);
    let (mut points, mut check, mut defined) = (first + unread.., Ok(()), true);
    let integrated = state.history.each_step((levels, unread), |before, stimuli, variables, rates| {
        variables.copy_from_slice(before[0]);
        let succeeded = points.next().is_some_and(|point| integrate(point, before, stimuli, variables));
        rates.fill(f64::NAN);
        tropism.rates(variables, stimuli[last], rates);
        // The integration and the analysis of stability use the declaration of the laws. It is compared with the rates
        // in every step.
        let finite = succeeded && rates.iter().all(|rate| rate.is_finite());
        if finite {
            check = laws.check_rates(variables, rates, stimuli[last]);
        } else {
            tropism.rates(before[0], stimuli[last], rates);
            defined = rates.iter().all(|rate| rate.is_finite());
        }
        finite && check.is_ok()
    });
    integrated.or_else(|point| {
        // More specific errors take precedence.
        check_size(laws, tropism)?;
        check?;
        if !defined {
            return Err(IntegrationError::NotFinite { what: RATE, time: to });
        }
        Err(IntegrationError::Variables { time: to, point: first + point })
    })
}

/// Returns an error if the radius of the intrinsic curvature at a point of the growth zone is not larger than that of
/// the section, at `time` (s). In an elliptic section the distance of the surface on the inner side of the bend
/// counts.
pub(super) fn check_slender(shoot: &Shoot<impl Model>, time: f64) -> Outcome {
    let rod = &shoot.state.rod;
    for point in &rod.points()[rod.zone()] {
        let (u, section) = (&point.intrinsic, &point.section);
        // The square costs less than its root, and this is examined in every step.
        let square = (u.x * section.along_d2).powi(2) + (u.y * section.along_d1).powi(2);
        if square >= 1.0 {
            let (curvature, arc_length) = (u.xy().norm(), rod.length() - point.apex_distance);
            return Err(IntegrationError::NotSlender {
                time,
                arc_length,
                curvature,
                radius: square.sqrt() / curvature,
            });
        }
    }
    Ok(())
}
