//! Ensembles of shoots: results do not depend on threads, parts and interruptions, and failures do
//! not end them.

use std::fmt::Write;

use morphorod::ensemble::{Shard, run};
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};

use crate::fixtures::shoots::reduced;

/// Number of members.
const COUNT: usize = 12;

/// The largest distance of the tip from the vertical. Member 7 has a time step of zero.
fn member(index: usize) -> Result<f64, IntegrationError> {
    let mut shoot = reduced(0.05 + 0.002 * index as f64, 72e3)
        .into_dyn()
        .elements(2)
        .build()?;
    shoot.set_intrinsic(|_| morphorod::nalgebra::Vector3::new(0.3, 0.1, 0.0));
    let mut largest = 0.0_f64;
    let step = if index == 7 { 0.0 } else { 360.0 };
    let times = (0..=4).map(|k| 450.0 * f64::from(k));
    let look = |shoot: &morphorod::Shoot<_>| largest = largest.max(shoot.tip().xy().norm());
    let _ = MethodOfSteps::new(step).advance_showing(&mut shoot, 1800.0, times, look)?;
    Ok(largest)
}

/// The results of a part as text, after `done` members whose results exist.
fn text(shard: Shard, done: usize, threads: usize) -> String {
    let mut text = String::new();
    let members = (0..COUNT).filter(|index| shard.contains(*index)).skip(done);
    run(members, threads, member, |index, result| match result {
        Ok(swing) => writeln!(text, "{index},{swing:e}"),
        Err(error) => writeln!(text, "{index},{error}"),
    })
    .unwrap();
    text
}

#[test]
fn text_of_an_ensemble_depends_neither_on_threads_nor_on_parts_nor_on_interruptions() {
    let whole = text(Shard::WHOLE, 0, 1);
    assert_eq!(whole.lines().count(), COUNT);
    assert_eq!(text(Shard::WHOLE, 0, 3), whole);
    let parts: Vec<String> = (1..=2)
        .map(|number| text(Shard::new(number, 2).unwrap(), 0, 2))
        .collect();
    let joined: Vec<&str> = (0..COUNT)
        .filter_map(|index| parts[index % 2].lines().nth(index / 2))
        .collect();
    assert_eq!(joined, whole.lines().collect::<Vec<_>>());
    // The lines that an interrupted run has written, and those of the run that continues it.
    let written: String = whole.split_inclusive('\n').take(5).collect();
    assert_eq!(written + &text(Shard::WHOLE, 5, 2), whole);
}

#[test]
fn failed_shoot_is_reported_with_its_index_and_error() {
    let whole = text(Shard::WHOLE, 0, 2);
    let failed: Vec<&str> = whole.lines().filter(|line| line.contains("step")).collect();
    assert_eq!(failed, [format!("7,{}", member(7).unwrap_err())]);
}

#[test]
fn parts_that_do_not_exist_are_refused() {
    let refused = |text: &str, words: &str| {
        let error = text.parse::<Shard>().unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
    };
    refused(
        "9/8",
        "number of a shard is 9 but must be from 1 to the number of shards",
    );
    refused("1/0", "number of shards is 0 but must be at least 1");
    for text in ["", "1", "a/b", "-1/8", "1 / 8"] {
        refused(
            text,
            "number of a shard is missing: it must be whole, and followed by that of all shards, as in 2/8",
        );
    }
}
