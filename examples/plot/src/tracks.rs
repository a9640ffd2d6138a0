//! Readers of tracked positions: tables as trackers and spreadsheets write them, one position in a
//! row.
//!
//! Columns are separated by commas, semicolons or tabs. With semicolons and tabs, decimals may have
//! commas. The names of the columns are those of the first row, with two exceptions: DeepLabCut
//! writes several rows, which give names such as `tip_x`, or `plant1_tip_x` for several animals,
//! and the first column is `frame`; TrackMate writes three rows of descriptions below the names,
//! which are skipped. A table whose first row has only numbers has no header, and its columns have
//! the names `1`, `2` and so on. A row without any coordinate is a lost frame, and is skipped.
//!
//! The unit of length, the unit of time and the directions of the axes are not part of such a table
//! and are required.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt;
use std::io::ErrorKind;
use std::path::Path;

/// Texts of the coordinates of a lost frame, in lower case.
const LOST: [&str; 3] = ["", "nan", "na"];

/// Description of a table.
#[derive(Clone, Debug)]
pub struct Layout<'a> {
    /// Name of the column of times or frame numbers. If it is empty, there is no such column, and
    /// the rows of a track are one unit of time apart.
    pub time: &'a str,
    /// Names of the columns of one to three coordinates.
    pub coordinates: Vec<&'a str>,
    /// Name of the column of the names of tracks, if there are several.
    pub track: Option<&'a str>,
    /// Unit of the time column, s: the time between frames, or 1.
    pub seconds: Option<f64>,
    /// Unit of the coordinates, m: the size of a pixel, or 1e-3 for millimetres; rad for an angle.
    pub metres: Option<f64>,
    /// 1 for a coordinate that increases to the right, upwards or towards the camera, −1 for the
    /// opposite direction, as for y of an image.
    pub signs: Option<Vec<f64>>,
    /// Name of the column of the length of the shoot, and its unit, m.
    pub length: Option<(&'a str, f64)>,
    /// Name of the column of the level of gravity, in multiples of 9.81 m/s².
    pub gravity: Option<&'a str>,
}

/// Positions of one object at increasing times.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Name in the column of tracks; empty without such a column.
    pub name: String,
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Positions, m: to the right, upwards, towards the camera. Coordinates that the table
    /// lacks are 0.
    pub positions: Vec<[f64; 3]>,
    /// Lengths of the shoot, m; empty without such a column.
    pub lengths: Vec<f64>,
    /// Level of gravity, in multiples of 9.81 m/s²; `None` without such a column.
    pub gravity: Option<f64>,
}

/// A header: the separator of columns, the names of the columns, and the number of rows that belong
/// to it.
struct Header {
    separator: char,
    names: Vec<String>,
    further: usize,
}

