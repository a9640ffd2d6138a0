//! Options that name a table of tracked positions and describe its units and axes.

use super::centre_lines::{CentreLine, read_centre_lines};
use super::options::{Opt, Options};
use super::tracks::{Layout, Missing, Track, TrackError, read_tracks};

const M_PER_MM: f64 = 1e-3;

/// Declarations of the options. `file` and `centre_lines` are the help texts of these tables, and
/// `time` is the default name of the column of times.
pub fn declarations(
    file: &'static str,
    centre_lines: &'static str,
    time: &'static str,
) -> Vec<Opt> {
    let axes = "sign and column of each coordinate, + to the right, up, or towards the camera: +x,-y for images";
    vec![
        Opt::value("file", "FILE", "", file),
        Opt::value("centre-lines", "FILE", "", centre_lines),
        Opt::value(
            "time",
            "NAME",
            time,
            "column of times or frame numbers; '' if there is none, and --seconds is the time between rows",
        ),
        Opt::value(
            "columns",
            "NAMES",
            "x,y",
            "columns of the coordinates; 1,2,3 and so on in a table without a header",
        ),
        Opt::value(
            "tracks",
            "NAME",
            "",
            "column of the names of tracks, if there are several",
        ),
        Opt::value(
            "track",
            "TRACK",
            "",
            "name of the analysed track; by default the first",
        ),
        Opt::value(
            "seconds",
            "S",
            "",
            "unit of the time column, s: the time between frames, or 1",
        ),
        Opt::value(
            "mm",
            "MM",
            "",
            "unit of the coordinates, mm: the size of a pixel, or 1, 10 or 1000 for mm, cm or m",
        ),
        Opt::value("axes", "SIGNS", "", axes),
    ]
}

/// Layout of the table. Nothing is assumed that the options do not state.
pub fn layout(options: &Options) -> Result<Layout<'_>, String> {
    let coordinates: Vec<&str> = options.text("columns").split(',').map(str::trim).collect();
    let given = |name: &str| options.flag(name).then(|| options.positive(name));
    Ok(Layout {
        time: options.text("time"),
        track: named(options, "tracks"),
        seconds: given("seconds"),
        metres: given("mm").map(|mm| M_PER_MM * mm),
        signs: named(options, "axes")
            .map(|text| signs(text, &coordinates))
            .transpose()?,
        length: None,
        gravity: None,
        coordinates,
    })
}

/// Text of an option, if it is not empty.
pub fn named<'a>(options: &'a Options, name: &str) -> Option<&'a str> {
    Some(options.text(name)).filter(|text| !text.is_empty())
}

/// Tracks of a file.
pub fn tracks(file: &str, layout: &Layout) -> Result<Vec<Track>, String> {
    read_tracks(file, layout).map_err(|error| explained(file, &error))
}

/// Centre lines of the file of the option.
pub fn centre_lines(options: &Options, layout: &Layout) -> Result<Vec<CentreLine>, String> {
    let file = options.text("centre-lines");
    read_centre_lines(file, layout, options.text("track")).map_err(|error| explained(file, &error))
}

/// The track with a name, or the first.
pub fn chosen<'a>(tracks: &'a [Track], name: &str) -> Result<&'a Track, String> {
    let names: Vec<&str> = tracks.iter().map(|track| track.name.as_str()).collect();
    let found = if name.is_empty() {
        tracks.first()
    } else {
        tracks.iter().find(|track| track.name == name)
    };
    found.ok_or_else(|| {
        format!(
            "there is no track '{name}'; the tracks are '{}'",
            names.join("', '")
        )
    })
}

/// Reads `+x,-y`: a sign for each of the columns, by their names.
fn signs(text: &str, columns: &[&str]) -> Result<Vec<f64>, String> {
    let wrong = || {
        let example = columns.join(",+");
        format!(
            "--axes is '{text}', but must give a sign and a name for each column of --columns, as in +{example}"
        )
    };
    let given: Vec<&str> = text.split(',').map(str::trim).collect();
    if given.len() != columns.len() {
        return Err(wrong());
    }
    let sign = |(axis, column): (&&str, &&str)| match axis.strip_suffix(column) {
        Some("+") => Ok(1.0),
        Some("-") => Ok(-1.0),
        _ => Err(wrong()),
    };
    given.iter().zip(columns).map(sign).collect()
}

/// The message of an error, with the name of the file and the options that avoid it.
fn explained(file: &str, error: &TrackError) -> String {
    let option = |missing: &Missing| match missing {
        Missing::Seconds => "--seconds",
        Missing::Metres => "--mm",
        Missing::Signs => "--axes, as in +x,-y for an image",
    };
    match error {
        TrackError::File(_) => error.to_string(),
        TrackError::NotGiven(missing) => {
            let options: Vec<&str> = missing.iter().map(option).collect();
            format!("{file}: {error}. Give {}", options.join("; "))
        }
        TrackError::NoColumn(..) => {
            format!(
                "{file}: {error}. Options such as --time and --columns name columns; --time '' is for a table \
                 without times"
            )
        }
        _ => format!("{file}: {error}"),
    }
}
