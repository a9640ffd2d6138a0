//! Waves of roots that respond to gravity with a delay, and a root on an inclined plate.
//!
//! A root that grows down an inclined plate waves. Noronha, Kaneko and Fujimoto (2026,
//! arXiv:2604.27675) explain the waves by the delay τ of the gravitropic response: the angle θ of
//! the tip from the direction of gravity in the plate obeys θ̇ = −k sin θ(t − τ) with the gain k
//! (1/s), and the period is four delays.
//!
//! # Model
//! The cap perceives gravity ([`AtApex`]), and the growth zone of the length ℓg responds with the
//! delay τ and the memory time τm. A root bends towards gravity, hence its sensitivity −β is
//! negative. On a plate that leans by an angle from the vertical, β is multiplied by the cosine of
//! this angle, because the plate bears the component across it. The root is not deformed
//! elastically.
//!
//! - *Zone of constant length.* The equation of the angle is exact, with the gain k = β ℓg/(r τg),
//!   the radius r (m) and the growth time τg (s). The oscillations begin at ωτ + atan(ωτm) = π/2,
//!   kτ = ωτ √(1 + ω²τm²), with the angular frequency ω (rad/s). For τm = 0 the period is 4τ at any
//!   amplitude A, and kτ = K, the complete elliptic integral of the complementary modulus cos²(A/2)
//!   (J. L. Kaplan and J. A. Yorke 1974, J. Math. Anal. Appl. 48:317–324).
//! - *Growing zone.* Tissue that is curved and elongates rotates the tip further (Bastien, Douady
//!   and Moulia 2014, Front. Plant Sci. 5:136). The curvature in the zone is uniform, and small
//!   angles grow as exp(λt) with
//!
//!   λ² (1 + λτm) + k (λ + 1/τg) exp(−λτ) = 0.
//!
//!   Oscillations begin at ωτ + atan(ωτm) = atan(ωτg). The period exceeds four delays. A root whose
//!   growth time is shorter than τ + τm oscillates at any gain.
//! - *Plate.* The root grows in space on a plate at 20° from the vertical, with friction.
//!   Gravitropism presses it on the plate, and a film of water holds it there. The cells of its
//!   zone twist it, so that it skews (A. Porat and others 2024, PNAS 121:e2312761121).
//!
//! # Results
//! Onset, period and amplitude agree with the closed forms. The period at the onset is four delays
//! without memory, 4.5 delays for the growing zone, and 7.3 delays if the memory time equals the
//! delay. Waves of the root on the plate take about five delays. Seen from above the plate, it
//! skews to the right if it is twisted like a right-handed screw, and to the left if it is twisted
//! in the opposite sense.
//!
//! # Options
//! `--growth-time 2`: a root that grows twice as fast and makes longer waves. `--hours 48`: a
//! longer run on the plate.

#[path = "roots/closed.rs"]
mod closed;
#[path = "roots/plate.rs"]
mod plate;

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;
use std::process::ExitCode;

use closed::{amplitude_of, onset_of};
use morphorod::constitutive::LinearElastic;
use morphorod::cycle::{Disturbances, PeriodicSolver};
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{GrowthLaw, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, onset};
use morphorod::tropism::{AtApex, Gravitropism, Memory, Response, SettledStatoliths};
use morphorod::{Model, Order, ParameterError, Shoot, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;
/// Delay τ, s.
const DELAY: f64 = HOUR;
/// Length of the growth zone ℓg, m.
const ZONE: f64 = 1e-3;
/// Radius, m.
const RADIUS: f64 = 0.07e-3;
/// Memory time in place of none, s. The closed forms without memory have a relative error of its
/// ratio to the delay.
const SHORT: f64 = 1e-5 * DELAY;

/// Returns a root with the gain kτ that points down and leans by an angle (rad).
fn root(
    gain: f64,
    memory: f64,
    (growth, time): (impl GrowthLaw, f64),
    lean: f64,
) -> Result<Shoot<impl Model>, ParameterError> {
    let sensitivity = -gain / DELAY * RADIUS * time / ZONE;
    Shoot::builder(LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    })
    .length(ZONE)
    .radius(RADIUS)
    // All tissue has the same curvature. One point describes it.
    .elements(1)
    .order(Order::Two)
    .growth(growth)
    .tropism(
        Gravitropism {
            sensitivity,
            perception: AtApex(SettledStatoliths),
        }
        .remembered(Memory {
            time: memory,
            delay: DELAY,
        }),
    )
    .scene(Still::tilted(PI - lean))
    .build()
}