impl Header {
    /// Reads the header from the lines that are not empty or comments.
    fn read(lines: &[(usize, &str)], layout: &Layout) -> Result<Self, TrackError> {
        let (_, first) = lines.first().ok_or(TrackError::Empty)?;
        let texts = |line: &str, separator| {
            fields(line, separator)
                .into_iter()
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        let has_numbers = |separator: &char| {
            let is_lost = |text: &str| LOST.contains(&text.to_ascii_lowercase().as_str());
            let is_number = |text: &str| decimal(text, *separator).parse::<f64>().is_ok();
            let texts = fields(first, *separator);
            texts.len() > 1
                && texts.iter().all(|text| is_number(text) || is_lost(text))
                && texts.iter().any(|text| !is_lost(text))
        };
        // Decimals with commas cannot be distinguished from columns if commas are tried first.
        if let Some(separator) = [';', '\t', ','].into_iter().find(has_numbers) {
            let columns = fields(first, separator).len();
            return Ok(Self {
                separator,
                names: (1..=columns).map(|k| k.to_string()).collect(),
                further: 0,
            });
        }
        // The separator is that for which the column of times exists, or without one that of the
        // first coordinate. DeepLabCut always writes commas.
        let known = if layout.time.is_empty() {
            layout.coordinates[0]
        } else {
            layout.time
        };
        let has_known =
            |separator: &char| texts(first, *separator).iter().any(|name| name == known);
        let separator = [',', ';', '\t'].into_iter().find(has_known).unwrap_or(',');
        let mut names = texts(first, separator);
        if names[0] == "scorer" {
            let rows: Vec<_> = lines
                .iter()
                .map(|(_, line)| texts(line, separator))
                .take(4)
                .collect();
            let further = rows
                .iter()
                .position(|row| row[0] == "coords")
                .ok_or(TrackError::Empty)?;
            let words = |column: usize| {
                rows[1..=further]
                    .iter()
                    .filter_map(move |row| row.get(column).cloned())
            };
            names = (0..names.len())
                .map(|column| words(column).collect::<Vec<_>>().join("_"))
                .collect();
            names[0] = "frame".into();
            return Ok(Self {
                separator,
                names,
                further: further + 1,
            });
        }
        // The second row of a table of TrackMate has texts in the columns of numbers, as `X` in
        // `POSITION_X`.
        let is_track_mate = names[0] == "LABEL" && names.iter().any(|name| name == "POSITION_X");
        Ok(Self {
            separator,
            names,
            further: if is_track_mate { 4 } else { 1 },
        })
    }
}

/// A row of a table in SI units.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub line: usize,
    pub track: String,
    pub time: f64,
    pub position: [f64; 3],
    pub length: Option<f64>,
    pub gravity: Option<f64>,
}

/// A property of a table that is required and was not given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The unit of the time column.
    Seconds,
    /// The unit of the coordinates.
    Metres,
    /// The directions of the axes.
    Signs,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Seconds => "the time of a frame or of the unit of time",
            Self::Metres => "the scale, which is the size of a pixel or of the unit of length",
            Self::Signs => "the directions of the axes",
        })
    }
}

/// Reason why a table cannot be read. Lines are counted from 1, with the header and comments.
#[derive(Clone, Debug, PartialEq)]
pub enum TrackError {
    /// The file cannot be read: its name and the message of the system.
    File(String),
    /// There is no header, or no row below it.
    Empty,
    /// A column does not exist: its name, and the names of all columns.
    NoColumn(String, Vec<String>),
    /// Two columns have the same name.
    TwoColumns(String),
    /// A line has another number of fields than the header.
    Fields {
        /// Line.
        line: usize,
        /// Number of fields in the line.
        found: usize,
        /// Number of fields in the header.
        expected: usize,
    },
    /// A field is not a finite number.
    NoNumber {
        /// Line.
        line: usize,
        /// Name of the column.
        column: String,
        /// Content of the field.
        text: String,
    },
    /// A time is not later than the previous one. Both are in the unit of the table.
    NotLater {
        /// Line.
        line: usize,
        /// Name of the track, empty without one.
        track: String,
        /// Time.
        time: f64,
        /// Previous time.
        before: f64,
    },
    /// The level of gravity changes within a track, at this line.
    GravityChanges(usize),
    /// Required properties of the table were not given.
    NotGiven(Vec<Missing>),
    /// A value is out of range: its description and the value.
    Invalid(&'static str, f64),
}

impl fmt::Display for TrackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(message) => write!(f, "{message}"),
            Self::Empty => write!(f, "the table has no rows below a header"),
            Self::NoColumn(name, all) => {
                write!(
                    f,
                    "there is no column '{name}'; the columns are '{}'",
                    all.join("', '")
                )
            }
            Self::TwoColumns(name) => write!(f, "there are two columns '{name}'"),
            Self::Fields {
                line,
                found,
                expected,
            } => {
                write!(
                    f,
                    "line {line} has {found} fields, but the header has {expected}"
                )
            }
            Self::NoNumber { line, column, text } => write!(
                f,
                "line {line}, column '{column}': '{text}' is not a finite number (decimal commas need columns \
                 that are separated by semicolons or tabs)"
            ),
            Self::NotLater {
                line,
                track,
                time,
                before,
            } => {
                let of = if track.is_empty() {
                    String::new()
                } else {
                    format!(" of track '{track}'")
                };
                write!(
                    f,
                    "line {line}: time {time}{of} is not later than the previous time {before}: \
                     rows must be in order of time, and several tracks need a column of their names"
                )
            }
            Self::GravityChanges(line) => write!(
                f,
                "line {line}: the level of gravity changes within a track"
            ),
            Self::NotGiven(missing) => {
                let missing: Vec<String> = missing.iter().map(Missing::to_string).collect();
                write!(
                    f,
                    "not given, and not part of the table: {}",
                    missing.join("; ")
                )
            }
            Self::Invalid(what, value) => write!(f, "{what} is {value}, which is out of range"),
        }
    }
}

