//! Phases of a step: differential growth, equilibrium, sensing, and the integration of the laws'
//! variables. The module `elongation` contains the motion of tissue.

use nalgebra::Vector3;

use super::collocation::Levels;
use super::{IntegrationError, Outcome, PointStep, ROUNDING, Run, StepInterval, Stepper};
use crate::equilibrium::{
    Equilibrium, EquilibriumError, EquilibriumSolver, HeldRod, IncrementStart, Past, check_balance,
};
use crate::error::ParameterError;
use crate::model::{GrowthLaw, Model};
use crate::rod::Rod;
use crate::scene::{Environment, Scene};
use crate::sensing;
use crate::shoot::Shoot;
use crate::state::{LEVELS, Nodes, State};
use crate::support::{Joint, Support};
use crate::tropism::{Declaration, Site, TropismLaw};

/// Name of the rates of variables in errors. The default of [`TropismLaw::rates`] is NaN.
pub(super) const RATE: &str =
    "rate of a variable of the tropism laws, which `TropismLaw::rates` writes,";

impl Stepper {
    /// Integrates the intrinsic strain of every point of the zone over the step, up to the exit of
    /// the point. Returns the largest difference from the present intrinsic strain of a point, as
    /// an angle over the length of the shoot, rad.
    pub(super) fn integrate_intrinsic(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        step: StepInterval,
    ) -> Outcome<f64> {
        let (growth, tropism, state) = (shoot.model.growth(), shoot.model.tropism(), &shoot.state);
        check_size(&self.laws, tropism)?;
        let StepInterval {
            from,
            to,
            leaving,
            growth: [start, end],
            ..
        } = step;
        let (laws, history) = ((growth, tropism), &state.history);
        self.changes.clear();
        self.changes.resize(self.places.len(), Vector3::zeros());
        // The points that leave the zone come first, and each has an end of its own.
        let leaving = (leaving * state.rod.order().points()).min(self.places.len());
        for i in 0..leaving {
            let (place, change) = (&self.places[i..=i], &mut self.changes[i..=i]);
            let exit = growth
                .exit_time(place[0].apex_distance, start, end)
                .unwrap_or(to);
            self.gradient_integral.prepare(history, [from, exit]);
            self.gradient_integral
                .add(laws, history, (i, start), place, change);
        }
        self.gradient_integral.prepare(history, [from, to]);
        let (places, changes) = (&self.places[leaving..], &mut self.changes[leaving..]);
        self.gradient_integral
            .add(laws, history, (leaving, start), places, changes);
        if let Some(i) = self
            .changes
            .iter()
            .position(|change| !change.sum().is_finite())
        {
            // A point that leaves the zone in the step is examined at all times of the step.
            let point = (&self.places[i], state.rod.length());
            return Err(self
                .gradient_integral
                .undefined(laws, history, (i, [start, to]), point));
        }
        Ok(self.apply_changes(shoot))
    }

    /// Sets the intrinsic strain of the points of the zone to that at the start of the step plus
    /// the changes. Returns the largest difference from the present one as an angle over the length
    /// of the shoot, rad.
    pub(super) fn apply_changes(&self, shoot: &mut Shoot<impl Model>) -> f64 {
        let rod = &mut shoot.state.rod;
        let (length, zone) = (rod.length(), rod.zone());
        let mut largest = 0.0_f64;
        for ((point, intrinsic), change) in rod.points[zone]
            .iter_mut()
            .zip(&self.starts)
            .zip(&self.changes)
        {
            let new = intrinsic + change;
            largest = largest.max((new - point.intrinsic).norm());
            point.intrinsic = new;
        }
        largest * length
    }

    /// Evaluates the rate of the intrinsic strain of a point of the zone, given by its index among
    /// all points, at a `time` (s) in a step, 1/(m s).
    pub(super) fn intrinsic_rate(
        &mut self,
        shoot: &Shoot<impl Model>,
        step: StepInterval,
        point: usize,
        time: f64,
    ) -> Outcome<Vector3<f64>> {
        let (growth, tropism, state) = (shoot.model.growth(), shoot.model.tropism(), &shoot.state);
        check_size(&self.laws, tropism)?;
        let [start, end] = step.growth;
        // Laws are evaluated after a discontinuity at the start, and before one at the end.
        let time = time.clamp(start, end);
        self.gradient_integral.prepare_rate(&state.history, time);
        let (laws, index, mut rate) = (
            (growth, tropism),
            point - state.rod.zone().start,
            [Vector3::zeros()],
        );
        self.gradient_integral.add(
            laws,
            &state.history,
            (index, start),
            &self.places[index..=index],
            &mut rate,
        );
        if rate[0].sum().is_finite() {
            return Ok(rate[0]);
        }
        let point = (&self.places[index], state.rod.length());
        Err(self
            .gradient_integral
            .undefined(laws, &state.history, (index, [start, time]), point))
    }

