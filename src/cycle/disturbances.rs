//! Disturbances of an orbit: in the plane of a planar orbit, out of it, or without such a
//! distinction.

/// A quantity of each disturbance of an orbit, such as its multiplier.
#[derive(Debug, Clone, PartialEq)]
pub enum Disturbances<T> {
    /// Disturbances of a planar orbit, if the laws do not couple motion in the plane with motion
    /// out of it.
    Planar {
        /// Disturbances in the plane of the orbit.
        in_plane: Vec<T>,
        /// Disturbances out of it.
        out_of_plane: Vec<T>,
    },
    /// Disturbances of any other orbit.
    Spatial(Vec<T>),
}

impl<T> Disturbances<T> {
    /// The quantities of all disturbances, those in the plane first.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.lists().into_iter().flatten()
    }

    /// The list of disturbances in the plane, or of all, and the list of those out of it.
    pub(super) fn lists(&self) -> [&[T]; 2] {
        match self {
            Self::Planar {
                in_plane,
                out_of_plane,
            } => [in_plane, out_of_plane],
            Self::Spatial(all) => [all, &[]],
        }
    }

    /// Converts the list or lists.
    pub(super) fn map<U>(self, mut of: impl FnMut(Vec<T>) -> Vec<U>) -> Disturbances<U> {
        match self {
            Self::Planar {
                in_plane,
                out_of_plane,
            } => Disturbances::Planar {
                in_plane: of(in_plane),
                out_of_plane: of(out_of_plane),
            },
            Self::Spatial(all) => Disturbances::Spatial(of(all)),
        }
    }
}