impl Error for TrackError {}

/// Reads the tracks of a file, in the order in which they begin.
pub fn read_tracks(file: impl AsRef<Path>, layout: &Layout) -> Result<Vec<Track>, TrackError> {
    tracks(&text_of(file.as_ref())?, layout)
}

/// Returns the text of a file.
pub(super) fn text_of(file: &Path) -> Result<String, TrackError> {
    std::fs::read_to_string(file).map_err(|error| {
        let advice = if error.kind() == ErrorKind::InvalidData {
            ": save the table as CSV (UTF-8)"
        } else {
            ""
        };
        TrackError::File(format!("{}: {error}{advice}", file.display()))
    })
}

/// Reads the tracks of a table.
pub fn tracks(text: &str, layout: &Layout) -> Result<Vec<Track>, TrackError> {
    let mut found: Vec<Track> = Vec::new();
    for Row {
        line,
        track,
        time,
        position,
        length,
        gravity,
    } in rows(text, layout)?
    {
        let place = found
            .iter()
            .position(|other| other.name == track)
            .unwrap_or(found.len());
        if place == found.len() {
            found.push(Track {
                name: track,
                times: vec![],
                positions: vec![],
                lengths: vec![],
                gravity,
            });
        }
        let one = &mut found[place];
        if let Some(before) = one.times.last().copied().filter(|before| time <= *before) {
            return Err(not_later(layout, line, one.name.clone(), [time, before]));
        }
        if one.gravity != gravity {
            return Err(TrackError::GravityChanges(line));
        }
        one.times.push(time);
        one.positions.push(position);
        one.lengths.extend(length);
    }
    Ok(found)
}

/// The error for a line of the table whose time (s) is not later than the one before (s).
pub(super) fn not_later(
    layout: &Layout,
    line: usize,
    track: String,
    [time, before]: [f64; 2],
) -> TrackError {
    let unit = layout.seconds.unwrap_or(1.0);
    TrackError::NotLater {
        line,
        track,
        time: time / unit,
        before: before / unit,
    }
}

