//! Files of tracked positions and centre lines: accepted tables, messages for invalid tables, and
//! curvature along the arc.

// The module belongs to the example `tracked_tip`.
#[path = "../../examples/tracked_tip/average.rs"]
mod average;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};

use crate::fixtures::random::Draw;
use average::moving_average;
use morphorod::tracking::Track;
use morphorod_plot::centre_lines::{centre_lines, curvature};
use morphorod_plot::tracks::{Layout, Missing, TrackError, read_tracks, tracks};
use nalgebra::Vector2;

/// Layout of a table with frames of one minute and pixels of 0.1 mm. The axis y points down.
fn pixels() -> Layout<'static> {
    Layout {
        time: "frame",
        coordinates: vec!["x", "y"],
        track: None,
        seconds: Some(60.0),
        metres: Some(1e-4),
        signs: Some(vec![1.0, -1.0]),
        length: None,
        gravity: None,
    }
}

#[test]
fn positions_in_pixels_and_frames_are_converted() {
    // The table has a byte order mark, a comment, blanks, quotes, Windows line ends, an unused
    // column, and columns in another order.
    let text =
        "\u{feff}# a remark\r\ny, \"frame\",quality,x\r\n20,0,0.9,10\r\n\r\n30,2,0.8,-5.5\r\n";
    let found = tracks(text, &pixels()).unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].times, [0.0, 120.0]);
    let known = [[1e-3, -2e-3, 0.0], [-5.5e-4, -3e-3, 0.0]];
    for (p, q) in found[0]
        .positions
        .iter()
        .flatten()
        .zip(known.iter().flatten())
    {
        assert_abs_diff_eq!(p, q, epsilon = 1e-18);
    }
}

/// Positions in space, one a minute, as published with an experiment: with or without times and a
/// header, in metres, centimetres and millimetres, with decimal points and commas.
#[test]
fn tables_without_times_or_without_a_header_are_read() {
    let layout = |time: &'static str, names: [&'static str; 3], metres: f64| Layout {
        time,
        coordinates: names.to_vec(),
        metres: Some(metres),
        signs: Some(vec![1.0, 1.0, -1.0]),
        ..pixels()
    };
    let (numbers, names) = (["1", "2", "3"], ["x", "y", "z"]);
    let behind = ["2", "3", "4"];
    for (text, layout) in [
        // The position of the second minute was lost.
        ("0.1,0.2,3\n,,\n-0.4,1e-1,3.5\n", layout("", numbers, 1e-2)),
        ("0,1;0,2;3\n;;\n-0,4;0,1;3,5\n", layout("", numbers, 1e-2)),
        (
            "x,y,z\n0.001,0.002,0.03\nnan,nan,nan\n-0.004,0.001,0.035\n",
            layout("", names, 1.0),
        ),
        (
            "x\ty\tz\n1\t2\t30\n\t\t\n-4\t1\t35\n",
            layout("", names, 1e-3),
        ),
        ("0,1,2,30\n2,-4,1,35\n", layout("1", behind, 1e-3)),
        (
            "minute,x,y,z\n0,1,2,30\n2,-4,1,35\n",
            layout("minute", names, 1e-3),
        ),
    ] {
        let found = tracks(text, &layout).unwrap();
        assert_eq!(
            (found.len(), &found[0].times[..]),
            (1, &[0.0, 120.0][..]),
            "{text}"
        );
        let known = [1e-3, 2e-3, -3e-2, -4e-3, 1e-3, -3.5e-2];
        for (p, q) in found[0].positions.iter().flatten().zip(known) {
            assert_abs_diff_eq!(*p, q, epsilon = 1e-17);
        }
    }
    // Rows without times are counted for each track.
    let text = "id,x,y\na,1,1\nb,2,2\na,3,3\nb,4,4\n";
    let two = Layout {
        time: "",
        track: Some("id"),
        ..pixels()
    };
    for track in tracks(text, &two).unwrap() {
        assert_eq!(track.times, [0.0, 60.0], "{}", track.name);
    }
    // The columns of a table without a header are counted from 1.
    let error = tracks("0.1,0.2,3\n", &layout("", names, 1.0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "there is no column 'x'; the columns are '1', '2', '3'"
    );
}

