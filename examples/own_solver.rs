//! Two solvers of equilibria that are written outside the library: dynamic relaxation, and a
//! continuation through folds.
//!
//! They use the public interface for solvers: `RodEnergy` returns the energy, the unbalanced
//! couples and the tangent of a rod at its frames, and `Rod::set_shape` sets the frames. The
//! chapter `docs/own-methods.md` explains it.
//!
//! 1. **Dynamic relaxation** (`own_solver/relaxation.rs`) implements `EquilibriumSolver`. It finds
//!    the shape of a horizontal shoot under its weight, and then serves the integrator of a shoot
//!    that rights itself.
//! 2. **Pseudo-arclength continuation** (`own_solver/arc_length.rs`). A flat upright rod carries a
//!    weight on its apex that is larger than Euler's, so that it leans to one side. A lateral force
//!    pushes it to the other side. At a fold the leaning shape ceases to exist, and the solver of
//!    the library, which finds stable equilibria, jumps to the other side. The continuation passes
//!    the fold, follows the unstable shapes back, and reaches the other side through a second fold.
//!    The force at the fold is compared with elliptic integrals.
//!
//! # Options
//! - `--weight 3`: closer to Euler's load (2.467), the folds move together.
//! - `--elements 4`: the error of the fold increases.

#[path = "own_solver/arc_length.rs"]
mod arc_length;
#[path = "own_solver/elastica.rs"]
mod elastica;
#[path = "own_solver/relaxation.rs"]
mod relaxation;

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::process::ExitCode;

use arc_length::{Family, Point};
use elastica::fold_force;
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Weight};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Section, ShootParameters, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::{UnitQuaternion, Vector3};
use relaxation::DynamicRelaxation;

const TISSUE: LinearElastic = LinearElastic {
    youngs_modulus: 1e7,
    poissons_ratio: 0.5,
};
const HOUR: f64 = 3600.0;

/// Compares dynamic relaxation with Newton's method, for a rod and in a run of a shoot.
fn relax() -> Result<(), Box<dyn Error>> {
    let scene = Still::tilted(FRAC_PI_2);
    let (now, weight) = (scene.environment(0.0), Weight { density: 1000.0 });
    let rod = || Rod::uniform(0.0659, 0.5e-3, scene.base, 8, Order::Eight);
    let (mut relaxed, mut exact) = (rod()?, rod()?);
    let mut solver = DynamicRelaxation {
        tolerance: 1e-10,
        max_steps: 100_000,
    };
    let found = solver.solve(&mut relaxed, &TISSUE, &weight, &now)?;
    let newton = NewtonSolver::default().solve(&mut exact, &TISSUE, &weight, &now)?;
    println!("a horizontal rod of 6.59 cm under its weight");
    println!(
        "  dynamic relaxation: {:5} evaluations, tip {:.10} m",
        found.evaluations,
        relaxed.tip().z
    );
    println!(
        "  Newton's method:    {:5} iterations,  tip {:.10} m",
        newton.iterations,
        exact.tip().z
    );
    println!(
        "  distance of the tips {:.1e} m",
        (relaxed.tip() - exact.tip()).norm()
    );

    let parameters = ShootParameters {
        length: 0.05,
        growth_time: 20.0 * HOUR,
        ..ShootParameters::default()
    };
    let shoot = || parameters.reduced().elements(4).scene(scene).build();
    let (mut relaxed, mut exact) = (shoot()?, shoot()?);
    let own = MethodOfSteps::with_solver(360.0, solver).advance(&mut relaxed, 4.0 * HOUR)?;
    let newton = MethodOfSteps::new(360.0).advance(&mut exact, 4.0 * HOUR)?;
    println!("a shoot that rights itself, after 4 h");
    println!(
        "  {:.0} evaluations per equilibrium, Newton's method {:.1}",
        own.work() as f64 / own.equilibria as f64,
        newton.work() as f64 / newton.equilibria as f64
    );
    println!(
        "  distance of the tips {:.1e} m",
        (relaxed.tip() - exact.tip()).norm()
    );
    Ok(())
}

/// Half of the thickness of the flat rod along d1, in the plane of bending, and along d2, m.
const FLAT: (f64, f64) = (0.5e-3, 1e-3);
const LENGTH: f64 = 0.1;

