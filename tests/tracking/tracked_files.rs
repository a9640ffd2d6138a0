//! Files of tracked positions and centre lines: what is read, what is refused and how it is said, and curvature along the arc.

// The readers belong to the examples; each test and each example uses a part of them.
#[allow(dead_code)]
#[path = "../../examples/common/centre_lines.rs"]
mod centre_lines;
#[allow(dead_code)]
#[path = "../../examples/common/tracks.rs"]
mod tracks;

use crate::fixtures::random::Draw;
use centre_lines::{centre_lines, curvature};
use tracks::{Layout, TrackError, read_tracks, tracks};

/// Frames of a minute, pixels of 0.1 mm, y down.
fn pixels() -> Layout<'static> {
    Layout {
        time: "frame",
        coordinates: vec!["x", "y"],
        track: None,
        seconds: Some(60.0),
        metres: Some(1e-4),
        signs: Some(vec![1.0, -1.0]),
    }
}

#[test]
fn positions_in_pixels_and_frames() {
    // Columns in any order, blanks, quotes, remarks, a mark of the encoding, lines that end as on Windows, columns that nobody asks for.
    let text = "\u{feff}# a remark\r\ny, \"frame\",quality,x\r\n20,0,0.9,10\r\n\r\n30,2,0.8,-5.5\r\n";
    let found = tracks(text, &pixels()).unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].times, [0.0, 120.0]);
    let known = [[1e-3, -2e-3, 0.0], [-5.5e-4, -3e-3, 0.0]];
    for (p, q) in found[0].positions.iter().flatten().zip(known.iter().flatten()) {
        assert!((p - q).abs() < 1e-18, "{p} {q}");
    }
}

#[test]
fn positions_in_space_and_several_tracks() {
    let text = "t,x,y,z\n0,1,2,3\n0.5,4,5,6\n";
    let plain = Layout {
        time: "t",
        coordinates: vec!["x", "y", "z"],
        seconds: Some(1.0),
        metres: Some(1e-3),
        signs: Some(vec![1.0, 1.0, -1.0]),
        ..pixels()
    };
    let found = tracks(text, &plain).unwrap();
    assert_eq!((found[0].times[1], found[0].positions[1]), (0.5, [4e-3, 5e-3, -6e-3]));
    let text = "frame,id,x,y\n0,b,1,1\n0,a,2,2\n1,a,3,3\n1,b,4,4\n";
    let found = tracks(text, &Layout { track: Some("id"), ..pixels() }).unwrap();
    assert_eq!(found.iter().map(|track| track.name.as_str()).collect::<Vec<_>>(), ["b", "a"]);
    assert_eq!(found[1].times, [0.0, 60.0]);
    assert!((found[0].positions[1][0] - 4e-4).abs() < 1e-18);
}

#[test]
fn what_is_no_table_of_positions_is_told_by_line_and_column() {
    let told = |text: &str| tracks(text, &pixels()).unwrap_err().to_string();
    let head = "frame,x,y\n";
    assert_eq!(told(""), "the table has no rows below a header");
    assert_eq!(told(head), told("# only\n"));
    assert!(told("frame;x;y\n0;1;2\n").contains("';'"), "{}", told("frame;x;y\n0;1;2\n"));
    assert!(told("frame\tx\ty\n0\t1\t2\n").contains("commas"));
    assert_eq!(told("frame,x,z\n0,1,2\n"), "there is no column 'y'; there are 'frame', 'x', 'z'");
    assert_eq!(told("frame,x,y,x\n0,1,2,3\n"), "there are two columns 'x'");
    assert_eq!(told(&format!("# r\n{head}0,1,2\n1,2\n")), "line 4 has 2 fields, but the header has 3");
    for text in ["abc", "", "NaN", "inf", "1e999", "1.5mm"] {
        let error = tracks(&format!("{head}0,1,2\n1,{text},2\n"), &pixels()).unwrap_err();
        assert_eq!(error, TrackError::NoNumber { line: 3, column: "x".into(), text: text.into() });
        assert!(error.to_string().starts_with(&format!("line 3, column 'x': '{text}' is no finite number")), "{error}");
    }
    for time in ["0", "-1"] {
        let error = tracks(&format!("{head}0,1,2\n{time},1,2\n"), &pixels()).unwrap_err();
        assert!(matches!(error, TrackError::NotLater { line: 3, before: 0.0, .. }), "{error}");
        assert!(error.to_string().contains(&format!("time {time} is not later than 0")), "{error}");
    }
    let missing = read_tracks("no/such/file.csv", &pixels()).unwrap_err();
    assert!(matches!(&missing, TrackError::File(message) if message.starts_with("no/such/file.csv: ")), "{missing}");
}

