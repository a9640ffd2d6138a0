//! Measured events, from the table of the example.

use std::error::Error;
use std::f64::consts::{PI, TAU};

/// Gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// A measured contact of a bean with a hanging support. SI units.
#[derive(Debug, Clone, Copy)]
pub struct Event {
    pub number: f64,
    /// Mass of the support, kg.
    pub mass: f64,
    /// Length of the support, m.
    pub support: f64,
    /// Length of the upright part of the stem, m.
    pub height: f64,
    /// Length of the overhanging part of the stem, m.
    pub arm: f64,
    /// Distance of the place of contact from the tip, m.
    pub contact: f64,
    /// Period of circumnutation, s.
    pub period: f64,
    /// Amplitude of the force, N.
    pub force: f64,
    /// Angular frequency of the force, rad/s.
    pub frequency: f64,
    /// Duration of the fit of amplitude and frequency, s.
    pub fitted: f64,
    /// Whether the bean twined afterwards.
    pub twined: bool,
}

impl Event {
    /// Length of the stem, m.
    pub fn length(&self) -> f64 {
        self.height + self.arm
    }

    /// Horizontal stiffness of the support at its lower end, N/m. It is a uniform pendulum for
    /// small angles.
    pub fn stiffness(&self) -> f64 {
        self.mass * GRAVITY / (2.0 * self.support)
    }

    /// Half of the angular frequency of circumnutation, rad/s: the frequency of the chord of the
    /// circle on which the free place of contact moves.
    pub fn half_frequency(&self) -> f64 {
        0.5 * TAU / self.period
    }

    /// Whether the fit of the force reaches its maximum.
    pub fn reaches_maximum(&self) -> bool {
        self.frequency * self.fitted >= 0.5 * PI
    }
}

/// Young's modulus (Pa) at a distance (m) from the tip. All tabulated moduli at places of contact,
/// up to 7.2 cm from the tip, are on this parabola to 0.002 MPa. Beyond it is an extrapolation:
/// means of the measured segments at 12.5 and 17.5 cm are larger by 17 % and 6 %.
pub fn modulus(from_tip: f64) -> f64 {
    1e6 * (0.19398 + 0.31973 * (100.0 * from_tip).powi(2))
}

/// Radius (m) at a distance (m) from the tip, on which all tabulated radii are to 5e-5 mm.
pub fn radius(from_tip: f64) -> f64 {
    1e-3 * (0.41337 + 0.7125 * from_tip)
}

/// Reads the events.
pub fn events() -> Result<Vec<Event>, Box<dyn Error>> {
    let mut lines = include_str!("bean_events.csv")
        .lines()
        .filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let get = |name: &str| -> Result<f64, Box<dyn Error>> {
                let column = header
                    .iter()
                    .position(|head| *head == name)
                    .ok_or(format!("no column {name}"))?;
                let cell = cells.get(column).ok_or(format!("no {name} in '{line}'"))?;
                cell.parse()
                    .map_err(|_| format!("{name} is '{cell}' in '{line}'").into())
            };
            Ok(Event {
                number: get("event")?,
                mass: 1e-3 * get("support_mass_g")?,
                support: 1e-2 * get("support_length_cm")?,
                height: 1e-2 * get("height_cm")?,
                arm: 1e-2 * get("arm_cm")?,
                contact: 1e-2 * get("contact_from_tip_cm")?,
                period: 60.0 * get("circumnutation_min")?,
                force: 1e-3 * get("force_amplitude_mN")?,
                frequency: get("force_frequency_rad_per_min")? / 60.0,
                fitted: 60.0 * get("fit_minutes")?,
                twined: get("twined")? > 0.5,
            })
        })
        .collect()
}
