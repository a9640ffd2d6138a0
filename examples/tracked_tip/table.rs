//! Reads the tables that the options name.

use nalgebra::Vector3;

use super::common::Options;
use super::common::centre_lines::{CentreLine, read_centre_lines};
use super::common::tracks::{Layout, Missing, Track, TrackError, read_tracks};
use super::{M_PER_MM, synthetic};

/// Table of the example.
const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tracked_tip/shoot_from_above.csv");

/// Layout of the table. That of the example is known; nothing is assumed of any other.
pub fn layout(options: &Options) -> Result<Layout<'_>, String> {
    let columns: Vec<&str> = options.text("columns").split(',').map(str::trim).collect();
    let shipped = is_shipped(options);
    let given = |name: &str| options.flag(name).then(|| options.positive(name));
    let named = |name: &str| Some(options.text(name)).filter(|name| !name.is_empty());
    Ok(Layout {
        time: options.text("time"),
        track: named("tracks").or(shipped.then_some("track")),
        seconds: given("seconds").or(shipped.then_some(synthetic::FRAME)),
        metres: given("mm").map(|mm| M_PER_MM * mm).or(shipped.then_some(synthetic::PIXEL)),
        signs: match options.text("axes") {
            "" => shipped.then(|| vec![1.0, -1.0]),
            text => Some(signs(text, &columns)?),
        },
        length: named("lengths").map(|name| (name, M_PER_MM * options.positive("lengths-mm"))),
        gravity: named("gravity"),
        coordinates: columns,
    })
}

fn is_shipped(options: &Options) -> bool {
    !options.flag("file") && !options.flag("centre-lines")
}

/// Name of the file of positions, and its tracks.
pub fn tracks(options: &Options, layout: &Layout) -> Result<(String, Vec<Track>), String> {
    let file = if is_shipped(options) { SHIPPED } else { options.text("file") };
    let tracks = read_tracks(file, layout).map_err(|error| explained(file, &error))?;
    Ok((file.to_owned(), tracks))
}

/// Centre lines of the file of the option.
pub fn centre_lines(options: &Options, layout: &Layout) -> Result<Vec<CentreLine>, String> {
    let file = options.text("centre-lines");
    read_centre_lines(file, layout, options.text("track")).map_err(|error| explained(file, &error))
}

/// The track with a name, or the first.
pub fn chosen<'a>(tracks: &'a [Track], name: &str) -> Result<&'a Track, String> {
    let names: Vec<&str> = tracks.iter().map(|track| track.name.as_str()).collect();
    let found = if name.is_empty() { tracks.first() } else { tracks.iter().find(|track| track.name == name) };
    found.ok_or_else(|| format!("there is no track '{name}'; the tracks are '{}'", names.join("', '")))
}

/// Reads the axis towards the observer, as in `0,0,1`.
pub fn axis(text: &str) -> Result<Vector3<f64>, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|text| text.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x, y, z]) => Ok(Vector3::new(*x, *y, *z)),
        _ => Err(format!("--seen-along is '{text}', but must be three numbers, as in 0,0,1")),
    }
}

/// Reads `+x,-y`: a sign for each of the columns, by their names.
fn signs(text: &str, columns: &[&str]) -> Result<Vec<f64>, String> {
    let wrong = || {
        let example = columns.join(",+");
        format!("--axes is '{text}', but must give a sign and a name for each column of --columns, as in +{example}")
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
            format!("{file}: {error}. The options --time, --columns, --tracks, --lengths and --gravity name columns")
        }
        _ => format!("{file}: {error}"),
    }
}
