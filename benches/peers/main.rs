//! The shape of a rod with a horizontal base at rest: ours and others, error of the tip against run time, from a straight first
//! guess.
//!
//! ```sh
//! cargo bench -p morphorod-benches --bench peers
//! cargo bench -p morphorod-benches --bench peers -- --peers target/out/peers_python.csv
//! ```
//!
//! All of Rust run in turns on one thread, and the shortest time of each counts. With `--peers` the figure shows what
//! `benches/peers/peers.py` has measured for peers in Python, too. What came out is in `benches/peers/README.md`.

#[path = "../../examples/common/mod.rs"]
mod common;
mod ours;
mod problem;
mod shooting;

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use common::file::write_whole;
use common::{Axes, Opt, Options, Series, Style, finish, lines_figure};
use morphorod::Order;
use problem::{Run, exact_tip, load_of, race};

/// The error, relative to the length, for which the fastest settings are compared.
const GOAL: f64 = 1e-9;
/// What counts as converged under a heavy load: the right one of many equilibria, resolved or not.
const RIGHT: f64 = 1e-2;
/// Heavier loads q̂; at the last the rod hangs down from a bend of a twentieth of its length.
const HEAVY: [f64; 4] = [12.0, 20.0, 300.0, 1000.0];
/// Elements of the reference under heavy loads.
const FINE: usize = 256;
const HEADER: &str = "peer,setting,error,seconds";

fn main() -> ExitCode {
    finish(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse_for(
        "cargo bench -p morphorod-benches --bench peers",
        "peers",
        "a rod at rest by morphorod and by others: error against run time",
        &[
            Opt::value("rounds", "N", "100", "runs of each setting, of which the fastest counts"),
            Opt::value("peers", "FILE", "", "a table of benches/peers/peers.py, to be shown in the figure"),
            Opt::flag("bench", "given by cargo bench; without effect"),
        ],
    );
    // Cargo starts benchmarks in the folder of their package; paths are to be those of the repository, as everywhere.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))?;
    let rounds = options.get_if("rounds", "larger than 0", |n: &usize| *n > 0);
    let others = match options.text("peers") {
        "" => Vec::new(),
        file => read(Path::new(file))?,
    };
    let out = options.out_dir();

    let load = load_of(problem::DENSITY);
    let mut candidates = ours::candidates(load);
    candidates.extend(shooting::candidates(load));
    let runs = race(&mut candidates, rounds, exact_tip());
    write(&out.join("peers.csv"), &runs)?;
    let all: Vec<&Run> = runs.iter().chain(&others).collect();
    compare(&all);
    draw(&out.join("peers.svg"), &all)?;

    println!("\nheavier rods, from straight: which settings find the shape to {RIGHT} of the length");
    for load in HEAVY {
        heavy(load)?;
    }
    println!("peers.csv and peers.svg are in {}", out.display());
    Ok(())
}

/// The names of all peers, ours first.
fn peers<'a>(runs: &[&'a Run]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for run in runs {
        if !names.contains(&run.peer.as_str()) {
            names.push(&run.peer);
        }
    }
    names
}

/// The fastest setting of a peer that is accurate enough.
fn fastest<'a>(runs: &[&'a Run], peer: &str, error: f64) -> Option<&'a Run> {
    let good = runs.iter().filter(|run| run.peer == peer && run.error <= error);
    good.min_by(|a, b| a.seconds.total_cmp(&b.seconds)).copied()
}

/// Prints the fastest setting of each peer for some errors, and how much longer it takes than ours.
fn compare(runs: &[&Run]) {
    println!("fastest settings for an error of the tip, relative to the length");
    for error in [1e-4, 1e-6, 3e-9, GOAL, 1e-11] {
        println!("at most {error:e}:");
        let ours = fastest(runs, ours::NAME, error);
        for peer in peers(runs) {
            match fastest(runs, peer, error) {
                None => println!("  {peer:26} none"),
                Some(run) => {
                    let ratio = ours.map_or(f64::NAN, |ours| run.seconds / ours.seconds);
                    let (micros, setting) = (1e6 * run.seconds, &run.setting);
                    println!(
                        "  {peer:26} {micros:>10.1} µs, {ratio:>8.1} times ours, error {:.1e}: {setting}",
                        run.error
                    );
                }
            }
        }
    }
}

