//! File format of a row of the grid, from which an interrupted sweep is resumed.
//!
//! ```text
//! morphorod sweep, format 1
//! # lengths: 48 from 4e-2 m to 9e-2 m        settings, one in each line
//! # row: 3 of 36
//! length_m,eta,growth_rate_per_s,...         comma-separated table
//! ...
//! # checksum: 0123456789abcdef               of all preceding text
//! ```

use super::grid::Grid;
use super::point::{COLUMNS, Numbers};
use morphorod_plot::table::number;

/// Beginning of the first line. The number of the format follows, which changes with the meaning of
/// the results.
const NAME: &str = "morphorod sweep, format ";
const FORMAT: &str = "1";
const CHECKSUM: &str = "# checksum: ";

/// Formats a row, counted from zero. Numbers are written with sufficient digits to be read back
/// exactly.
#[must_use]
pub fn write(grid: &Grid, row: usize, points: &[Numbers]) -> String {
    let mut text = format!("{NAME}{FORMAT}\n");
    for line in settings(grid, row) {
        text += &format!("{line}\n");
    }
    text += &format!("{}\n", COLUMNS.join(","));
    for point in points {
        text += &format!("{}\n", point.map(number).join(","));
    }
    let sum = checksum(&text);
    text + &format!("{CHECKSUM}{sum:016x}\n")
}

/// Parses a row that [`write`] has formatted for the same grid.
///
/// # Errors
/// Returns the reason if the text has another format, is damaged or truncated, or belongs to other
/// settings.
pub fn read(grid: &Grid, row: usize, text: &str) -> Result<Vec<Numbers>, String> {
    let format = text.lines().next().and_then(|line| line.strip_prefix(NAME));
    match format {
        None => return Err("the file is not a row of a sweep, or its beginning is damaged".into()),
        Some(FORMAT) => {}
        Some(other) => {
            return Err(format!(
                "the file has format {other:?}, but this program reads format {FORMAT:?}"
            ));
        }
    }
    let Some((before, sum)) = text.rsplit_once(CHECKSUM) else {
        return Err("the file is cut short: the checksum at its end is missing".into());
    };
    if sum != format!("{:016x}\n", checksum(before)) {
        return Err("the file is damaged: its checksum differs".into());
    }
    // The file is intact, but may belong to another sweep.
    let mut lines = before.lines().skip(1);
    for expected in settings(grid, row) {
        match lines.next() {
            Some(found) if found == expected => {}
            found => {
                let [expected, found] = [expected.as_str(), found.unwrap_or("")]
                    .map(|line| line.trim_start_matches("# "));
                return Err(format!(
                    "the file belongs to another sweep: its setting is \"{found}\" instead of \"{expected}\""
                ));
            }
        }
    }
    let points: Option<Vec<Numbers>> = lines.skip(1).map(numbers).collect();
    match points {
        Some(points) if points.len() == grid.lengths.count => Ok(points),
        _ => Err(format!(
            "the file does not contain {} points of {} numbers",
            grid.lengths.count,
            COLUMNS.len()
        )),
    }
}

fn settings(grid: &Grid, row: usize) -> Vec<String> {
    let mut lines = grid.settings();
    lines.push(format!("row: {} of {}", row + 1, grid.etas.count));
    lines.into_iter().map(|line| format!("# {line}")).collect()
}

fn numbers(line: &str) -> Option<Numbers> {
    let values: Option<Vec<f64>> = line.split(',').map(|value| value.parse().ok()).collect();
    values?.try_into().ok()
}

/// Checksum FNV-1a with 64 bits (Fowler, Noll and Vo, RFC 9923). It detects every change of a
/// single byte, because each step is invertible, and other random changes with a probability of 1 −
/// 2⁻⁶⁴.
fn checksum(text: &str) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
    text.bytes().fold(OFFSET, |sum, byte| {
        (sum ^ u64::from(byte)).wrapping_mul(PRIME)
    })
}

#[cfg(test)]
mod tests {
    use super::super::grid::Span;
    use super::*;

    const GRID: Grid = Grid {
        lengths: Span {
            from: 0.04,
            to: 0.09,
            count: 3,
        },
        etas: Span {
            from: 0.0,
            to: 80.0,
            count: 4,
        },
        beta: 0.8,
        growth_time: 72e3,
        time: 86.4e3,
        step: 120.0,
        elements: 6,
    };

    fn text() -> String {
        let third = 1.0 / 3.0;
        let points = [0.04, 0.065, 0.09]
            .map(|l| [l, 80.0 * third, -1e-5 * third, f64::NAN, 0.0, 1e-17 * third]);
        write(&GRID, 1, &points)
    }

    #[test]
    fn written_row_is_read_back_bit_by_bit() {
        let back = read(&GRID, 1, &text()).unwrap();
        assert_eq!(write(&GRID, 1, &back), text());
        assert_eq!(back[2][2], -1e-5 * (1.0 / 3.0));
        assert!(back[0][3].is_nan());
    }

    #[test]
    fn truncated_and_changed_rows_are_refused() {
        let whole = text();
        for cut in 0..whole.len() {
            assert!(
                read(&GRID, 1, &whole[..cut]).is_err(),
                "cut after {cut} bytes"
            );
        }
        for place in 0..whole.len() {
            let mut bytes = whole.clone().into_bytes();
            bytes[place] ^= 1;
            let changed = String::from_utf8(bytes).unwrap();
            assert!(read(&GRID, 1, &changed).is_err(), "byte {place} changed");
        }
    }

    #[test]
    fn rows_of_other_sweeps_are_refused_with_the_setting_that_differs() {
        let mut other = GRID;
        other.time = 43.2e3;
        let reason = read(&other, 1, &text()).unwrap_err();
        assert!(
            reason.contains("simulated time: 8.64e4 s")
                && reason.contains("simulated time: 4.32e4 s"),
            "{reason}"
        );
        let reason = read(&GRID, 2, &text()).unwrap_err();
        assert!(
            reason.contains("row: 2 of 4") && reason.contains("row: 3 of 4"),
            "{reason}"
        );
        let reason = read(&GRID, 1, &text().replace("format 1", "format 2")).unwrap_err();
        assert!(reason.contains("format"), "{reason}");
    }
}
