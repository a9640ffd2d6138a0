//! The history function of the delay differential equations, on [−delay, 0].

use crate::tropism::{Site, TropismLaw};

/// The laws' variables before the start of a run, at every material point.
///
/// It is implemented by [`ConstantHistory`] and by closures `|t: f64, site: &Site, variables: &mut
/// [f64]|`. A closure is a smooth function of the time (s, from minus the longest delay to 0) and
/// the site. It writes the variables in the order in which the laws declare them.
pub trait HistoryFunction {
    /// Returns whether the variables were constant before 0.
    fn is_constant(&self) -> bool;

    /// Writes the variables of `law` at time `t` ≤ 0 (s), at a site in the first equilibrium, where
    /// the law senses `stimuli`.
    fn variables(
        &self,
        law: &impl TropismLaw,
        t: f64,
        site: &Site,
        stimuli: &[f64],
        variables: &mut [f64],
    );
}

/// A history in which the laws' variables are constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ConstantHistory {
    /// Memories are zero before the start, and statoliths have sedimented in the first equilibrium.
    /// This is the default.
    #[default]
    Empty,
    /// The stimuli were those of the first equilibrium at all times.
    Steady,
}

impl HistoryFunction for ConstantHistory {
    fn is_constant(&self) -> bool {
        true
    }

    fn variables(
        &self,
        law: &impl TropismLaw,
        _t: f64,
        _site: &Site,
        stimuli: &[f64],
        variables: &mut [f64],
    ) {
        match self {
            Self::Empty => law.initial(stimuli, variables),
            Self::Steady => law.steady(stimuli, variables),
        }
    }
}

impl<F: Fn(f64, &Site, &mut [f64])> HistoryFunction for F {
    fn is_constant(&self) -> bool {
        false
    }

    fn variables(
        &self,
        _law: &impl TropismLaw,
        t: f64,
        site: &Site,
        _stimuli: &[f64],
        variables: &mut [f64],
    ) {
        self(t, site, variables);
    }
}
