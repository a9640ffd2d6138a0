//! A heavy rod, clamped horizontally, is lowered onto a table: contact force and place of
//! touch-down.
//!
//! The rod hangs down from its clamp. As the clamp comes down, first the tip touches the table.
//! Closer to the table, a part of the rod lies flat on it, and the place of touch-down moves
//! towards the clamp. At that place the table pushes with a concentrated force; beyond it, with the
//! weight of the rod.
//!
//! The program writes three figures: shapes at several heights; force and touch-down against the
//! height, with the heights at which the kind of contact changes; and the error of the touch-down
//! against the number of elements.
//!
//! ```text
//! cargo run --release --example strip_on_table
//! ```
//!
//! Try a longer rod (`--length 12`) or a stiffer one (`--modulus 3e7`): the length of the part that
//! hangs free is proportional to (E I h/q)^¼ for small heights h.

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI};
use std::process::ExitCode;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, Held, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::support::{Contact, HalfSpace};
use morphorod::{Order, Scene, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::Vector3;

/// Radius of the rod, m.
const RADIUS: f64 = 0.5e-3;
/// Number of heights in the figure of force and place.
const HEIGHTS: usize = 120;

/// The rod and its clamp.
struct Strip {
    tissue: LinearElastic,
    weight: Weight,
    scene: Still,
    length: f64,
}

/// What touches the table.
#[derive(Clone, Copy)]
struct Touch {
    /// Sum of the forces of the table, N.
    force: f64,
    /// Arc length at which contact begins, m.
    place: f64,
}

impl Strip {
    fn rod(&self, elements: usize) -> Result<Rod, Box<dyn Error>> {
        Ok(Rod::uniform(
            self.length,
            RADIUS,
            self.scene.base,
            elements,
            Order::Eight,
        )?)
    }

    /// Equilibrium with the clamp at a height above the table (m).
    fn lowered(&self, height: f64, elements: usize) -> Result<Held, Box<dyn Error>> {
        let plane = HalfSpace {
            through: Vector3::z() * -height,
            normal: Vector3::z(),
        };
        let table = Contact {
            obstacle: plane,
            radius: 0.0,
            friction: 0.0,
        };
        let environment = self.scene.environment(0.0);
        let solve = |elements: usize| -> Result<Result<Held, EquilibriumError>, Box<dyn Error>> {
            let mut rod = self.rod(elements)?;
            Ok(NewtonSolver::default().solve_held(
                &mut rod,
                &self.tissue,
                &self.weight,
                &table,
                &environment,
            ))
        };
        // A slightly finer mesh may converge where this one does not.
        for finer in 0..6 {
            match solve(elements + finer)? {
                Err(error) if error.is_recoverable() => {}
                held => return Ok(held?),
            }
        }
        Ok(solve(elements + 6)??)
    }

    /// Contact with the table; `None` without contact.
    fn touch(&self, held: &Held) -> Option<Touch> {
        let place = held
            .reactions
            .iter()
            .map(|reaction| reaction.arc_length)
            .reduce(f64::min)?;
        Some(Touch {
            force: held.reactions.iter().map(|reaction| reaction.normal).sum(),
            place,
        })
    }

    /// Height (m) between two ones at which a condition on the contact changes.
    fn transition(
        &self,
        mut low: f64,
        mut high: f64,
        is_low: impl Fn(Option<Touch>) -> bool,
    ) -> Result<f64, Box<dyn Error>> {
        while high - low > 1e-5 * self.length {
            let middle = 0.5 * (low + high);
            // Just below the transition the part that lies flat is too short for the search.
            let low_side = self
                .lowered(middle, 16)
                .map_or(true, |held| is_low(self.touch(&held)));
            if low_side {
                low = middle
            } else {
                high = middle
            }
        }
        Ok(0.5 * (low + high))
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "strip_on_table",
        "a heavy rod, clamped horizontally, is lowered onto a table",
        &[
            Opt::value("length", "CM", "9", "length of the rod, cm"),
            Opt::value("modulus", "PA", "1e7", "Young's modulus, Pa"),
        ],
    );
    let strip = Strip {
        tissue: LinearElastic {
            youngs_modulus: options.positive("modulus"),
            poissons_ratio: 0.5,
        },
        weight: Weight { density: 1000.0 },
        scene: Still::tilted(FRAC_PI_2),
        length: 1e-2 * options.positive("length"),
    };
    let out = options.out_dir();

    let mut free = strip.rod(16)?;
    let environment = strip.scene.environment(0.0);
    let _ = NewtonSolver::default().solve(&mut free, &strip.tissue, &strip.weight, &environment)?;
    let drop = -free.tip().z;
    let lies =
        |touch: Option<Touch>| touch.is_some_and(|touch| touch.place < strip.length * (1.0 - 1e-6));
    let flat = strip.transition(1e-2 * drop, drop, lies)?;
    println!("the tip touches below a height of {:.6} mm", 1e3 * drop);
    println!("a part lies flat below            {:.6} mm", 1e3 * flat);

    let mut shapes = Vec::new();
    let heights = [
        1.2 * drop,
        0.8 * drop,
        0.5 * (drop + flat),
        0.7 * flat,
        0.4 * flat,
        0.1 * flat,
    ];
    for (index, height) in heights.into_iter().enumerate() {
        let held = strip.lowered(height, 16)?;
        // The table is at z = 0.
        let line = held
            .rod
            .centre_line_at(201)
            .iter()
            .map(|p| (1e3 * p.x, 1e3 * (p.z + height)))
            .collect();
        let label = format!("clamp at {:.1} mm", 1e3 * height);
        shapes.push(Series::new(label, line, Style::Line, 0).ordered(index, heights.len()));
    }
    shapes.push(Series::new(
        "table",
        vec![(0.0, 0.0), (1.05e3 * strip.length, 0.0)],
        Style::Dashed,
        6,
    ));
    let title = "A heavy rod above and on a table";
    let x = "distance from the clamp x (mm)";
    Figure::new(out.join("shapes.svg"), title).lines(x, "height z (mm)", &shapes, Axes::Equal)?;

    let per_length = strip.weight.density * strip.scene.gravity.norm() * PI * RADIUS * RADIUS;
    let mut table = Table::create(out.join("contact.csv"), &["height_m", "force_N", "begin_m"])?;
    let (mut force, mut concentrated, mut place) = (Vec::new(), Vec::new(), Vec::new());
    for k in 1..=HEIGHTS {
        let height = 1.15 * drop * k as f64 / HEIGHTS as f64;
        let Ok(held) = strip.lowered(height, 16) else {
            println!("no equilibrium found at a height of {:.3} mm", 1e3 * height);
            continue;
        };
        let Some(touch) = strip.touch(&held) else {
            force.push((1e3 * height, 0.0));
            continue;
        };
        table.row(&[height, touch.force, touch.place])?;
        force.push((1e3 * height, 1e6 * touch.force));
        let lying = strip.length - touch.place;
        concentrated.push((1e3 * height, 1e6 * (touch.force - per_length * lying)));
        place.push((1e3 * height, 1e3 * touch.place));
    }
    table.finish()?;
    let mark = |height: f64, top: f64, label: &str, style, colour| {
        Series::new(
            label,
            vec![(1e3 * height, 0.0), (1e3 * height, top)],
            style,
            colour,
        )
    };
    let largest = force.iter().map(|(_, value)| *value).fold(0.0, f64::max);
    let forces = [
        Series::new("whole force of the table", force, Style::Line, 0),
        Series::new("concentrated force", concentrated, Style::Dashed, 1),
        mark(
            flat,
            largest,
            "a part lies flat | tip contact",
            Style::Dotted,
            2,
        ),
        mark(drop, largest, "tip contact | no contact", Style::DashDot, 3),
    ];
    let title = "Force of the table on the rod";
    Figure::new(out.join("force.svg"), title).lines(
        "height of the clamp (mm)",
        "force (µN)",
        &forces,
        Axes::Linear,
    )?;
    let places = [
        Series::new("begin of the contact", place, Style::Line, 0),
        mark(
            flat,
            1e3 * strip.length,
            "a part lies flat | tip contact",
            Style::Dotted,
            2,
        ),
        mark(
            drop,
            1e3 * strip.length,
            "tip contact | no contact",
            Style::DashDot,
            3,
        ),
    ];
    let title = "Place at which contact with the table begins";
    let y = "arc length from the clamp (mm)";
    Figure::new(out.join("place.svg"), title).lines(
        "height of the clamp (mm)",
        y,
        &places,
        Axes::Linear,
    )?;

    let touch_down = |height: f64, elements: usize| -> Result<f64, Box<dyn Error>> {
        let touch = strip.touch(&strip.lowered(height, elements)?);
        Ok(touch.ok_or("no contact")?.place)
    };
    let mut errors = Vec::new();
    for (colour, share) in [(0, 0.1), (1, 0.4), (2, 0.8)] {
        let height = share * flat;
        let exact = touch_down(height, 48)?;
        let mut line = Vec::new();
        for elements in [3, 4, 5, 6, 8, 11, 16, 22, 32] {
            if let Ok(place) = touch_down(height, elements) {
                line.push((elements as f64, (place / exact - 1.0).abs()));
            }
        }
        errors.push(Series::new(
            format!("clamp at {:.2} mm", 1e3 * height),
            line,
            Style::Marked,
            colour,
        ));
    }
    let title = "Convergence of the place of touch-down";
    let panel = [("", &errors[..])];
    let (x, y) = ("number of elements", "relative error of the place");
    Figure::new(out.join("convergence.svg"), title).panels(x, y, &panel, Axes::LogLog)?;
    println!(
        "wrote contact.csv, shapes.svg, force.svg, place.svg and convergence.svg to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