#[test]
fn scale_frame_time_and_signs_are_asked_for() {
    let text = "frame,x,y\n0,1,2\n1,2,3\n";
    let told = |layout: Layout| tracks(text, &layout).unwrap_err().to_string();
    assert!(told(Layout { seconds: None, ..pixels() }).contains("time of a frame"));
    assert!(told(Layout { metres: None, ..pixels() }).contains("scale"));
    assert!(told(Layout { signs: None, ..pixels() }).contains("where the axes point was not given"));
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(tracks(text, &Layout { seconds: Some(value), ..pixels() }), Err(TrackError::Senseless(..))));
        assert!(matches!(tracks(text, &Layout { metres: Some(value), ..pixels() }), Err(TrackError::Senseless(..))));
    }
    for signs in [vec![1.0, 2.0], vec![1.0], vec![1.0, 1.0, 1.0], vec![1.0, f64::NAN]] {
        assert!(matches!(tracks(text, &Layout { signs: Some(signs), ..pixels() }), Err(TrackError::Senseless(..))));
    }
}

#[test]
fn the_table_of_the_example_is_read() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/tracked_tip/shoot_from_above.csv");
    let layout = Layout { track: Some("track"), seconds: Some(120.0), ..pixels() };
    let found = read_tracks(file, &layout).unwrap();
    assert_eq!(found.iter().map(|track| track.name.as_str()).collect::<Vec<_>>(), ["tip", "stake"]);
    assert!(found.iter().all(|track| track.times.len() > 900));
    // Two tracks that are not told apart: a time that repeats.
    let error = read_tracks(file, &Layout { track: None, ..layout }).unwrap_err();
    assert!(matches!(error, TrackError::NotLater { line: 5, .. }), "{error}");
}

#[test]
fn centre_lines_are_grouped_by_their_times() {
    let text = "frame,x,y\n0,0,0\n0,0,-1\n1,0,0\n1,1,-1\n1,2,-2\n";
    let found = centre_lines(text, &pixels(), "").unwrap();
    assert_eq!(found.iter().map(|line| (line.time, line.points.len())).collect::<Vec<_>>(), [(0.0, 2), (60.0, 3)]);
    // y of an image points down: the second point is above the base.
    assert_eq!(found[0].points[1], [0.0, 1e-4, 0.0]);
    let error = centre_lines("frame,x,y\n1,0,0\n0,0,-1\n", &pixels(), "").unwrap_err();
    assert!(matches!(error, TrackError::NotLater { line: 3, .. }), "{error}");
    assert_eq!(centre_lines(text, &pixels(), "other").unwrap_err(), TrackError::Empty);
}

/// Points with noise along a line whose direction angle is given; by steps of a thousandth of the distance between points.
fn line(count: usize, apart: f64, noise: f64, angle: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
    let mut draw = Draw::new(11);
    let (mut x, mut y) = (0.0, 0.0);
    let fine = apart / 1000.0;
    let mut points = Vec::new();
    for k in 0..count {
        // A uniform distribution of standard deviation `noise`.
        let mut off = || draw.uniform(-1.0, 1.0) * noise * 3.0_f64.sqrt();
        points.push([x + off(), y + off(), 0.0]);
        for i in 0..1000 {
            let s = apart * k as f64 + fine * (f64::from(i) + 0.5);
            x += fine * angle(s).cos();
            y += fine * angle(s).sin();
        }
    }
    points
}