    /// Moves the base to its position and frame at `time` (s), and returns the environment of that
    /// time.
    pub(super) fn move_base(
        &self,
        shoot: &mut Shoot<impl Model>,
        time: f64,
    ) -> Outcome<Environment> {
        // Until the first equilibrium, a base with a joint is where the scene has it.
        let started = shoot.state.history.levels() > 0 || !shoot.state.rod.reactions().is_empty();
        let model = &shoot.model;
        let scene = model.scene();
        let (base, position, environment) = (
            scene.base(time),
            scene.position(time),
            scene.environment(time),
        );
        IntegrationError::finite(base.norm().is_finite(), "frame of the base", time)?;
        ParameterError::unit("norm of the base frame's quaternion", base.norm())?;
        IntegrationError::finite(environment.gravity.norm().is_finite(), "gravity", time)?;
        shoot.state.gravity = environment.gravity;
        let base_joint = model.support().base().filter(|_| started);
        let rod = &mut shoot.state.rod;
        let placed = base_joint == Some(Joint::Free) || position.sum().is_finite();
        IntegrationError::finite(placed, "position of the base", time)?;
        rod.place_base((base, position), base_joint)?;
        Ok(environment)
    }

    /// Stores shape and reactions at the start of an increment. The search for contacts begins
    /// there, and friction acts on the displacement since then.
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
        let State {
            rod,
            history,
            contact,
            ..
        } = &mut shoot.state;
        let time = self.force.environment().time;
        let last = history.levels() - 1;
        self.visit_stimuli(
            (rod, contact.shape.as_ref()),
            &shoot.model,
            time,
            |i, _, stimuli| {
                history.at_mut(last, i).stimuli.copy_from_slice(stimuli);
            },
        )
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
        let (laws, position, mut finite) = (
            (model.constitutive(), model.tropism()),
            self.laws.reads_position(),
            true,
        );
        sensing::visit_stimuli(
            rod,
            laws,
            &self.force,
            position,
            &mut self.stimuli,
            |i, site, stimuli| {
                finite &= stimuli.iter().all(|x| x.is_finite());
                visit(i, site, stimuli);
            },
        );
        let what = "stimulus of a tropism law (a law that reads its position must declare `with_position`)";
        IntegrationError::finite(finite, what, time)
    }

    /// Integrates the laws' variables from the last level but one to the last. In an explicit step
    /// nothing depends on those of the points that leave the zone in it.
    pub(super) fn integrate_variables(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        step: StepInterval,
    ) -> Outcome {
        if self.laws.size().variables == 0 {
            return Ok(());
        }
        let (tropism, state) = (shoot.model.tropism(), &mut shoot.state);
        check_size(&self.laws, tropism)?;
        let size = step.to - step.from;
        let (
            smooth,
            Levels {
                count,
                times,
                transient,
            },
        ) = step.levels;
        // Times in units of the step, from its start.
        let mut times = times.map(|time| (time - step.from) / size);
        times[count - 1] = 1.0;
        let transient = transient.map(|tau| tau / size);
        self.collocation.prepare(
            &self.laws,
            size,
            Levels {
                count,
                times,
                transient,
            },
        );
        let unread = if self.is_explicit(step) {
            step.leaving * state.rod.order().points()
        } else {
            0
        };
        let collocation = &mut self.collocation;
        let result = integrate_points(
            (state, tropism),
            &self.laws,
            (&smooth, unread),
            step.to,
            |_, [_, rates], x, y| collocation.integrate(tropism, x, y, rates),
        );
        self.statistics.halvings += std::mem::take(&mut self.collocation.halvings);
        result
    }

    /// Sets the variables at the last level by a function of those at the level before and of the
    /// stimuli at both, for each point of the zone, and evaluates their rates.
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
        let set = |point: usize,
                   [before, rates]: [&[f64]; 2],
                   stimuli: &[&[f64]; LEVELS],
                   variables: &mut [f64]| {
            let stimuli = [stimuli[0], stimuli[1]];
            integrate(
                &PointStep {
                    point,
                    variables: before,
                    rates,
                    stimuli,
                    law: tropism,
                },
                variables,
            );
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

impl<M: Model, E: EquilibriumSolver> Run<'_, M, E> {
    /// Moves the base to its position and frame at `time` (s), and solves the equilibrium under the
    /// load and the environment of that time.
    pub fn solve_equilibrium(&mut self, time: f64) -> Outcome<Equilibrium> {
        let environment = self.stepper.move_base(self.shoot, time)?;
        if !self.shoot.model.support().is_absent() {
            return self.solve_held(&environment);
        }
        let Self {
            stepper,
            shoot,
            solver,
        } = self;
        let (model, rod) = (&shoot.model, &mut shoot.state.rod);
        let material = model.constitutive();
        stepper.force.update(rod, model.load(), &environment);
        let before = (!solver.is_trusted()).then(|| rod.clone());
        // A solver that changes material points does so from the start, so that they are compared
        // once.
        let points = stepper.statistics.equilibria == 0;
        let found = solver
            .equilibrate(rod, material, &stepper.force)
            .and_then(|found| {
                if let Some(before) = &before {
                    // The history belongs to these elements, and the scene determines the base.
                    rod.changed_from(before, points)
                        .map_or(Ok(()), |what| Err(EquilibriumError::Changed { what }))?;
                    found.check()?;
                    check_balance(rod, material, &stepper.force, found.error)?;
                }
                Ok(found)
            });
        found.map_err(|error| IntegrationError::Equilibrium { time, error })
    }

    /// Solves the equilibrium of a shoot with a support.
    fn solve_held(&mut self, environment: &Environment) -> Outcome<Equilibrium> {
        let Self {
            stepper,
            shoot,
            solver,
        } = self;
        let model = &shoot.model;
        let State {
            rod,
            contact,
            predictor,
            ..
        } = &mut shoot.state;
        let (material, load, support) = (model.constitutive(), model.load(), model.support());
        let (reactions, patches) = contact.predicted(rod.reactions(), environment.time);
        let earlier = (&reactions[..], &patches[..]);
        let (shape, start) = (contact.shape.as_ref(), stepper.increment_start.as_ref());
        let last = predictor.last().filter(|_| stepper.is_extrapolated);
        let past = Past {
            earlier,
            shape,
            start,
            last,
            omits_descent: stepper.omits_descent,
        };
        let held = solver.hold(&HeldRod {
            rod,
            material,
            load,
            support,
            environment,
            past,
        });
        let held = held.map_err(|error| IntegrationError::Equilibrium {
            time: environment.time,
            error,
        })?;
        stepper.force.update(&held.rod, load, environment);
        stepper.force.react(&held.rod, &held.reactions);
        contact.take(
            held.patches,
            [rod.reactions(), &held.reactions],
            environment.time,
        );
        if held.rod.elements() == rod.elements() {
            rod.copy_shape(&held.rod);
            contact.shape = None;
        } else {
            rod.sample_shape(&held.rod);
            contact.shape = Some(held.rod);
        }
        Ok(held.equilibrium)
    }
}

