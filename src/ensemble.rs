//! Ensembles: many independent shoots on several threads or processes, with results in order and
//! memory that does not grow with their number.
//!
//! A member of an ensemble is a closure from an index to a result. It builds a shoot, runs it and
//! reduces the run to a few numbers while it runs. [`run`] computes the members on threads and
//! passes their results, in the order of the indices, to a second closure on the thread of the
//! caller, which writes them or adds them up. The order does not depend on the number of threads,
//! so that neither does what is written. A [`Shard`] is the part of one process, as in the job
//! array of a cluster. A run that was interrupted is resumed with the indices whose results are
//! missing: [recipes](crate::guide::recipes) has a program.
//!
//! ```
//! use morphorod::ensemble::{self, Shard};
//! use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
//! use morphorod::{ShootParameters, Still};
//!
//! // The largest height of the tip of a horizontal shoot that rises, for a sensitivity.
//! let member = |index: usize| -> Result<f64, IntegrationError> {
//!     let parameters = ShootParameters {
//!         length: 0.05,
//!         growth_time: 72e3,
//!         gravitropic_sensitivity: 0.2 * index as f64,
//!         ..Default::default()
//!     };
//!     let mut shoot = parameters.reduced().scene(Still::tilted(1.57)).build()?;
//!     let mut highest = f64::NEG_INFINITY;
//!     let times = (0..=10).map(|k| 720.0 * f64::from(k));
//!     MethodOfSteps::new(360.0).advance_showing(&mut shoot, 7200.0, times, |shoot| {
//!         highest = highest.max(shoot.tip().z);
//!     })?;
//!     Ok(highest)
//! };
//! let shard: Shard = "1/2".parse()?; // as a job array numbers its jobs
//! let members = (0..6).filter(|index| shard.contains(*index));
//! let mut failed = Vec::new();
//! ensemble::run(members, ensemble::cores(), member, |index, result| {
//!     match result {
//!         Ok(height) => println!("{index}: {height:.4} m"),
//!         Err(error) => failed.push((index, error)),
//!     }
//!     Ok::<(), std::io::Error>(())
//! })?;
//! assert!(failed.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::convert::Infallible;
use std::str::FromStr;
use std::sync::mpsc::{self, Receiver, Sender, SyncSender};
use std::sync::{Arc, Mutex};
use std::thread;

use crate::error::ParameterError;

/// Largest number of results for each thread that wait for that of an earlier member. Until then a
/// member that takes longer than others does not delay them.
const WAITING: usize = 256;

/// Part of an ensemble for one of several processes: member `number` − 1 and every `of`-th one
/// after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl Shard {
    /// The whole ensemble.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Part `number` of a number of parts, counted from one.
    ///
    /// # Errors
    /// A number that is zero or larger than that of the parts.
    pub fn new(number: usize, of: usize) -> Result<Self, ParameterError> {
        ParameterError::unless(of > 0, "number of shards", of as f64, "at least 1")?;
        let inside = (1..=of).contains(&number);
        ParameterError::unless(
            inside,
            "number of a shard",
            number as f64,
            "from 1 to the number of shards",
        )?;
        Ok(Self { number, of })
    }

    /// Whether the part contains a member, counted from zero.
    #[must_use]
    pub fn contains(&self, index: usize) -> bool {
        index % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = ParameterError;

    /// Reads `number/of`, for example `2/8`. Text that is not a whole number counts as a missing
    /// one.
    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let read = |text: &str| text.parse::<usize>().ok();
        let parts = text
            .split_once('/')
            .and_then(|(number, of)| read(number).zip(read(of)));
        let malformed = || {
            ParameterError::missing(
                "number of a shard",
                "whole, and followed by that of all shards, as in 2/8",
            )
        };
        parts
            .ok_or_else(malformed)
            .and_then(|(number, of)| Self::new(number, of))
    }
}

/// Number of threads that the machine runs at once; one if it is unknown.
#[must_use]
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// Computes members on a number of threads, and passes each index and result to `take` in the order
/// of `members`, on the thread of the caller. With less than two threads the members are computed
/// there, too.
///
/// Threads start members in order. At most 256 results for each thread wait for that of an earlier
/// member: memory does not grow with the number of members. A member that fails returns its error
/// as result, and the others continue.
///
/// # Errors
/// The first error of `take`. No member is started after it, and results of started ones are
/// dropped.
///
/// # Panics
/// If a member panics.
pub fn run<T: Send, E>(
    members: impl IntoIterator<Item = usize, IntoIter: Send>,
    threads: usize,
    member: impl Fn(usize) -> T + Sync,
    mut take: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    let mut members = members.into_iter();
    if threads < 2 {
        return members.try_for_each(|index| take(index, member(index)));
    }
    thread::scope(|scope| {
        let (sender, started) = mpsc::sync_channel(WAITING * threads);
        // The list of started members ends when the last thread has dropped the queue.
        let queue = Arc::new(Mutex::new((members, sender)));
        for _ in 0..threads {
            let (queue, member) = (Arc::clone(&queue), &member);
            scope.spawn(move || {
                while let Some((index, result)) = start(&queue) {
                    // The result is not received if `take` has failed.
                    let _ = result.send(member(index));
                }
            });
        }
        drop(queue);
        for (index, result) in started {
            // A member that panics does not send a result, and the panic continues when its thread
            // is joined.
            let Ok(result) = result.recv() else { break };
            take(index, result)?;
        }
        Ok(())
    })
}

