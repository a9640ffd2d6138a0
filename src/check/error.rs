//! Error of a law whose methods contradict each other.

use std::fmt;

use nalgebra::Vector3;

use crate::error::{Number, debug_by_display};

/// Quantity of a law. Components and indices are counted from zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Quantity {
    /// Number of points, sites or places at which a law is checked.
    #[error("number of points")]
    Points,
    /// Distance (m) or time (s) of a point at which a growth law is checked.
    #[error("distance (m) or time (s) of a point")]
    Point,
    /// Time over which the motion of points is checked, s.
    #[error("span (s)")]
    Span,
    /// Elastic energy per length at zero strain, J/m.
    #[error("elastic energy (J/m)")]
    Energy,
    /// Derivative of the elastic energy by a component of the strain, N m.
    #[error("derivative of the elastic energy by the strain u{} (N m)", .0 + 1)]
    EnergySlope(usize),
    /// Component of the couple, N m.
    #[error("couple m{} (N m)", .0 + 1)]
    Couple(usize),
    /// Derivative of a component of the couple by the same component of the strain, N m².
    #[error("derivative of the couple m{i} by the strain u{i} (N m²)", i = .0 + 1)]
    CoupleSlope(usize),
    /// Entry of the tangent: row and column, N m².
    #[error("tangent ∂m{}/∂u{} (N m²)", .0 + 1, .1 + 1)]
    Tangent(usize, usize),
    /// Component of the strain of the centre line.
    #[error("strain v{} of the centre line", .0 + 1)]
    LineStrain(usize),
    /// Derivative of a component of the strain of the centre line by a component of the force, 1/N.
    #[error("derivative of the strain v{} of the centre line by the force n{} (1/N)", .0 + 1, .1 + 1)]
    LineStrainSlope(usize, usize),
    /// Energy of shear and stretch per length without force, J/m.
    #[error("energy of shear and stretch (J/m)")]
    LineEnergy,
    /// Derivative of the energy of shear and stretch by a component of the force, J/(m N).
    #[error("derivative of the energy of shear and stretch by the force n{} (J/(m N))", .0 + 1)]
    LineEnergySlope(usize),
    /// Entry of the compliance of the centre line: row and column, 1/N.
    #[error("compliance ∂v{}/∂n{} (1/N)", .0 + 1, .1 + 1)]
    Compliance(usize, usize),
    /// Relative elemental growth rate, 1/s.
    #[error("REGR (1/s)")]
    Regr,
    /// Speed of the apex relative to a point, m/s.
    #[error("apical speed (m/s)")]
    ApicalSpeed,
    /// Derivative of this speed by the distance from the apex, 1/s.
    #[error("derivative of the apical speed by the distance from the apex (1/s)")]
    ApicalSpeedSlope,
    /// Distance from the apex to which growth moves a point, m.
    #[error("distance of `flow` (m)")]
    Distance,
    /// Stretch of the tissue at a point.
    #[error("stretch of `flow`")]
    Stretch,
    /// Time at which a point leaves the growth zone, s.
    #[error("exit time (s)")]
    ExitTime,
    /// Length of a shoot, m.
    #[error("length (m)")]
    Length,
    /// Number of declared stimuli.
    #[error("number of stimuli")]
    Stimuli,
    /// Number of declared variables.
    #[error("number of variables")]
    Variables,
    /// Declared rotation of a stimulus.
    #[error("index of the partner of stimulus {0} under rotations")]
    StimulusRotation(usize),
    /// Declared rotation of a variable.
    #[error("index of the partner of variable {0} under rotations")]
    VariableRotation(usize),
    /// Stimulus.
    #[error("stimulus {0}")]
    Stimulus(usize),
    /// Component of the signal of a perception.
    #[error("component {0} of the signal")]
    Signal(usize),
    /// Steady value of a variable.
    #[error("rate of variable {0} in the steady state (its unit per second)")]
    Steady(usize),
    /// Value of a variable at t = 0.
    #[error("initial variable {0}")]
    Initial(usize),
    /// Rate of a variable.
    #[error("rate of variable {0} (its unit per second)")]
    Rate(usize),
    /// Rate of a variable that `coupled_rates` writes.
    #[error("rate of variable {0} by `coupled_rates` (its unit per second)")]
    CoupledRate(usize),
    /// Component of the growth gradient, 1/m.
    #[error("component of the growth gradient along d{} (1/m)", .0 + 1)]
    Gradient(usize),
    /// Signed distance of a place from an obstacle, m.
    #[error("signed distance from the obstacle (m)")]
    Clearance,
    /// Norm of the normal of an obstacle.
    #[error("norm of the normal")]
    NormalLength,
    /// Component of the normal of an obstacle.
    #[error("component {} of the normal", ["x", "y", "z"].get(*.0).unwrap_or(&"?"))]
    Normal(usize),
    /// Entry of the curvature of an obstacle: row and column, 1/m.
    #[error("entry {}, {} of the curvature (1/m)", .0 + 1, .1 + 1)]
    Curvature(usize, usize),
}

