//! Declaration of the stimuli and variables of a tropism law.

use super::{Rotation, TropismLaw};
use crate::error::ParameterError;

/// Source of a number at a material point. Indices count the stimuli or variables of all laws of
/// the shoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Source {
    /// A stimulus.
    Stimulus(usize),
    /// A variable.
    Variable(usize),
    /// An expression that is not declared.
    #[default]
    Computed,
}

impl Source {
    /// The `k`-th stimulus or variable after this one; `Computed` is unchanged.
    #[must_use]
    #[inline]
    pub fn offset(self, k: usize) -> Self {
        match self {
            Self::Stimulus(i) => Self::Stimulus(i + k),
            Self::Variable(i) => Self::Variable(i + k),
            Self::Computed => Self::Computed,
        }
    }
}

/// Variable of a law at every material point of the growth zone.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use]
pub struct Variable {
    /// Delay with which [`gradient`](TropismLaw::gradient) reads the variable, s; `None` if it does
    /// not read it.
    pub delay: Option<f64>,
    /// Time constant τ in ẏ = (… − y)/τ, s; infinite without such a term. The integrator treats
    /// −y/τ exactly, at any ratio of step to τ.
    pub time_constant: f64,
    /// The source x of a *linear memory*, a variable with τ ẏ = x − y; otherwise
    /// [`Source::Computed`].
    pub remembers: Source,
    /// The stimulus x of a variable with ẏ ≈ (x − y)/τ near a steady state; otherwise
    /// [`Source::Computed`]. The integrator begins its iteration with the response of a linear
    /// memory, which saves evaluations of the rates. The result of an iteration changes within its
    /// tolerance. The number of intervals that are halved may change.
    pub approaches: Source,
    /// Transformation under a rotation of the directors about d3.
    pub rotation: Rotation,
    /// Whether the rates of other variables may depend on this variable. It concerns linear
    /// memories: an uncoupled one is integrated after the variables that are coupled.
    /// [`rates`](TropismLaw::rates) may then be called with NaN in its place, and its own rate is
    /// ignored there. A declared memory of a memory does not couple them.
    pub coupled: bool,
    /// For one of the two variables p and q of a *damped oscillation*, the complex memory z = p +
    /// iq with ż = (x − z)/τ + iωz: ω (rad/s) and the place of q for p, −ω and the place of p for
    /// q. Both remember x. The two rates are ṗ = (x − p)/τ − ωq and q̇ = −q/τ + ωp. `None` for
    /// other variables.
    pub turns: Option<(f64, usize)>,
}

impl Variable {
    /// Variable that the gradient reads with a delay (s).
    #[inline]
    pub fn read_after(delay: f64) -> Self {
        Self {
            delay: Some(delay),
            ..Self::unread()
        }
    }

    /// Variable that only the rates of other variables depend on.
    #[inline]
    pub fn unread() -> Self {
        Self {
            delay: None,
            time_constant: f64::INFINITY,
            remembers: Source::Computed,
            approaches: Source::Computed,
            rotation: Rotation::Undeclared,
            coupled: true,
            turns: None,
        }
    }

    /// Rate of a linear memory y of x with the time constant τ, (x − y)/τ, or of one of the
    /// variables of a damped oscillation: `turns` is its [ω](Self::turns), of either sign, and the
    /// value of the other variable.
    #[inline]
    pub(crate) fn linear_rate(y: f64, x: f64, tau: f64, turns: Option<(f64, f64)>) -> f64 {
        match turns {
            None => (x - y) / tau,
            Some((frequency, other)) if frequency > 0.0 => (x - y) / tau - frequency * other,
            Some((frequency, other)) => -y / tau - frequency * other,
        }
    }

