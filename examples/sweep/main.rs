//! Which shoots begin to swing, and how far? A map of length against the sensitivity to one's own bending.
//!
//! Upright shoots of constant length, steered by gravity and by their own bending, both after a delay. Of each point of the
//! grid the characteristic roots say whether a small tilt dies out, and a run in time says what becomes of a small kick. Bending
//! is what a shoot must sense in order to straighten itself; but it senses it late, and the better it does, the sooner it begins to
//! swing.
//!
//! # What to see
//! Left of the black curve the kick dies out, right of it the shoot swings by centimetres. The colours come from runs
//! in time, the curve from the linear problem alone, two parts of the library that share little; the one must change where the
//! other runs. Right of the dashed line the shoot buckles, whatever it senses.
//!
//! # Stop and go on
//! Every row of the grid becomes a file of its own, at once or not at all. Start the same command again after whatever has
//! ended it, and it goes on; the table in the end is the same byte for byte, on however many threads, in however many parts and
//! attempts. (On machines of the same kind: mathematical functions may differ in the last bit between kinds.)
//!
//! # Many machines
//! `--shard i/n` computes every n-th row beginning with the i-th. The jobs of an array on a cluster share one folder:
//!
//! ```sh
//! sweep --shard $INDEX/$COUNT --out /shared/map     # each job
//! sweep --merge --out /shared/map                   # afterwards: what is missing, or table and picture
//! ```

#[path = "../common/mod.rs"]
mod common;
mod grid;
mod picture;
mod point;
mod row;
mod store;
mod threads;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::thread::available_parallelism;
use std::time::Instant;

use common::options::Value;
use common::{Opt, Options, Progress, finish};
use grid::{Grid, Part, Span};
use point::{Numbers, critical_length, look_at};
use store::Store;

const HOUR: f64 = 3600.0;
const CM: f64 = 0.01;

/// What goes wrong in a thread.
type Failure = Box<dyn Error + Send + Sync>;

/// A part on the command line.
struct Shard(Part);

impl Value for Shard {
    const MUST_BE: &'static str = "i/n with whole numbers and 1 <= i <= n, like 2/8";
    fn read(text: &str) -> Option<Self> {
        // Without the option: all.
        if text.is_empty() { Some(Self(Part::WHOLE)) } else { Part::read(text).map(Self) }
    }
}

const OPTIONS: [Opt; 14] = [
    Opt::value("length-from", "CM", "4", "shortest shoot, cm"),
    Opt::value("length-to", "CM", "9", "longest shoot, cm"),
    Opt::value("lengths", "N", "41", "number of lengths"),
    Opt::value("eta-from", "E", "0", "smallest proprioceptive sensitivity"),
    Opt::value("eta-to", "E", "80", "largest proprioceptive sensitivity"),
    Opt::value("etas", "N", "33", "number of sensitivities, the rows of the grid"),
    Opt::value("beta", "B", "0.8", "gravitropic sensitivity of all"),
    Opt::value("tau-g", "H", "20", "growth time of all, h"),
    Opt::value("hours", "H", "24", "simulated time, h"),
    Opt::value("step", "S", "120", "time step, s"),
    Opt::value("elements", "N", "6", "elements of a shoot"),
    Opt::value("threads", "N", "", "threads; without it, as many as the machine has cores"),
    Opt::value(
        "shard",
        "I/N",
        "",
        "compute every N-th row from the I-th (1 to N) only, and merge nothing: with the same grid in all parts",
    ),
    Opt::flag("merge", "compute nothing: make table and picture of what is there, or say what is missing"),
];

fn main() -> ExitCode {
    finish(run())
}

fn span(options: &Options, what: &str, unit: f64) -> Span {
    let count = options.get_if(&format!("{what}s"), "2 or larger", |n: &usize| *n > 1);
    let from: f64 = options.get_if(&format!("{what}-from"), "0 or larger", |v: &f64| *v >= 0.0);
    let to = options.get_if(&format!("{what}-to"), &format!("larger than --{what}-from"), |v: &f64| *v > from);
    Span { from: unit * from, to: unit * to, count }
}

