//! Error of a law whose methods contradict each other.

use std::fmt;

use nalgebra::Vector3;

use crate::error::{Number, debug_by_display};

/// Quantity of a law. Components and indices are counted from zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Number of points, sites or places at which a law is checked.
    Points,
    /// Distance (m) or time (s) of a point at which a growth law is checked.
    Point,
    /// Time over which the motion of points is checked, s.
    Span,
    /// Elastic energy per length at zero strain, J/m.
    Energy,
    /// Derivative of the elastic energy by a component of the strain, N m.
    EnergySlope(usize),
    /// Component of the couple, N m.
    Couple(usize),
    /// Derivative of a component of the couple by the same component of the strain, N m².
    CoupleSlope(usize),
    /// Entry of the tangent: row and column, N m².
    Tangent(usize, usize),
    /// Component of the strain of the centre line.
    LineStrain(usize),
    /// Derivative of a component of the strain of the centre line by a component of the force, 1/N.
    LineStrainSlope(usize, usize),
    /// Energy of shear and stretch per length without force, J/m.
    LineEnergy,
    /// Derivative of the energy of shear and stretch by a component of the force, J/(m N).
    LineEnergySlope(usize),
    /// Entry of the compliance of the centre line: row and column, 1/N.
    Compliance(usize, usize),
    /// Relative elemental growth rate, 1/s.
    Regr,
    /// Speed of the apex relative to a point, m/s.
    ApicalSpeed,
    /// Derivative of this speed by the distance from the apex, 1/s.
    ApicalSpeedSlope,
    /// Distance from the apex to which growth moves a point, m.
    Distance,
    /// Stretch of the tissue at a point.
    Stretch,
    /// Time at which a point leaves the growth zone, s.
    ExitTime,
    /// Length of a shoot, m.
    Length,
    /// Number of declared stimuli.
    Stimuli,
    /// Number of declared variables.
    Variables,
    /// Declared rotation of a stimulus.
    StimulusRotation(usize),
    /// Declared rotation of a variable.
    VariableRotation(usize),
    /// Stimulus.
    Stimulus(usize),
    /// Component of the signal of a perception.
    Signal(usize),
    /// Steady value of a variable.
    Steady(usize),
    /// Value of a variable at t = 0.
    Initial(usize),
    /// Rate of a variable.
    Rate(usize),
    /// Rate of a variable that `coupled_rates` writes.
    CoupledRate(usize),
    /// Component of the growth gradient, 1/m.
    Gradient(usize),
    /// Signed distance of a place from an obstacle, m.
    Clearance,
    /// Norm of the normal of an obstacle.
    NormalLength,
    /// Component of the normal of an obstacle.
    Normal(usize),
    /// Entry of the curvature of an obstacle: row and column, 1/m.
    Curvature(usize, usize),
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Points => write!(f, "number of points"),
            Self::Point => write!(f, "distance (m) or time (s) of a point"),
            Self::Span => write!(f, "span (s)"),
            Self::Energy => write!(f, "elastic energy (J/m)"),
            Self::EnergySlope(i) => write!(f, "derivative of the elastic energy by the strain u{} (N m)", i + 1),
            Self::Couple(i) => write!(f, "couple m{} (N m)", i + 1),
            Self::CoupleSlope(i) => write!(f, "derivative of the couple m{0} by the strain u{0} (N m²)", i + 1),
            Self::Tangent(i, j) => write!(f, "tangent ∂m{}/∂u{} (N m²)", i + 1, j + 1),
            Self::LineStrain(i) => write!(f, "strain v{} of the centre line", i + 1),
            Self::LineStrainSlope(i, j) => {
                write!(f, "derivative of the strain v{} of the centre line by the force n{} (1/N)", i + 1, j + 1)
            }
            Self::LineEnergy => write!(f, "energy of shear and stretch (J/m)"),
            Self::LineEnergySlope(i) => {
                write!(f, "derivative of the energy of shear and stretch by the force n{} (J/(m N))", i + 1)
            }
            Self::Compliance(i, j) => write!(f, "compliance ∂v{}/∂n{} (1/N)", i + 1, j + 1),
            Self::Regr => write!(f, "REGR (1/s)"),
            Self::ApicalSpeed => write!(f, "apical speed (m/s)"),
            Self::ApicalSpeedSlope => write!(f, "derivative of the apical speed by the distance from the apex (1/s)"),
            Self::Distance => write!(f, "distance of `flow` (m)"),
            Self::Stretch => write!(f, "stretch of `flow`"),
            Self::ExitTime => write!(f, "exit time (s)"),
            Self::Length => write!(f, "length (m)"),
            Self::Stimuli => write!(f, "number of stimuli"),
            Self::Variables => write!(f, "number of variables"),
            Self::StimulusRotation(k) => write!(f, "index of the partner of stimulus {k} under rotations"),
            Self::VariableRotation(k) => write!(f, "index of the partner of variable {k} under rotations"),
            Self::Stimulus(k) => write!(f, "stimulus {k}"),
            Self::Signal(k) => write!(f, "component {k} of the signal"),
            Self::Steady(k) => write!(f, "rate of variable {k} in the steady state (its unit per second)"),
            Self::Initial(k) => write!(f, "initial variable {k}"),
            Self::Rate(k) => write!(f, "rate of variable {k} (its unit per second)"),
            Self::CoupledRate(k) => write!(f, "rate of variable {k} by `coupled_rates` (its unit per second)"),
            Self::Clearance => write!(f, "signed distance from the obstacle (m)"),
            Self::NormalLength => write!(f, "norm of the normal"),
            Self::Normal(i) => write!(f, "component {} of the normal", ["x", "y", "z"].get(i).unwrap_or(&"?")),
            Self::Curvature(i, j) => write!(f, "entry {}, {} of the curvature (1/m)", i + 1, j + 1),
            Self::Gradient(i) => write!(f, "component of the growth gradient along d{} (1/m)", i + 1),
        }
    }
}