    /// Returns an error with the rate that the variable at place `k` should have unless its `rate`
    /// is that of its declaration, up to the rounding of one subtraction and one quotient, whose
    /// results may be subnormal numbers. A computed rate may have any value.
    #[inline]
    pub(crate) fn check_rate(
        &self,
        k: usize,
        rate: f64,
        variables: &[f64],
        stimuli: &[f64],
    ) -> Result<(), f64> {
        let x = match self.remembers {
            Source::Stimulus(i) => stimuli.get(i),
            Source::Variable(i) => variables.get(i),
            Source::Computed => return Ok(()),
        };
        let number = |x: Option<&f64>| x.copied().unwrap_or(f64::NAN);
        let (x, y, time) = (number(x), variables[k], self.time_constant);
        let turns = self
            .turns
            .map(|(frequency, other)| (frequency, number(variables.get(other))));
        let expected = Self::linear_rate(y, x, time, turns);
        let size = x.abs()
            + y.abs()
            + turns.map_or(0.0, |(frequency, other)| (frequency * time * other).abs());
        let rounding = 16.0 * f64::EPSILON * size + f64::MIN_POSITIVE * (1.0 + time);
        if (rate * time - expected * time).abs() <= rounding {
            Ok(())
        } else {
            Err(expected)
        }
    }

    /// The variable with a time constant (s).
    #[inline]
    pub fn relaxing_in(self, time_constant: f64) -> Self {
        Self {
            time_constant,
            ..self
        }
    }

    /// The variable, which approaches a stimulus with its time constant.
    #[inline]
    pub fn approaching(self, stimulus: Source) -> Self {
        Self {
            approaches: stimulus,
            ..self
        }
    }

    /// The variable with a transformation under rotations about d3.
    #[inline]
    pub fn turning(self, rotation: Rotation) -> Self {
        Self { rotation, ..self }
    }
}

/// Numbers of variables and stimuli of a law at a material point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Size {
    /// Number of variables.
    pub variables: usize,
    /// Number of stimuli.
    pub stimuli: usize,
    /// Whether [`gradient`](TropismLaw::gradient) reads the present stimuli.
    pub reads_present: bool,
}

impl Size {
    /// Counts what a function declares. The counts are constants if the declaration is known at
    /// compile time.
    #[inline(always)]
    pub(super) fn of(declare: impl FnOnce(&mut Declaration)) -> Self {
        let mut counted = Declaration {
            counts_only: true,
            ..Declaration::default()
        };
        declare(&mut counted);
        counted.size
    }

    /// Argument `now` of [`gradient`](TropismLaw::gradient) for stimuli `x`: all of them, or none
    /// if the law does not read them.
    #[inline]
    pub(crate) fn present<'a>(&self, x: &'a [f64]) -> &'a [f64] {
        if self.reads_present { x } else { &[] }
    }
}

/// Stimuli and variables of a law at a material point, in order. [`TropismLaw::declare`] writes it;
/// those of the laws in a tuple or a `Vec` follow one another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Declaration {
    size: Size,
    reads_position: bool,
    /// Only the counts are computed, and the lists below stay empty.
    counts_only: bool,
    stimuli: Vec<Rotation>,
    variables: Vec<Variable>,
}

impl Declaration {
    /// Declaration of a law.
    #[must_use]
    pub fn of<T: TropismLaw + ?Sized>(law: &T) -> Self {
        let mut declaration = Self::default();
        declaration.read(law);
        declaration
    }

    /// Overwrites this declaration with that of a law, without allocation if the capacity suffices.
    pub(crate) fn read<T: TropismLaw + ?Sized>(&mut self, law: &T) {
        self.stimuli.clear();
        self.variables.clear();
        (self.size, self.reads_position) = (Size::default(), false);
        law.declare(self);
    }

    /// Declares a number of stimuli whose transformation is unknown. Returns the first.
    #[inline(always)]
    pub fn stimuli(&mut self, number: usize) -> Source {
        self.add_stimuli(number, |_| Rotation::Undeclared)
    }

    /// Declares two stimuli, the components along d1 and d2 of a vector. Returns the first.
    #[inline(always)]
    pub fn stimulus_pair(&mut self) -> Source {
        self.add_stimuli(2, |k| {
            if k == 0 {
                Rotation::First
            } else {
                Rotation::Second
            }
        })
    }

