//! Sketch of the model: directors, growth, helix, statoliths, and the parts of the strain.
//!
//! This example computes what figure 2 of Agostinelli, DeSimone and Noselli (2021), *Nutations in
//! Plant Shoots*, Front. Plant Sci. 12:608005, sketches. Numbers in brackets are its equations.
//!
//! - A: the directors d1, d2, d3 along a rod whose intrinsic strain bends and twists it.
//! - B: an element before and after growth that doubles its length. *Uniform* growth keeps it
//!   straight. With the *gradient* REGR (1 + δ x), equation (4), it bends away from the side that
//!   grows faster. The gradient is a law that is written here.
//! - C: the centre line of a constant strain u = (κ, 0, τ), equation (1): a helix of radius
//!   κ/(κ² + τ²) and pitch 2πτ/(κ² + τ²).
//! - D: the angle φ between the normal h of the pile of statoliths and the vertical after the base
//!   was tilted by φ0 = 90°, equation (6). It obeys tan(φ/2) = tan(φ0/2) exp(−t/τa).
//! - E: a shoot that was laid on its side three hours ago. Its visible strain u is the sum of the
//!   intrinsic strain u*, which growth has produced, and of an elastic part due to the weight (9).
//!   Without weight the shoot would have the shape of u*.
//!
//! # Results
//! The printed deviations are those between the crate and the closed forms. In panel E the visible
//! strain is computed from the directors by differences, and the elastic part from the couple of
//! the weight by the trapezoidal rule.
//!
//! # Options
//! - `--hours 0`: panel E for the shoot that has only sagged. `--hours 24`: close to the steady
//!   state.

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, LN_2, TAU};
use std::path::Path;
use std::process::ExitCode;

use morphorod::equilibrium::{EquilibriumSolver, Unloaded};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::tropism::{Growing, TropismLaw};
use morphorod::{Order, Scene, Shoot, ShootParameters, Still, Turned};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const MM_PER_M: f64 = 1e3;
/// End of a line; the next point begins another one.
const GAP: (f64, f64) = (f64::NAN, f64::NAN);

/// Strain κ, τ of the helix, 1/m.
const HELIX: [f64; 2] = [200.0, 100.0];
/// Length of the element of panel B before growth, m.
const ELEMENT: f64 = 2e-3;
/// Gradient δ1 of panel B, 1/m: growth at the surface is 15 % faster than on the centre line.
const GRADIENT: f64 = 300.0;