/// Growth zone with a growth time (s).
fn zone(time: f64) -> UniformGrowth {
    UniformGrowth {
        zone_length: ZONE,
        time,
    }
}

/// Angle of the apex from the downward direction, rad.
fn angle(shoot: &Shoot<impl Model>) -> f64 {
    let tangent = shoot.rod().apex_frame() * Vector3::z();
    tangent.x.atan2(-tangent.z)
}

/// Prints the onset of a root with a zone of constant length for several memory times, with the
/// closed form.
fn onsets(out: &Path, growth_time: f64) -> Result<(), Box<dyn Error>> {
    let columns = [
        "memory_over_delay",
        "gain",
        "closed_gain",
        "period_over_delay",
        "closed_period_over_delay",
    ];
    let mut table = Table::create(out.join("onset.csv"), &columns)?;
    println!(
        "onset of oscillations: memory/delay, gain kτ and period/delay, found and in closed form"
    );
    for memory in [SHORT / DELAY, 0.1, 0.5, 1.0] {
        let law = || (Ongoing(zone(growth_time)), growth_time);
        let family = |gain: f64| Linearisation::about(&root(gain, memory * DELAY, law(), 0.0)?);
        let found = onset(family, 1.0, 2.0)?;
        let (gain, period) = (found.parameters[0], found.period() / DELAY);
        let [closed_gain, closed_period] = onset_of(memory, f64::INFINITY);
        println!("{memory:8.5}  {gain:.8} {closed_gain:.8}  {period:.8} {closed_period:.8}");
        table.row(&[memory, gain, closed_gain, period, closed_period])?;
    }
    let [gain, period] = onset_of(SHORT / DELAY, growth_time / DELAY);
    println!("growing zone, no memory: closed form {gain:.8}  {period:.8}");
    table.finish()?;
    Ok(())
}

/// Period over the delay, amplitude (rad) and stability in its plane of the orbit of a zone of
/// constant length; NaN below the onset.
fn orbit(gain: f64, growth_time: f64) -> Result<[f64; 3], Box<dyn Error>> {
    let Some(expected) = amplitude_of(gain) else {
        return Ok([f64::NAN; 3]);
    };
    let shoot = root(gain, SHORT, (Ongoing(zone(growth_time)), growth_time), 0.0)?;
    let mode = Linearisation::about(&shoot)?.rightmost()?;
    let excursion = ZONE * (1.0 - expected.cos()) / expected;
    let orbit = PeriodicSolver::default().from_mode(&shoot, &mode, excursion)?;
    let (_, rod) = orbit.largest_excursion(&shoot)?;
    // The plate keeps a root in its plane.
    let stable = match orbit.multipliers(&shoot, 2)?.values {
        Disturbances::Planar { in_plane, .. } => in_plane
            .iter()
            .all(|multiplier| multiplier.value.norm() < 1.0),
        Disturbances::Spatial(_) => false,
    };
    let amplitude = (rod.apex_frame() * Vector3::z()).angle(&-Vector3::z());
    Ok([orbit.period / DELAY, amplitude, f64::from(u8::from(stable))])
}

/// Period over the delay and amplitude (rad) of a growing root at the end of a long run; NaN if it
/// does not oscillate.
fn grow(gain: f64, growth_time: f64) -> Result<[f64; 2], Box<dyn Error>> {
    let mut root = root(gain, SHORT, (zone(growth_time), growth_time), 0.3)?;
    let mut run = MethodOfSteps::with_solver(DELAY / 20.0, Unloaded);
    let (mut last, mut crossings, mut highest) = (angle(&root), Vec::new(), Vec::new());
    let mut high = 0.0_f64;
    for k in 1..=3000 {
        run.advance(&mut root, 0.05 * DELAY * f64::from(k))?;
        let now = angle(&root);
        high = high.max(now);
        if last < 0.0 && now >= 0.0 {
            crossings.push(0.05 * (f64::from(k) - now / (now - last)));
            highest.push(std::mem::take(&mut high));
        }
        last = now;
    }
    match (&crossings[..], highest.last()) {
        ([.., first, second], Some(amplitude)) if *amplitude > 0.01 => {
            Ok([second - first, *amplitude])
        }
        _ => Ok([f64::NAN; 2]),
    }
}

