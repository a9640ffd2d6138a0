//! The laws of a shoot as one type.

use std::fmt;
use std::sync::Arc;

use crate::error::ParameterError;
use crate::growth::check_speed;
use crate::pointers::forward_pointers;
use crate::scene::Still;
use crate::tropism::Declaration;
// The traits of the six laws, for modules that use a model.
pub(crate) use crate::{constitutive::Constitutive, growth::GrowthLaw, load::Load};
pub(crate) use crate::{scene::Scene, support::Support, tropism::TropismLaw};

/// The laws of a shoot: growth, tropism, elasticity, load, scene and support.
///
/// [`Laws`] is the usual model. A type of your own can be a model as well, for example to store
/// further data beside the laws. A function that accepts any shoot has the signature `fn
/// follow(shoot: &mut Shoot<impl Model>)`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a model",
    note = "laws together are a model: `morphorod::Laws {{ constitutive, growth, tropism, load, scene, support }}`"
)]
pub trait Model {
    /// Type of the growth law.
    type Growth: GrowthLaw;
    /// Type of the tropism law.
    type Tropism: TropismLaw;
    /// Type of the elastic law.
    type Constitutive: Constitutive;
    /// Type of the load.
    type Load: Load;
    /// Type of the scene.
    type Scene: Scene;
    /// Type of the support; `()` for none.
    type Support: Support;

    /// The growth law.
    fn growth(&self) -> &Self::Growth;
    /// The tropism law, which may be a tuple of laws.
    fn tropism(&self) -> &Self::Tropism;
    /// The elastic law.
    fn constitutive(&self) -> &Self::Constitutive;
    /// The load, which may be a tuple of loads.
    fn load(&self) -> &Self::Load;
    /// The scene: gravity and the base.
    fn scene(&self) -> &Self::Scene;
    /// The support: what holds the shoot besides its base, and what it may touch.
    fn support(&self) -> &Self::Support;
}

/// The first time after `t` (s) at which a law, a load or the scene of a model has a discontinuity;
/// infinite without one.
///
/// # Errors
/// A law that returns a time that is not later than `t`, or NaN.
pub(crate) fn next_discontinuity(model: &impl Model, t: f64) -> Result<f64, ParameterError> {
    let announced = [
        (
            "next discontinuity of the growth law",
            model.growth().next_discontinuity(t),
        ),
        (
            "next discontinuity of the load",
            model.load().next_discontinuity(t),
        ),
        (
            "next discontinuity of the scene",
            model.scene().next_discontinuity(t),
        ),
        (
            "next discontinuity of the tropism laws",
            model.tropism().next_discontinuity(t),
        ),
        (
            "next discontinuity of the support",
            model.support().next_discontinuity(t),
        ),
    ];
    announced
        .into_iter()
        .try_fold(f64::INFINITY, |first, (name, time)| {
            ParameterError::unless(
                time > t,
                name,
                time,
                "later than the time for which it is requested (s)",
            )?;
            Ok(first.min(time))
        })
}

/// Returns an error for a shoot with a support, whose shape cannot rotate about the tangent of the
/// base in general.
pub(crate) fn check_unsupported(model: &impl Model) -> Result<(), ParameterError> {
    let (name, requirement) = (
        "number of supports",
        "zero for rotating waves and orbits that return rotated",
    );
    ParameterError::unless(model.support().is_absent(), name, 1.0, requirement)
}

/// Returns an error for the first parameter that is out of range for a shoot of the given initial
/// length (m).
pub(crate) fn check(model: &impl Model, length: f64) -> Result<(), ParameterError> {
    model.growth().check(length)?;
    check_speed(model.growth(), length)?;
    model.tropism().check()?;
    let declaration = Declaration::of(model.tropism());
    declaration.check()?;
    let different = 1 + usize::from(Declaration::of(model.tropism()) != declaration);
    let requirement = "since `declare` is called repeatedly";
    ParameterError::count(
        "number of declarations of the tropism laws",
        [different, 1],
        requirement,
    )?;
    model.constitutive().check()?;
    model.load().check()?;
    model.scene().check()?;
    check_support(model.support())?;
    let zone = model.growth().zone_length();
    ParameterError::unless(
        zone > 0.0,
        "length of the growth zone",
        zone,
        "positive (m)",
    )
}

/// Returns an error for a parameter out of range, and for a support that is absent and has
/// conditions, which would have no effect.
fn check_support(support: &impl Support) -> Result<(), ParameterError> {
    support.check()?;
    if !support.is_absent() {
        return Ok(());
    }
    let conditions =
        support.holds(0.0).len() + support.potentials().len() + support.contacts().len();
    let ignored = conditions + usize::from(support.base().is_some());
    let (name, requirement) = (
        "number of conditions of a support that `is_absent`",
        "since they have no effect",
    );
    ParameterError::count(name, [ignored, 0], requirement)
}

forward_pointers!(Model {
    type Growth;
    type Tropism;
    type Constitutive;
    type Load;
    type Scene;
    type Support;
    fn growth() -> &T::Growth;
    fn tropism() -> &T::Tropism;
    fn constitutive() -> &T::Constitutive;
    fn load() -> &T::Load;
    fn scene() -> &T::Scene;
    fn support() -> &T::Support;
});

