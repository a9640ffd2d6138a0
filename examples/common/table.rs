//! Comma-separated tables of numbers, one header line with names and units.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A CSV file being written.
pub struct Table {
    out: BufWriter<File>,
    columns: usize,
}

impl Table {
    /// Creates the file and writes its header, e.g. `t_s`, `length_m`.
    pub fn create(file: impl AsRef<Path>, columns: &[&str]) -> io::Result<Self> {
        // Refused rather than quoted: many plotting scripts split at commas.
        if let Some(name) = columns.iter().find(|c| c.contains([',', '"', '\n'])) {
            return Err(invalid(format!("column name {name:?} breaks a CSV header")));
        }
        let file = file.as_ref();
        let created = File::create(file).map_err(|error| {
            // The system's message alone does not name the file.
            io::Error::new(error.kind(), format!("{}: {error}", file.display()))
        })?;
        let mut out = BufWriter::new(created);
        writeln!(out, "{}", columns.join(","))?;
        Ok(Self { out, columns: columns.len() })
    }

    /// Writes one row; it must have as many values as there are columns.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        if values.len() != self.columns {
            return Err(invalid(format!("a row of {} values in a table of {} columns", values.len(), self.columns)));
        }
        for (i, &value) in values.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            write!(self.out, "{comma}{}", number(value))?;
        }
        writeln!(self.out)
    }

    /// Writes what is still buffered; without this call an error would be lost.
    pub fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Reads a table: rows of numbers after the header; lines that begin with `#` are remarks.
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

/// Shortest text that reads back as the same number.
///
/// The exponent form is kept for magnitudes where plain digits would be a long
/// row of zeros.
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
