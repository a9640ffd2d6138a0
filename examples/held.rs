//! Rods that are held at both ends: a propped cantilever, an arch, and a twisted ring.
//!
//! This example solves for equilibria of an elastic rod with supports, without growth. The
//! reactions of the supports are unknowns of the solver besides the shape.
//!
//! 1. A horizontal cantilever under its weight has a frictionless prop under its apex. At small
//!    load the prop bears 3/8 of the weight.
//! 2. A rod without weight is clamped at both ends, which approach each other. It bends to a planar
//!    arch, the elastica of Euler. Beyond a shortening of 0.5427 of the length the arch is
//!    unstable: an eigenvalue of a mode out of its plane is negative.
//! 3. A rod is closed to a ring, and one end is twisted. The circle is an equilibrium at any twist,
//!    and loses stability at √3 B/C turns (J. H. Michell 1889, E. E. Zajac 1962), where B and C are
//!    the stiffnesses to bending and twist.
//!
//! # Results
//! The reaction at q ℓ³/B = 1 is 0.37501 q ℓ. The arch is stable up to a shortening of 0.5 and
//! unstable at 0.6. The circle loses stability at 2.59808 turns. The bifurcation is subcritical:
//! the buckled ring, a figure of eight from the side, exists below the critical twist and is
//! unstable.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::process::ExitCode;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{Equilibrium, EquilibriumError, NewtonSolver};
use morphorod::load::{Load, Weight};
use morphorod::rod::Rod;
use morphorod::support::{Hold, Reaction, Support};
use morphorod::{Order, Scene, Still};
use morphorod_plot::{Axes, Figure, Options, Series, Style, Table, println};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Length of the rods, m.
const LENGTH: f64 = 0.1;
/// Radius, m.
const RADIUS: f64 = 5e-4;
/// Young's modulus, Pa.
const YOUNGS_MODULUS: f64 = 1e7;
/// Density, kg/m³.
const DENSITY: f64 = 1000.0;

/// A rod with what its equilibrium depends on.
struct Setup {
    rod: Rod,
    tissue: LinearElastic,
    scene: Still,
    solver: NewtonSolver,
}

impl Setup {
    fn new(tissue: LinearElastic, scene: Still, stable_only: bool) -> Result<Self, Box<dyn Error>> {
        let rod = Rod::uniform(LENGTH, RADIUS, scene.base, 16, Order::Eight)?;
        Ok(Self {
            rod,
            tissue,
            scene,
            solver: NewtonSolver {
                stable_only,
                ..NewtonSolver::with_tolerance(1e-14)
            },
        })
    }

    fn hold(
        &mut self,
        load: &impl Load,
        support: &impl Support,
    ) -> Result<(Equilibrium, Vec<Reaction>), EquilibriumError> {
        let environment = self.scene.environment(0.0);
        let held =
            self.solver
                .solve_held(&mut self.rod, &self.tissue, load, support, &environment)?;
        Ok((held.equilibrium, held.reactions))
    }

    /// Points of the centre line, cm.
    fn line(&self) -> Vec<Vector3<f64>> {
        self.rod
            .centre_line_at(201)
            .into_iter()
            .map(|point| 100.0 * point)
            .collect()
    }
}

/// Stiffness to bending, N m².
fn bending(tissue: &LinearElastic) -> f64 {
    tissue.stiffness(RADIUS).x
}

/// Propped cantilevers of several weights.
fn cantilever(tissue: LinearElastic, out: &Path) -> Result<(), Box<dyn Error>> {
    let scene = Still::tilted(0.5 * PI);
    let loads = [1.0, 10.0, 30.0, 100.0];
    let mut table = Table::create(
        out.join("cantilever.csv"),
        &["load", "reaction", "s_m", "x_m", "z_m"],
    )?;
    let mut series = Vec::new();
    for (index, load) in loads.into_iter().enumerate() {
        let mut setup = Setup::new(tissue, scene, true)?;
        let weight = load * bending(&tissue) / (LENGTH * LENGTH);
        let density = weight / (LENGTH * scene.gravity.norm() * PI * RADIUS * RADIUS);
        // The apex slides in the horizontal plane through the base.
        let prop = Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis());
        let (_, reactions) = setup.hold(&Weight { density }, &prop)?;
        let share = reactions[0].force.z / weight;
        println!("load q ℓ³/B = {load:5}: reaction {share:.9} q ℓ");
        for (i, point) in setup.rod.centre_line_at(201).iter().enumerate() {
            table.row(&[load, share, LENGTH * i as f64 / 200.0, point.x, point.z])?;
        }
        let line: Vec<_> = setup.line().iter().map(|p| (p.x, p.z)).collect();
        let tip = line[line.len() - 1];
        let label = format!("qℓ³/B = {load}, R = {share:.4} qℓ");
        series.push(Series::new(label, line, Style::Line, 0).ordered(index, loads.len()));
        series.push(Series::new("", vec![tip], Style::Points, 2).ordered(index, loads.len()));
    }
    table.finish()?;
    let title = "Cantilevers under their weight with a prop at the apex";
    Figure::new(out.join("cantilever.svg"), title).lines(
        "x (cm)",
        "z (cm)",
        &series,
        Axes::Equal,
    )?;
    Ok(())
}

