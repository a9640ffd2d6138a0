//! Readers of tracked positions: comma-separated tables as trackers write them, one position a row.
//!
//! What a table does not say is asked for and never guessed: the metres of its unit of length, the seconds of its unit of time, and
//! where its axes point.

use std::error::Error;
use std::fmt;
use std::path::Path;

/// What has to be known of a table to read it.
#[derive(Clone, Debug)]
pub struct Layout<'a> {
    /// Name of the column of times or frame numbers.
    pub time: &'a str,
    /// Names of the columns of two or three coordinates.
    pub coordinates: Vec<&'a str>,
    /// Name of the column that tells tracks apart, if there are several.
    pub track: Option<&'a str>,
    /// Seconds in a unit of the time column: the time from one frame to the next, or 1 of seconds.
    pub seconds: Option<f64>,
    /// Metres in a unit of the coordinates: the size of a pixel, or 1e-3 of millimetres.
    pub metres: Option<f64>,
    /// 1 of a coordinate that grows to the right, up or towards the camera, −1 of one that grows the other way, as y of an image does.
    pub signs: Option<Vec<f64>>,
}

/// Positions of one thing in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// What stands in the column that tells tracks apart; empty without one.
    pub name: String,
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Positions, m: to the right, up, towards the camera. The third is 0 where there are two.
    pub positions: Vec<[f64; 3]>,
}

/// A row of a table in SI units, with its line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub line: usize,
    pub track: String,
    pub time: f64,
    pub position: [f64; 3],
}

