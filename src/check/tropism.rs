//! Check of tropism laws, and of the perceptions and responses of which they consist.

use nalgebra::Vector3;

use super::error::{At, LawError, Quantity, Where};
use super::sensed::Sensed;
use super::symmetry::check_rotation;
use crate::pointers::forward_methods;
use crate::tropism::{
    Declaration, Growing, Memory, Perception, Response, Site, Source, TropismLaw,
};

/// Checks a tropism law at sites of a rod.
///
/// - All declared stimuli, variables and rates are written, and are finite, and so is the gradient.
/// - The rates of declared memories are those of memories, τ ẏ = x − y.
/// - [`coupled_rates`](TropismLaw::coupled_rates) equals [`rates`](TropismLaw::rates), and needs
///   none of the variables that it may omit.
/// - The gradient does not depend on variables that are declared
///   [unread](crate::tropism::Variable::unread).
/// - The rates vanish at [`steady`](TropismLaw::steady).
/// - After a rotation of d1 and d2 about d3 the stimuli are those that their declared
///   [rotation](crate::tropism::Rotation) yields.
/// - If the rotations of all stimuli and variables are declared, rates and gradient rotate with d1
///   and d2. Terms of the gradient without variables may have a direction of their own, as that of
///   an [`Oscillator`](crate::tropism::Oscillator). A law that responds more strongly along one
///   director declares its stimuli by [`stimuli`](Declaration::stimuli), without a rotation.
///
/// A rotation does not tell which component of a pair has the wrong sign: one of both is reported.
///
/// [`Site::new`] creates a site of a rod; the law reads its other fields, too. The base should be
/// inclined, so that no stimulus is zero. A law that indexes beyond its declared numbers panics
/// here as it does in a run.
///
/// # Errors
/// The first quantity that is not finite or contradicts the others, and a check without sites.
pub fn tropism_law<T: TropismLaw>(law: &T, sites: &[Site]) -> Result<(), LawError> {
    At::of_points::<T>(sites.len())?;
    let declaration = Declaration::of(law);
    for (index, site) in sites.iter().enumerate() {
        let at = At::of::<T>(Where::Site {
            index,
            arc_length: site.arc_length,
        });
        Sensed::new(law, &declaration, at, site)?.check()?;
        check_rotation(law, &declaration, at, site)?;
    }
    Ok(())
}

/// Checks a response: the [perception](perception()) and the law that it becomes with a memory, see
/// [`tropism_law`].
///
/// # Errors
/// The first quantity that is not finite or contradicts the others, and a check without sites.
pub fn response<R: Response>(response: &R, sites: &[Site]) -> Result<(), LawError> {
    perception(response.perception(), sites)?;
    let named = |error: LawError| LawError {
        law: std::any::type_name::<R>(),
        ..error
    };
    tropism_law(&response.remembered(Memory::default()), sites).map_err(named)
}

/// Checks a perception at sites of a rod: as [`tropism_law`] checks a law, and whether the source
/// that [`declare`](Perception::declare) returns is the [signal](Perception::signal).
///
/// # Errors
/// The first quantity that is not finite or contradicts the others, and a check without sites.
pub fn perception<P: Perception>(perception: &P, sites: &[Site]) -> Result<(), LawError> {
    At::of_points::<P>(sites.len())?;
    let (law, mut declaration) = (Perceiving(perception), Declaration::default());
    let source = perception.declare(&mut declaration);
    let named = |error: LawError| LawError {
        law: std::any::type_name::<P>(),
        ..error
    };
    for (index, site) in sites.iter().enumerate() {
        let at = At::of::<P>(Where::Site {
            index,
            arc_length: site.arc_length,
        });
        let sensed = Sensed::new(&law, &declaration, at, site)?;
        for variables in &sensed.states {
            let signal = perception.signal(variables, &sensed.stimuli);
            for (k, value) in signal.as_ref().iter().enumerate() {
                let declared = match source.offset(k) {
                    Source::Stimulus(i) => sensed.stimuli.get(i),
                    Source::Variable(i) => variables.get(i),
                    Source::Computed => Some(value),
                };
                let values = [*value, declared.copied().unwrap_or(f64::NAN)];
                at.equal(
                    Quantity::Signal(k),
                    values,
                    0.0,
                    "the stimulus or variable that is declared as its source",
                )?;
            }
        }
    }
    tropism_law(&law, sites).map_err(named)
}

/// A perception as a law without a gradient. Its variables are unread.
struct Perceiving<'a, P>(&'a P);

impl<P: Perception> TropismLaw for Perceiving<'_, P> {
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
    fn declare(&self, to: &mut Declaration) {
        let _ = self.0.declare(to);
    }
    forward_methods!(self, Perception of self.0 =>
        fn sense(site: &Site, stimuli: &mut [f64]);
        fn rates(variables: &[f64], stimuli: &[f64], rates: &mut [f64]);
        fn steady(stimuli: &[f64], variables: &mut [f64]);
        fn initial(stimuli: &[f64], variables: &mut [f64]);
    );
}