    /// Declares a stimulus with a transformation under rotations about d3.
    #[inline(always)]
    pub fn stimulus(&mut self, rotation: Rotation) -> Source {
        self.add_stimuli(1, |_| rotation)
    }

    /// Declares a variable.
    #[inline(always)]
    pub fn variable(&mut self, variable: Variable) -> Source {
        self.add_variables(1, |_, _| variable)
    }

    /// Declares a number of linear memories, τ ẏ = x − y, of consecutive sources that begin with
    /// `of`. A memory transforms like its source. `time_constant` is τ (s), and `delay` that of
    /// [`Variable::delay`]. Returns the first.
    #[inline(always)]
    pub fn memories(
        &mut self,
        number: usize,
        of: Source,
        time_constant: f64,
        delay: Option<f64>,
    ) -> Source {
        self.add_memories(number, of, time_constant, (delay, true))
    }

    /// Declares [memories](Self::memories) on which only the gradient and further memories depend,
    /// and no other rate: they are not [coupled](Variable::coupled). Their integration costs less.
    #[inline(always)]
    pub fn uncoupled_memories(
        &mut self,
        number: usize,
        of: Source,
        time_constant: f64,
        delay: Option<f64>,
    ) -> Source {
        self.add_memories(number, of, time_constant, (delay, false))
    }

    /// Declares a number of [damped oscillations](Variable::turns) of consecutive sources that
    /// begin with `of`: first the variables p of all, then the variables q. τ (s) and ω (rad/s) are
    /// given, and `delay` is that of [`Variable::delay`]. They are not
    /// [coupled](Variable::coupled). Returns the first.
    pub fn oscillations(
        &mut self,
        number: usize,
        of: Source,
        (time, omega): (f64, f64),
        delay: Option<f64>,
    ) -> Source {
        let first = self.add_memories(number, of, time, (delay, false));
        self.add_memories(number, of, time, (delay, false));
        if let (Source::Variable(first), false) = (first, self.counts_only) {
            let pair = &mut self.variables[first..first + 2 * number];
            for (k, variable) in pair.iter_mut().enumerate() {
                variable.turns = Some(if k < number {
                    (omega, first + number + k)
                } else {
                    (-omega, first + k - number)
                });
            }
        }
        first
    }

    #[inline(always)]
    fn add_memories(
        &mut self,
        number: usize,
        of: Source,
        time: f64,
        (delay, coupled): (Option<f64>, bool),
    ) -> Source {
        self.add_variables(number, |to, k| {
            let remembers = of.offset(k);
            let rotation = to.rotation(remembers);
            Variable {
                delay,
                time_constant: time,
                remembers,
                rotation,
                coupled,
                ..Variable::unread()
            }
        })
    }

    #[inline(always)]
    fn add_stimuli(&mut self, number: usize, rotation: impl Fn(usize) -> Rotation) -> Source {
        let first = self.size.stimuli;
        self.size.stimuli += number;
        self.list(|to| to.stimuli.extend((0..number).map(&rotation)));
        Source::Stimulus(first)
    }

    #[inline(always)]
    fn add_variables(
        &mut self,
        number: usize,
        variable: impl Fn(&Self, usize) -> Variable,
    ) -> Source {
        let first = self.size.variables;
        self.size.variables += number;
        self.list(|to| {
            for k in 0..number {
                let variable = variable(to, k);
                to.variables.push(variable);
            }
        });
        Source::Variable(first)
    }

    /// Writes to the lists in a function that is not inlined, so that the compiler removes
    /// declarations of which only the counts are used.
    #[inline(always)]
    fn list(&mut self, write: impl FnOnce(&mut Self)) {
        #[cold]
        #[inline(never)]
        fn out_of_line(to: &mut Declaration, write: impl FnOnce(&mut Declaration)) {
            write(to);
        }
        if !self.counts_only {
            out_of_line(self, write);
        }
    }

    /// Declares that [`sense`](TropismLaw::sense) reads the position of the site.
    #[inline]
    pub fn with_position(&mut self) -> &mut Self {
        self.reads_position = true;
        self
    }

