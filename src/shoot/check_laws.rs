//! Check of the laws of a shoot at its own places.

use nalgebra::{UnitQuaternion, Vector3};

use super::Shoot;
use crate::check::{self, LawError, Where};
use crate::load::InternalForce;
use crate::model::{GrowthLaw, Model};
use crate::sensing::visit_sites;
use crate::tropism::{Declaration, Site};

/// Number of places at which the elastic law and the growth law are checked.
const PLACES: usize = 5;
/// Rotation that inclines a site, rad: a generic one, since the stimuli of an upright shoot are
/// zero.
const INCLINE: [f64; 3] = [0.5, -0.3, 0.0];
/// Part of a growth time over which the motion of points is checked.
const SPAN: f64 = 0.1;

impl<M: Model> Shoot<M> {
    /// Checks that the methods of the growth law, of the elastic law and of the tropism law agree
    /// with each other, by the functions of the module [`check`](crate::check). The points are
    /// places along the shoot at the present time, with their tissue, force and stimuli. As the
    /// shoot may be straight and upright, a bend of a radius of the length is added to the strain,
    /// and tropisms are also checked at inclined sites.
    ///
    /// A test of a model calls it once. Integrators do not call it.
    ///
    /// # Errors
    /// The first quantity that is not finite or contradicts the others. Sites are counted from the
    /// first material point of the growth zone.
    pub fn check_laws(&self) -> Result<(), LawError> {
        let (rod, profile, bend) = (
            self.rod(),
            self.profile(),
            Vector3::from(check::STRAINS[0]) / self.rod().length(),
        );
        for place in profile.sample(PLACES) {
            let force = place.frame.inverse_transform_vector(&place.force);
            let strain = place.strain - place.intrinsic + bend;
            check::elastic_law(self.model.constitutive(), &place.tissue, &[(strain, force)])?;
        }
        let (growth, time) = (self.model.growth(), self.environment().time);
        let zone = growth.zone_length().min(rod.length());
        let points: Vec<_> = (1..=PLACES)
            .map(|k| (zone * k as f64 / (PLACES + 1) as f64, time))
            .collect();
        let rate = points
            .iter()
            .map(|(sigma, time)| growth.regr(*sigma, *time).abs())
            .fold(0.0, f64::max);
        check::growth_law(growth, &points, if rate > 0.0 { SPAN / rate } else { 0.0 })?;
        self.check_tropism(&bend)
    }

    fn check_tropism(&self, bend: &Vector3<f64>) -> Result<(), LawError> {
        let (rod, law, incline) = (
            self.rod(),
            self.model.tropism(),
            UnitQuaternion::new(Vector3::from(INCLINE)),
        );
        let mut force = InternalForce::of(rod, self.model.load(), &self.environment());
        force.react(rod, rod.reactions());
        let with_position = Declaration::of(law).reads_position();
        let mut first = Ok(());
        visit_sites(
            rod,
            self.model.constitutive(),
            &force,
            with_position,
            |index, site| {
                let inclined = Site {
                    frame: site.frame * incline,
                    strain: site.strain + bend,
                    ..*site
                };
                let place = Where::Site {
                    index,
                    arc_length: site.arc_length,
                };
                for site in [site, &inclined] {
                    let checked = check::tropism_law(law, &[*site])
                        .map_err(|error| LawError { place, ..error });
                    first = std::mem::replace(&mut first, Ok(())).and(checked);
                }
            },
        );
        first
    }
}
