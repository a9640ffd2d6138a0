//! Error against run time of the equilibrium of a rod with a horizontal base, for several programs.
//!
//! ```sh
//! cargo bench -p morphorod-benches --bench peers
//! cargo bench -p morphorod-benches --bench peers -- --python target/peers/bin/python --write docs/performance.md
//! ```
//!
//! All programs start from the straight shape. Programs in Rust are measured in alternation on one
//! thread, and the shortest run time of each setting counts. `--python` also runs
//! `benches/peers/peers.py`, which measures programs in Python. `--write` writes the table of the
//! fastest settings into a chapter.

mod ours;
mod problem;
mod shooting;

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};

use morphorod::Order;
use morphorod_plot::file::{write_between_marks, write_whole};
use morphorod_plot::table::duration;
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, finish};
use problem::{Run, exact_tip, load_of, race};

/// Error, relative to the length, for which the fastest settings are compared under heavy loads.
const GOAL: f64 = 1e-9;
/// Largest error of a solution that is close to the reference and not to another equilibrium,
/// relative to the length.
const CLOSE: f64 = 1e-2;
/// Heavier loads q̂. Under the last load, the bent part at the base is a twentieth of the length,
/// and the rest hangs down.
const HEAVY: [f64; 4] = [12.0, 20.0, 300.0, 1000.0];
/// Number of elements of the reference under heavy loads.
const FINE: usize = 256;
const HEADER: &str = "peer,setting,error,seconds";

fn main() -> ExitCode {
    finish(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse_for(
        "cargo bench -p morphorod-benches --bench peers",
        "peers",
        "error against run time of the equilibrium of a rod, for several programs",
        &[
            Opt::value(
                "rounds",
                "N",
                "100",
                "number of runs of each setting, of which the fastest counts",
            ),
            Opt::value(
                "python",
                "FILE",
                "",
                "Python with SciPy, by which benches/peers/peers.py is run as well",
            ),
            Opt::value(
                "write",
                "FILE",
                "",
                "chapter into which the table is written, between two marks",
            ),
            Opt::flag("bench", "passed by cargo bench; has no effect"),
        ],
    );
    // Cargo starts benchmarks in the folder of their package. Paths are relative to the repository.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))?;
    let rounds = options.get_if("rounds", "larger than 0", |n: &usize| *n > 0);
    let out = options.out_dir();
    let others = match options.text("python") {
        "" => Vec::new(),
        python => measure_python(python, &out.join("peers_python.csv"))?,
    };

    let load = load_of(problem::DENSITY);
    let mut candidates = ours::candidates(load);
    candidates.extend(shooting::candidates(load));
    let runs = race(&mut candidates, rounds, exact_tip());
    write(&out.join("peers.csv"), &runs)?;
    let all: Vec<&Run> = runs.iter().chain(&others).collect();
    compare(&all);
    let table = table(&all);
    println!("{table}");
    match options.text("write") {
        "" => (),
        chapter => write_between_marks(Path::new(chapter), &table)?,
    }
    draw(&out.join("peers.svg"), &all)?;

    println!("\nheavier loads: number of settings that converge to within {CLOSE} of the length");
    for load in HEAVY {
        heavy(load)?;
    }
    println!("wrote peers.csv and peers.svg to {}", out.display());
    Ok(())
}

/// Names of all programs, in the order of the results.
fn peers<'a>(runs: &[&'a Run]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for run in runs {
        if !names.contains(&run.peer.as_str()) {
            names.push(&run.peer);
        }
    }
    names
}

/// Fastest setting of a program whose error is at most `error`.
fn fastest<'a>(runs: &[&'a Run], peer: &str, error: f64) -> Option<&'a Run> {
    let good = runs
        .iter()
        .filter(|run| run.peer == peer && run.error <= error);
    good.min_by(|a, b| a.seconds.total_cmp(&b.seconds)).copied()
}

/// Prints the fastest setting of each program for several errors, and its run time divided by that
/// of `morphorod`.
fn compare(runs: &[&Run]) {
    println!("fastest settings for given errors of the tip, relative to the length");
    for error in [1e-4, 1e-6, 3e-9, GOAL, 1e-11] {
        println!("error at most {error:e}:");
        let ours = fastest(runs, ours::NAME, error);
        for peer in peers(runs) {
            match fastest(runs, peer, error) {
                None => println!("  {peer:26} none"),
                Some(run) => {
                    let ratio = ours.map_or(f64::NAN, |ours| run.seconds / ours.seconds);
                    let (micros, setting) = (1e6 * run.seconds, &run.setting);
                    println!(
                        "  {peer:26} {micros:>10.1} µs, {ratio:>8.1} times morphorod, error {:.1e}: {setting}",
                        run.error
                    );
                }
            }
        }
    }
}