fn grid(options: &Options) -> Grid {
    Grid {
        lengths: span(options, "length", CM),
        etas: span(options, "eta", 1.0),
        beta: options.get_if("beta", "0 or larger", |beta: &f64| *beta >= 0.0),
        growth_time: HOUR * options.positive("tau-g"),
        time: HOUR * options.positive("hours"),
        step: options.positive("step"),
        elements: options.get_if("elements", "larger than 0", |n: &usize| *n > 0),
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "sweep",
        "which shoots begin to swing, and how far: a grid of shoots on all cores, which can be stopped and resumed",
        &OPTIONS,
    );
    let grid = grid(&options);
    let cores = match options.text("threads") {
        "" => available_parallelism().map_or(1, usize::from),
        _ => options.get_if("threads", "larger than 0", |n: &usize| *n > 0),
    };
    let Shard(part) = options.get("shard");
    let (merge, whole) = (options.flag("merge"), options.text("shard").is_empty());
    if merge && !whole {
        return Err("--merge takes all rows, --shard some: give one of the two".into());
    }
    let out = options.out_dir();
    let store = Store::open(&out, grid)?;
    let rows = store.read()?;
    if !merge {
        let missing: Vec<usize> = (0..rows.len()).filter(|row| part.has(*row) && rows[*row].is_none()).collect();
        let wanted = (0..rows.len()).filter(|row| part.has(*row)).count();
        println!("{} of {wanted} rows are there already", wanted - missing.len());
        compute(&grid, &store, &missing, cores).map_err(|error| -> Box<dyn Error> { error })?;
    }
    if whole { publish(&grid, &store, cores, &out) } else { Ok(()) }
}

/// Computes rows. A row is written when its last point is there; threads share points, not rows, so that all are busy to the end.
fn compute(grid: &Grid, store: &Store, rows: &[usize], cores: usize) -> Result<(), Failure> {
    let clock = Instant::now();
    let across = grid.lengths.count;
    let points = rows.len() * across;
    let progress = Progress::new("shoots");
    let mut done = 0;
    let mut open: Vec<Vec<Option<Numbers>>> = vec![vec![None; across]; rows.len()];
    threads::share(
        cores,
        points,
        |k| look_at(grid, grid.lengths.at(k % across), grid.etas.at(rows[k / across])),
        |k, numbers| {
            let row = &mut open[k / across];
            row[k % across] = Some(numbers);
            if let Some(all) = row.iter().copied().collect::<Option<Vec<Numbers>>>() {
                store.write(rows[k / across], &all)?;
            }
            done += 1;
            progress.set(f64::from(done) / points as f64);
            Ok(())
        },
    )?;
    progress.finish();
    println!("{points} shoots on {cores} threads in {:.2} s", clock.elapsed().as_secs_f64());
    Ok(())
}

/// Table and picture of all rows.
fn publish(grid: &Grid, store: &Store, cores: usize, out: &Path) -> Result<(), Box<dyn Error>> {
    let found = store.read()?;
    let missing: Vec<String> = (1..=found.len()).filter(|k| found[k - 1].is_none()).map(|k| k.to_string()).collect();
    if !missing.is_empty() {
        let (count, all, list) = (missing.len(), found.len(), missing.join(", "));
        return Err(format!("{count} of {all} rows are missing: {list}; run without --merge to compute them").into());
    }
    let rows: Vec<Vec<Numbers>> = found.into_iter().flatten().collect();
    picture::write_table(&out.join("sweep.csv"), &rows)?;
    let mut onsets = vec![None; rows.len()];
    let work = |row| Ok::<_, Failure>(critical_length(grid, grid.etas.at(row)));
    let take = |row: usize, length| {
        onsets[row] = length;
        Ok(())
    };
    threads::share(cores, rows.len(), work, take).map_err(|error| -> Box<dyn Error> { error })?;
    picture::draw(&out.join("sweep.svg"), grid, &rows, &onsets)?;
    println!("sweep.csv and sweep.svg are in {}", out.display());
    Ok(())
}