/// Computes and draws period and amplitude against the gain.
fn waves(out: &Path, growth_time: f64) -> Result<(), Box<dyn Error>> {
    let columns = [
        "gain",
        "period_over_delay",
        "amplitude_rad",
        "closed_amplitude_rad",
        "stable_in_plane",
        "growing_period_over_delay",
        "growing_amplitude_rad",
    ];
    let mut table = Table::create(out.join("waves.csv"), &columns)?;
    let (mut periods, mut amplitudes, mut growing_periods, mut growing_amplitudes) =
        (vec![], vec![], vec![], vec![]);
    println!(
        "gain kτ: period/delay and amplitude (closed form) of a zone of constant length; of a growing zone"
    );
    for gain in [1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0, 2.1, 2.2] {
        let [period, amplitude, stable] = orbit(gain, growth_time)?;
        let [growing_period, growing_amplitude] = grow(gain, growth_time)?;
        let closed = amplitude_of(gain).unwrap_or(0.0);
        table.row(&[
            gain,
            period,
            amplitude,
            closed,
            stable,
            growing_period,
            growing_amplitude,
        ])?;
        let shown = |period: f64, amplitude: f64| match period.is_finite() {
            true => format!("{period:.6} {:.3}°", amplitude.to_degrees()),
            false => "no oscillation".to_owned(),
        };
        let (fixed, growing) = (
            shown(period, amplitude),
            shown(growing_period, growing_amplitude),
        );
        println!(
            "{gain:.1}: {fixed} ({:.3}°); {growing}",
            closed.to_degrees()
        );
        periods.push((gain, period));
        amplitudes.push((gain, amplitude.to_degrees()));
        growing_periods.push((gain, growing_period));
        growing_amplitudes.push((gain, growing_amplitude.to_degrees()));
    }
    table.finish()?;
    let curve = (0..=200).map(|i| 1.3 + 0.0045 * f64::from(i));
    let curve = curve
        .map(|gain| (gain, amplitude_of(gain).map_or(f64::NAN, f64::to_degrees)))
        .collect();
    let [[fixed_gain, fixed_period], [growing_gain, growing_period]] = [
        onset_of(0.0, f64::INFINITY),
        onset_of(0.0, growth_time / DELAY),
    ];
    let onsets = [
        "onset, zone of constant length, closed form",
        "onset, growing zone, closed form",
    ];
    let (fixed, growing) = ("zone of constant length", "growing zone");
    let left = [
        Series::new(fixed, periods, Style::Points, 0),
        Series::new(
            "closed form",
            vec![(fixed_gain, 4.0), (2.2, 4.0)],
            Style::Dashed,
            0,
        ),
        Series::new(growing, growing_periods, Style::Marked, 1),
        Series::new(
            onsets[0],
            vec![(fixed_gain, fixed_period)],
            Style::Points,
            6,
        ),
        Series::new(
            onsets[1],
            vec![(growing_gain, growing_period)],
            Style::Points,
            3,
        ),
    ];
    let right = [
        Series::new(fixed, amplitudes, Style::Points, 0),
        Series::new("closed form", curve, Style::Dashed, 0),
        Series::new(growing, growing_amplitudes, Style::Marked, 1),
        Series::new(onsets[0], vec![(fixed_gain, 0.0)], Style::Points, 6),
        Series::new(onsets[1], vec![(growing_gain, 0.0)], Style::Points, 3),
    ];
    let x = "gain × delay kτ (1)";
    let panels = [
        ("", [x, "period / delay (1)"], &left[..]),
        ("", [x, "amplitude of the tip angle (°)"], &right[..]),
    ];
    Figure::new(
        out.join("waves.svg"),
        "Waves of a root with a delayed response to gravity",
    )
    .separate_panels(&panels, Axes::Linear)?;
    Ok(())
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "roots",
        "waves of roots that respond to gravity with a delay, and a root on an inclined plate",
        &[
            Opt::value(
                "growth-time",
                "H",
                "4",
                "growth time τg, h; the delay is 1 h",
            ),
            Opt::value(
                "hours",
                "H",
                "30",
                "time to simulate the root on the plate, h",
            ),
            Opt::value("step", "S", "180", "time step on the plate, s"),
        ],
    );
    let growth_time = HOUR * options.positive("growth-time");
    let out = options.out_dir();
    onsets(&out, growth_time)?;
    waves(&out, growth_time)?;
    plate::grow(
        &out,
        growth_time,
        HOUR * options.positive("hours"),
        options.positive("step"),
    )?;
    println!(
        "wrote onset.csv, waves.csv, waves.svg, plate.csv and plate.svg to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