/// Reads all rows of a table. Lines that are empty or begin with `#` are skipped.
pub(super) fn rows(text: &str, layout: &Layout) -> Result<Vec<Row>, TrackError> {
    let (seconds, metres, signs) = required(layout)?;
    if let Some(sign) = signs.iter().find(|sign| sign.abs() != 1.0) {
        return Err(TrackError::Invalid("the sign of an axis", *sign));
    }
    if signs.len() != layout.coordinates.len() || !(1..=3).contains(&signs.len()) {
        return Err(TrackError::Invalid(
            "the number of axes",
            signs.len() as f64,
        ));
    }
    // Some programs write a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines: Vec<(usize, &str)> = text
        .lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line))
        .collect();
    // Spreadsheets write the separator into a line of its own, `sep=;`. A line of tabs is a row of
    // empty fields.
    let is_note = |line: &str| {
        line.trim_matches(' ').is_empty() || line.starts_with('#') || line.starts_with("sep=")
    };
    let used = |(_, line): &(usize, &str)| !is_note(line);
    let lines: Vec<(usize, &str)> = lines.into_iter().filter(used).collect();
    let Header {
        separator,
        names,
        further,
    } = Header::read(&lines, layout)?;
    let place = |name: &str| {
        let mut places = (0..names.len()).filter(|k| names[*k] == name);
        let there = || names.clone();
        let first = places
            .next()
            .ok_or_else(|| TrackError::NoColumn(name.to_owned(), there()))?;
        if places.next().is_some() {
            Err(TrackError::TwoColumns(name.to_owned()))
        } else {
            Ok(first)
        }
    };
    let time = Some(layout.time)
        .filter(|name| !name.is_empty())
        .map(place)
        .transpose()?;
    let coordinates = layout
        .coordinates
        .iter()
        .map(|name| place(name))
        .collect::<Result<Vec<_>, _>>()?;
    let track = layout.track.map(place).transpose()?;
    let length = layout
        .length
        .map(|(name, unit)| Ok((place(name)?, unit)))
        .transpose()?;
    let gravity = layout.gravity.map(place).transpose()?;
    let mut found = Vec::new();
    // Number of rows of each track before the present one, lost frames included.
    let mut counts: BTreeMap<String, u32> = BTreeMap::new();
    for (line, text) in lines.into_iter().skip(further) {
        let fields = fields(text, separator);
        if fields.len() != names.len() {
            return Err(TrackError::Fields {
                line,
                found: fields.len(),
                expected: names.len(),
            });
        }
        let track = track.map_or(String::new(), |column| fields[column].to_owned());
        let count = counts.entry(track.clone()).or_default();
        let frame = f64::from(*count);
        *count += 1;
        if coordinates
            .iter()
            .all(|column| LOST.contains(&fields[*column].to_ascii_lowercase().as_str()))
        {
            continue;
        }
        // The product with the unit may overflow.
        let number = |column: usize, unit: f64| {
            let value = decimal(fields[column], separator)
                .parse::<f64>()
                .map(|value| value * unit)
                .ok()
                .filter(|value| value.is_finite());
            let error = || TrackError::NoNumber {
                line,
                column: names[column].clone(),
                text: fields[column].into(),
            };
            value.ok_or_else(error)
        };
        let mut position = [0.0; 3];
        for (k, column) in coordinates.iter().enumerate() {
            position[k] = signs[k] * number(*column, metres)?;
        }
        let length = length
            .map(|(column, unit)| number(column, unit))
            .transpose()?;
        if let Some(length) = length.filter(|length| *length <= 0.0) {
            return Err(TrackError::Invalid("a length of the shoot (m)", length));
        }
        let gravity = gravity.map(|column| number(column, 1.0)).transpose()?;
        found.push(Row {
            line,
            track,
            time: time.map_or(Ok(seconds * frame), |column| number(column, seconds))?,
            position,
            length,
            gravity,
        });
    }
    if found.is_empty() {
        Err(TrackError::Empty)
    } else {
        Ok(found)
    }
}

/// Returns the units of time (s) and length (m) and the signs of the axes. All that are missing are
/// reported together.
fn required<'a>(layout: &'a Layout) -> Result<(f64, f64, &'a [f64]), TrackError> {
    let (Some(seconds), Some(metres), Some(signs)) = (layout.seconds, layout.metres, &layout.signs)
    else {
        let all = [
            (layout.seconds.is_none(), Missing::Seconds),
            (layout.metres.is_none(), Missing::Metres),
            (layout.signs.is_none(), Missing::Signs),
        ];
        return Err(TrackError::NotGiven(
            all.iter()
                .filter(|(is, _)| *is)
                .map(|(_, missing)| *missing)
                .collect(),
        ));
    };
    for (what, value) in [
        ("the unit of time (s)", seconds),
        ("the unit of length (m)", metres),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(TrackError::Invalid(what, value));
        }
    }
    Ok((seconds, metres, signs))
}

/// Returns the text of a number with a decimal point. Decimals have no commas if commas separate
/// the columns.
fn decimal(text: &str, separator: char) -> String {
    if separator == ',' {
        text.to_owned()
    } else {
        text.replace(',', ".")
    }
}

/// Returns the fields of a line without blanks and quotation marks around them. A separator between
/// quotation marks belongs to its field.
fn fields(line: &str, separator: char) -> Vec<&str> {
    let mut is_quoted = false;
    let ends = |c: char| {
        is_quoted ^= c == '"';
        c == separator && !is_quoted
    };
    line.split(ends)
        .map(|field| field.trim().trim_matches('"'))
        .collect()
}