/// Who converges under a heavy load.
fn heavy(load: f64) -> Result<(), Box<dyn Error>> {
    let fine = (ours::candidate(load, Order::Eight, FINE).solve)().ok_or("the reference does not converge")?;
    println!("load {load}: tip at ({:.12}, {:.12}) of the length", fine.x, fine.z);
    let mut candidates = ours::candidates(load);
    candidates.extend(shooting::candidates(load));
    // Once to see who converges; the fastest of three is enough beside that.
    let runs = race(&mut candidates, 3, fine);
    let all: Vec<&Run> = runs.iter().collect();
    for peer in peers(&all) {
        let of: Vec<&&Run> = all.iter().filter(|run| run.peer == peer).collect();
        let right = of.iter().filter(|run| run.error <= RIGHT).count();
        let wrong = of.iter().filter(|run| run.error > RIGHT).count();
        print!(
            "  {peer:26} {right:>3} of {} right, {wrong} elsewhere or unresolved, {} fail",
            of.len(),
            of.len() - right - wrong
        );
        match fastest(&all, peer, GOAL) {
            Some(run) => println!("; to {GOAL:e} in {:.1} µs: {}", 1e6 * run.seconds, run.setting),
            None => println!("; none to {GOAL:e}"),
        }
    }
    Ok(())
}

/// One line for each order of ours but the second, which is in the table only, and one for the best settings of each other peer.
fn draw(file: &Path, runs: &[&Run]) -> std::io::Result<()> {
    let place = |run: &Run| (1e6 * run.seconds, run.error);
    let mut series = Vec::new();
    for order in [Order::Four, Order::Six, Order::Eight] {
        let name = format!("order {},", order.exponent());
        let of = runs.iter().filter(|run| run.peer == ours::NAME && run.setting.starts_with(&name));
        let label = format!("{}, order {}, 1 to 64 elements", ours::NAME, order.exponent());
        series.push(Series::new(label, of.map(|run| place(run)).collect(), Style::Marked, series.len()));
    }
    for peer in peers(runs).into_iter().filter(|peer| *peer != ours::NAME) {
        let mut best: Vec<&&Run> = runs.iter().filter(|run| run.peer == peer && run.error.is_finite()).collect();
        best.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        // Only settings that no other of this peer beats in both.
        let mut least = f64::INFINITY;
        best.retain(|run| {
            let better = run.error < least;
            least = least.min(run.error);
            better
        });
        let points = best.iter().map(|run| place(run)).collect();
        series.push(Series::new(format!("{peer}, best settings"), points, Style::Marked, series.len()));
    }
    let (x, y) = ("run time (µs)", "error of the tip, relative to the length");
    lines_figure(file, "A rod with a horizontal base, at rest", x, y, &series, Axes::LogLog)
}

fn write(file: &Path, runs: &[Run]) -> std::io::Result<()> {
    let mut text = format!("{HEADER}\n");
    for Run { peer, setting, error, seconds } in runs {
        // A comma inside a cell would be a cell more.
        text += &format!("{peer},{},{error:e},{seconds:e}\n", setting.replace(',', ";"));
    }
    write_whole(file, text)
}

fn read(file: &Path) -> Result<Vec<Run>, Box<dyn Error>> {
    let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Err(format!("{}: the first line is not {HEADER}", file.display()).into());
    }
    let run = |line: &str| -> Option<Run> {
        let [peer, setting, error, seconds] = line.split(',').collect::<Vec<_>>().try_into().ok()?;
        let (error, seconds) = (error.parse().ok()?, seconds.parse().ok()?);
        Some(Run { peer: peer.into(), setting: setting.into(), error, seconds })
    };
    let wrong = |line: &str| format!("{}: '{line}' is not {HEADER}", file.display()).into();
    lines.map(|line| run(line).ok_or_else(|| wrong(line))).collect()
}