/// Returns an error if laws have changed their declaration.
fn check_size(laws: &Declaration, tropism: &impl TropismLaw) -> Result<(), ParameterError> {
    let (now, own, same) = (tropism.size(), laws.size(), "the same throughout a call");
    ParameterError::count(
        "number of variables that the tropism laws declare",
        [now.variables, own.variables],
        same,
    )?;
    ParameterError::count(
        "number of stimuli that the tropism laws declare",
        [now.stimuli, own.stimuli],
        same,
    )?;
    let reads = [now.reads_present, own.reads_present].map(usize::from);
    ParameterError::count("number of reads of present stimuli", reads, same)
}

/// Sets the variables at the last level, at the time `to` (s), for each point of the zone but the
/// first `unread` ones, and evaluates their rates. `integrate` is called with the index of the
/// point in the rod, its variables and their rates at the level before, its stimuli at `levels`,
/// and the variables to be changed, which are those before. It returns whether it succeeds.
fn integrate_points<T: TropismLaw>(
    (state, tropism): (&mut State, &T),
    laws: &Declaration,
    (levels, unread): (&Nodes, usize),
    to: f64,
    mut integrate: impl FnMut(usize, [&[f64]; 2], &[&[f64]; LEVELS], &mut [f64]) -> bool,
) -> Outcome {
    let (first, last) = (state.rod.zone().start, levels.len() - 1);
    let (mut points, mut check, mut defined) = (first + unread.., Ok(()), true);
    let integrated =
        state
            .history
            .each_step((levels, unread), |before, stimuli, variables, rates| {
                variables.copy_from_slice(before[0]);
                let succeeded = points
                    .next()
                    .is_some_and(|point| integrate(point, before, stimuli, variables));
                rates.fill(f64::NAN);
                tropism.rates(variables, stimuli[last], rates);
                // The integration and the analysis of stability use the declaration of the laws. It
                // is compared with the rates in every step.
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
        IntegrationError::finite(defined, RATE, to)?;
        Err(IntegrationError::Variables {
            time: to,
            point: first + point,
        })
    })
}

/// Returns an error if the radius of the intrinsic curvature at a point of the growth zone is not
/// larger than that of the section, at `time` (s). In an elliptic section the distance of the
/// surface on the inner side of the bend counts.
pub(super) fn check_slender(shoot: &Shoot<impl Model>, time: f64) -> Outcome {
    let rod = &shoot.state.rod;
    for point in &rod.points()[rod.zone()] {
        let (u, section) = (&point.intrinsic, &point.section);
        // The square costs less than its root, and this is examined in every step.
        let square = (u.x * section.along_d2).powi(2) + (u.y * section.along_d1).powi(2);
        if square >= 1.0 {
            let (curvature, arc_length) = (u.xy().norm(), rod.length() - point.apex_distance);
            let radius = square.sqrt() / curvature;
            return Err(IntegrationError::NotSlender {
                time,
                arc_length,
                curvature,
                radius,
            });
        }
    }
    Ok(())
}