/// The planar arch between clamps at several shortenings.
fn arch(tissue: LinearElastic, out: &Path) -> Result<(), Box<dyn Error>> {
    let scene = Still {
        gravity: Vector3::zeros(),
        ..Still::tilted(0.5 * PI)
    };
    let columns = [
        "shortening",
        "thrust_n",
        "negative_eigenvalues",
        "s_m",
        "x_m",
        "z_m",
    ];
    let mut table = Table::create(out.join("arch.csv"), &columns)?;
    let mut setup = Setup::new(tissue, scene, false)?;
    // A small weight, which is removed again, selects the plane and the side to which the rod
    // buckles.
    let mut load = Weight {
        density: -0.01 * DENSITY,
    };
    setup.scene.gravity = Still::upright().gravity;
    let mut series = Vec::new();
    let count = 6;
    for step in 1..=count {
        let shortening = 0.1 * f64::from(step);
        let clamp = Hold::apex()
            .at(Vector3::x() * (LENGTH * (1.0 - shortening)))
            .held(scene.base);
        if load.density != 0.0 {
            let _ = setup.hold(&load, &clamp)?;
            load.density = 0.0;
        }
        let (found, reactions) = setup.hold(&load, &clamp)?;
        let (thrust, negative) = (-reactions[0].force.x, found.inertia.negative);
        let dimensionless = thrust * LENGTH * LENGTH / bending(&tissue);
        println!(
            "shortening {shortening:.1}: P ℓ²/B = {dimensionless:.6}, {negative} negative eigenvalues"
        );
        for (i, point) in setup.rod.centre_line_at(201).iter().enumerate() {
            let s = LENGTH * i as f64 / 200.0;
            table.row(&[shortening, thrust, negative as f64, s, point.x, point.z])?;
        }
        let (style, kind) = if negative > 0 {
            (Style::Dashed, "unstable")
        } else {
            (Style::Line, "stable")
        };
        let line = setup.line().iter().map(|p| (p.x, p.z)).collect();
        let label = format!("shortening {shortening:.1} ℓ, {kind}");
        series.push(Series::new(label, line, style, 0).ordered(step as usize - 1, count as usize));
    }
    table.finish()?;
    let title = "Planar arches between clamps that approach each other";
    Figure::new(out.join("arch.svg"), title).lines("x (cm)", "z (cm)", &series, Axes::Equal)?;
    Ok(())
}

/// A ring whose ends meet at the base, without twist.
fn ring(tissue: LinearElastic, stable_only: bool) -> Result<Setup, Box<dyn Error>> {
    let mut setup = Setup::new(tissue, Still::weightless(), stable_only)?;
    // The shape without load is a circle while the rod is closed.
    setup.rod.set_intrinsic(|_| Vector3::y() * (TAU / LENGTH));
    let _ = setup.hold(&(), &())?;
    setup.rod.set_intrinsic(|_| Vector3::zeros());
    Ok(setup)
}

/// Closes the ring with a number of turns of twist.
fn closed(turns: f64) -> Hold {
    let frame = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TAU * turns);
    Hold::apex().at(Vector3::zeros()).held(frame)
}

/// Coordinates along the principal axes of a line, of which the first is the longest. The ring
/// rotates freely about its tangent at the base, and its bends move freely along it.
fn principal(line: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let centre = line.iter().sum::<Vector3<f64>>() / line.len() as f64;
    let spread: Matrix3<f64> = line
        .iter()
        .map(|p| (p - centre) * (p - centre).transpose())
        .sum();
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let along = |p: &Vector3<f64>, i: usize| eigen.eigenvectors.column(order[i]).dot(&(p - centre));
    line.iter()
        .map(|p| Vector3::new(along(p, 0), along(p, 1), along(p, 2)))
        .collect()
}