/// The mean of positions on a circle is on a smaller circle. A gap divides the line.
#[test]
fn moving_average_is_that_of_consecutive_positions() {
    let times = (0..40).map(|k| 60.0 * f64::from(k)).collect();
    let angle = |k: usize| std::f64::consts::TAU / 95.0 * k as f64;
    let circle = |k: usize| Vector2::new(angle(k).cos(), angle(k).sin());
    let positions: Vec<_> = (0..40).map(circle).collect();
    let track = Track::new(times, positions.clone()).unwrap();
    let lines = moving_average(&track, 10, 90.0);
    assert_eq!((lines.len(), lines[0].positions().len()), (1, 31));
    // The sum of ten unit vectors whose directions differ by δ has the length
    // sin(10 δ/2)/sin(δ/2).
    let step = angle(1);
    let factor = (5.0 * step).sin() / (10.0 * (0.5 * step).sin());
    for (k, mean) in lines[0].positions().iter().enumerate() {
        let middle = step * (k as f64 + 4.5);
        // Ten additions of numbers of order one.
        assert_abs_diff_eq!(mean.x, factor * middle.cos(), epsilon = 1e-14);
        assert_abs_diff_eq!(mean.y, factor * middle.sin(), epsilon = 1e-14);
    }
    // Twelve positions before a gap have three means, and eight positions behind it have none.
    let times = (0..20)
        .map(|k| if k < 12 { 60.0 } else { 70.0 } * f64::from(k))
        .collect();
    let track = Track::new(times, positions[..20].to_vec()).unwrap();
    let lines = moving_average(&track, 10, 90.0);
    assert_eq!((lines.len(), lines[0].positions().len()), (1, 3));
    // The mean of a single position is the position.
    let lines = moving_average(&track, 1, 90.0);
    let all: Vec<_> = lines.iter().flat_map(Track::positions).copied().collect();
    assert_eq!(all, positions[..20]);
}

#[test]
fn positions_in_space_and_several_tracks_are_read() {
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
    assert_eq!(
        (found[0].times[1], found[0].positions[1]),
        (0.5, [4e-3, 5e-3, -6e-3])
    );
    let text = "frame,id,x,y\n0,b,1,1\n0,a,2,2\n1,a,3,3\n1,b,4,4\n";
    let found = tracks(
        text,
        &Layout {
            track: Some("id"),
            ..pixels()
        },
    )
    .unwrap();
    assert_eq!(
        found
            .iter()
            .map(|track| track.name.as_str())
            .collect::<Vec<_>>(),
        ["b", "a"]
    );
    assert_eq!(found[1].times, [0.0, 60.0]);
    assert_abs_diff_eq!(found[0].positions[1][0], 4e-4, epsilon = 1e-18);
}

#[test]
fn lengths_and_levels_of_gravity_are_read() {
    let layout = Layout {
        track: Some("id"),
        length: Some(("mm", 1e-3)),
        gravity: Some("g"),
        ..pixels()
    };
    let found = tracks(
        "frame,id,x,y,mm,g\n0,a,1,1,50,1\n1,a,2,2,51,1\n0,b,1,1,40,0\n",
        &layout,
    )
    .unwrap();
    assert_eq!(
        found.iter().map(|track| track.gravity).collect::<Vec<_>>(),
        [Some(1.0), Some(0.0)]
    );
    assert_relative_eq!(
        found[0].lengths[1],
        0.051,
        epsilon = 0.0,
        max_relative = 1e-15
    );
    let error = tracks("frame,id,x,y,mm,g\n0,a,1,1,50,1\n1,a,2,2,51,0\n", &layout).unwrap_err();
    assert_eq!(error, TrackError::GravityChanges(3));
    let error = tracks("frame,id,x,y,mm,g\n0,a,1,1,-50,1\n", &layout).unwrap_err();
    assert!(
        matches!(error, TrackError::Invalid(_, length) if length < 0.0),
        "{error}"
    );
}