/// Panel of the figure.
struct Panel {
    name: &'static str,
    labels: [&'static str; 2],
    series: Vec<Series>,
    axes: Axes,
}

/// Labels of a panel that shows a view in space.
const VIEW: [&str; 2] = ["across the view (mm)", "up the view (mm)"];
/// Labels of a panel that shows the plane of bending.
const PLANE: [&str; 2] = ["x (mm)", "z (mm)"];

/// Returns a position (m) in an orthographic view, mm: azimuth −60°, elevation 24°.
fn view(p: &Vector3<f64>) -> (f64, f64) {
    let (sin_a, cos_a) = (-60.0_f64).to_radians().sin_cos();
    let (sin_e, cos_e) = 24.0_f64.to_radians().sin_cos();
    let across = cos_a * p.y - sin_a * p.x;
    let up = cos_e * p.z - sin_e * (cos_a * p.x + sin_a * p.y);
    (MM_PER_M * across, MM_PER_M * up)
}

/// Returns a position (m) in the plane of e1 and e3, mm.
fn plane(p: &Vector3<f64>) -> (f64, f64) {
    (MM_PER_M * p.x, MM_PER_M * p.z)
}

/// Returns a rod with an intrinsic strain that is a function of the arc length, m and 1/m.
fn rod_with(
    length: f64,
    scene: &Still,
    strain: impl Fn(f64) -> Vector3<f64>,
) -> Result<Rod, Box<dyn Error>> {
    let paper = ShootParameters::default();
    let mut rod = Rod::uniform(length, paper.radius, scene.base, 32, Order::Eight)?;
    rod.set_intrinsic(|point| strain(length - point.apex_distance));
    let _ = Unloaded.solve(&mut rod, &paper.young(), &(), &scene.environment(0.0))?;
    Ok(rod)
}

/// Panel A: directors along a curved and twisted rod.
fn directors(out: &Path) -> Result<Panel, Box<dyn Error>> {
    /// Length of the rod, m.
    const LENGTH: f64 = 0.02;
    /// Length of a director in the figure, m.
    const SHOWN: f64 = 3.5e-3;
    /// Curvature, 1/m.
    const BENDING: f64 = 70.0;
    /// Twist, 1/m.
    const TWIST: f64 = 100.0;
    let rod = rod_with(LENGTH, &Still::upright(), |s| {
        // The directors turn about the tangent, and the direction of bending does not turn with them.
        let (sin, cos) = (TWIST * s).sin_cos();
        Vector3::new(BENDING * sin, BENDING * cos, TWIST)
    })?;
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let names = ["s_m", "x_m", "y_m", "z_m"];
    let components = [
        "d1_x", "d1_y", "d1_z", "d2_x", "d2_y", "d2_z", "d3_x", "d3_y", "d3_z",
    ];
    let mut table = Table::create(
        out.join("directors.csv"),
        &[&names[..], &components[..]].concat(),
    )?;
    let mut lines = [Vec::new(), Vec::new(), Vec::new()];
    for i in 0..=5 {
        let s = LENGTH * f64::from(i) / 5.0;
        let (at, frame) = rod.at(s).ok_or("no such place")?;
        let mut row = vec![s, at.x, at.y, at.z];
        for (line, axis) in lines.iter_mut().zip(&axes) {
            let director = frame * axis;
            line.extend([view(&at), view(&(at + SHOWN * director)), GAP]);
            row.extend(director.iter());
        }
        table.row(&row)?;
    }
    table.finish()?;
    let line = rod.centre_line_at(101).iter().map(view).collect();
    let mut series = vec![Series::new("centre line", line, Style::Line, 6)];
    let styles = [
        ("director d1", Style::Line, 0),
        ("director d2", Style::Dashed, 1),
        ("director d3", Style::DashDot, 2),
    ];
    for (line, (label, style, colour)) in lines.into_iter().zip(styles) {
        series.push(Series::new(label, line, style, colour));
    }
    // The fixed frame, beside the rod.
    let origin = Vector3::new(-7e-3, 0.0, 2e-3);
    for (axis, name) in axes.iter().zip(["e1", "e2", "e3"]) {
        let end = origin + SHOWN * axis;
        let line = vec![view(&origin), view(&end)];
        series.push(Series::new("", line, Style::Line, 6));
        series.push(Series::text(name, view(&end), Style::Beside, 6));
    }
    Ok(Panel {
        name: "A: directors of a rod",
        labels: VIEW,
        series,
        axes: Axes::Equal,
    })
}

/// Growth at the rate REGR (1 + δ·x) at the place x of the section, equation (4).
struct Gradient {
    /// Components δ1 and δ2 along d1 and d2, 1/m.
    delta: [f64; 2],
}

impl TropismLaw for Gradient {
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let [first, second] = self.delta;
        Vector3::new(second, -first, 0.0)
    }
}