/// Place at which a law was evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Where {
    /// Arguments of the check.
    Arguments,
    /// Elastic strain, components along the directors, 1/m.
    Strain(Vector3<f64>),
    /// Force in the rod, components along the directors, N.
    Force(Vector3<f64>),
    /// Distance from the apex (m) and time (s).
    Growing {
        /// Distance from the apex, m.
        sigma: f64,
        /// Time, s.
        time: f64,
    },
    /// Place beside an obstacle.
    Place {
        /// Place in the fixed frame, m.
        place: Vector3<f64>,
        /// Index of the surface of the obstacle.
        surface: usize,
    },
    /// Site of a tropism law.
    Site {
        /// Index of the site among those given.
        index: usize,
        /// Arc length of the site from the base, m.
        arc_length: f64,
    },
}

impl fmt::Display for Where {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arguments => write!(f, "in the arguments of the check"),
            Self::Strain(u) => write!(f, "at the elastic strain {} 1/m", Components(u)),
            Self::Force(n) => write!(f, "under the force {} N", Components(n)),
            Self::Growing { sigma, time } => {
                write!(f, "at {:.5} m from the apex and {} s", Number(*sigma), Number(*time))
            }
            Self::Place { place: p, surface } => {
                write!(f, "at {} m beside surface {surface}", Components(p))
            }
            Self::Site { index, arc_length } => {
                write!(f, "at site {index}, {:.5} m from the base", Number(*arc_length))
            }
        }
    }
}

/// Components of a vector in a message.
struct Components<'a>(&'a Vector3<f64>);

impl fmt::Display for Components<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = (*self.0).into();
        write!(f, "({:.5}, {:.5}, {:.5})", Number(x), Number(y), Number(z))
    }
}

/// Contradiction between two methods of a law.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub struct LawError {
    /// Type of the law.
    pub law: &'static str,
    /// The quantity that is wrong, with its component.
    pub quantity: Quantity,
    /// Place at which it is wrong.
    pub place: Where,
    /// Value of the quantity: what the law returns, or for a derivative the difference quotient of what it returns.
    pub value: f64,
    /// Value that follows from the other methods of the law. NaN if the requirement is no single value.
    pub expected: f64,
    /// Definition of the expected value.
    pub requirement: &'static str,
}

impl fmt::Display for LawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { law, quantity, place, value, expected, requirement } = self;
        let law = describe_type(law);
        write!(f, "the {quantity} of {law} is {:.7} {place} but must be ", Number(*value))?;
        if expected.is_nan() {
            write!(f, "{requirement}")
        } else {
            write!(f, "{:.7}: {requirement}", Number(*expected))
        }
    }
}

/// Describes a law by the name of its type. That of a law which is chosen at run time, behind a pointer, does not name
/// it.
pub(crate) fn describe_type(law: &str) -> String {
    let pointers = ["alloc::sync::Arc<dyn ", "alloc::rc::Rc<dyn ", "alloc::boxed::Box<dyn ", "dyn "];
    let known = !pointers.iter().any(|pointer| law.trim_start_matches('&').starts_with(pointer));
    if known { format!("`{law}`") } else { "a law that was chosen at run time".to_owned() }
}

impl std::error::Error for LawError {}

debug_by_display!(LawError);

/// A law and a place at which its quantities are compared.
#[derive(Clone, Copy)]
pub(super) struct At {
    pub law: &'static str,
    pub place: Where,
}

impl At {
    /// The place of a law of type `L`.
    pub fn of<L: ?Sized>(place: Where) -> Self {
        Self { law: std::any::type_name::<L>(), place }
    }

    /// Returns an error for a check of a law of type `L` at no point.
    pub fn of_points<L: ?Sized>(number: usize) -> Result<(), LawError> {
        let at = Self::of::<L>(Where::Arguments);
        if number > 0 { Ok(()) } else { Err(at.error(Quantity::Points, [0.0, f64::NAN], "at least 1")) }
    }

    /// The error of a value.
    pub fn error(self, quantity: Quantity, [value, expected]: [f64; 2], requirement: &'static str) -> LawError {
        let Self { law, place } = self;
        LawError { law, quantity, place, value, expected, requirement }
    }

    /// Returns an error for a value that is not finite.
    pub fn finite(self, quantity: Quantity, value: f64) -> Result<(), LawError> {
        if value.is_finite() { Ok(()) } else { Err(self.error(quantity, [value, f64::NAN], "finite")) }
    }

    /// Returns an error unless the two values differ by at most a tolerance; NaN is an error.
    pub fn equal(
        self,
        quantity: Quantity,
        values: [f64; 2],
        tolerance: f64,
        requirement: &'static str,
    ) -> Result<(), LawError> {
        let equal = (values[0] - values[1]).abs() <= tolerance;
        if equal { Ok(()) } else { Err(self.error(quantity, values, requirement)) }
    }
}