/// Members that are not started, and the place to which the started ones are sent in order: the
/// index of each with the receiver of its result.
type Queue<I, T> = Mutex<(I, SyncSender<(usize, Receiver<T>)>)>;

/// Starts the next member. Waits as long as too many results are not taken. Returns the index of
/// the member and the sender of its result, or `None` after the last one, after an error of the
/// caller, and after a panic of the members' iterator.
fn start<T>(queue: &Queue<impl Iterator<Item = usize>, T>) -> Option<(usize, Sender<T>)> {
    let (sender, receiver) = mpsc::channel();
    let mut queue = queue.lock().ok()?;
    let index = queue.0.next()?;
    queue.1.send((index, receiver)).ok()?;
    Some((index, sender))
}

/// Results of members 0 to `count` − 1, in their order, computed on a number of threads.
///
/// # Panics
/// If a member panics.
pub fn collect<T: Send>(
    count: usize,
    threads: usize,
    member: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let mut results = Vec::with_capacity(count);
    let Ok(()) = run(0..count, threads.min(count), member, |_, result| {
        results.push(result);
        Ok::<(), Infallible>(())
    });
    results
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    /// A member whose duration depends on its index, so that threads overtake each other.
    fn uneven(index: usize) -> usize {
        thread::sleep(Duration::from_micros(50 * (index * 7 % 5) as u64));
        3 * index
    }

    #[test]
    fn results_arrive_in_order_for_any_number_of_threads() {
        for threads in [0, 1, 2, 7] {
            let mut seen = Vec::new();
            let members = (0..200).filter(|index| index % 3 != 1);
            let end: Result<(), ()> = run(members.clone(), threads, uneven, |index, result| {
                assert_eq!(result, 3 * index);
                seen.push(index);
                Ok(())
            });
            assert_eq!(
                (end, seen),
                (Ok(()), members.collect()),
                "{threads} threads"
            );
            assert_eq!(
                collect(20, threads, uneven),
                (0..20).map(|index| 3 * index).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn failed_member_is_reported_and_the_others_continue() {
        let member = |index: usize| if index == 5 { Err("five") } else { Ok(index) };
        let mut failed = Vec::new();
        let end: Result<(), ()> = run(0..10, 3, member, |index, result| {
            failed.extend(result.err().map(|error| (index, error)));
            Ok(())
        });
        assert_eq!((end, failed), (Ok(()), vec![(5, "five")]));
    }

    #[test]
    fn error_of_the_caller_ends_the_work() {
        for threads in [1, 2] {
            let started = AtomicUsize::new(0);
            let member = |index| {
                started.fetch_add(1, Ordering::Relaxed);
                index
            };
            let end = run(0..1_000_000, threads, member, |index, _| {
                if index == 5 { Err("five") } else { Ok(()) }
            });
            assert_eq!(end, Err("five"));
            assert!(
                started.into_inner() <= 6 + threads * WAITING,
                "{threads} threads"
            );
        }
    }

    /// The first member lasts until the threads wait for it.
    #[test]
    fn number_of_waiting_results_is_bounded() {
        let (started, threads) = (AtomicUsize::new(0), 3);
        let member = |index| {
            started.fetch_add(1, Ordering::SeqCst);
            while index == 0 && started.load(Ordering::SeqCst) < threads * WAITING {
                thread::yield_now();
            }
        };
        let end: Result<(), ()> = run(0..2 * threads * WAITING, threads, member, |index, ()| {
            assert!(started.load(Ordering::SeqCst) <= index + 1 + threads * WAITING);
            Ok(())
        });
        assert_eq!((end, started.into_inner()), (Ok(()), 2 * threads * WAITING));
    }

    #[test]
    fn panic_of_a_member_or_of_the_caller_reaches_the_caller() {
        let member = |index| assert!(index != 300, "member 300");
        let caught =
            std::panic::catch_unwind(|| run(0..10_000, 2, member, |_, ()| Ok::<(), ()>(())));
        assert!(caught.is_err());
        let take = |index, ()| -> Result<(), ()> {
            if index == 300 {
                panic!("caller")
            } else {
                Ok(())
            }
        };
        assert!(std::panic::catch_unwind(|| run(0..10_000, 2, |_| (), take)).is_err());
    }

    #[test]
    fn every_member_belongs_to_exactly_one_shard() {
        for of in 1..6 {
            let shards: Vec<Shard> = (1..=of)
                .map(|number| Shard::new(number, of).unwrap())
                .collect();
            for index in 0..20 {
                assert_eq!(
                    shards.iter().filter(|shard| shard.contains(index)).count(),
                    1,
                    "{index} of {of}"
                );
            }
        }
    }

    #[test]
    fn invalid_shards_are_refused() {
        for text in [
            "0/4", "5/4", "a/b", "1/0", "0/0", "3", "1/2/3", "-1/4", "", "/", "1.5/4",
        ] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
        assert_eq!("4/4".parse::<Shard>().unwrap(), Shard::new(4, 4).unwrap());
        assert_eq!("0/4".parse::<Shard>().unwrap_err().value, 0.0);
    }
}
