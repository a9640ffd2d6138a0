//! Atomic writing of files, and tables in chapters of the documentation.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Writes a file atomically: a reader finds the complete new content or the previous one, even
/// after a crash. The content is written to a temporary file in the same folder, flushed to the
/// disk, and renamed.
///
/// A process that is killed meanwhile leaves a file whose name begins with a dot and ends with
/// `.tmp`. It can be deleted.
///
/// # Errors
/// Errors of the file system, with the name of the file.
pub fn write_whole(file: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    // The time distinguishes processes on different machines that share a folder and have the same
    // process number.
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos());
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let other = file.with_file_name(format!(".{name}.{}-{now}.tmp", std::process::id()));
    let written = || -> io::Result<()> {
        let mut out = File::options().write(true).create_new(true).open(&other)?;
        out.write_all(content.as_ref())?;
        out.sync_all()?;
        fs::rename(&other, file)?;
        // The folder is flushed as well, because it contains the name. Only Unix can open folders
        // as files.
        #[cfg(unix)]
        if let Some(folder) = file
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty())
        {
            File::open(folder)?.sync_all()?;
        }
        Ok(())
    };
    written().map_err(|error| named(file, &error))
}

/// Adds the name of the file to the message of the system.
pub fn named(file: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", file.display()))
}

/// Marks between which a program writes its tables into a chapter.
const MARKS: [&str; 2] = ["<!-- tables -->", "<!-- end of the tables -->"];

/// Replaces the text between the marks of a chapter.
///
/// # Errors
/// Errors of the file system, and a chapter without marks.
pub fn write_between_marks(file: &Path, tables: &str) -> io::Result<()> {
    let text = fs::read_to_string(file).map_err(|error| named(file, &error))?;
    let missing = || io::Error::other(format!("{}: no marks {MARKS:?}", file.display()));
    let (head, rest) = text.split_once(MARKS[0]).ok_or_else(missing)?;
    let (_, tail) = rest.split_once(MARKS[1]).ok_or_else(missing)?;
    write_whole(
        file,
        format!(
            "{head}{}\n\n{}\n\n{}{tail}",
            MARKS[0],
            tables.trim_end(),
            MARKS[1]
        ),
    )
}
