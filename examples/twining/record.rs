//! Tables, figures and printed results of a run.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use morphorod::profile::Place;
use morphorod::{Model, Shoot};
use morphorod_plot::{Axes, Figure, Series, Strip, Style, Table, println};
use nalgebra::Vector3;

use crate::{HOUR, RADIUS, Setup};

/// Number of shapes that are drawn.
const SHAPES: usize = 12;
/// Height of the view from the side, and its smallest width, mm.
const HEIGHT: f64 = 240.0;
const LEAST_WIDTH: f64 = 85.0;
/// Width and height of the view from the side outside its frame, mm.
const MARGINS: [f64; 2] = [62.0, 32.0];
/// Width and height of the view from above with a square frame, mm.
const SQUARE: [f64; 2] = [212.0, 180.0];

/// Results of a run over time.
#[derive(Default)]
pub struct Record {
    /// Time (s), length (m), tip (m), turns between the lowest and the highest contact, number of
    /// contacts, and horizontal force on the pole (N).
    rows: Vec<[f64; 9]>,
    /// Times (h) and centre lines (cm).
    shapes: Vec<(f64, Vec<Vector3<f64>>)>,
}

/// A contact at the end of a run.
struct Touch {
    /// Arc length, m.
    place: f64,
    /// Normal force, N.
    normal: f64,
    /// Normal force over half of the distance between the neighbouring contacts, N/m.
    pressure: f64,
}

/// Contacts of a shoot from its base to its apex. Reactions at one place are one contact.
fn touches(shoot: &Shoot<impl Model>) -> Vec<Touch> {
    let mut all: Vec<(f64, f64)> = shoot
        .reactions()
        .iter()
        .map(|at| (at.arc_length, at.normal))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        kept.1 += if same { next.1 } else { 0.0 };
        same
    });
    let last = all.len().saturating_sub(1);
    let touch = |i: usize| {
        let ends = all[(i + 1).min(last)].0 - all[i.saturating_sub(1)].0;
        let spacing = ends / if i == 0 || i == last { 1.0 } else { 2.0 };
        let pressure = if spacing > 0.0 {
            all[i].1 / spacing
        } else {
            f64::NAN
        };
        Touch {
            place: all[i].0,
            normal: all[i].1,
            pressure,
        }
    };
    (0..all.len()).map(touch).collect()
}

impl Record {
    /// Adds the present shape.
    pub fn add(&mut self, shoot: &Shoot<impl Model>, setup: &Setup) {
        let (time, tip, rod) = (shoot.time(), shoot.tip(), shoot.rod());
        let number = shoot.reactions().len() as f64;
        let force = -shoot
            .reactions()
            .iter()
            .map(|reaction| reaction.force)
            .sum::<Vector3<f64>>();
        self.rows.push([
            time,
            rod.length(),
            tip.x,
            tip.y,
            tip.z,
            setup.turns(shoot),
            number,
            force.x,
            force.y,
        ]);
        if time >= setup.end / SHAPES as f64 * self.shapes.len() as f64 - 1e-6 {
            self.shapes.push((
                time / HOUR,
                rod.centre_line_at(401)
                    .iter()
                    .map(|point| 100.0 * point)
                    .collect(),
            ));
        }
    }

