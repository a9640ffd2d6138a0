//! C interface of the shoot of the live page, for WebAssembly. The example `live_page` compiles it,
//! and the page calls it.
//!
//! Each thread has one shoot. Calls that may fail return 0 on success and 1 on failure;
//! [`live_message`] then returns the address of the error message.

mod pole;
mod shoot;

use std::cell::RefCell;
use std::error::Error;

use shoot::Live;

/// Simulation, and buffers that the page reads: numbers and the last error message.
#[derive(Default)]
struct Desk {
    live: Option<Live>,
    numbers: Vec<f64>,
    message: String,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::default();
}

/// Applies a function to the shoot and the numbers, and stores the error message. The first call
/// creates the shoot.
fn with(act: impl FnOnce(&mut Live, &mut Vec<f64>) -> Result<(), Box<dyn Error>>) -> i32 {
    DESK.with_borrow_mut(|desk| {
        let Desk {
            live,
            numbers,
            message,
        } = desk;
        let outcome = match live {
            Some(live) => act(live, numbers),
            None => Live::new().and_then(|made| act(live.insert(made), numbers)),
        };
        let error = outcome.err();
        *message = error.as_ref().map_or_else(String::new, ToString::to_string);
        i32::from(error.is_some())
    })
}

/// Changes a parameter, which is given by its index in `shoot::Parameter`.
#[unsafe(no_mangle)]
pub extern "C" fn live_set(number: usize, value: f64) -> i32 {
    with(|live, _| live.set(number, value))
}

/// Writes the value of a parameter to the numbers.
#[unsafe(no_mangle)]
pub extern "C" fn live_get(number: usize) -> i32 {
    with(|live, numbers| {
        *numbers = vec![live.value(number).ok_or("there is no such parameter")?];
        Ok(())
    })
}

/// Restarts the simulation with the current parameters.
#[unsafe(no_mangle)]
pub extern "C" fn live_restart() -> i32 {
    with(|live, _| live.restart())
}

/// Advances the simulation by a number of seconds.
#[unsafe(no_mangle)]
pub extern "C" fn live_advance(seconds: f64) -> i32 {
    with(|live, _| live.advance(seconds))
}

/// Writes a description of the shoot to the numbers: time (s), length (m), relative start of the
/// growth zone, tip (m), place and radius of the pole (m; the radius is zero without a pole), three
/// counts, and all positions (m) and unit vectors of the frame.
#[unsafe(no_mangle)]
pub extern "C" fn live_look() -> i32 {
    with(|live, numbers| {
        let frame = live.look();
        let counts =
            [frame.line.len(), frame.directors.len(), frame.piles.len()].map(|count| count as f64);
        *numbers = vec![frame.time, frame.length, frame.zone];
        numbers.extend(live.tip().iter());
        numbers.extend(live.pole());
        numbers.extend(counts);
        numbers.extend(frame.line.as_flattened());
        numbers.extend(frame.directors.as_flattened().as_flattened());
        numbers.extend(frame.piles.as_flattened().as_flattened());
        Ok(())
    })
}

/// Writes the tip position (m) to the numbers.
#[unsafe(no_mangle)]
pub extern "C" fn live_tip() -> i32 {
    with(|live, numbers| {
        *numbers = live.tip().iter().copied().collect();
        Ok(())
    })
}

/// Writes period (s), semi-major axis and signed semi-minor axis (m) to the numbers; all three are
/// zero without an oscillation.
#[unsafe(no_mangle)]
pub extern "C" fn live_read() -> i32 {
    with(|live, numbers| {
        *numbers = live.read().map_or_else(
            || vec![0.0; 3],
            |read| vec![read.period, read.axes[0], read.axes[1]],
        );
        Ok(())
    })
}

/// Writes the self-buckling length and the critical length for oscillations (m) to the numbers. A
/// length that does not exist is infinite.
#[unsafe(no_mangle)]
pub extern "C" fn live_critical() -> i32 {
    with(|live, numbers| {
        *numbers = vec![
            live.buckling_length(),
            live.critical_length().unwrap_or(f64::INFINITY),
        ];
        Ok(())
    })
}

/// Returns the address of the numbers.
#[unsafe(no_mangle)]
pub extern "C" fn live_numbers() -> *const f64 {
    DESK.with_borrow(|desk| desk.numbers.as_ptr())
}

/// Returns the count of the numbers.
#[unsafe(no_mangle)]
pub extern "C" fn live_count() -> usize {
    DESK.with_borrow(|desk| desk.numbers.len())
}

/// Returns the address of the last message, in UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn live_message() -> *const u8 {
    DESK.with_borrow(|desk| desk.message.as_ptr())
}

/// Returns the length of the last message, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn live_message_length() -> usize {
    DESK.with_borrow(|desk| desk.message.len())
}