/// Panel B: an element before growth, after uniform growth, and after growth with a gradient.
fn growth(out: &Path) -> Result<Panel, Box<dyn Error>> {
    let paper = ShootParameters::default();
    // The length doubles in this time.
    let duration = paper.growth_time * LN_2;
    let cases = [
        ("before", 0.0, 0.0, 0.0),
        ("uniform", duration, 0.0, 3.0),
        ("gradient", duration, GRADIENT, 7.0),
    ];
    let mut table = Table::create(
        out.join("growth.csv"),
        &[
            "t_s",
            "gradient_per_m",
            "length_m",
            "closed_form_m",
            "strain_u2_per_m",
            "closed_form_per_m",
        ],
    )?;
    // Points without a text make room for the names.
    let mut series = vec![Series::new(
        "",
        vec![(-1.2, 0.0), (8.2, 0.0)],
        Style::Text,
        6,
    )];
    for (name, time, gradient, place) in cases {
        let mut shoot = Shoot::builder(paper.young())
            .length(ELEMENT)
            .radius(paper.radius)
            .elements(1)
            .growth(paper.growth())
            .tropism(Gradient {
                delta: [gradient, 0.0],
            })
            .build()?;
        MethodOfSteps::with_solver(0.25 * HOUR, Unloaded).advance(&mut shoot, time)?;
        let rod = shoot.rod();
        let length = rod.length();
        let strain = shoot.profile().at(0.5 * length).ok_or("no place")?.strain.y;
        let stretch = time / paper.growth_time;
        let closed = [ELEMENT * stretch.exp(), -gradient * stretch];
        table.row(&[time, gradient, length, closed[0], strain, closed[1]])?;
        println!(
            "B, {name}: length {:.6} mm, strain u2 {strain:.6} 1/m; \
             deviations from the closed forms {:.0e} mm and {:.0e} 1/m",
            MM_PER_M * length,
            MM_PER_M * (length - closed[0]).abs(),
            (strain - closed[1]).abs()
        );
        // Sides of the element, and sections at equal distances.
        let side = |share: f64, across: f64| {
            let (at, frame) = rod.at(length * share)?;
            let (x, z) = plane(&(at + frame * Vector3::x() * (across * paper.radius)));
            Some((x + place, z))
        };
        for across in [-1.0, 1.0] {
            let line = (0..=40).filter_map(|i| side(f64::from(i) / 40.0, across));
            series.push(Series::new("", line.collect(), Style::Line, 6));
        }
        let mut sections = Vec::new();
        for i in 0..=4 {
            let share = f64::from(i) / 4.0;
            sections.extend([-1.0, 1.0].into_iter().filter_map(|x| side(share, x)));
            sections.push(GAP);
        }
        series.push(Series::new("", sections, Style::Line, 5));
        series.push(Series::text(name, (place, -0.6), Style::Text, 6));
    }
    table.finish()?;
    Ok(Panel {
        name: "B: growth of an element",
        labels: PLANE,
        series,
        axes: Axes::Equal,
    })
}

/// Panel C: the helix of a constant strain.
fn helix(out: &Path) -> Result<Panel, Box<dyn Error>> {
    let [curvature, torsion] = HELIX;
    let rate = curvature.hypot(torsion);
    let turn = TAU / rate;
    let length = 2.0 * turn;
    // The constant Darboux vector points up.
    let scene = Still::tilted(-curvature.atan2(torsion));
    let rod = rod_with(length, &scene, |_| Vector3::new(curvature, 0.0, torsion))?;
    let [radius, pitch] = [curvature, TAU * torsion].map(|x| x / (rate * rate));
    let closed = |s: f64| {
        let (sin, cos) = (rate * s).sin_cos();
        Vector3::new(-radius * sin, radius * (cos - 1.0), pitch * s / turn)
    };
    let mut table = Table::create(
        out.join("helix.csv"),
        &[
            "s_m",
            "x_m",
            "y_m",
            "z_m",
            "closed_form_x_m",
            "closed_form_y_m",
            "closed_form_z_m",
        ],
    )?;
    let line = rod.centre_line_at(201);
    let mut exact = Vec::new();
    let mut deviation = 0.0_f64;
    for (i, p) in line.iter().enumerate() {
        let s = length * i as f64 / 200.0;
        let q = closed(s);
        table.row(&[s, p.x, p.y, p.z, q.x, q.y, q.z])?;
        deviation = deviation.max((p - q).norm());
        if i % 10 == 0 {
            exact.push(view(&q));
        }
    }
    table.finish()?;
    let place = |s: f64| rod.at(s).map(|(p, _)| p).ok_or("no such place");
    // Places half a turn apart are opposite to each other.
    let across = place(0.5 * turn)? - place(0.0)?;
    let measured = [0.5 * across.xy().norm(), place(turn)?.z - place(0.0)?.z];
    println!(
        "C: radius {:.9} mm, pitch {:.9} mm; closed form {:.9} and {:.9} mm; \
         largest distance between the curves {:.0e} mm",
        MM_PER_M * measured[0],
        MM_PER_M * measured[1],
        MM_PER_M * radius,
        MM_PER_M * pitch,
        MM_PER_M * deviation
    );
    Ok(Panel {
        name: "C: helix of a constant strain",
        labels: VIEW,
        series: vec![
            Series::new(
                "centre line",
                line.iter().map(view).collect(),
                Style::Line,
                6,
            ),
            Series::new("closed form", exact, Style::Points, 4),
        ],
        axes: Axes::Equal,
    })
}

