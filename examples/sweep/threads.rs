//! Work for all threads.
//!
//! Scoped threads of the standard library, and not `rayon`: pieces of work are independent, take milliseconds each, and need
//! nothing that a shared counter does not give. Work stealing would not make them faster, and is a dependency more.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Does `count` pieces of work on `threads` threads, in order as far as there are threads, and hands every result with its
/// number to `take`, on the thread of the caller, as it comes.
///
/// # Errors
/// The first error of a piece or of `take`; no piece is begun after it.
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
                    // Nobody listens any more after an error.
                    if to.send((k, result)).is_err() {
                        break;
                    }
                }
            });
        }
        // The loop below ends when the last thread has dropped its end of the channel.
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
    fn every_piece_of_work_is_done_once() {
        for threads in [1, 2, 7] {
            let mut seen = vec![0; 100];
            let done: Result<(), ()> = share(
                threads,
                seen.len(),
                |k| Ok(3 * k),
                |k, r| {
                    assert_eq!(r, 3 * k);
                    seen[k] += 1;
                    Ok(())
                },
            );
            assert_eq!(done, Ok(()));
            assert_eq!(seen, vec![1; 100]);
        }
    }

    #[test]
    fn error_of_a_piece_or_of_the_caller_ends_the_work() {
        let begun = AtomicUsize::new(0);
        let work = |k: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if k == 3 { Err("three") } else { Ok(k) }
        };
        assert_eq!(share(1, 1_000_000, work, |_, _| Ok(())), Err("three"));
        // A single thread does the pieces in order, and no piece after its own error.
        assert_eq!(begun.into_inner(), 4);
        assert_eq!(share(2, 1000, Ok, |k, _| if k == 5 { Err("five") } else { Ok(()) }), Err("five"));
    }
}