    /// Prints turns, forces and pitch at the end of the run.
    pub fn report(&self, shoot: &Shoot<impl Model>, setup: &Setup) {
        let (curvature, torsion) = (setup.curvature, setup.torsion());
        let natural = curvature / (curvature * curvature + torsion * torsion);
        println!(
            "radius of the helix {:.3} mm, wound {:.3} mm",
            1e3 * natural,
            1e3 * (setup.pole + RADIUS)
        );
        println!(
            "length after {:.2} h: {:.2} cm",
            shoot.time() / HOUR,
            100.0 * shoot.rod().length()
        );
        match self.rows.iter().find(|row| row[6] > 0.0) {
            Some(row) => println!("  first contact at {:.2} h", row[0] / HOUR),
            None => println!("  no contact"),
        }
        println!(
            "  turns from the lowest to the highest contact: {:.3}",
            setup.turns(shoot)
        );
        let touches = touches(shoot);
        let (Some(first), Some(last)) = (touches.first(), touches.last()) else {
            return;
        };
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        };
        let [low, high] = range(&mut touches.iter().map(|touch| 1e3 * touch.normal));
        println!(
            "  {} contacts, normal forces from {low:.4} to {high:.3} mN",
            touches.len()
        );
        if touches.len() < 3 {
            return;
        }
        let [low, high] = range(
            &mut touches[1..touches.len() - 1]
                .iter()
                .map(|touch| touch.pressure),
        );
        println!(
            "  force per length between the first and the last contact: {low:.3} to {high:.3} N/m"
        );
        let wound = || {
            profile(shoot)
                .into_iter()
                .filter(|row| row[0] > first.place && row[0] < last.place)
        };
        let [low, high] = range(&mut wound().map(|row| 1e3 * row[1]));
        println!("  tension there: {low:.2} to {high:.2} mN");
        let [low, high] = range(&mut wound().map(|row| row[2]));
        println!("  angle of the tangent to the horizontal: {low:.1}° to {high:.1}°");
    }

    /// Writes tables and figures.
    pub fn write(
        &self,
        shoot: &Shoot<impl Model>,
        setup: &Setup,
        out: &Path,
    ) -> Result<(), Box<dyn Error>> {
        let columns = [
            "t_s",
            "length_m",
            "x_m",
            "y_m",
            "z_m",
            "turns",
            "contacts",
            "force_x_n",
            "force_y_n",
        ];
        let mut table = Table::create(out.join("tip.csv"), &columns)?;
        self.rows.iter().try_for_each(|row| table.row(row))?;
        table.finish()?;
        let touches = touches(shoot);
        let mut table = Table::create(
            out.join("contact.csv"),
            &["s_m", "normal_n", "normal_per_length_n_per_m"],
        )?;
        touches
            .iter()
            .try_for_each(|touch| table.row(&[touch.place, touch.normal, touch.pressure]))?;
        table.finish()?;
        let profile = profile(shoot);
        let mut table = Table::create(
            out.join("profile.csv"),
            &["s_m", "tension_n", "pitch_deg", "twist_per_m"],
        )?;
        profile.iter().try_for_each(|row| table.row(row))?;
        table.finish()?;
        self.draw_shapes(setup, out)?;
        self.draw_force(out)?;
        draw_contact(&touches, &profile, shoot.time() / HOUR, out)
    }

    /// Draws the horizontal force on the pole over time.
    fn draw_force(&self, out: &Path) -> Result<(), Box<dyn Error>> {
        let line = |of: &dyn Fn(&[f64; 9]) -> f64| {
            self.rows
                .iter()
                .map(|row| (row[0] / HOUR, 1e3 * of(row)))
                .collect()
        };
        let series = [
            Series::new("towards the base", line(&|row| -row[7]), Style::Dashed, 0),
            Series::new("across", line(&|row| row[8]), Style::DashDot, 1),
            Series::new(
                "magnitude",
                line(&|row| row[7].hypot(row[8])),
                Style::Line,
                6,
            ),
        ];
        let figure = Figure::new(
            out.join("force.svg"),
            "Horizontal force of the shoot on the pole",
        );
        figure.lines("time (h)", "force (mN)", &series, Axes::Linear)?;
        Ok(())
    }

    /// Draws the shapes over time with the pole, from the side and from above. From the side, what is
    /// behind the pole is pale.
    fn draw_shapes(&self, setup: &Setup, out: &Path) -> Result<(), Box<dyn Error>> {
        let (x, r) = (100.0 * setup.distance(), 100.0 * setup.pole);
        let range = |of: &dyn Fn(&Vector3<f64>) -> f64| {
            let all = self.shapes.iter().flat_map(|(_, line)| line).map(of);
            all.fold((0.0, 0.0), |(low, high): (f64, f64), value| {
                (low.min(value), high.max(value))
            })
        };
        let ((left, right), (low, high)) = (range(&|p| p.x), range(&|p| p.z));
        let edge = |x: f64, label| Series::new(label, vec![(x, low), (x, high)], Style::Line, 6);
        let mut side = vec![edge(x - r, "pole"), edge(x + r, "")];
        for (hours, line) in &self.shapes {
            for (hidden, part) in parts(line, |p| (p.x - x).abs() < r && p.y > 0.0) {
                let style = if hidden { Style::Hidden } else { Style::Line };
                side.push(Series::new("", part, style, 0).at_time(*hours));
            }
        }
        let width = right.max(x + r) - left;
        let height = HEIGHT - MARGINS[1];
        Figure::new(out.join("side.svg"), "Seen from the side")
            .width((MARGINS[0] + height * width / (high - low)).max(LEAST_WIDTH))
            .height(HEIGHT)
            .lines("x (cm)", "z (cm)", &side, Axes::Equal)?;
        let circle = (0..=72)
            .map(|i| (TAU * f64::from(i) / 72.0).sin_cos())
            .map(|(sin, cos)| (x + r * cos, r * sin));
        let mut above = vec![Series::new("pole", circle.collect(), Style::Line, 6)];
        for (hours, line) in &self.shapes {
            let line = line.iter().map(|p| (p.x, p.y)).collect();
            above.push(Series::new("", line, Style::Line, 0).at_time(*hours));
        }
        Figure::new(out.join("above.svg"), "Seen from above")
            .width(SQUARE[0])
            .height(SQUARE[1])
            .lines("x (cm)", "y (cm)", &above, Axes::Equal)?;
        Ok(())
    }
}