/// Place at which a law was evaluated.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Where {
    /// Arguments of the check.
    #[error("in the arguments of the check")]
    Arguments,
    /// Elastic strain, components along the directors, 1/m.
    #[error("at the elastic strain {} 1/m", Components(.0))]
    Strain(Vector3<f64>),
    /// Force in the rod, components along the directors, N.
    #[error("under the force {} N", Components(.0))]
    Force(Vector3<f64>),
    /// Distance from the apex (m) and time (s).
    #[error("at {:.5} m from the apex and {} s", Number(*sigma), Number(*time))]
    Growing {
        /// Distance from the apex, m.
        sigma: f64,
        /// Time, s.
        time: f64,
    },
    /// Place beside an obstacle.
    #[error("at {} m beside surface {surface}", Components(place))]
    Place {
        /// Place in the fixed frame, m.
        place: Vector3<f64>,
        /// Index of the surface of the obstacle.
        surface: usize,
    },
    /// Site of a tropism law.
    #[error("at site {index}, {:.5} m from the base", Number(*arc_length))]
    Site {
        /// Index of the site among those given.
        index: usize,
        /// Arc length of the site from the base, m.
        arc_length: f64,
    },
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
    /// Value of the quantity: what the law returns, or for a derivative the difference quotient of
    /// what it returns.
    pub value: f64,
    /// Value that follows from the other methods of the law. NaN if the requirement is no single
    /// value.
    pub expected: f64,
    /// Definition of the expected value.
    pub requirement: &'static str,
}

impl fmt::Display for LawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            law,
            quantity,
            place,
            value,
            expected,
            requirement,
        } = self;
        let law = describe_type(law);
        write!(
            f,
            "the {quantity} of {law} is {:.7} {place} but must be ",
            Number(*value)
        )?;
        if expected.is_nan() {
            write!(f, "{requirement}")
        } else {
            write!(f, "{:.7}: {requirement}", Number(*expected))
        }
    }
}

/// Describes a law by the name of its type. That of a law which is chosen at run time, behind a
/// pointer, does not name it.
pub(crate) fn describe_type(law: &str) -> String {
    let pointers = [
        "alloc::sync::Arc<dyn ",
        "alloc::rc::Rc<dyn ",
        "alloc::boxed::Box<dyn ",
        "dyn ",
    ];
    let known = !pointers
        .iter()
        .any(|pointer| law.trim_start_matches('&').starts_with(pointer));
    if known {
        format!("`{law}`")
    } else {
        "a law that was chosen at run time".to_owned()
    }
}

impl std::error::Error for LawError {}

debug_by_display!(LawError);

/// Result of a check.
pub(super) type Checked = Result<(), LawError>;

/// A law and a place at which its quantities are compared.
#[derive(Clone, Copy)]
pub(super) struct At {
    pub law: &'static str,
    pub place: Where,
}

impl At {
    /// The place of a law of type `L`.
    pub fn of<L: ?Sized>(place: Where) -> Self {
        Self {
            law: std::any::type_name::<L>(),
            place,
        }
    }

    /// Returns an error for a check of a law of type `L` at no point.
    pub fn of_points<L: ?Sized>(number: usize) -> Checked {
        let at = Self::of::<L>(Where::Arguments);
        if number > 0 {
            Ok(())
        } else {
            Err(at.error(Quantity::Points, [0.0, f64::NAN], "at least 1"))
        }
    }

    /// The error of a value.
    pub fn error(
        self,
        quantity: Quantity,
        [value, expected]: [f64; 2],
        requirement: &'static str,
    ) -> LawError {
        let Self { law, place } = self;
        LawError {
            law,
            quantity,
            place,
            value,
            expected,
            requirement,
        }
    }

    /// Returns an error for a value that is not finite.
    pub fn finite(self, quantity: Quantity, value: f64) -> Checked {
        if value.is_finite() {
            Ok(())
        } else {
            Err(self.error(quantity, [value, f64::NAN], "finite"))
        }
    }

    /// Returns an error unless the two values differ by at most a tolerance; NaN is an error.
    pub fn equal(
        self,
        quantity: Quantity,
        values: [f64; 2],
        tolerance: f64,
        requirement: &'static str,
    ) -> Checked {
        let equal = (values[0] - values[1]).abs() <= tolerance;
        if equal {
            Ok(())
        } else {
            Err(self.error(quantity, values, requirement))
        }
    }
}