/// Panel D: the normal of the pile of statoliths after the base was tilted.
fn statoliths(out: &Path) -> Result<Panel, Box<dyn Error>> {
    /// Time of the tilt, s.
    const FROM: f64 = MINUTE;
    // A shoot that neither responds nor sags keeps the cells at their angle.
    let paper = ShootParameters {
        gravitropic_sensitivity: 0.0,
        proprioceptive_sensitivity: 0.0,
        ..ShootParameters::default()
    };
    let mut shoot = paper
        .reduced()
        .tropism(paper.steering(paper.statoliths()))
        .load(())
        .scene(Turned::tilted(FRAC_PI_2, FROM, f64::INFINITY))
        .elements(1)
        .build()?;
    let mut integrator = MethodOfSteps::with_solver(10.0, Unloaded);
    let mut table = Table::create(
        out.join("statoliths.csv"),
        &["t_s", "angle_deg", "closed_form_deg"],
    )?;
    let mut found = Vec::new();
    let mut exact = Vec::new();
    let mut deviation = 0.0_f64;
    for i in 1..=60 {
        let t = 15.0 * f64::from(i);
        integrator.advance(&mut shoot, FROM + t)?;
        let variables = shoot.state().variables(0).ok_or("no statoliths")?;
        let normal = shoot.rod().frames()[0] * Vector3::from_column_slice(&variables[..3]);
        let angle = normal.xy().norm().atan2(normal.z);
        // The tilt is 90°, so that tan(φ0/2) = 1.
        let closed = 2.0 * (-t / paper.avalanche_time).exp().atan();
        let [angle, closed] = [angle, closed].map(f64::to_degrees);
        table.row(&[t, angle, closed])?;
        deviation = deviation.max((angle - closed).abs());
        found.push((t / MINUTE, angle));
        if i % 4 == 0 {
            exact.push((t / MINUTE, closed));
        }
    }
    table.finish()?;
    println!("D: largest deviation of the angle from the closed form {deviation:.0e} degrees");
    Ok(Panel {
        name: "D: avalanche of statoliths",
        labels: ["time after the tilt (min)", "angle of h from e3 (deg)"],
        series: vec![
            Series::new("", found, Style::Line, 6),
            Series::new("closed form", exact, Style::Points, 4),
        ],
        axes: Axes::Linear,
    })
}

