//! Ends of the elements of a new shoot.

use super::{MOST_ELEMENTS, SAME_PLACE};
use crate::error::ParameterError;

/// Equally spaced nodes behind the growth zone, and equally spaced nodes in it, at distances of at
/// most `longest` (m). `mature` is the length of the part behind the zone (m).
pub(super) fn equal_nodes(
    length: f64,
    mature: f64,
    longest: f64,
) -> Result<Vec<f64>, ParameterError> {
    check_number(length, longest)?;
    // An excess of rounding over a whole number of elements does not add an element.
    let count = |length: f64| (length / longest * (1.0 - 1e-12)).ceil() as usize;
    let (below, above) = (count(mature), count(length - mature).max(1));
    let mut nodes: Vec<f64> = (0..below)
        .map(|i| mature * i as f64 / below as f64)
        .collect();
    nodes.extend((0..=above).map(|i| mature + (length - mature) * i as f64 / above as f64));
    Ok(nodes)
}

/// Checks the `nodes` of the user and adds one at the end of the mature part. Returns them with the
/// length of the longest element in the growth zone (m).
pub(super) fn user_nodes(
    nodes: &[f64],
    length: f64,
    mature: f64,
) -> Result<(Vec<f64>, f64), ParameterError> {
    let (count, requirement) = (nodes.len(), "at least 2, the ends of the shoot");
    let &[first, .., last] = nodes else {
        return Err(ParameterError::refused(
            "number of nodes",
            count as f64,
            requirement,
        ));
    };
    ParameterError::unless(first == 0.0, "arc length of the first node", first, "0 (m)")?;
    let spans = (last - length).abs() <= SAME_PLACE * length;
    ParameterError::unless(spans, "arc length of the last node", last, "the length (m)")?;
    for ends in nodes.windows(2) {
        let requirement = "larger than that of the node before it (m)";
        ParameterError::unless(
            ends[1] > ends[0],
            "arc length of a node",
            ends[1],
            requirement,
        )?;
    }
    let mut nodes = nodes.to_vec();
    nodes.pop();
    nodes.push(length);
    insert_node(&mut nodes, mature);
    let growing = nodes
        .windows(2)
        .filter(|ends| ends[0] >= mature * (1.0 - SAME_PLACE));
    let longest = growing.map(|ends| ends[1] - ends[0]).fold(0.0, f64::max);
    check_number(length, longest)?;
    Ok((nodes, longest))
}

/// Returns an error if elements of the length `longest` (m) would exceed the largest number of
/// elements.
fn check_number(length: f64, longest: f64) -> Result<(), ParameterError> {
    let number = length / longest;
    let requirement = "below 1e6, if all are as long as those of the growth zone: are its length (m) and the number right?";
    ParameterError::unless(
        number < MOST_ELEMENTS,
        "number of elements over the whole length",
        number,
        requirement,
    )
}

/// Inserts a node at an arc length (m), unless there is one at the same place. Returns the arc
/// length of the node.
pub(super) fn insert_node(nodes: &mut Vec<f64>, place: f64) -> f64 {
    let length = nodes.last().copied().unwrap_or(0.0);
    if let Some(node) = nodes
        .iter()
        .find(|node| (**node - place).abs() <= SAME_PLACE * length)
    {
        return *node;
    }
    nodes.insert(nodes.partition_point(|node| *node < place), place);
    place
}