/// Why a table cannot be read. Lines count from 1, the header and remarks included.
#[derive(Clone, Debug, PartialEq)]
pub enum TrackError {
    /// The system cannot read the file: its message.
    File(String),
    /// There is no header, or nothing below it.
    Empty,
    /// Columns are separated by something else than commas.
    Separator(char),
    /// A column is not there; the names that are.
    NoColumn(String, Vec<String>),
    /// Two columns have the same name.
    TwoColumns(String),
    /// A line has another number of fields than the header.
    Fields {
        /// The line.
        line: usize,
        /// Fields in it.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A field is no finite number.
    NoNumber {
        /// The line.
        line: usize,
        /// Name of the column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A time is not after the one before it, both in the table's unit.
    NotLater {
        /// The line.
        line: usize,
        /// Name of the track, empty without one.
        track: String,
        /// The time.
        time: f64,
        /// The one before it.
        before: f64,
    },
    /// Something that the table does not say was not given.
    NotGiven(&'static str),
    /// Something was given that cannot be.
    Senseless(&'static str, f64),
}

impl fmt::Display for TrackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(message) => write!(f, "{message}"),
            Self::Empty => write!(f, "the table has no rows below a header"),
            Self::Separator(found) => {
                write!(
                    f,
                    "the header has {found:?} in it but no comma: columns must be separated by commas, and decimals by points"
                )
            }
            Self::NoColumn(name, there) => write!(f, "there is no column '{name}'; there are '{}'", there.join("', '")),
            Self::TwoColumns(name) => write!(f, "there are two columns '{name}'"),
            Self::Fields { line, found, expected } => {
                write!(f, "line {line} has {found} fields, but the header has {expected}")
            }
            Self::NoNumber { line, column, text } => {
                write!(
                    f,
                    "line {line}, column '{column}': '{text}' is no finite number; leave out lines of lost frames"
                )
            }
            Self::NotLater { line, track, time, before } => {
                let of = if track.is_empty() { String::new() } else { format!(" of track '{track}'") };
                write!(
                    f,
                    "line {line}: time {time}{of} is not later than {before} before it; is there a column of tracks?"
                )
            }
            Self::NotGiven(what) => write!(f, "{what} was not given, and a table does not tell it"),
            Self::Senseless(what, value) => write!(f, "{what} is {value}, which cannot be"),
        }
    }
}

impl Error for TrackError {}

/// Reads the tracks of a file, in the order in which they begin.
pub fn read_tracks(file: impl AsRef<Path>, layout: &Layout) -> Result<Vec<Track>, TrackError> {
    tracks(&text_of(file.as_ref())?, layout)
}

/// The text of a file.
pub(super) fn text_of(file: &Path) -> Result<String, TrackError> {
    std::fs::read_to_string(file).map_err(|error| TrackError::File(format!("{}: {error}", file.display())))
}

/// Reads the tracks of a table.
pub fn tracks(text: &str, layout: &Layout) -> Result<Vec<Track>, TrackError> {
    let mut found: Vec<Track> = Vec::new();
    for Row { line, track, time, position } in rows(text, layout)? {
        let one = match found.iter().position(|other| other.name == track) {
            Some(place) => &mut found[place],
            None => {
                found.push(Track { name: track, times: vec![], positions: vec![] });
                found.last_mut().ok_or(TrackError::Empty)?
            }
        };
        if let Some(before) = one.times.last().copied().filter(|before| time <= *before) {
            let unit = layout.seconds.unwrap_or(1.0);
            return Err(TrackError::NotLater {
                line,
                track: one.name.clone(),
                time: time / unit,
                before: before / unit,
            });
        }
        one.times.push(time);
        one.positions.push(position);
    }
    Ok(found)
}

/// Reads all rows of a table. Lines that are empty or begin with `#` are remarks.
pub(super) fn rows(text: &str, layout: &Layout) -> Result<Vec<Row>, TrackError> {
    let seconds = known("the time of a frame, or of the unit of time (s),", layout.seconds)?;
    let metres = known("the scale, the size of a pixel or of the unit of length (m),", layout.metres)?;
    let signs = layout.signs.as_ref().ok_or(TrackError::NotGiven("where the axes point"))?;
    if let Some(sign) = signs.iter().find(|sign| sign.abs() != 1.0) {
        return Err(TrackError::Senseless("the sign of an axis", *sign));
    }
    if signs.len() != layout.coordinates.len() || !(2..=3).contains(&signs.len()) {
        return Err(TrackError::Senseless("the number of axes", signs.len() as f64));
    }
    // Some programs mark the encoding in the first three bytes.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    let mut lines = lines.by_ref().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let (_, header) = lines.next().ok_or(TrackError::Empty)?;
    if let Some(other) = header.chars().find(|c| matches!(c, ';' | '\t' | '|')).filter(|_| !header.contains(',')) {
        return Err(TrackError::Separator(other));
    }
    let names: Vec<&str> = header.split(',').map(bare).collect();
    let place = |name: &str| {
        let mut places = (0..names.len()).filter(|k| names[*k] == name);
        let there = || names.iter().map(|name| (*name).to_owned()).collect();
        let first = places.next().ok_or_else(|| TrackError::NoColumn(name.to_owned(), there()))?;
        if places.next().is_some() { Err(TrackError::TwoColumns(name.to_owned())) } else { Ok(first) }
    };
    let time = place(layout.time)?;
    let coordinates = layout.coordinates.iter().map(|name| place(name)).collect::<Result<Vec<_>, _>>()?;
    let track = layout.track.map(place).transpose()?;
    let found = lines.map(|(line, text)| {
        let fields: Vec<&str> = text.split(',').map(bare).collect();
        if fields.len() != names.len() {
            return Err(TrackError::Fields { line, found: fields.len(), expected: names.len() });
        }
        // A number that is finite in its unit may not be in metres.
        let number = |column: usize, unit: f64| {
            let value = fields[column].parse::<f64>().map(|value| value * unit).ok().filter(|value| value.is_finite());
            let error = || TrackError::NoNumber { line, column: names[column].into(), text: fields[column].into() };
            value.ok_or_else(error)
        };
        let mut position = [0.0; 3];
        for (k, column) in coordinates.iter().enumerate() {
            position[k] = signs[k] * number(*column, metres)?;
        }
        let track = track.map_or(String::new(), |column| fields[column].to_owned());
        Ok(Row { line, track, time: number(time, seconds)?, position })
    });
    let found = found.collect::<Result<Vec<Row>, TrackError>>()?;
    if found.is_empty() { Err(TrackError::Empty) } else { Ok(found) }
}

/// A number that must be given and positive.
fn known(what: &'static str, value: Option<f64>) -> Result<f64, TrackError> {
    let value = value.ok_or(TrackError::NotGiven(what))?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(TrackError::Senseless(what, value)) }
}

/// A field without blanks and quotes around it.
fn bare(field: &str) -> &str {
    field.trim().trim_matches('"')
}