#[test]
fn invalid_tables_are_refused_with_line_and_column() {
    let message = |text: &str| tracks(text, &pixels()).unwrap_err().to_string();
    let head = "frame,x,y\n";
    assert_eq!(message(""), "the table has no rows below a header");
    assert_eq!(message(head), message("# only\n"));
    assert_eq!(
        message("frame|x|y\n0|1|2\n"),
        "there is no column 'frame'; the columns are 'frame|x|y'"
    );
    // Decimal commas between separating commas.
    assert_eq!(
        message(&format!("{head}0,1,5,2,5\n")),
        "line 2 has 5 fields, but the header has 3"
    );
    assert_eq!(
        message("frame,x,z\n0,1,2\n"),
        "there is no column 'y'; the columns are 'frame', 'x', 'z'"
    );
    assert_eq!(
        message("frame,x,y,x\n0,1,2,3\n"),
        "there are two columns 'x'"
    );
    assert_eq!(
        message(&format!("# r\n{head}0,1,2\n1,2\n")),
        "line 4 has 2 fields, but the header has 3"
    );
    for text in ["abc", "", "NaN", "inf", "1e999", "1.5mm"] {
        let error = tracks(&format!("{head}0,1,2\n1,{text},2\n"), &pixels()).unwrap_err();
        assert_eq!(
            error,
            TrackError::NoNumber {
                line: 3,
                column: "x".into(),
                text: text.into()
            }
        );
        assert!(
            error.to_string().starts_with(&format!(
                "line 3, column 'x': '{text}' is not a finite number"
            )),
            "{error}"
        );
    }
    for time in ["0", "-1"] {
        let error = tracks(&format!("{head}0,1,2\n{time},1,2\n"), &pixels()).unwrap_err();
        assert!(
            matches!(
                error,
                TrackError::NotLater {
                    line: 3,
                    before: 0.0,
                    ..
                }
            ),
            "{error}"
        );
        assert!(
            error.to_string().contains(&format!(
                "time {time} is not later than the previous time 0"
            )),
            "{error}"
        );
    }
    let missing = read_tracks("no/such/file.csv", &pixels()).unwrap_err();
    assert!(
        matches!(&missing, TrackError::File(message) if message.starts_with("no/such/file.csv: ")),
        "{missing}"
    );
}

/// Headers and rows as TrackMate (all spots), DeepLabCut, SLEAP (analysis as CSV) and a spreadsheet
/// with decimal commas write them. The second frame is lost, except in the spreadsheet.
#[test]
fn tables_of_trackers_and_spreadsheets_are_read() {
    let with = |time: &'static str, x: &'static str, y: &'static str| Layout {
        time,
        coordinates: vec![x, y],
        ..pixels()
    };
    let track_mate = "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME\n\
        Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\nLabel,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\n\
        ,,,(quality),(pixel),(pixel),(pixel),(sec),\nID1,1,0,5.1,10.5,20,0,0,0\nID2,2,0,5.2,NaN,NaN,0,1,1\n\
        ID3,3,0,5.3,11.5,21,0,2,2\n";
    let deep_lab_cut = "scorer,DLC_resnet50,DLC_resnet50,DLC_resnet50,DLC_resnet50,DLC_resnet50,DLC_resnet50\n\
        bodyparts,base,base,base,tip,tip,tip\ncoords,x,y,likelihood,x,y,likelihood\n0,1,2,0.99,10.5,20,0.98\n\
        1,1,2,0.99,,,\n2,1,2,0.99,11.5,21,0.97\n";
    let individuals = "individuals,a,a,a,b,b,b\nbodyparts,".to_owned();
    let sleap = "track,frame_idx,instance.score,base.x,base.y,base.score,tip.x,tip.y,tip.score\n\
        ,0,0.9,1,2,0.9,10.5,20,0.9\n,1,0.9,1,2,0.9,,,\n,2,0.9,1,2,0.9,11.5,21,0.9\n";
    let sheet = "frame;x;y\r\n0;10,5;20,0\r\n2;11,5;21\r\n";
    for (text, layout) in [
        (
            track_mate.to_owned(),
            with("FRAME", "POSITION_X", "POSITION_Y"),
        ),
        (deep_lab_cut.to_owned(), with("frame", "tip_x", "tip_y")),
        (sleap.to_owned(), with("frame_idx", "tip.x", "tip.y")),
        (sheet.to_owned(), pixels()),
        (sheet.replace(';', "\t"), pixels()),
        (format!("sep=;\r\n{sheet}"), pixels()),
        (
            deep_lab_cut.replace("bodyparts,", &individuals),
            with("frame", "b_tip_x", "b_tip_y"),
        ),
    ] {
        let found = tracks(&text, &layout).unwrap();
        assert_eq!(
            (found.len(), &found[0].times[..]),
            (1, &[0.0, 120.0][..]),
            "{text}"
        );
        for (p, q) in found[0]
            .positions
            .iter()
            .flatten()
            .zip([1.05e-3, -2e-3, 0.0, 1.15e-3, -2.1e-3, 0.0])
        {
            assert_abs_diff_eq!(*p, q, epsilon = 1e-17);
        }
    }
    // A separator between quotation marks belongs to its field.
    let error = tracks("frame,x,y\n0,\"10,5\",20\n", &pixels()).unwrap_err();
    assert_eq!(
        error,
        TrackError::NoNumber {
            line: 2,
            column: "x".into(),
            text: "10,5".into()
        }
    );
    // Half of a position is no lost frame, and a text in a later row is refused with its line.
    let error = tracks(
        &sleap.replace(",11.5,21,", ",11.5,,"),
        &with("frame_idx", "tip.x", "tip.y"),
    )
    .unwrap_err();
    assert_eq!(
        error,
        TrackError::NoNumber {
            line: 4,
            column: "tip.y".into(),
            text: String::new()
        }
    );
    let error = tracks(
        &track_mate.replace("21,0,2,2", "2l,0,2,2"),
        &with("FRAME", "POSITION_X", "POSITION_Y"),
    );
    assert!(
        error
            .unwrap_err()
            .to_string()
            .starts_with("line 7, column 'POSITION_Y': '2l' is not a finite number")
    );
}

