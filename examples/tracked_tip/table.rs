//! Reads the tables that the options name.

use nalgebra::Vector3;

use super::{M_PER_MM, synthetic};
use morphorod_plot::Options;
use morphorod_plot::track_options::{self, named};
use morphorod_plot::tracks::{Layout, Track};

/// Table of the example.
const SHIPPED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/examples/tracked_tip/shoot_from_above.csv"
);

/// Layout of the table. That of the example is known; nothing is assumed of any other.
pub fn layout(options: &Options) -> Result<Layout<'_>, String> {
    let (given, shipped) = (track_options::layout(options)?, is_shipped(options));
    if given.coordinates.len() < 2 {
        return Err("--columns must name two or three coordinates".into());
    }
    Ok(Layout {
        track: given.track.or(shipped.then_some("track")),
        seconds: given.seconds.or(shipped.then_some(synthetic::FRAME)),
        metres: given.metres.or(shipped.then_some(synthetic::PIXEL)),
        signs: given.signs.or(shipped.then(|| vec![1.0, -1.0])),
        length: named(options, "lengths")
            .map(|name| (name, M_PER_MM * options.positive("lengths-mm"))),
        gravity: named(options, "gravity"),
        ..given
    })
}

fn is_shipped(options: &Options) -> bool {
    !options.flag("file") && !options.flag("centre-lines")
}

/// Name of the file of positions, and its tracks.
pub fn tracks(options: &Options, layout: &Layout) -> Result<(String, Vec<Track>), String> {
    let file = if is_shipped(options) {
        SHIPPED
    } else {
        options.text("file")
    };
    Ok((file.to_owned(), track_options::tracks(file, layout)?))
}

/// Reads the axis towards the observer, as in `0,0,1`.
pub fn axis(text: &str) -> Result<Vector3<f64>, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|text| text.trim().parse().ok())
        .collect();
    match numbers.as_deref() {
        Some([x, y, z]) => Ok(Vector3::new(*x, *y, *z)),
        _ => Err(format!(
            "--seen-along is '{text}', but must be three numbers, as in 0,0,1"
        )),
    }
}