/// Divides a line, seen from −e2, into parts that are hidden or not. Neighbouring parts share a
/// point.
fn parts(
    line: &[Vector3<f64>],
    is_hidden: impl Fn(&Vector3<f64>) -> bool,
) -> Vec<(bool, Vec<(f64, f64)>)> {
    let mut parts: Vec<(bool, Vec<(f64, f64)>)> = Vec::new();
    for place in line {
        let (hidden, point) = (is_hidden(place), (place.x, place.z));
        match parts.last_mut() {
            Some((same, part)) if *same == hidden => part.push(point),
            last => {
                let shared = last.and_then(|(_, part)| part.last().copied());
                parts.push((hidden, shared.into_iter().chain([point]).collect()));
            }
        }
    }
    parts
}

/// Arc length (m), tension (N), angle of the tangent to the horizontal (°) and twist (1/m) along a
/// shoot.
fn profile(shoot: &Shoot<impl Model>) -> Vec<[f64; 4]> {
    let row = |place: &Place| {
        let tangent = place.tangent();
        [
            place.arc_length,
            place.force.dot(&tangent),
            tangent.z.clamp(-1.0, 1.0).asin().to_degrees(),
            place.strain.z,
        ]
    };
    shoot.profile().sample(401).iter().map(row).collect()
}

/// Draws the forces of the contacts, tension and pitch against the arc length.
fn draw_contact(
    touches: &[Touch],
    profile: &[[f64; 4]],
    hours: f64,
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let along = |k: usize, factor: f64| {
        let points = profile
            .iter()
            .map(|row| (100.0 * row[0], factor * row[k]))
            .collect();
        [Series::new("", points, Style::Line, 0)]
    };
    let finite = touches.iter().filter(|touch| touch.pressure.is_finite());
    let pressure = finite
        .map(|touch| (100.0 * touch.place, touch.pressure))
        .collect();
    let pressure = [Series::new("", pressure, Style::Points, 1)];
    let (tension, pitch, twist) = (along(1, 1e3), along(2, 1.0), along(3, 1e-2));
    let strips = [
        Strip {
            label: "pressure (N/m)",
            series: &pressure,
        },
        Strip {
            label: "tension (mN)",
            series: &tension,
        },
        Strip {
            label: "pitch (°)",
            series: &pitch,
        },
        Strip {
            label: "twist (1/cm)",
            series: &twist,
        },
    ];
    let title = format!("Shoot wound round a pole after {hours:.1} h");
    Figure::new(out.join("contact.svg"), title).strips("arc length (cm)", &strips)?;
    Ok(())
}
