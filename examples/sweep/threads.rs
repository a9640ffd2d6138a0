//! Distribution of work over threads.
//!
//! The tasks are independent and take milliseconds each, so that a shared counter distributes them
//! sufficiently well over scoped threads of the standard library. Work stealing, as in `rayon`, would not
//! be faster and would add a dependency.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Computes `count` tasks on `threads` threads, which start them in order. Each result is passed with its
/// number to `take` on the thread of the caller, in the order of completion.
///
/// # Errors
/// Returns the first error of a task or of `take`. No task starts after an error.
pub fn share<R: Send, E: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> Result<R, E> + Sync,
    mut take: impl FnMut(usize, R) -> Result<(), E>,
) -> Result<(), E> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (to, results) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..threads.min(count) {
            let (to, next, stop, work) = (to.clone(), &next, &stop, &work);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= count {
                        break;
                    }
                    let result = work(k);
                    if result.is_err() {
                        stop.store(true, Ordering::Relaxed);
                    }
                    // After an error, the receiver no longer exists.
                    if to.send((k, result)).is_err() {
                        break;
                    }
                }
            });
        }
        // The loop below ends when the last thread has dropped its sender.
        drop(to);
        for (k, result) in results {
            if let Err(error) = result.and_then(|result| take(k, result)) {
                stop.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_is_computed_once() {
        for threads in [1, 2, 7] {
            let mut seen = vec![0; 100];
            let outcome: Result<(), ()> = share(
                threads,
                seen.len(),
                |k| Ok(3 * k),
                |k, r| {
                    assert_eq!(r, 3 * k);
                    seen[k] += 1;
                    Ok(())
                },
            );
            assert_eq!(outcome, Ok(()));
            assert_eq!(seen, vec![1; 100]);
        }
    }

    #[test]
    fn error_of_a_task_or_of_the_caller_ends_the_work() {
        let started = AtomicUsize::new(0);
        let work = |k: usize| {
            started.fetch_add(1, Ordering::Relaxed);
            if k == 3 { Err("three") } else { Ok(k) }
        };
        assert_eq!(share(1, 1_000_000, work, |_, _| Ok(())), Err("three"));
        // A single thread computes the tasks in order, and starts none after an error.
        assert_eq!(started.into_inner(), 4);
        assert_eq!(share(2, 1000, Ok, |k, _| if k == 5 { Err("five") } else { Ok(()) }), Err("five"));
    }
}
