//! Ends of contact segments, which nodes approach in a sequence of placements.

/// Smallest and largest factor by which a motion is extrapolated. They belong to distances that
/// change by the ratios −1 and 0.9.
const EXTRAPOLATION: (f64, f64) = (0.5, 10.0);

/// The end of a contact segment, at which nodes are placed repeatedly.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub obstacle: usize,
    /// Direction along the rod from the contact to its free side.
    pub outward: f64,
    /// Arc length of its node, m.
    pub node: f64,
    /// The node in the placement before, m, and the motion from it to the end that was found with
    /// it, m.
    pub before: Option<(f64, f64)>,
}

impl End {
    /// The next place of the node for an end `found` (m) of the present shape. The distances of
    /// nodes from the ends that are found with them are assumed to change by a constant ratio
    /// (Aitken's extrapolation), since the shape of a coarse rod depends on its nodes. An end
    /// farther than two largest motions from all earlier ones is new. The node moves by at most
    /// `longest` (m).
    pub fn after(
        ends: &[Self],
        (obstacle, outward, found): (usize, f64, f64),
        longest: f64,
    ) -> Self {
        let distance = |end: &Self| (end.node - found).abs();
        let same = ends
            .iter()
            .filter(|end| end.obstacle == obstacle && end.outward == outward);
        let nearest = same.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(end) = nearest.filter(|end| distance(end) < 2.0 * longest) else {
            return Self {
                obstacle,
                outward,
                node: found,
                before: None,
            };
        };
        let moved = found - end.node;
        let factor = end.before.map_or(1.0, |(node, moved_before)| {
            (end.node - node) / (moved_before - moved)
        });
        let (shortest, largest) = EXTRAPOLATION;
        let factor = if (shortest..=largest).contains(&factor) {
            factor
        } else {
            1.0
        };
        let by = (factor * moved).clamp(-longest, longest);
        Self {
            obstacle,
            outward,
            node: end.node + by,
            before: Some((end.node, moved)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distances of the node from the end of the shape with it, which is at 1 + `ratio` (node −
    /// 1).
    fn distances(ratio: f64) -> Vec<f64> {
        let (mut ends, mut node) = (Vec::new(), 1.2);
        let mut distances = Vec::new();
        for _ in 0..5 {
            let found = 1.0 + ratio * (node - 1.0);
            let end = End::after(&ends, (0, 1.0, found), 0.5);
            ends = vec![
                End::after(&[], (1, 1.0, found), 0.5),
                end,
                End::after(&[], (0, -1.0, found), 0.5),
            ];
            node = end.node;
            distances.push((node - 1.0).abs());
        }
        distances
    }

    #[test]
    fn distances_that_decrease_in_proportion_vanish_at_the_third_placement() {
        for ratio in [0.8, 0.5, 0.06, 0.0, -0.3, -0.9] {
            let distances = distances(ratio);
            assert!(
                distances[1] >= 0.99 * ratio.abs() * distances[0],
                "{ratio}: {distances:?}"
            );
            assert!(distances[2] < 1e-12, "{ratio}: {distances:?}");
        }
    }

    #[test]
    fn motion_is_limited_and_distances_that_increase_are_not_extrapolated() {
        let end = End {
            obstacle: 0,
            outward: 1.0,
            node: 1.0,
            before: Some((0.9, 0.05)),
        };
        assert_eq!(End::after(&[end], (0, 1.0, 1.1), 0.3).node, 1.1);
        assert_eq!(End::after(&[end], (0, 1.0, 1.5), 0.3).node, 1.3);
        assert_eq!(End::after(&[end], (0, 1.0, 2.0), 0.3).before, None);
    }
}