#[test]
fn missing_and_invalid_scale_frame_time_and_signs_are_refused() {
    let text = "frame,x,y\n0,1,2\n1,2,3\n";
    let message = |layout: Layout| tracks(text, &layout).unwrap_err().to_string();
    assert!(
        message(Layout {
            seconds: None,
            ..pixels()
        })
        .contains("time of a frame")
    );
    assert!(
        message(Layout {
            metres: None,
            ..pixels()
        })
        .contains("scale")
    );
    assert!(
        message(Layout {
            signs: None,
            ..pixels()
        })
        .contains("directions of the axes")
    );
    let all = tracks(
        text,
        &Layout {
            seconds: None,
            metres: None,
            signs: None,
            ..pixels()
        },
    )
    .unwrap_err();
    assert_eq!(
        all,
        TrackError::NotGiven(vec![Missing::Seconds, Missing::Metres, Missing::Signs])
    );
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            tracks(
                text,
                &Layout {
                    seconds: Some(value),
                    ..pixels()
                }
            ),
            Err(TrackError::Invalid(..))
        ));
        assert!(matches!(
            tracks(
                text,
                &Layout {
                    metres: Some(value),
                    ..pixels()
                }
            ),
            Err(TrackError::Invalid(..))
        ));
    }
    for signs in [
        vec![1.0, 2.0],
        vec![1.0],
        vec![1.0, 1.0, 1.0],
        vec![1.0, f64::NAN],
    ] {
        assert!(matches!(
            tracks(
                text,
                &Layout {
                    signs: Some(signs),
                    ..pixels()
                }
            ),
            Err(TrackError::Invalid(..))
        ));
    }
}

#[test]
fn table_of_the_example_tracked_tip_is_read() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../examples/tracked_tip/shoot_from_above.csv"
    );
    let layout = Layout {
        track: Some("track"),
        seconds: Some(120.0),
        ..pixels()
    };
    let found = read_tracks(file, &layout).unwrap();
    assert_eq!(
        found
            .iter()
            .map(|track| track.name.as_str())
            .collect::<Vec<_>>(),
        ["tip", "stake"]
    );
    assert!(found.iter().all(|track| track.times.len() > 900));
    // The times of the two tracks repeat if the column of track names is not given.
    let error = read_tracks(
        file,
        &Layout {
            track: None,
            ..layout
        },
    )
    .unwrap_err();
    assert!(
        matches!(error, TrackError::NotLater { line: 5, .. }),
        "{error}"
    );
}

#[test]
fn centre_lines_are_grouped_by_their_times() {
    let text = "frame,x,y\n0,0,0\n0,0,-1\n1,0,0\n1,1,-1\n1,2,-2\n";
    let found = centre_lines(text, &pixels(), "").unwrap();
    assert_eq!(
        found
            .iter()
            .map(|line| (line.time, line.points.len()))
            .collect::<Vec<_>>(),
        [(0.0, 2), (60.0, 3)]
    );
    // The axis y of an image points down, so that the second point is above the base.
    assert_eq!(found[0].points[1], [0.0, 1e-4, 0.0]);
    let error = centre_lines("frame,x,y\n1,0,0\n0,0,-1\n", &pixels(), "").unwrap_err();
    assert!(
        matches!(error, TrackError::NotLater { line: 3, .. }),
        "{error}"
    );
    assert_eq!(
        centre_lines(text, &pixels(), "other").unwrap_err(),
        TrackError::Empty
    );
}