/// The usual [`Model`]: a struct of its laws.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub struct Laws<C, G = (), T = (), L = (), S = Still, U = ()> {
    /// The elastic law.
    pub constitutive: C,
    /// The growth law.
    pub growth: G,
    /// The tropism law, or a tuple of laws.
    pub tropism: T,
    /// The load, or a tuple of loads.
    pub load: L,
    /// The scene: gravity and the base.
    pub scene: S,
    /// The support, or a tuple of supports.
    pub support: U,
}

impl<C, G, T, L, S, U> Laws<C, G, T, L, S, U> {
    /// Replaces the elastic law.
    pub fn with_constitutive<N: Constitutive>(self, constitutive: N) -> Laws<N, G, T, L, S, U> {
        let Self {
            growth,
            tropism,
            load,
            scene,
            support,
            ..
        } = self;
        Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            support,
        }
    }

    /// Replaces the growth law.
    pub fn with_growth<N: GrowthLaw>(self, growth: N) -> Laws<C, N, T, L, S, U> {
        let Self {
            constitutive,
            tropism,
            load,
            scene,
            support,
            ..
        } = self;
        Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            support,
        }
    }

    /// Replaces the tropism law by a law or a tuple of laws.
    pub fn with_tropism<N: TropismLaw>(self, tropism: N) -> Laws<C, G, N, L, S, U> {
        let Self {
            constitutive,
            growth,
            load,
            scene,
            support,
            ..
        } = self;
        Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            support,
        }
    }

    /// Replaces the load by a load or a tuple of loads.
    pub fn with_load<N: Load>(self, load: N) -> Laws<C, G, T, N, S, U> {
        let Self {
            constitutive,
            growth,
            tropism,
            scene,
            support,
            ..
        } = self;
        Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            support,
        }
    }

    /// Replaces the scene.
    pub fn with_scene<N: Scene>(self, scene: N) -> Laws<C, G, T, L, N, U> {
        let Self {
            constitutive,
            growth,
            tropism,
            load,
            support,
            ..
        } = self;
        Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            support,
        }
    }

    /// Replaces the support by a support or a tuple of supports.
    pub fn with_support<N: Support>(self, support: N) -> Laws<C, G, T, L, S, N> {
        let Self {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            ..
        } = self;
        Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
            support,
        }
    }
}

/// Laws that are chosen at run time. A clone shares its laws with the original.
///
/// Dynamic dispatch does not change the results, which are equal bit for bit.
///
/// ```
/// use morphorod::constitutive::LinearElastic;
/// use morphorod::load::Weight;
/// use morphorod::{DynLaws, Shoot};
///
/// let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
/// let light = Shoot::builder(tissue).length(0.05).radius(5e-4);
/// let heavy = light.clone().load(Weight { density: 1000.0 });
/// // Shoots of different models in one list.
/// let shoots: Vec<Shoot<DynLaws>> = vec![light.into_dyn().build()?, heavy.into_dyn().build()?];
/// # let _ = shoots;
/// # Ok::<(), morphorod::ParameterError>(())
/// ```
pub type DynLaws = Laws<
    Arc<dyn Constitutive + Send + Sync>,
    Arc<dyn GrowthLaw + Send + Sync>,
    Arc<dyn TropismLaw + Send + Sync>,
    Arc<dyn Load + Send + Sync>,
    Arc<dyn Scene + Send + Sync>,
    Arc<dyn Support + Send + Sync>,
>;

impl<C, G, T, L, S, U> Laws<C, G, T, L, S, U>
where
    C: Constitutive + Send + Sync + 'static,
    G: GrowthLaw + Send + Sync + 'static,
    T: TropismLaw + Send + Sync + 'static,
    L: Load + Send + Sync + 'static,
    S: Scene + Send + Sync + 'static,
    U: Support + Send + Sync + 'static,
{
    /// Converts the laws to the common type [`DynLaws`], for collections of shoots with different
    /// laws.
    pub fn into_dyn(self) -> DynLaws {
        Laws {
            constitutive: Arc::new(self.constitutive),
            growth: Arc::new(self.growth),
            tropism: Arc::new(self.tropism),
            load: Arc::new(self.load),
            scene: Arc::new(self.scene),
            support: Arc::new(self.support),
        }
    }
}

/// Implements `Debug` by the name of the trait, since laws need not be `Debug`.
macro_rules! debug_by_name {
    ($($Trait:ident),*) => {$(
        impl fmt::Debug for dyn $Trait + Send + Sync {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(concat!("dyn ", stringify!($Trait)))
            }
        }
    )*};
}

debug_by_name!(Constitutive, GrowthLaw, TropismLaw, Load, Scene, Support);

impl<C: Constitutive, G: GrowthLaw, T: TropismLaw, L: Load, S: Scene, U: Support> Model
    for Laws<C, G, T, L, S, U>
{
    type Growth = G;
    type Tropism = T;
    type Constitutive = C;
    type Load = L;
    type Scene = S;
    type Support = U;

    fn growth(&self) -> &G {
        &self.growth
    }
    fn tropism(&self) -> &T {
        &self.tropism
    }
    fn constitutive(&self) -> &C {
        &self.constitutive
    }
    fn load(&self) -> &L {
        &self.load
    }
    fn scene(&self) -> &S {
        &self.scene
    }
    fn support(&self) -> &U {
        &self.support
    }
}
