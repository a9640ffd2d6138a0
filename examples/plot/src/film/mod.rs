//! Films: HTML files that play in a browser without a network.

mod frame;

use std::io;
use std::path::Path;

use morphorod::support::Cylinder;

pub use frame::Frame;

use super::file::write_whole;

/// Largest size of all frames in bytes. Their text is longer by one third.
const MOST_BYTES: usize = 2_000_000;

/// A sequence of frames with a title and a description.
#[derive(Debug, Clone)]
pub struct Film {
    title: String,
    about: String,
    /// Initial speed, in simulated hours per second.
    speed: f64,
    frames: Vec<Frame>,
    poles: Vec<Cylinder>,
    measured: Vec<(f64, Vec<[f64; 3]>)>,
}

impl Film {
    /// Returns a film without frames. `speed` is one of the values of the player: 0.1, 0.25, 0.5,
    /// 1, 2, 4 or 8 h per second.
    pub fn new(title: &str, about: &str, speed: f64) -> Self {
        Self {
            title: title.into(),
            about: about.into(),
            speed,
            frames: vec![],
            poles: vec![],
            measured: vec![],
        }
    }

    /// Adds a frame. Its time is later than that of the last frame, and its number of points is the
    /// same.
    pub fn push(&mut self, frame: Frame) {
        self.frames.push(frame);
    }

    /// Adds a pole at rest, which is drawn in all frames.
    pub fn add_pole(&mut self, pole: Cylinder) {
        self.poles.push(pole);
    }

    /// Adds measured places (m) of a time (s), later than those before. They are drawn until the
    /// next ones; if there is one at each time, as on the track of a tip, all of them remain.
    pub fn add_measured(&mut self, time: f64, places: Vec<[f64; 3]>) {
        self.measured.push((time, places));
    }

    /// Writes the page.
    ///
    /// # Errors
    /// Errors of the file system, frames with different numbers of points, and a film without
    /// frames.
    pub fn write(&self, file: impl AsRef<Path>) -> io::Result<()> {
        let page = fill(
            include_str!("film.html"),
            &[
                ("title", &escaped(&self.title)),
                ("about", &escaped(&self.about)),
                ("css", include_str!("page.css")),
                ("data", &self.data()?),
                ("scene", SCENE),
                ("player", include_str!("player.js")),
            ],
        );
        write_whole(file.as_ref(), page)
    }

    /// Returns every n-th frame, where n is the smallest number for which the page is smaller than
    /// 3 MB.
    fn kept(&self, bytes: usize) -> Vec<&Frame> {
        let every = (bytes * self.frames.len()).div_ceil(MOST_BYTES).max(1);
        self.frames.iter().step_by(every).collect()
    }

    /// Returns the data of the player: times, lengths, growth zones, and all vectors as 16-bit
    /// numbers.
    fn data(&self) -> io::Result<String> {
        let wrong =
            |what: &str| io::Error::new(io::ErrorKind::InvalidInput, format!("a film {what}"));
        let first = self
            .frames
            .first()
            .ok_or_else(|| wrong("needs at least one frame"))?;
        let counts = |frame: &Frame| (frame.line.len(), frame.directors.len(), frame.piles.len());
        if self
            .frames
            .iter()
            .any(|frame| counts(frame) != counts(first))
        {
            return Err(wrong("needs frames with equal numbers of points"));
        }
        let (points, stations, piles) = counts(first);
        let frames = self.kept(6 * (points + 3 * stations + 2 * piles));
        let furthest = frames.iter().flat_map(|frame| frame.line.iter().flatten());
        let furthest = furthest.fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
        let most = f64::from(i16::MAX);
        let unit = furthest / most;
        let mut bytes = Vec::new();
        let mut put = |vector: &[f64; 3], unit: f64| {
            // The conversion saturates. Positions exceed those of the centre line by rounding only.
            vector
                .iter()
                .for_each(|x| bytes.extend(((x / unit).round() as i16).to_le_bytes()));
        };
        for frame in &frames {
            frame.line.iter().for_each(|at| put(at, unit));
            for [at, d1, d2] in &frame.directors {
                put(at, unit);
                [d1, d2].into_iter().for_each(|d| put(d, 1.0 / most));
            }
            for [at, h] in &frame.piles {
                put(at, unit);
                put(h, 1.0 / most);
            }
        }
        let list = |of: &dyn Fn(&Frame) -> f64, digits: usize| {
            let numbers: Vec<String> = frames
                .iter()
                .map(|frame| format!("{:.digits$}", of(frame)))
                .collect();
            numbers.join(",")
        };
        let poles = self.poles.iter().map(|pole| {
            let ([x, y, z], [a, b, c]): ([f64; 3], [f64; 3]) =
                (pole.through.into(), pole.along.normalize().into());
            format!("[[{x},{y},{z}],[{a},{b},{c}],{}]", pole.radius)
        });
        let place = |p: &[f64; 3]| format!("[{:.6},{:.6},{:.6}]", p[0], p[1], p[2]);
        let measured = self.measured.iter().map(|(time, places)| {
            let places: Vec<String> = places.iter().map(place).collect();
            format!("[{:.4},[{}]]", time / 3600.0, places.join(","))
        });
        Ok(format!(
            "{{\"poles\":[{}],\"measured\":[{}],\
             \"speed\":{},\"unit\":{unit:e},\"points\":{points},\"stations\":{stations},\
             \"piles\":{piles},\"times\":[{}],\"lengths\":[{}],\"zones\":[{}],\"data\":\"{}\"}}",
            poles.collect::<Vec<_>>().join(","),
            measured.collect::<Vec<_>>().join(","),
            self.speed,
            list(&|frame| frame.time / 3600.0, 4),
            list(&|frame| frame.length, 6),
            list(&|frame| frame.zone, 4),
            base64(&bytes),
        ))
    }
}

/// Script that draws a shoot in space.
pub const SCENE: &str = include_str!("scene.js");
/// Style sheet of the pages.
pub const STYLE: &str = include_str!("page.css");

/// Replaces each `{{name}}` by its text.
pub fn fill(page: &str, texts: &[(&str, &str)]) -> String {
    texts.iter().fold(page.to_string(), |page, (name, text)| {
        page.replace(&format!("{{{{{name}}}}}"), text)
    })
}

/// Encodes bytes in base 64 (RFC 4648).
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let number = three
            .iter()
            .enumerate()
            .fold(0, |sum, (i, byte)| sum | (u32::from(*byte) << (16 - 8 * i)));
        for i in 0..4 {
            let digit = DIGITS[(number >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= three.len() {
                char::from(digit)
            } else {
                '='
            });
        }
    }
    text
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