/// The fastest setting of each program with an error of at most [`GOAL`], or the most accurate one
/// if no setting has such an error.
fn table(runs: &[&Run]) -> String {
    let mut text =
        "| program | setting | error | run time | relative to `morphorod` |\n|---|---|---|---|---|\n".to_owned();
    let ours = fastest(runs, ours::NAME, GOAL).map_or(f64::NAN, |run| run.seconds);
    for peer in peers(runs) {
        let of = || {
            runs.iter()
                .filter(|run| run.peer == peer && run.error.is_finite())
        };
        let best = || of().min_by(|a, b| a.error.total_cmp(&b.error)).copied();
        let Some(run) = fastest(runs, peer, GOAL).or_else(best) else {
            continue;
        };
        let (time, ratio) = (duration(run.seconds), run.seconds / ours);
        let ratio = match ratio {
            _ if run.error > GOAL => "–".to_owned(),
            ratio if ratio < 100.0 => format!("{ratio:.2}"),
            ratio => format!("{ratio:.0}"),
        };
        text += &format!(
            "| {peer} | {} | {:.1e} | {time} | {ratio} |\n",
            run.setting, run.error
        );
    }
    text
}

/// Measures the programs in Python, and reads the table of their results.
fn measure_python(python: &str, file: &Path) -> Result<Vec<Run>, Box<dyn Error>> {
    let status = Command::new(python)
        .arg("benches/peers/peers.py")
        .arg("--out")
        .arg(file)
        .status();
    let status = status.map_err(|error| format!("{python}: {error}"))?;
    if !status.success() {
        return Err(format!("{python} benches/peers/peers.py: {status}").into());
    }
    read(file)
}

/// Prints which programs converge under a heavy load.
fn heavy(load: f64) -> Result<(), Box<dyn Error>> {
    let fine = (ours::candidate(load, Order::Eight, FINE).solve)()
        .ok_or("the reference does not converge")?;
    println!(
        "load q̂ = {load}: tip at ({:.12}, {:.12}) of the length",
        fine.x, fine.z
    );
    let mut candidates = ours::candidates(load);
    candidates.extend(shooting::candidates(load));
    // Run times are secondary here, so that three runs suffice.
    let runs = race(&mut candidates, 3, fine);
    let all: Vec<&Run> = runs.iter().collect();
    for peer in peers(&all) {
        let of: Vec<&&Run> = all.iter().filter(|run| run.peer == peer).collect();
        let close = of.iter().filter(|run| run.error <= CLOSE).count();
        let far = of.iter().filter(|run| run.error > CLOSE).count();
        print!(
            "  {peer:26} {close:>3} of {} converge, {far} to another shape or inaccurately, {} fail",
            of.len(),
            of.len() - close - far
        );
        match fastest(&all, peer, GOAL) {
            Some(run) => println!(
                "; error {GOAL:e} in {:.1} µs: {}",
                1e6 * run.seconds,
                run.setting
            ),
            None => println!("; none with error {GOAL:e}"),
        }
    }
    Ok(())
}

/// Draws one curve for each of the orders four, six and eight of `morphorod`, and one for the best
/// settings of each other program.
fn draw(file: &Path, runs: &[&Run]) -> std::io::Result<()> {
    let place = |run: &Run| (1e6 * run.seconds, run.error);
    let mut series = Vec::new();
    for order in [Order::Four, Order::Six, Order::Eight] {
        let name = format!("order {},", order.exponent());
        let of = runs
            .iter()
            .filter(|run| run.peer == ours::NAME && run.setting.starts_with(&name));
        let label = format!(
            "{}, order {}, 1 to 64 elements",
            ours::NAME,
            order.exponent()
        );
        series.push(Series::new(
            label,
            of.map(|run| place(run)).collect(),
            Style::Marked,
            series.len(),
        ));
    }
    for peer in peers(runs).into_iter().filter(|peer| *peer != ours::NAME) {
        let mut best: Vec<&&Run> = runs
            .iter()
            .filter(|run| run.peer == peer && run.error.is_finite())
            .collect();
        best.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        // Settings are dropped if another one of this program is both faster and more accurate.
        let mut least = f64::INFINITY;
        best.retain(|run| {
            let better = run.error < least;
            least = least.min(run.error);
            better
        });
        let points = best.iter().map(|run| place(run)).collect();
        series.push(Series::new(
            format!("{peer}, best settings"),
            points,
            Style::Marked,
            series.len(),
        ));
    }
    let (x, y) = ("run time (µs)", "error of the tip / length");
    Figure::new(
        file,
        "Equilibrium of a rod with a horizontal base: error against run time",
    )
    .lines(x, y, &series, Axes::LogLog)
}

fn write(file: &Path, runs: &[Run]) -> std::io::Result<()> {
    let mut text = format!("{HEADER}\n");
    for Run {
        peer,
        setting,
        error,
        seconds,
    } in runs
    {
        // Commas separate the columns.
        text += &format!(
            "{peer},{},{error:e},{seconds:e}\n",
            setting.replace(',', ";")
        );
    }
    write_whole(file, text)
}

fn read(file: &Path) -> Result<Vec<Run>, Box<dyn Error>> {
    let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Err(format!("{}: the first line is not '{HEADER}'", file.display()).into());
    }
    let run = |line: &str| -> Option<Run> {
        let [peer, setting, error, seconds] =
            line.split(',').collect::<Vec<_>>().try_into().ok()?;
        let (error, seconds) = (error.parse().ok()?, seconds.parse().ok()?);
        Some(Run {
            peer: peer.into(),
            setting: setting.into(),
            error,
            seconds,
        })
    };
    let wrong =
        |line: &str| format!("{}: '{line}' is not a row of {HEADER}", file.display()).into();
    lines
        .map(|line| run(line).ok_or_else(|| wrong(line)))
        .collect()
}
