//! Comma-separated tables of numbers with a header line of names and units.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

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
        let created = File::create(file).map_err(|error| {
            // The message of the system does not contain the file name.
            io::Error::new(error.kind(), format!("{}: {error}", file.display()))
        })?;
        let mut out = BufWriter::new(created);
        writeln!(out, "{}", columns.join(","))?;
        Ok(Self { out, columns: columns.len() })
    }

    /// Writes one row, which must have one value for each column.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        if values.len() != self.columns {
            return Err(invalid(format!(
                "a row has {} values, but the table has {} columns",
                values.len(),
                self.columns
            )));
        }
        for (i, &value) in values.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            write!(self.out, "{comma}{}", number(value))?;
        }
        writeln!(self.out)
    }

    /// Writes buffered rows. Without this call, an error would be ignored.
    pub fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Reads the rows of a table after its header. Lines that begin with `#` are comments.
pub fn read(file: impl AsRef<Path>) -> io::Result<Vec<Vec<f64>>> {
    let file = file.as_ref();
    let wrong = |what: String| invalid(format!("{}: {what}", file.display()));
    let text = std::fs::read_to_string(file)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", file.display())))?;
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let columns = lines.next().unwrap_or_default().split(',').count();
    lines
        .map(|line| {
            let row: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
            match row {
                Ok(row) if row.len() == columns => Ok(row),
                _ => Err(wrong(format!("'{line}' is not a row of {columns} numbers"))),
            }
        })
        .collect()
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