#[test]
fn the_curvature_of_an_arc_of_a_circle() {
    // A radius of 5 cm, 10 cm of it every 0.5 mm, smoothed over 2 mm; it turns clockwise, then counterclockwise.
    for sign in [1.0, -1.0] {
        let found = curvature(&line(201, 5e-4, 0.0, |s| sign * s / 0.05), 2e-3).unwrap();
        for (k, place) in found.iter().enumerate() {
            // The arc is longer than its smoothed line by (width/radius)² or less.
            assert!((place.arc_length - 5e-4 * k as f64).abs() < 2e-3 * 0.1, "{place:?}");
            // Inside by (width/radius)²/2 = 8e-4 less; at the ends a cubic misses (width/radius)² times a few.
            assert!((place.curvature[2] * sign * 0.05 - 1.0).abs() < 0.02, "{k}: {place:?}");
            if (40..160).contains(&k) {
                assert!((place.curvature[2] * sign * 0.05 - 1.0).abs() < 1e-3, "{k}: {place:?}");
            }
        }
        assert!((found[200].arc_length / 0.1 - 1.0).abs() < 2e-3);
    }
    // The same arc in another plane: the norm.
    let tilted: Vec<[f64; 3]> = line(201, 5e-4, 0.0, |s| s / 0.05).iter().map(|p| [0.0, p[0], p[1]]).collect();
    let middle = curvature(&tilted, 2e-3).unwrap()[100];
    assert!((middle.curvature[0] * 0.05 - 1.0).abs() < 1e-3 && middle.curvature[2].abs() < 1e-9, "{middle:?}");
}

#[test]
fn the_curvature_of_a_clothoid_with_noise() {
    // From −20 to 20 per metre over 10 cm; noise of 20 µm, smoothed over 5 mm.
    let (slope, noise, width, apart) = (400.0, 2e-5, 5e-3, 5e-4);
    let found = curvature(&line(201, apart, noise, |s| -20.0 * s + 0.5 * slope * s * s), width).unwrap();
    // As the reader says: ε √(3 δ/(8 √π w⁵)).
    let expected = noise * (3.0 * apart / (8.0 * std::f64::consts::PI.sqrt() * width.powi(5))).sqrt();
    let inner: Vec<f64> =
        found[40..161].iter().map(|place| place.curvature[2] - (slope * place.arc_length - 20.0)).collect();
    let deviation = (inner.iter().map(|x| x * x).sum::<f64>() / inner.len() as f64).sqrt();
    // Some 8 independent values: their mean square is known to one half.
    println!("{deviation:.3} of {expected:.3} per metre");
    assert!(deviation < 1.6 * expected && deviation > 0.4 * expected, "{deviation} {expected}");
    assert!(found.windows(2).all(|pair| pair[1].arc_length > pair[0].arc_length));
}

#[test]
fn what_has_no_curvature() {
    let arc = line(50, 1e-3, 0.0, |s| s / 0.05);
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(curvature(&arc, width).is_none(), "{width}");
    }
    // Too few points, within reach or at all, and points that coincide.
    assert!(curvature(&arc, 1e-4).is_none());
    assert!(curvature(&arc[..3], 1e-2).is_none());
    assert!(curvature(&[[1.0, 2.0, 0.0]; 20], 1e-2).is_none());
    assert_eq!(curvature(&[], 1e-2), Some(vec![]));
    // A straight line has none: an answer.
    let straight = curvature(&line(50, 1e-3, 0.0, |_| 1.0), 5e-3).unwrap();
    assert!(straight.iter().all(|place| place.curvature[2].abs() < 1e-9), "{straight:?}");
}
