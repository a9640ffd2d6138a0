//! Files that are there as a whole or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Writes a file so that whoever reads it, now or after a crash, finds all of it or none: under another name in the same
/// folder, brought to the disk, then renamed, which file systems do at once or not at all.
///
/// Who is killed in between leaves a file that begins with a dot and ends with `.tmp`; it may be deleted.
///
/// # Errors
/// Those of the file system, with the file's name.
pub fn write_whole(file: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    // Processes on several machines that share a folder may have the same number, but not at the same nanosecond.
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let other = file.with_file_name(format!(".{name}.{}-{now}.tmp", std::process::id()));
    let written = || -> io::Result<()> {
        let mut out = File::options().write(true).create_new(true).open(&other)?;
        out.write_all(content.as_ref())?;
        out.sync_all()?;
        fs::rename(&other, file)?;
        // The name must reach the disk, too. Folders can be opened as files on Unix only.
        #[cfg(unix)]
        if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            File::open(folder)?.sync_all()?;
        }
        Ok(())
    };
    written().map_err(|error| named(file, &error))
}

/// The system's message alone does not name the file.
pub fn named(file: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", file.display()))
}
