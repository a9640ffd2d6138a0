//! The contacts of a rod: those that a step gains and loses, and the search with all of them.

use super::arrange::place_along;
use super::correct::FOLLOWING;
use super::data::HeldSearch;
use super::sites::Site;
use super::touch::{CLEAR, Penetration, Place, SAME, Sampling, is_deep, penetrations};
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::load::Load;
use crate::rod::Rod;

/// Number of changes of the contacts in one search.
const CHANGES: usize = 30;
/// Largest number of Newton iterations of an increment with contacts, unless a caller asks for more. Without a bound an
/// increment with a hundred contacts may take minutes and fail.
const MOST_ITERATIONS: usize = 1200;
/// Number of changes after which smaller penetrations and slopes at contacts are accepted.
const PATIENCE: i32 = 8;
/// Largest factor by which these are larger then.
const LARGEST_LENIENCY: f64 = 1e3;
/// Largest gap, relative to an element, between two contacts that are one at first. Contacts that the elements do not
/// resolve yet alternate with small gaps.
const TOUCHING: f64 = 1e-4;

/// Lengths over which a rod bends on the elastic foundations in the place of the obstacles, relative to an element. On
/// a stiffer one the rod penetrates less, but a force at a point acts on fewer stations.
const FOUNDATIONS: [f64; 3] = [1.0, 0.5, 0.25];
/// Number of Newton iterations for given contacts after which these are estimated with elastic foundations.
const ATTEMPT: usize = 40;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Whether the rod may touch obstacles in a step.
    pub(super) fn approaches(&self) -> bool {
        !self.frozen && !self.obstacles.contacts.is_empty()
    }

    /// The arc lengths of the contacts, with their obstacles.
    pub(super) fn touches(&self, rod: &Rod) -> Vec<(usize, f64)> {
        let touching = self.sites.iter().filter_map(|site| Some((site, site.touch?)));
        touching.map(|(site, touch)| (touch.obstacle, self.place_of(rod, (site.element, site.x)).arc_length)).collect()
    }

    /// The place on the rod at the coordinate x in an element.
    pub(super) fn place_of(&self, rod: &Rod, at: (usize, f64)) -> Place {
        place_along(rod, &self.tangents, at)
    }

    /// The places at which the rod penetrates obstacles.
    pub(super) fn penetrations(&self, sampling: &Sampling, rod: &Rod) -> Vec<Penetration> {
        penetrations(sampling, &self.touches(rod), (self.length, CLEAR * self.leniency))
    }

    /// Whether the rod penetrates an obstacle so far that it may leave it on the other side.
    pub(super) fn is_deep(&self, rod: &Rod) -> bool {
        !self.obstacles.contacts.is_empty() && is_deep(&self.sampling(rod))
    }

    /// The obstacles and the stations of a rod at the last evaluated tangents.
    pub(super) fn sampling<'b>(&'b self, rod: &'b Rod) -> Sampling<'b, 'b> {
        Sampling::new(rod, &self.tangents, &self.obstacles)
    }

    /// Adds contacts where the rod penetrates obstacles: at the deepest place, and at all stations beside a contact.
    /// Unless `strict`, a contact that slides to the place of least gap is left alone. Returns whether there is a new
    /// one.
    pub(super) fn touch(&mut self, rod: &Rod, penetrations: &[Penetration], strict: bool) -> bool {
        let number = self.sites.len();
        let margin = SAME * self.length;
        for Penetration { obstacle, stations, deepest, between } in penetrations {
            let places: Vec<f64> =
                self.sites.iter().map(|site| self.place_of(rod, (site.element, site.x)).arc_length).collect();
            let near = |s: f64| s >= between.0 - margin && s <= between.1 + margin;
            let (deep, reach) = (self.place_of(rod, *deepest).arc_length, self.length / self.parent.elements() as f64);
            let slides = self.sites.iter().zip(&places).any(|(site, s)| {
                let close = near(*s) || (s - deep).abs() < reach;
                let touch = site.touch.filter(|touch| touch.obstacle == *obstacle && close);
                touch.is_some_and(|touch| touch.floats && touch.approach.1 > 0.0)
            });
            if slides && !strict {
                continue;
            }
            let mut beside = false;
            for (site, s) in self.sites.iter_mut().zip(&places) {
                if let Some(touch) = &mut site.touch
                    && touch.obstacle == *obstacle
                    && near(*s)
                {
                    beside = true;
                    touch.floats = false;
                }
            }
            if beside && !stations.is_empty() {
                let new = stations.iter().map(|at| Site::touching(*obstacle, *at, 0.0, false));
                self.sites.extend(new);
            } else {
                let at_apex = deepest.0 + 1 == rod.elements() && deepest.1 >= 1.0;
                self.sites.push(Site::touching(*obstacle, *deepest, 0.0, !at_apex));
            }
        }
        self.sites.len() > number
    }

    /// Keeps a contact at the apex if the gap would be less beyond it.
    pub(super) fn settle_apex(&mut self, rod: &Rod) {
        for site in self.sites.iter_mut().filter(|site| site.element + 1 == rod.elements() && site.x >= 1.0) {
            if let Some(touch) = &mut site.touch {
                let (slope, bend) = touch.approach;
                touch.floats &= slope > 0.0 && bend > 0.0;
            }
        }
    }

    /// Merges contacts that have slid to the same place, and removes those at the base, which does not move.
    pub(super) fn merge_sites(&mut self, rod: &Rod) {
        let mut kept: Vec<(usize, f64, usize)> = Vec::new();
        let mut i = 0;
        while i < self.sites.len() {
            let site = &self.sites[i];
            let Some(touch) = site.touch else {
                i += 1;
                continue;
            };
            let s = self.place_of(rod, (site.element, site.x)).arc_length;
            let margin = SAME * self.length;
            if s <= margin {
                self.sites.remove(i);
                continue;
            }
            let same = kept.iter().find(|(obstacle, at, _)| *obstacle == touch.obstacle && (at - s).abs() <= margin);
            if let Some((.., first)) = same
                && let Some(first) = &mut self.sites[*first].touch
            {
                first.push += touch.push;
                self.sites.remove(i);
            } else {
                kept.push((touch.obstacle, s, i));
                i += 1;
            }
        }
    }

    /// Finds an equilibrium with its contacts. If the search for them fails, they are estimated with elastic
    /// foundations in the place of the obstacles. If this fails, too, the first search is repeated with more
    /// iterations.
    pub(super) fn settle(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        if self.obstacles.contacts.is_empty() {
            return self.find_contacts(rod, bound);
        }
        self.iteration_limit = self.found.iterations + MOST_ITERATIONS.max(bound);
        let guess = self.snapshot(rod);
        let fails =
            |result: &Result<(), EquilibriumError>| result.as_ref().is_err_and(EquilibriumError::is_recoverable);
        let mut result = self.find_contacts(rod, bound.min(ATTEMPT));
        if self.quick {
            return result;
        }
        for width in FOUNDATIONS {
            if !fails(&result) {
                return result;
            }
            // The laws of supports may be invalid where the search has ended.
            self.check_end(rod)?;
            self.restore(rod, guess.clone());
            self.leniency = 1.0;
            self.foundations += 1;
            result = self.soften(rod, bound, width).and_then(|()| self.find_contacts(rod, bound));
        }
        if fails(&result) && bound > ATTEMPT {
            self.restore(rod, guess);
            self.leniency = 1.0;
            result = self.find_contacts(rod, bound);
        }
        result
    }

    /// Finds an equilibrium with its contacts: contacts that pull are released, and their places are corrected.
    fn find_contacts(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let mut touching = TOUCHING * self.length / self.parent.elements() as f64;
        if self.follow(rod, bound, touching) {
            return Ok(());
        }
        for change in 0..CHANGES {
            // Contacts with almost no force may be lost and found again in turn.
            self.leniency = 10.0_f64.powi(change as i32 - PATIENCE).clamp(1.0, LARGEST_LENIENCY);
            self.find(rod, bound)?;
            if !self.obstacles.contacts.is_empty() {
                let penetrations = self.penetrations(&self.sampling(rod), rod);
                if self.touch(rod, &penetrations, true) {
                    continue;
                }
            }
            if self.correct(rod, bound, touching)? {
                touching = (0.1 * touching).max(SAME * self.length);
                continue;
            }
            return Ok(());
        }
        Err(self.contacts_not_found(0.0))
    }

    /// The error of a search for contacts.
    pub(super) fn contacts_not_found(&self, misplacement: f64) -> EquilibriumError {
        let contacts = self.sites.iter().filter(|site| site.touch.is_some()).count();
        EquilibriumError::ContactsNotFound { iterations: self.found.iterations, contacts, misplacement }
    }

    /// Finds the equilibrium with the long contacts of the initial guess, whose ends move. Returns whether it is one;
    /// after a failure the rod and its contacts are those of the initial guess.
    fn follow(&mut self, rod: &mut Rod, bound: usize, touching: f64) -> bool {
        let patches = self.patches(rod, touching);
        if patches.is_empty() || patches.iter().any(|patch| patch.from == patch.to) {
            return false;
        }
        let guess = self.snapshot(rod);
        let found = self.correct(rod, bound.min(FOLLOWING), touching).is_ok_and(|changed| !changed);
        if found && self.penetrations(&self.sampling(rod), rod).is_empty() {
            return true;
        }
        self.restore(rod, guess);
        false
    }
}
