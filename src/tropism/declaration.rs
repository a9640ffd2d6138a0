//! What a law keeps at a material point, and what it reads: said once, in one place.

use super::TropismLaw;
use crate::error::ParameterError;

/// Where a number at a material point comes from; the indices count all laws of the shoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Source {
    /// A stimulus.
    Stimulus(usize),
    /// A variable.
    Variable(usize),
    /// A formula of the law's own.
    #[default]
    Computed,
}

impl Source {
    /// The one that stands `k` places further on.
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

/// How a number changes when the directors d1 and d2 turn about d3, the rest of the world staying as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rotation {
    /// The law says nothing of it.
    #[default]
    Undeclared,
    /// It stays.
    Invariant,
    /// It is the component along d1 of a vector; the component along d2 stands next to it.
    First,
    /// It is the component along d2 of a vector; the component along d1 stands before it.
    Second,
}

/// A variable that a law keeps at every material point of the growth zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    /// How long ago [`gradient`](TropismLaw::gradient) reads it, s; none if it does not.
    pub delay: Option<f64>,
    /// τ in ẏ = (… − y)/τ, s; infinite if it does not relax. The integrator treats −y/τ exactly, at any ratio of step
    /// to τ.
    pub time_constant: f64,
    /// x, if the variable is a *linear memory*: τ ẏ = x − y with τ the time constant and nothing else.
    pub remembers: Source,
    /// How it changes when the directors turn about d3.
    pub rotation: Rotation,
}

impl Variable {
    /// A variable that the gradient reads as it was `delay` seconds ago.
    #[must_use]
    #[inline]
    pub fn read_after(delay: f64) -> Self {
        Self { delay: Some(delay), ..Self::unread() }
    }

    /// A variable that the gradient does not read: it acts through others.
    #[must_use]
    #[inline]
    pub fn unread() -> Self {
        Self { delay: None, time_constant: f64::INFINITY, remembers: Source::Computed, rotation: Rotation::Undeclared }
    }

    /// The same, relaxing in `time_constant` seconds.
    #[must_use]
    #[inline]
    pub fn relaxing_in(self, time_constant: f64) -> Self {
        Self { time_constant, ..self }
    }

    /// The same, with what is known of how it turns.
    #[must_use]
    #[inline]
    pub fn turning(self, rotation: Rotation) -> Self {
        Self { rotation, ..self }
    }
}

/// How many numbers laws keep and sense at a material point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Size {
    /// Variables.
    pub variables: usize,
    /// Stimuli.
    pub stimuli: usize,
    /// Whether [`gradient`](TropismLaw::gradient) reads the present stimuli.
    pub reads_present: bool,
}

impl Size {
    /// Counts what is declared. Where the declaration is known at compile time the counts are constants.
    #[must_use]
    #[inline(always)]
    pub fn of(declare: impl FnOnce(&mut Declaration)) -> Self {
        let mut counted = Declaration { counts_only: true, ..Declaration::default() };
        declare(&mut counted);
        counted.size
    }

    /// Whether the slices hold as many numbers as this law and a second one have together.
    #[inline]
    pub(super) fn fits(&self, second: Self, variables: &[f64], stimuli: &[f64]) -> bool {
        variables.len() == self.variables + second.variables && stimuli.len() == self.stimuli + second.stimuli
    }

    /// What [`gradient`](TropismLaw::gradient) is given of the stimuli `x`: all, or none if it does not read the present.
    #[must_use]
    #[inline]
    pub fn present<'a>(&self, x: &'a [f64]) -> &'a [f64] {
        if self.reads_present { x } else { &[] }
    }
}

/// The stimuli that laws sense and the variables that they keep at a material point, in order.
///
/// A law writes its own with [`TropismLaw::declare`]; those of a tuple stand one behind the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Declaration {
    size: Size,
    reads_position: bool,
    /// The lists below stay empty.
    counts_only: bool,
    stimuli: Vec<Rotation>,
    variables: Vec<Variable>,
}

impl Declaration {
    /// What a law declares.
    #[must_use]
    pub fn of<T: TropismLaw + ?Sized>(law: &T) -> Self {
        let mut declaration = Self::default();
        declaration.read(law);
        declaration
    }

