//! Sets of indices that depend on each other: the connected components of a graph.

/// The sets of 0..n whose members are connected by some pairs, directly or through others, each in
/// ascending order.
pub(super) fn connected(n: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Vec<Vec<usize>> {
    // The label of a set is its least member.
    let mut label: Vec<usize> = (0..n).collect();
    for (i, j) in pairs {
        let (least, other) = (label[i].min(label[j]), label[i].max(label[j]));
        if least != other {
            label
                .iter_mut()
                .filter(|name| **name == other)
                .for_each(|name| *name = least);
        }
    }
    let mut sets = vec![Vec::new(); n];
    label
        .iter()
        .enumerate()
        .for_each(|(i, &least)| sets[least].push(i));
    sets.retain(|set| !set.is_empty());
    sets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_of_a_set_are_connected_directly_or_through_others() {
        let pairs = [(4, 1), (2, 5), (1, 0), (5, 5), (0, 4)];
        assert_eq!(
            connected(6, pairs.into_iter()),
            [vec![0, 1, 4], vec![2, 5], vec![3]]
        );
        assert_eq!(connected(3, [].into_iter()), [[0], [1], [2]]);
        assert!(connected(0, [].into_iter()).is_empty());
    }
}
