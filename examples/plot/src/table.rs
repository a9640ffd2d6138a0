//! Comma-separated tables of numbers with a header line of names and units.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::file::named;

/// Writer of a CSV file.
pub struct Table {
    out: BufWriter<File>,
    columns: usize,
}

impl Table {
    /// Creates the file and writes its header, for example `t_s`, `length_m`.
    pub fn create(file: impl AsRef<Path>, columns: &[&str]) -> io::Result<Self> {
        // Many plotting scripts split lines at commas, even inside quotation marks.
        if let Some(name) = columns.iter().find(|c| c.contains([',', '"', '\n'])) {
            return Err(invalid(format!(
                "the column name {name:?} contains a comma, a quotation mark or a line break"
            )));
        }
        let file = file.as_ref();
        let mut out = BufWriter::new(File::create(file).map_err(|error| named(file, &error))?);
        writeln!(out, "{}", columns.join(","))?;
        Ok(Self {
            out,
            columns: columns.len(),
        })
    }

    /// Writes one row, which must have one value for each column.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        if values.len() != self.columns {
            let (found, expected) = (values.len(), self.columns);
            return Err(invalid(format!(
                "a row has {found} values, but the table has {expected} columns"
            )));
        }
        let numbers: Vec<String> = values.iter().map(|value| number(*value)).collect();
        writeln!(self.out, "{}", numbers.join(","))
    }

    /// Writes buffered rows. Without this call, an error would be ignored.
    pub fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Reads the rows of a table after its header. Lines that begin with `#` are comments.
pub fn read(file: impl AsRef<Path>) -> io::Result<Vec<Vec<f64>>> {
    let file = file.as_ref();
    let text = std::fs::read_to_string(file).map_err(|error| named(file, &error))?;
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let columns = lines.next().unwrap_or_default().split(',').count();
    let row = |line: &str| {
        let row: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
        let wrong = || {
            invalid(format!(
                "{}: '{line}' is not a row of {columns} numbers",
                file.display()
            ))
        };
        row.ok()
            .filter(|row| row.len() == columns)
            .ok_or_else(wrong)
    };
    lines.map(row).collect()
}

/// Returns the shortest text that is parsed to the same number.
///
/// Very small and very large magnitudes have an exponent.
pub fn number(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if !value.is_finite() || (1e-4..1e15).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

/// Formats a time, s, with a unit.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.1} µs", 1e6 * s),
        s if s < 1.0 => format!("{:.1} ms", 1e3 * s),
        s => format!("{s:.1} s"),
    }
}