    /// Becomes what a law declares, without new allocations if there is room.
    pub fn read<T: TropismLaw + ?Sized>(&mut self, law: &T) {
        self.stimuli.clear();
        self.variables.clear();
        (self.size, self.reads_position) = (Size::default(), false);
        law.declare(self);
    }

    /// Declares `number` stimuli, of which nothing is said but that they are sensed. Returns the first.
    #[inline(always)]
    pub fn stimuli(&mut self, number: usize) -> Source {
        self.add_stimuli(number, |_| Rotation::Undeclared)
    }

    /// Declares two stimuli that are the components along d1 and d2 of a vector. Returns the first.
    #[inline(always)]
    pub fn stimulus_pair(&mut self) -> Source {
        self.add_stimuli(2, |k| if k == 0 { Rotation::First } else { Rotation::Second })
    }

    /// Declares one stimulus that turns in a given way.
    #[inline(always)]
    pub fn stimulus(&mut self, rotation: Rotation) -> Source {
        self.add_stimuli(1, |_| rotation)
    }

    /// Declares a variable.
    #[inline(always)]
    pub fn variable(&mut self, variable: Variable) -> Source {
        self.add_variables(1, |_, _| variable)
    }

    /// Declares `number` linear memories, τ ẏ = x − y: the first of `of`, the next of what stands behind it. A memory turns as
    /// what it remembers does. `delay` is how long ago the gradient reads them, s, if it does. Returns the first.
    #[inline(always)]
    pub fn memories(&mut self, number: usize, of: Source, time_constant: f64, delay: Option<f64>) -> Source {
        self.add_variables(number, |to, k| {
            let remembers = of.offset(k);
            Variable { delay, time_constant, remembers, rotation: to.rotation(remembers) }
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
    fn add_variables(&mut self, number: usize, variable: impl Fn(&Self, usize) -> Variable) -> Source {
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

    /// Writes to the lists, out of line: where only counts are asked for, a declaration is to vanish in compilation.
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

    /// How many stimuli and variables there are.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// The variables.
    #[must_use]
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Whether a law looks where its site is.
    #[must_use]
    pub fn reads_position(&self) -> bool {
        self.reads_position
    }

    /// How a stimulus or a variable changes when the directors turn about d3.
    #[must_use]
    #[inline]
    pub fn rotation(&self, of: Source) -> Rotation {
        match of {
            Source::Stimulus(i) => self.stimuli.get(i).copied().unwrap_or_default(),
            Source::Variable(i) => self.variables.get(i).map_or(Rotation::Undeclared, |variable| variable.rotation),
            Source::Computed => Rotation::Undeclared,
        }
    }

    /// The delays with which variables are read, s.
    pub fn delays(&self) -> impl Iterator<Item = f64> {
        self.variables.iter().filter_map(|variable| variable.delay)
    }

    /// Refuses delays and time constants that make no sense, and memories of what is not declared.
    ///
    /// # Errors
    /// The first of them.
    pub fn check(&self) -> Result<(), ParameterError> {
        for variable in &self.variables {
            ParameterError::not_negative("delay of a tropism law", variable.delay.unwrap_or(0.0))?;
            let time = variable.time_constant;
            ParameterError::unless(time > 0.0, "time constant of a variable", time, "positive (s)")?;
            let (index, number) = match variable.remembers {
                Source::Stimulus(i) => (i, self.stimuli.len()),
                Source::Variable(i) => (i, self.variables.len()),
                Source::Computed => continue,
            };
            let name = "index of what a variable remembers";
            ParameterError::unless(index < number, name, index as f64, "that of a declared stimulus or variable")?;
        }
        Ok(())
    }

    /// The longest delay, s; zero if nothing of the past is read.
    #[must_use]
    pub fn longest_delay(&self) -> f64 {
        self.delays().fold(0.0, f64::max)
    }

    /// The shortest delay, s: zero if the laws read what is present, infinite if they read neither.
    #[must_use]
    pub fn shortest_delay(&self) -> f64 {
        if self.size.reads_present { 0.0 } else { self.delays().fold(f64::INFINITY, f64::min) }
    }
}
