//! Tests of figures of `morphorod-plot`: sizes, formats, times as colours, and refused sizes.

use std::fs;
use std::path::{Path, PathBuf};

use morphorod_plot::{Axes, Figure, Series, Style};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// States of a circular motion of one hour: time, s, and two coordinates.
fn circle() -> Vec<(f64, f64, f64)> {
    (0..=60)
        .map(|k| {
            (
                60.0 * f64::from(k),
                (0.1 * f64::from(k)).sin(),
                (0.1 * f64::from(k)).cos(),
            )
        })
        .collect()
}

#[test]
fn size_and_font_of_a_figure_are_those_that_are_set() {
    let draw = |name: &str, width: f64, points: f64| {
        Figure::new(file(name), "")
            .width(width)
            .height(60.0)
            .font_size(points)
            .phase(["x (m)", "y (m)"], &circle())
    };
    draw("column.svg", 85.0, 8.0).unwrap();
    let text = fs::read_to_string(file("column.svg")).unwrap();
    // 85 mm are 321 pixels of 1/96 inch. The height has a margin of 10 pixels of a figure of 12.75
    // points.
    assert!(
        text.contains("width=\"321\" height=\"233\""),
        "{}",
        &text[..200]
    );
    draw("column.png", 85.0, 8.0).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(file("column.png")).unwrap(),
    ));
    let mut reader = decoder.read_info().unwrap();
    // 300 dots per inch: 321 · 300/96 = 1003.1.
    assert_eq!((reader.info().width, reader.info().height), (1004, 729));
    let mut dots = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut dots).unwrap();
    // Tick labels are the only dark dots left of the frame, which begins at 92 pixels, and of its
    // ticks.
    let (row, left) = (4 * 1004, 4 * 140);
    assert!(
        dots.chunks(row)
            .flat_map(|line| &line[..left])
            .any(|dot| *dot < 0x40),
        "there are no letters"
    );
    for (name, width, points) in [
        ("a.svg", 85.0, 40.0),
        ("a.svg", f64::NAN, 8.0),
        ("a.svg", 85.0, 0.0),
        ("a.pdf", 85.0, 8.0),
    ] {
        let error = draw(name, width, points).unwrap_err().to_string();
        assert!(error.contains(name) && !file(name).exists(), "{error}");
    }
}

#[test]
fn series_with_times_have_a_colour_bar_and_different_colours() {
    let series: Vec<Series> = (0..3)
        .map(|k| {
            Series::new("", vec![(0.0, 0.0), (1.0, f64::from(k))], Style::Line, 0)
                .at_time(f64::from(k))
        })
        .collect();
    Figure::new(file("times.svg"), "")
        .lines("x (1)", "y (1)", &series, Axes::Linear)
        .unwrap();
    let text = fs::read_to_string(file("times.svg")).unwrap();
    assert!(text.contains("time (h)"));
    let colours: std::collections::BTreeSet<&str> = text
        .lines()
        .filter(|line| line.starts_with("<polyline") && line.contains("stroke-width=\"24\""))
        .filter_map(|line| line.split("stroke=\"").nth(1)?.split('"').next())
        .collect();
    assert_eq!(colours.len(), 3, "{colours:?}");
}

#[test]
fn line_styles_differ_without_colour() {
    let [solid, dashed, dotted, dash_dot] =
        [Style::Line, Style::Dashed, Style::Dotted, Style::DashDot].map(|style| {
            let line = Series::new("", vec![(0.0, 0.0), (1.0, 1.0)], style, 0);
            Figure::new(file("style.svg"), "")
                .lines("x (1)", "y (1)", &[line], Axes::Linear)
                .unwrap();
            let text = fs::read_to_string(file("style.svg")).unwrap();
            // Each dash is a line of its own. Lines of axes have other widths.
            text.lines()
                .filter(|line| {
                    line.starts_with("<polyline") && line.contains("stroke-width=\"24\"")
                })
                .count() as f64
        });
    assert_eq!(solid, 1.0);
    // Widths of the line from one dash or dot to the next. The patterns end with the line, within
    // one pattern.
    let length = 7.5 * dashed;
    assert!(
        dashed > 20.0 && (3.0 * dotted - length).abs() < 7.5,
        "{dashed} dashes, {dotted} dots"
    );
    assert!(
        (6.15 * dash_dot - length).abs() < 12.3,
        "{dashed} dashes, {dash_dot} dashes and dots"
    );
}