/// Follows the branch of shapes of a rod with a weight on its apex, and compares it with the
/// library.
fn pass_folds(weight: f64, elements: usize, out: &Path) -> Result<(), Box<dyn Error>> {
    let section = Section::ellipse(FLAT.0, FLAT.1);
    let nodes = Rod::equal_nodes(LENGTH, elements);
    let straight = Rod::straight(
        &nodes,
        |_| section,
        UnitQuaternion::identity(),
        Order::Eight,
    )?;
    let unit = TISSUE.stiffness(section).y / (LENGTH * LENGTH);
    let load = |force: f64| ApicalForce(move |_: f64| Vector3::new(force, 0.0, -weight) * unit);
    let now = Still::weightless().environment(0.0);
    let family = Family {
        material: &TISSUE,
        load,
        environment: now,
        scale: 10.0,
    };

    // The branch begins at a force to the left, where the rod leans to the left.
    let (least, step) = (-2.0, 0.03);
    let (mut rod, mut newton) = (straight.clone(), NewtonSolver::default());
    let _ = newton.solve(&mut rod, &TISSUE, &load(least), &now)?;
    let mut branch: Vec<Point> = vec![family.begin(&rod, least)?];
    let mut folds = Vec::new();
    while branch.last().is_some_and(|point| point.parameter < -least) {
        let last = branch.last().ok_or("empty branch")?;
        let next = family.advance(last, step)?;
        if next.slope() * last.slope() < 0.0 {
            folds.push(family.fold(last, step)?);
        }
        branch.push(next);
    }
    println!(
        "a rod with a weight of {weight} E I/ℓ² on its apex: {} points, {} folds",
        branch.len(),
        folds.len()
    );
    let exact = fold_force(weight);
    for fold in &folds {
        let found = fold.parameter;
        println!(
            "  fold at the force {found:+.10} E I/ℓ², {:+.1e} from the elliptic integrals",
            found.abs() - exact
        );
    }

    // The library, with the last shape as initial guess, for increasing and for decreasing forces.
    let (mut paths, mut largest) = (Vec::new(), 0.0_f64);
    for sign in [1.0, -1.0] {
        let (mut rod, mut path) = (straight.clone(), Vec::new());
        for k in -40..=40 {
            let force = sign * 0.05 * f64::from(k);
            let found = newton.solve(&mut rod, &TISSUE, &load(force), &now)?;
            if let Some(jump) = found.jump.filter(|_| k > -40) {
                println!(
                    "  the library jumps by {:.2} ℓ at the force {force:+.2} E I/ℓ²",
                    jump / LENGTH
                );
            }
            path.push((force, rod.tip().x / LENGTH));
            largest = largest.max(off_branch(&family, &branch, &rod, force)?);
        }
        paths.push(path);
    }
    println!("  largest distance of the tips of the library from the branch {largest:.1e} m");
    let mut table = Table::create(
        out.join("branch.csv"),
        &["force_over_bl2", "tip_x_m", "negative"],
    )?;
    for point in &branch {
        table.row(&[point.parameter, point.rod.tip().x, point.negative as f64])?;
    }
    table.finish()?;
    draw(&branch, &folds, &paths, out)?;
    Ok(())
}

/// Distance of the tip of a rod from that of the branch at the same force, m: Newton's method from
/// the closest stable point.
fn off_branch<L: morphorod::load::Load, F: Fn(f64) -> L>(
    family: &Family<'_, LinearElastic, F>,
    branch: &[Point],
    rod: &Rod,
    force: f64,
) -> Result<f64, Box<dyn Error>> {
    let away = |point: &&Point| (point.rod.tip() - rod.tip()).norm();
    let stable = branch.iter().filter(|point| point.negative == 0);
    let closest = stable
        .min_by(|a, b| away(a).total_cmp(&away(b)))
        .ok_or("no stable point")?;
    let point = family.begin(&closest.rod, force)?;
    Ok((point.rod.tip() - rod.tip()).norm())
}

fn draw(
    branch: &[Point],
    folds: &[Point],
    paths: &[Vec<(f64, f64)>],
    out: &Path,
) -> std::io::Result<()> {
    let at = |point: &Point| (point.parameter, point.rod.tip().x / LENGTH);
    let mut series = Vec::new();
    // Pieces of the branch with the same stability, which share their ends.
    let mut from = 0;
    for to in 1..branch.len() {
        if to + 1 == branch.len() || branch[to].negative != branch[from].negative {
            let stable = branch[from].negative == 0;
            let name = match (stable, series.len()) {
                (true, 0) => "continuation, stable",
                (false, 1) => "continuation, unstable",
                _ => "",
            };
            let (style, colour) = if stable {
                (Style::Line, 0)
            } else {
                (Style::Dashed, 1)
            };
            series.push(Series::new(
                name,
                branch[from..=to].iter().map(at).collect(),
                style,
                colour,
            ));
            from = to;
        }
    }
    let names = ["library, force increases", "library, force decreases"];
    for (i, (path, name)) in paths.iter().zip(names).enumerate() {
        series.push(Series::new(
            name,
            path.iter().copied().step_by(2).collect(),
            Style::Points,
            2 + i,
        ));
    }
    series.push(Series::new(
        "folds",
        folds.iter().map(at).collect(),
        Style::Points,
        5,
    ));
    let (title, y) = (
        "A rod that snaps: lateral force and position of its apex",
        "position of the apex x/ℓ (1)",
    );
    Figure::new(out.join("branch.svg"), title).lines(
        "lateral force (E I/ℓ²)",
        y,
        &series,
        Axes::Linear,
    )
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "own_solver",
        "solvers written outside the library: dynamic relaxation, and continuation through folds",
        &[
            Opt::value(
                "weight",
                "P",
                "4",
                "weight on the apex over E I/ℓ², above π²/4",
            ),
            Opt::value("elements", "N", "8", "number of elements of the rod"),
        ],
    );
    let weight = options.positive("weight");
    let elements = options.positive("elements").round() as usize;
    let out = options.out_dir();
    relax()?;
    pass_folds(weight, elements, &out)?;
    println!("wrote branch.csv and branch.svg to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
