//! A root in contact with an inclined plate.

use std::error::Error;
use std::path::Path;

use morphorod::constitutive::LinearElastic;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Distributed;
use morphorod::support::{Contact, HalfSpace};
use morphorod::tropism::{
    AtApex, Gravitropism, Growing, Localised, Memory, Proprioception, Response, SettledStatoliths,
    TropismLaw,
};
use morphorod::{Model, Order, ParameterError, Shoot, Still};
use morphorod_plot::{Axes, Figure, Progress, Series, Style, Table, println};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{DELAY, HOUR, RADIUS, ZONE};

/// Angle of the plate from the vertical, rad.
const LEAN: f64 = 0.35;
/// Gravitropic sensitivity β. The gain in the plate is kτ = β cos(lean) ℓg τ/(r τg), about 1 for τg
/// = 4τ.
const SENSITIVITY: f64 = 0.3;
/// Proprioceptive sensitivity, which limits the curvature into the plate.
const STRAIGHTENING: f64 = 2.0;
/// Force of the film of water on the root, towards the plate, N/m.
const FILM: f64 = 0.03;
/// Coefficient of friction.
const FRICTION: f64 = 1.0;

/// Differential growth that twists the tissue, with a gradient of u3 (1/m); positive like a
/// right-handed screw.
struct Twisting(f64);

impl TropismLaw for Twisting {
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::z() * self.0
    }
}

/// Normal of the plate, which points to the root, and direction in which it descends.
fn directions() -> [Vector3<f64>; 2] {
    let (sin, cos) = LEAN.sin_cos();
    [Vector3::new(0.0, cos, sin), Vector3::new(0.0, sin, -cos)]
}

/// Returns a root that lies on the plate and points down it, with a slight curvature to one side.
fn root(twist: f64, growth_time: f64) -> Result<Shoot<impl Model>, ParameterError> {
    let [normal, down] = directions();
    let frame = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[
        normal.cross(&down),
        normal,
        down,
    ]));
    let base = UnitQuaternion::from_rotation_matrix(&frame);
    let memory = Memory {
        time: 0.1 * DELAY,
        delay: DELAY,
    };
    let plate = HalfSpace {
        through: -normal * RADIUS,
        normal,
    };
    let twisting = Localised {
        law: Twisting(twist),
        from: 0.4 * ZONE,
        to: 0.8 * ZONE,
        edge: 0.3 * ZONE,
    };
    let mut root = Shoot::builder(LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    })
    .length(ZONE)
    .radius(RADIUS)
    // Contacts are searched at every point of an element, and their number determines the run time.
    .elements(4)
    .order(Order::Four)
    .merge_tolerance(1e-2)
    .growth(UniformGrowth {
        zone_length: ZONE,
        time: growth_time,
    })
    .tropism((
        Gravitropism {
            sensitivity: -SENSITIVITY,
            perception: AtApex(SettledStatoliths),
        }
        .remembered(memory),
        Proprioception {
            sensitivity: STRAIGHTENING,
        }
        .remembered(memory),
        twisting,
    ))
    .load(Distributed(-normal * FILM))
    .scene(Still {
        base,
        ..Still::upright()
    })
    .support(Contact {
        obstacle: plate,
        radius: RADIUS,
        friction: FRICTION,
    })
    .build()?;
    root.set_intrinsic(|_| Vector3::new(0.0, 100.0, 0.0));
    Ok(root)
}

/// Simulates roots with three twists, prints period and skew, and draws the roots from above the
/// plate. Times are in seconds.
pub fn grow(out: &Path, growth_time: f64, end: f64, step: f64) -> Result<(), Box<dyn Error>> {
    let [normal, down] = directions();
    let across = normal.cross(&down);
    let columns = [
        "twist_per_m",
        "t_s",
        "across_m",
        "down_m",
        "above_plate_m",
        "heading_rad",
        "contact_force_n",
    ];
    let mut table = Table::create(out.join("plate.csv"), &columns)?;
    let mut series = Vec::new();
    let progress = Progress::new("plate");
    println!("root on a plate: twist, mean period/delay, displacement to the right and down");
    for (colour, twist) in [-1000.0, 0.0, 1000.0].into_iter().enumerate() {
        let mut root = root(twist, growth_time)?;
        let mut run = MethodOfSteps {
            retries: 10,
            max_work: 400_000,
            ..MethodOfSteps::new(step)
        };
        let (mut last, mut crossings) = (0.0_f64, Vec::new());
        let steps = (end / step).ceil() as u32;
        for k in 0..=steps {
            if let Err(error) = run.advance(&mut root, step * f64::from(k)) {
                progress
                    .suspend(|| println!("the run ends at {:.1} h: {error}", root.time() / HOUR));
                break;
            }
            let (tip, tangent) = (root.tip(), root.rod().apex_frame() * Vector3::z());
            let heading = tangent.dot(&across).atan2(tangent.dot(&down));
            let force: f64 = root
                .reactions()
                .iter()
                .map(|reaction| reaction.normal)
                .sum();
            let place = [tip.dot(&across), tip.dot(&down), tip.dot(&normal)];
            table.row(&[
                twist,
                root.time(),
                place[0],
                place[1],
                place[2],
                heading,
                force,
            ])?;
            if last < 0.0 && (0.0..1.5).contains(&heading) {
                crossings.push(root.time() - step * heading / (heading - last));
            }
            last = heading;
            progress.set((colour as f64 + root.time() / end) / 3.0);
        }
        let waves = crossings.len().saturating_sub(1);
        let span = crossings
            .last()
            .zip(crossings.first())
            .map_or(f64::NAN, |(last, first)| last - first);
        let period = span / DELAY / waves as f64;
        let (right, below) = (1e3 * root.tip().dot(&across), 1e3 * root.tip().dot(&down));
        let period = if waves > 0 {
            format!("{period:.2} in {waves} waves")
        } else {
            "no wave".to_owned()
        };
        progress.suspend(|| println!("{twist:+6.0} 1/m: {period}, {right:+.2} mm, {below:.2} mm"));
        // The roots are drawn side by side.
        let shift = 3.0 * colour as f64;
        let line = root.rod().centre_line_at(400).into_iter();
        let line = line
            .map(|p| (1e3 * p.dot(&across) + shift, -1e3 * p.dot(&down)))
            .collect();
        let label = [
            "left-handed twist, −1 /mm",
            "no twist",
            "right-handed twist, 1 /mm",
        ][colour];
        let style = [Style::Dashed, Style::Line, Style::DashDot][colour];
        series.push(Series::new(label, line, style, colour));
    }
    progress.finish();
    table.finish()?;
    let title = format!("Roots on an inclined plate after {} h", end / HOUR);
    let figure = Figure::new(out.join("plate.svg"), title);
    figure.lines(
        "across the plate (mm)",
        "up the plate (mm)",
        &series,
        Axes::Equal,
    )?;
    Ok(())
}