/// Noisy points along a line, with the direction angle (rad) as a function of arc length. The
/// direction is integrated with steps of a thousandth of the distance between points.
fn line(count: usize, apart: f64, noise: f64, angle: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
    let mut draw = Draw::new(11);
    let (mut x, mut y) = (0.0, 0.0);
    let fine = apart / 1000.0;
    let mut points = Vec::new();
    for k in 0..count {
        // The noise is uniform with standard deviation `noise`.
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
fn curvature_of_a_circular_arc_is_constant() {
    // The arc has radius 5 cm, length 10 cm and points every 0.5 mm. It is smoothed over 2 mm, and
    // both senses of rotation are tested.
    for sign in [1.0, -1.0] {
        let found = curvature(&line(201, 5e-4, 0.0, |s| sign * s / 0.05), 2e-3).unwrap();
        for (k, place) in found.iter().enumerate() {
            // Smoothing shortens the arc at most by a fraction (width/radius)².
            assert!(
                abs_diff_eq!(place.arc_length, 5e-4 * k as f64, epsilon = 2e-3 * 0.1),
                "{k}: {place:?}"
            );
            // Far from the ends smoothing reduces the curvature by (width/radius)²/2 = 8e-4. Near
            // the ends the cubic has an error of a few times (width/radius)².
            let curvature = place.curvature[2] * sign * 0.05;
            assert!(
                abs_diff_eq!(curvature, 1.0, epsilon = 0.02),
                "{k}: {place:?}"
            );
            if (40..160).contains(&k) {
                assert!(
                    abs_diff_eq!(curvature, 1.0, epsilon = 1e-3),
                    "{k}: {place:?}"
                );
            }
        }
        assert_relative_eq!(
            found[200].arc_length,
            0.1,
            epsilon = 0.0,
            max_relative = 2e-3
        );
    }
    // The same arc in another plane has its curvature in the first component.
    let tilted: Vec<[f64; 3]> = line(201, 5e-4, 0.0, |s| s / 0.05)
        .iter()
        .map(|p| [0.0, p[0], p[1]])
        .collect();
    let middle = curvature(&tilted, 2e-3).unwrap()[100];
    assert_abs_diff_eq!(middle.curvature[0] * 0.05, 1.0, epsilon = 1e-3);
    assert_abs_diff_eq!(middle.curvature[2], 0.0, epsilon = 1e-9);
}

#[test]
fn curvature_of_a_noisy_clothoid_has_the_predicted_error() {
    // The curvature grows from −20/m to 20/m over 10 cm. The noise is 20 µm, smoothed over 5 mm.
    let (slope, noise, width, apart) = (400.0, 2e-5, 5e-3, 5e-4);
    let found = curvature(
        &line(201, apart, noise, |s| -20.0 * s + 0.5 * slope * s * s),
        width,
    )
    .unwrap();
    // The documentation of `curvature` gives the standard deviation ε √(3 δ/(8 √π w⁵)).
    let expected =
        noise * (3.0 * apart / (8.0 * std::f64::consts::PI.sqrt() * width.powi(5))).sqrt();
    let inner: Vec<f64> = found[40..161]
        .iter()
        .map(|place| place.curvature[2] - (slope * place.arc_length - 20.0))
        .collect();
    let deviation = (inner.iter().map(|x| x * x).sum::<f64>() / inner.len() as f64).sqrt();
    // There are about eight independent values, so that the relative error of their mean square is
    // one half.
    println!("{deviation:.3} of {expected:.3} per metre");
    assert!(
        deviation < 1.6 * expected && deviation > 0.4 * expected,
        "{deviation} {expected}"
    );
    assert!(
        found
            .windows(2)
            .all(|pair| pair[1].arc_length > pair[0].arc_length)
    );
}

#[test]
fn curvature_is_refused_for_invalid_widths_and_too_few_points() {
    let arc = line(50, 1e-3, 0.0, |s| s / 0.05);
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(curvature(&arc, width).is_none(), "{width}");
    }
    // Too few points within the width, too few points in total, and coinciding points.
    assert!(curvature(&arc, 1e-4).is_none());
    assert!(curvature(&arc[..3], 1e-2).is_none());
    assert!(curvature(&[[1.0, 2.0, 0.0]; 20], 1e-2).is_none());
    assert_eq!(curvature(&[], 1e-2), Some(vec![]));
    // The curvature of a straight line is zero.
    let straight = curvature(&line(50, 1e-3, 0.0, |_| 1.0), 5e-3).unwrap();
    assert!(
        straight.iter().all(|place| place.curvature[2].abs() < 1e-9),
        "{straight:?}"
    );
}