/// Panels E: the parts of the strain, and the visible and the relaxed shape.
fn parts(out: &Path, end: f64) -> Result<[Panel; 2], Box<dyn Error>> {
    /// Half of the distance over which the rotation is measured, m.
    const HALF: f64 = 5e-5;
    let paper = ShootParameters {
        length: 0.05,
        growth_time: 20.0 * HOUR,
        ..ShootParameters::default()
    };
    let mut shoot = paper
        .reduced()
        .elements(16)
        .scene(Still::tilted(FRAC_PI_2))
        .build()?;
    MethodOfSteps::new(MINUTE).advance(&mut shoot, end)?;
    let rod = shoot.rod();
    let mut relaxed = rod.clone();
    let environment = shoot.environment();
    let _ = Unloaded.solve(&mut relaxed, &paper.young(), &(), &environment)?;

    let stiffness = paper.young().stiffness(paper.radius).y;
    let weight = paper.weight().density * environment.gravity.norm() * rod.volume() / paper.length;
    let line = rod.centre_line_at(2001);
    let step = paper.length / 2000.0;
    let mut table = Table::create(
        out.join("strain.csv"),
        &[
            "s_m",
            "visible_per_m",
            "intrinsic_per_m",
            "couple_over_stiffness_per_m",
            "x_m",
            "z_m",
            "relaxed_x_m",
            "relaxed_z_m",
        ],
    )?;
    let mut visible = Vec::new();
    let mut intrinsic = Vec::new();
    let mut elastic = Vec::new();
    let mut loaded = Vec::new();
    let mut residual = 0.0_f64;
    let mut largest = 0.0_f64;
    for i in 0..50 {
        // Middle of one of fifty equal parts.
        let index = 40 * i + 20;
        let s = step * index as f64;
        let frame = |s: f64| rod.at(s).map(|(_, frame)| frame).ok_or("no such place");
        let turned = frame(s - HALF)?.inverse() * frame(s + HALF)?;
        let total = turned.scaled_axis().y / (2.0 * HALF);
        let of_growth = shoot.profile().at(s).ok_or("no place")?.intrinsic.y;
        // Couple of the weight of the part between this place and the apex, by the trapezoidal
        // rule.
        let beyond = &line[index..];
        let levers = beyond.iter().map(|p| p.x - line[index].x);
        let tip = beyond[beyond.len() - 1].x - line[index].x;
        let couple = weight * step * (levers.sum::<f64>() - 0.5 * tip);
        let of_weight = couple / stiffness;
        let at = line[index];
        let (without, _) = relaxed.at(s).ok_or("no such place")?;
        table.row(&[
            s, total, of_growth, of_weight, at.x, at.z, without.x, without.z,
        ])?;
        residual = residual.max((total - of_growth - of_weight).abs());
        largest = largest.max(total.abs());
        let s = MM_PER_M * s;
        visible.push((s, total));
        intrinsic.push((s, of_growth));
        elastic.push((s, total - of_growth));
        if i % 4 == 2 {
            loaded.push((s, of_weight));
        }
    }
    table.finish()?;
    let [shown, without] = [rod, &relaxed].map(|rod| {
        let line = rod.centre_line_at(101);
        line.iter().map(plane).collect::<Vec<_>>()
    });
    println!(
        "E, after {} h: strain u2 at 24.5 mm {:.3} 1/m = {:.3} (intrinsic) + {:.3} (elastic); \
         largest |u − u* − m/(EI)| {:.0e} of the largest |u|",
        end / HOUR,
        visible[24].1,
        intrinsic[24].1,
        elastic[24].1,
        residual / largest
    );
    println!(
        "E: height of the tip {:.3} mm, without weight {:.3} mm",
        MM_PER_M * rod.tip().z,
        MM_PER_M * relaxed.tip().z
    );
    let series = |label: &str, line, style, colour| Series::new(label, line, style, colour);
    Ok([
        Panel {
            name: "E: parts of the strain",
            labels: ["arc length (mm)", "strain u2 (1/m)"],
            series: vec![
                series("visible strain u, shape", visible, Style::Line, 0),
                series("intrinsic u*, relaxed shape", intrinsic, Style::DashDot, 2),
                series("elastic part u − u*", elastic, Style::Dashed, 1),
                series("couple of the weight over EI", loaded, Style::Points, 1),
            ],
            axes: Axes::Linear,
        },
        Panel {
            name: "E: visible and relaxed shape",
            labels: PLANE,
            series: vec![
                series("visible strain u, shape", shown, Style::Line, 0),
                series("intrinsic u*, relaxed shape", without, Style::DashDot, 2),
            ],
            axes: Axes::Equal,
        },
    ])
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "model_sketch",
        "directors, growth, helix, statoliths, and the parts of the strain",
        &[Opt::value(
            "hours",
            "H",
            "3",
            "time since the shoot of panel E was laid on its side, h",
        )],
    );
    let end = HOUR * options.get_if("hours", "not negative", |hours: &f64| *hours >= 0.0);
    let out = options.out_dir();
    let mut panels = vec![
        directors(&out)?,
        growth(&out)?,
        helix(&out)?,
        statoliths(&out)?,
    ];
    panels.extend(parts(&out, end)?);
    let panels: Vec<_> = panels
        .iter()
        .map(|panel| (panel.name, panel.labels, &panel.series[..], panel.axes))
        .collect();
    Figure::new(out.join("model_sketch.svg"), "")
        .width(212.0)
        .height(95.0)
        .mixed_panels(&panels)?;
    println!(
        "wrote model_sketch.svg and five tables to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