    /// Declares that [`gradient`](TropismLaw::gradient) reads the present stimuli, without delay.
    #[inline]
    pub fn with_present(&mut self) -> &mut Self {
        self.size.reads_present = true;
        self
    }

    /// Numbers of stimuli and variables.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// The variables.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Whether [`sense`](TropismLaw::sense) reads the position of the site.
    #[must_use]
    pub fn reads_position(&self) -> bool {
        self.reads_position
    }

    /// Transformation of a stimulus or a variable under a rotation of the directors about d3.
    #[must_use]
    #[inline]
    pub fn rotation(&self, of: Source) -> Rotation {
        match of {
            Source::Stimulus(i) => self.stimuli.get(i).copied().unwrap_or_default(),
            Source::Variable(i) => self
                .variables
                .get(i)
                .map_or(Rotation::Undeclared, |variable| variable.rotation),
            Source::Computed => Rotation::Undeclared,
        }
    }

    /// Delays of the variables that the gradient reads, s.
    pub fn delays(&self) -> impl Iterator<Item = f64> {
        self.variables.iter().filter_map(|variable| variable.delay)
    }

    /// Checks delays, time constants and the sources of memories.
    ///
    /// # Errors
    /// The first one that is out of range.
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        for (i, variable) in self.variables.iter().enumerate() {
            ParameterError::not_negative(
                "delay of a tropism law",
                variable.delay.unwrap_or(0.0),
                "s",
            )?;
            let time = variable.time_constant;
            ParameterError::unless(
                time > 0.0,
                "time constant of a variable",
                time,
                "positive (s)",
            )?;
            let (index, number) = match variable.remembers {
                Source::Stimulus(i) => (i, self.stimuli.len()),
                Source::Variable(i) => (i, self.variables.len()),
                Source::Computed => continue,
            };
            if let Some((frequency, other)) = variable.turns {
                // The integrator treats both variables together.
                let mutual = self.variables.get(other).is_some_and(|other| {
                    let Variable {
                        approaches,
                        rotation,
                        ..
                    } = *other;
                    *other
                        == Variable {
                            turns: Some((-frequency, i)),
                            approaches,
                            rotation,
                            ..*variable
                        }
                });
                let name = "angular frequency of a damped oscillation";
                let requirement = "finite and not zero, and minus that of the other variable, which refers to this one \
                    and agrees with it in all else (rad/s)";
                let given = frequency.is_finite() && frequency != 0.0;
                ParameterError::unless(given && mutual, name, frequency, requirement)?;
            }
            let name = "index of what a variable remembers";
            ParameterError::unless(
                index < number,
                name,
                index as f64,
                "that of a declared stimulus or variable",
            )?;
        }
        Ok(())
    }

    /// Returns an error unless the rates at a point are those that are declared.
    #[inline]
    pub(crate) fn check_rates(
        &self,
        variables: &[f64],
        rates: &[f64],
        stimuli: &[f64],
    ) -> Result<(), ParameterError> {
        let name = "time constant times the rate of a variable that is declared a memory";
        let requirement =
            "the remembered quantity minus the variable: `rates` contradicts `declare`";
        self.variables
            .iter()
            .zip(rates)
            .enumerate()
            .try_for_each(|(k, (variable, rate))| {
                let checked = variable.check_rate(k, *rate, variables, stimuli);
                checked.map_err(|_| {
                    ParameterError::refused(name, rate * variable.time_constant, requirement)
                })
            })
    }

    /// Longest delay, s; zero without delays.
    #[must_use]
    pub fn longest_delay(&self) -> f64 {
        self.delays().fold(0.0, f64::max)
    }

    /// Shortest delay, s: zero if the gradient reads the present stimuli, and infinite if it reads
    /// neither these nor variables.
    #[must_use]
    pub fn shortest_delay(&self) -> f64 {
        if self.size.reads_present {
            0.0
        } else {
            self.delays().fold(f64::INFINITY, f64::min)
        }
    }
}