/// The twisted ring: energy against twist, and shapes.
fn twisted_ring(tissue: LinearElastic, out: &Path) -> Result<(), Box<dyn Error>> {
    let critical = 3_f64.sqrt() * (1.0 + tissue.poissons_ratio);
    let unit = bending(&tissue) / LENGTH;
    let circle_energy =
        |turns: f64| 0.5 * TAU * TAU * (1.0 + turns * turns / (1.0 + tissue.poissons_ratio)) * unit;
    let mut table = Table::create(
        out.join("ring.csv"),
        &["turns", "energy_j", "negative_eigenvalues", "buckled"],
    )?;

    // The circle, stable or not. A held frame rotates by the shortest rotation, and steps are less
    // than half a turn.
    let mut circle = ring(tissue, false)?;
    let (mut stable, mut unstable) = (vec![], vec![]);
    for step in 0..=55 {
        let turns = 1.1 * critical * f64::from(step) / 55.0;
        let (found, _) = circle.hold(&(), &closed(turns))?;
        let point = (turns, (found.energy - circle_energy(turns)) / unit);
        if found.inertia.negative == 0 {
            stable.push(point)
        } else {
            unstable.push(point)
        }
        table.row(&[turns, found.energy, found.inertia.negative as f64, 0.0])?;
    }
    println!(
        "ring: the circle is stable at {:.4} turns",
        stable[stable.len() - 1].0
    );
    println!("ring: theory predicts the loss of stability at {critical:.6} turns");

    // The buckled ring is unstable and exists below the critical twist. A weight along the
    // diameter, which is removed in steps, leads to it.
    let mut setup = ring(tissue, false)?;
    let start = critical - 0.06;
    for step in 1..=25 {
        let _ = setup.hold(&(), &closed(start * f64::from(step) / 25.0))?;
    }
    setup.scene.gravity = -Still::upright().gravity;
    for share in [1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.02, 0.01] {
        let _ = setup.hold(
            &Weight {
                density: share * DENSITY,
            },
            &closed(start),
        )?;
    }
    let mut buckled = Vec::new();
    let mut views: [Vec<Series>; 2] = [Vec::new(), Vec::new()];
    // The twists increase to the critical one and then decrease from the same start.
    let offsets = (0..6)
        .map(|i| -0.06 + 0.01 * f64::from(i))
        .chain((0..6).map(|i| -0.06 - 0.02 * f64::from(i)));
    let first = setup.rod.clone();
    for (index, offset) in offsets.enumerate() {
        let turns = critical + offset;
        if index == 6 {
            setup.rod.clone_from(&first);
        }
        // If there is no solution at one twist, the next search begins at the last shape found. The
        // ring rotates freely about its tangent at the base. Rounding in this direction may prevent
        // convergence. It becomes a circle then.
        let last = setup.rod.clone();
        let Ok((found, _)) = setup.hold(&(), &closed(turns)) else {
            continue;
        };
        let excess = (found.energy - circle_energy(turns)) / unit;
        if excess < 1e-6 {
            println!("ring: at {turns:.3} turns the solver returned to the circle");
            setup.rod = last;
            continue;
        }
        buckled.push((turns, excess));
        table.row(&[turns, found.energy, found.inertia.negative as f64, 1.0])?;
        if [4, 6, 7, 9, 11].contains(&index) {
            let line = principal(&setup.line());
            let label = format!("{turns:.3} turns");
            let projections = [|p: &Vector3<f64>| (p.x, p.y), |p: &Vector3<f64>| (p.x, p.z)];
            for (view, project) in views.iter_mut().zip(projections) {
                let (points, rank) = (line.iter().map(project).collect(), view.len());
                view.push(Series::new(label.clone(), points, Style::Line, 0).ordered(rank, 5));
            }
        }
    }
    table.finish()?;

    buckled.sort_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0));
    unstable.insert(0, (critical, 0.0));
    let top = buckled.iter().map(|point| point.1).fold(0.1, f64::max);
    let shown = |line: Vec<(f64, f64)>| {
        line.into_iter()
            .filter(|point| point.0 > 0.85 * critical)
            .collect()
    };
    let series = [
        Series::new("circle, stable", shown(stable), Style::Line, 0),
        Series::new("circle, unstable", shown(unstable), Style::Dashed, 0),
        Series::new("buckled ring, unstable", buckled, Style::DashDot, 1),
        Series::new(
            format!("critical twist, {critical:.4} turns"),
            vec![(critical, 0.0)],
            Style::Points,
            6,
        ),
        Series::new(
            "",
            vec![(critical, -0.05 * top), (critical, top)],
            Style::Dotted,
            6,
        ),
    ];
    let title = "Elastic energy of a twisted ring relative to that of the circle";
    let label = "energy difference × ℓ/B (1)";
    Figure::new(out.join("ring.svg"), title).lines(
        "twist (turns)",
        label,
        &series,
        Axes::Linear,
    )?;
    let title = "Buckled rings, unstable, in two projections";
    let panels = [
        ("across the ring", &views[0][..]),
        ("along the ring", &views[1][..]),
    ];
    Figure::new(out.join("ring_shapes.svg"), title).panels(
        "place along the longest axis (cm)",
        "place along a shorter axis (cm)",
        &panels,
        Axes::Equal,
    )?;
    Ok(())
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse("held", "rods that are held at both ends", &[]);
    let out = options.out_dir();
    let tissue = LinearElastic {
        youngs_modulus: YOUNGS_MODULUS,
        poissons_ratio: 0.5,
    };
    cantilever(tissue, &out)?;
    arch(tissue, &out)?;
    twisted_ring(tissue, &out)?;
    println!("wrote tables and figures to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
