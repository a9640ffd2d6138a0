//! Onset and amplitude of oscillations for a grid of lengths and proprioceptive sensitivities.
//!
//! The shoots are upright and of constant length, with delayed gravitropism and proprioception. For
//! each point of the grid, the program computes the leading characteristic root of the upright
//! shoot and the number of unstable roots. It also simulates the response to a small perturbation
//! of the intrinsic curvature. By default, all cores of the machine are used.
//!
//! # Results
//! The colours show the amplitude of the tip at the end of the simulations. The black curve is the
//! critical length, computed from the characteristic roots. To the left of this curve, the
//! perturbation decays. To the right of it, the shoot oscillates with an amplitude of centimetres.
//! The colours and the curve are computed by largely independent parts of the library, and the
//! colours change at the curve. A larger proprioceptive sensitivity reduces the critical length,
//! because the response is delayed. To the right of the dashed line, the shoot buckles under its
//! weight.
//!
//! # Interruption
//! Each row of the grid is a separate file, which is written as a whole. An interrupted sweep is
//! resumed by the same command. The final table is identical byte for byte for all numbers of
//! threads, parts and interruptions, on machines of the same kind. On other machines, mathematical
//! functions may differ in the last bit.
//!
//! # Several machines
//! `--shard i/n` computes row i and every n-th row after it. The jobs of a job array share one
//! folder:
//!
//! ```sh
//! sweep --shard $INDEX/$COUNT --out /shared/map   # each job
//! sweep --merge --out /shared/map                 # afterwards: table and picture, or a list of missing rows
//! ```

mod grid;
mod picture;
mod point;
mod row;
mod store;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use grid::{Grid, Span};
use morphorod::ensemble::{self, Shard};
use morphorod_plot::options::Value;
use morphorod_plot::{Opt, Options, Progress, finish, println};
use point::{Numbers, compute_point, critical_length};
use store::Store;

const HOUR: f64 = 3600.0;
const CM: f64 = 0.01;

/// Error that a thread can return.
type Failure = Box<dyn Error + Send + Sync>;

/// Rows that are selected on the command line.
struct Rows(Shard);

impl Value for Rows {
    const MUST_BE: &'static str = "i/n with whole numbers and 1 <= i <= n, like 2/8";
    fn read(text: &str) -> Option<Self> {
        // An absent option selects all rows.
        if text.is_empty() {
            Some(Self(Shard::WHOLE))
        } else {
            text.parse().ok().map(Self)
        }
    }
}

const OPTIONS: [Opt; 14] = [
    Opt::value("length-from", "CM", "4", "smallest length, cm"),
    Opt::value("length-to", "CM", "9", "largest length, cm"),
    Opt::value("lengths", "N", "41", "number of lengths"),
    Opt::value("eta-from", "E", "0", "smallest proprioceptive sensitivity"),
    Opt::value("eta-to", "E", "80", "largest proprioceptive sensitivity"),
    Opt::value(
        "etas",
        "N",
        "33",
        "number of sensitivities, which are the rows of the grid",
    ),
    Opt::value("beta", "B", "0.8", "gravitropic sensitivity"),
    Opt::value("tau-g", "H", "20", "growth time, h"),
    Opt::value("hours", "H", "24", "simulated time, h"),
    Opt::value("step", "S", "120", "time step, s"),
    Opt::value("elements", "N", "6", "elements of a shoot"),
    Opt::value(
        "threads",
        "N",
        "",
        "number of threads; by default, the number of cores",
    ),
    Opt::value(
        "shard",
        "I/N",
        "",
        "compute only row I (1 to N) and every N-th row after it; all parts need the same grid",
    ),
    Opt::flag(
        "merge",
        "write table and picture from existing rows, or report missing rows",
    ),
];

fn main() -> ExitCode {
    finish(run())
}

fn span(options: &Options, what: &str, unit: f64) -> Span {
    let count = options.get_if(&format!("{what}s"), "2 or larger", |n: &usize| *n > 1);
    let from: f64 = options.get_if(&format!("{what}-from"), "0 or larger", |v: &f64| *v >= 0.0);
    let to = options.get_if(
        &format!("{what}-to"),
        &format!("larger than --{what}-from"),
        |v: &f64| *v > from,
    );
    Span {
        from: unit * from,
        to: unit * to,
        count,
    }
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
        "onset and amplitude of oscillations for a grid of shoots; can be interrupted and resumed",
        &OPTIONS,
    );
    let grid = grid(&options);
    let cores = match options.text("threads") {
        "" => ensemble::cores(),
        _ => options.get_if("threads", "larger than 0", |n: &usize| *n > 0),
    };
    let Rows(part) = options.get("shard");
    let (merge, whole) = (options.flag("merge"), options.text("shard").is_empty());
    if merge && !whole {
        return Err("--merge and --shard exclude each other".into());
    }
    let out = options.out_dir();
    let store = Store::open(&out, grid)?;
    if !merge {
        let wanted: Vec<usize> = (0..grid.etas.count)
            .filter(|row| part.contains(*row))
            .collect();
        let missing = store.missing(&wanted)?;
        println!(
            "{} of {} rows are there already",
            wanted.len() - missing.len(),
            wanted.len()
        );
        compute(&grid, &store, &missing, cores).map_err(|error| -> Box<dyn Error> { error })?;
    }
    if whole {
        publish(&grid, &store, cores, &out)
    } else {
        Ok(())
    }
}

/// Computes rows. A row is written when its last point is computed. Threads share points instead of
/// rows, so that all threads have work until the end.
fn compute(grid: &Grid, store: &Store, rows: &[usize], cores: usize) -> Result<(), Failure> {
    let clock = Instant::now();
    let across = grid.lengths.count;
    let points = rows.len() * across;
    let progress = Progress::new("shoots");
    let mut row: Vec<Numbers> = Vec::with_capacity(across);
    ensemble::run(
        0..points,
        cores,
        |k| {
            compute_point(
                grid,
                grid.lengths.at(k % across),
                grid.etas.at(rows[k / across]),
            )
        },
        |k, numbers| -> Result<(), Failure> {
            row.push(numbers?);
            if row.len() == across {
                store.write(rows[k / across], &row)?;
                row.clear();
            }
            progress.set((k + 1) as f64 / points as f64);
            Ok(())
        },
    )?;
    progress.finish();
    println!(
        "{points} shoots on {cores} threads in {:.2} s",
        clock.elapsed().as_secs_f64()
    );
    Ok(())
}

/// Writes table and picture of all rows. Returns an error if rows are missing.
fn publish(grid: &Grid, store: &Store, cores: usize, out: &Path) -> Result<(), Box<dyn Error>> {
    let found = store.read()?;
    let missing: Vec<String> = (1..=found.len())
        .filter(|k| found[k - 1].is_none())
        .map(|k| k.to_string())
        .collect();
    if !missing.is_empty() {
        let (count, all, list) = (missing.len(), found.len(), missing.join(", "));
        return Err(format!(
            "{count} of {all} rows are missing: {list}; run without --merge to compute them"
        )
        .into());
    }
    let rows: Vec<Vec<Numbers>> = found.into_iter().flatten().collect();
    picture::write_table(&out.join("sweep.csv"), &rows)?;
    let onsets = ensemble::collect(rows.len(), cores, |row| {
        critical_length(grid, grid.etas.at(row))
    });
    picture::draw(&out.join("sweep.svg"), grid, &rows, &onsets)?;
    println!("wrote sweep.csv and sweep.svg to {}", out.display());
    Ok(())
}
