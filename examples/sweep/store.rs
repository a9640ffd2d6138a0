//! Folder of a sweep, with one complete file for each computed row of the grid.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::grid::Grid;
use super::point::Numbers;
use super::row;
use morphorod_plot::file::{named, write_whole};

/// Row files of one sweep. Several processes may share the folder.
pub struct Store {
    folder: PathBuf,
    grid: Grid,
}

impl Store {
    /// Opens or creates the folder `rows` in `out`.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be created.
    pub fn open(out: &Path, grid: Grid) -> io::Result<Self> {
        let folder = out.join("rows");
        fs::create_dir_all(&folder).map_err(|error| named(&folder, &error))?;
        Ok(Self { folder, grid })
    }

    /// Path of the file of a row, counted from zero.
    fn file(&self, row: usize) -> PathBuf {
        self.folder.join(format!("row-{:04}.csv", row + 1))
    }

    /// Reads all existing rows.
    ///
    /// # Errors
    /// Returns the first file that is not a valid row of this sweep, with the reason. No file is
    /// changed.
    pub fn read(&self) -> io::Result<Vec<Option<Vec<Numbers>>>> {
        (0..self.grid.etas.count)
            .map(|row| self.read_row(row))
            .collect()
    }

    /// Returns those of some rows that have no file. The files of other rows are not read, so that
    /// the cost of a part of a sweep does not grow with the number of the others.
    ///
    /// # Errors
    /// Returns the first of these files that is not a valid row of this sweep, with the reason.
    pub fn missing(&self, rows: &[usize]) -> io::Result<Vec<usize>> {
        let mut missing = Vec::new();
        for row in rows {
            if self.read_row(*row)?.is_none() {
                missing.push(*row);
            }
        }
        Ok(missing)
    }

    fn read_row(&self, row: usize) -> io::Result<Option<Vec<Numbers>>> {
        let file = self.file(row);
        let bytes = match fs::read(&file) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(named(&file, &error)),
        };
        let refused = |reason: &str| {
            let what = format!(
                "{}: {reason}; no file was changed; move this file or choose another --out",
                file.display()
            );
            io::Error::new(ErrorKind::InvalidData, what)
        };
        let text =
            String::from_utf8(bytes).map_err(|_| refused("the file is damaged: it is not text"))?;
        row::read(&self.grid, row, &text)
            .map(Some)
            .map_err(|reason| refused(&reason))
    }

    /// Writes a row. If another process has written the same row in the meantime, its file is kept.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written, or if an existing file is not a valid row of
    /// this sweep.
    pub fn write(&self, row: usize, points: &[Numbers]) -> io::Result<()> {
        if self.read_row(row)?.is_some() {
            return Ok(());
        }
        write_whole(&self.file(row), row::write(&self.grid, row, points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_is_complete_whenever_it_is_read_during_writing() {
        let folder = std::env::temp_dir().join(format!("morphorod-whole-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let file = folder.join("file");
        // The texts are long, so that writing takes many times as long as opening a file.
        let texts = ["a", "b"].map(|letter| letter.repeat(1 << 20));
        write_whole(&file, &texts[0]).unwrap();
        std::thread::scope(|scope| {
            let writer =
                scope.spawn(|| (0..40).for_each(|k| write_whole(&file, &texts[k % 2]).unwrap()));
            while !writer.is_finished() {
                let found = fs::read_to_string(&file).unwrap();
                assert!(
                    texts.contains(&found),
                    "{} of {} bytes",
                    found.len(),
                    texts[0].len()
                );
            }
        });
        // No temporary files remain.
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }
}
