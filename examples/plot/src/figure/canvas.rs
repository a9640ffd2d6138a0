//! Drawing of lines, areas and text in pixels of the finished figure.

use std::fs;
use std::io;
use std::path::Path;

use plotters::prelude::{DrawingBackend, FontTransform, IntoFont, SVGBackend, ShapeStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBColor, TextStyle};

use crate::file::named;

/// Position in pixels; y points down.
pub type Point = (f64, f64);

/// Number of backend units per pixel. The backend rounds coordinates to whole units, and ten units
/// per pixel make the rounding invisible.
const UNITS_PER_PIXEL: f64 = 10.0;

/// Position and appearance of a text.
#[derive(Clone, Copy)]
pub struct Label {
    /// Anchor position.
    pub at: Point,
    /// Font size in pixels.
    pub size: f64,
    /// Horizontal position of the anchor in the text.
    pub h: HPos,
    /// Vertical position of the anchor in the text.
    pub v: VPos,
    /// Whether the text runs upwards.
    pub upwards: bool,
    /// Colour of the letters.
    pub colour: RGBColor,
}

impl Label {
    /// Returns a label of the default size, centred at the position.
    pub fn new(x: f64, y: f64) -> Self {
        Self {
            at: (x, y),
            size: super::LABEL_SIZE,
            h: HPos::Center,
            v: VPos::Center,
            upwards: false,
            colour: RGBColor(0x22, 0x22, 0x22),
        }
    }

    /// Returns the label with a smaller font if `text` would exceed `width`.
    pub fn fitted(self, text: &str, width: f64) -> Self {
        let needed = text_width(text, self.size);
        let shrink = (width / needed.max(1.0)).min(1.0);
        // Fonts below 16 px are illegible, so that a very long text may exceed the width.
        let size = (self.size * shrink).max(16.0_f64.min(self.size));
        Self { size, ..self }
    }
}

/// Returns an upper estimate of the width of a text. The font of the viewer is unknown; a wide one
/// is assumed.
pub fn text_width(text: &str, size: f64) -> f64 {
    0.61 * size * text.chars().count() as f64
}

/// A figure under construction.
pub struct Canvas<'a> {
    backend: SVGBackend<'a>,
    // First error of the backend. `write` returns it after drawing.
    error: Option<io::Error>,
}

/// Draws a figure of the given width and height and writes it to a file. One pixel of them is
/// `scale` pixels of the file.
pub fn write(
    file: &Path,
    [width, height]: [f64; 2],
    scale: f64,
    draw: impl FnOnce(&mut Canvas),
) -> io::Result<()> {
    let size = (units(width) as u32, units(height) as u32);
    let mut svg = String::new();
    {
        let mut canvas = Canvas {
            backend: SVGBackend::with_string(&mut svg, size),
            error: None,
        };
        canvas.area(
            &[(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)],
            RGBColor(255, 255, 255),
        );
        draw(&mut canvas);
        let presented = canvas.backend.present();
        canvas.keep(presented);
        if let Some(error) = canvas.error {
            return Err(error);
        }
    }
    // Attributes that all elements share are set once on the root element, which makes the file
    // smaller.
    let svg = svg
        .replace("<polyline fill=\"none\"", "<polyline")
        .replace(" opacity=\"1\"", "");
    // The view box remains in backend units. Round caps close the joints of lines that are drawn
    // piecewise in several colours.
    let fine = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    let [width, height] = [width, height].map(|pixels| (pixels * scale).round());
    let shown = format!(
        "width=\"{width}\" height=\"{height}\" fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\""
    );
    let svg = svg.replacen(&fine, &shown, 1);
    let content = match file.extension().and_then(|ending| ending.to_str()) {
        Some("png") => png(&svg),
        Some("svg") => Ok(svg.into_bytes()),
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "the name of a figure must end with .svg or .png",
        )),
    };
    content
        .and_then(|content| fs::write(file, content))
        .map_err(|error| named(file, &error))
}

/// Converts a figure to PNG with 300 dots per inch.
#[cfg(feature = "png")]
fn png(svg: &str) -> io::Result<Vec<u8>> {
    use resvg::{tiny_skia, usvg};
    /// Dots per pixel.
    const DOTS: f32 = 300.0 / 96.0;
    /// Families that stand for "sans-serif", the first that is installed; otherwise any family.
    const FAMILIES: [&str; 5] = [
        "Helvetica",
        "Arial",
        "Liberation Sans",
        "DejaVu Sans",
        "Noto Sans",
    ];
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_system_fonts();
    let names: Vec<String> = fonts
        .faces()
        .flat_map(|face| &face.families)
        .map(|(name, _)| name.clone())
        .collect();
    let known = FAMILIES
        .into_iter()
        .find(|family| names.iter().any(|name| name == family));
    let family = known.or(names.first().map(String::as_str));
    fonts.set_sans_serif_family(
        family.ok_or_else(|| io::Error::other("PNG needs a font, and none is installed"))?,
    );
    let tree = usvg::Tree::from_str(svg, &options).map_err(io::Error::other)?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|pixels| (pixels * DOTS).ceil() as u32);
    let mut dots = tiny_skia::Pixmap::new(width, height)
        .ok_or_else(|| io::Error::other("the figure is too large"))?;
    resvg::render(
        &tree,
        tiny_skia::Transform::from_scale(DOTS, DOTS),
        &mut dots.as_mut(),
    );
    dots.encode_png().map_err(io::Error::other)
}

/// Reports that the package was compiled without PNG.
#[cfg(not(feature = "png"))]
fn png(_: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(
        io::ErrorKind::Unsupported,
        "PNG needs the feature `png` of morphorod-plot",
    ))
}

impl Canvas<'_> {
    /// Draws a line through the points, or a dot if there is only one point.
    pub fn line(&mut self, path: &[Point], colour: RGBColor, width: f64) {
        match path {
            [] => return,
            [only] => return self.dot(*only, 1.6 * width, colour),
            _ => {}
        }
        let mut kept = vec![path[0]];
        simplify(path, &mut kept);
        let kept: Vec<_> = kept.into_iter().map(fine).collect();
        let result = self.backend.draw_path(kept, &stroke(colour, width));
        self.keep(result);
    }

    /// Draws a line through the points with a pattern: lengths of dashes and gaps in turn, in
    /// widths of the line. The line is solid without a pattern.
    pub fn dashed(&mut self, path: &[Point], colour: RGBColor, width: f64, pattern: &[f64]) {
        if pattern.is_empty() || path.len() < 2 {
            return self.line(path, colour, width);
        }
        let mut dash = vec![path[0]];
        let (mut piece, mut left) = (0, pattern[0] * width);
        for pair in path.windows(2) {
            let (mut from, to) = (pair[0], pair[1]);
            loop {
                let length = (to.0 - from.0).hypot(to.1 - from.1);
                if length <= left {
                    left -= length;
                    dash.push(to);
                    break;
                }
                let s = left / length;
                from = (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
                dash.push(from);
                if piece % 2 == 0 {
                    self.line(&dash, colour, width);
                }
                dash = vec![from];
                piece = (piece + 1) % pattern.len();
                left = pattern[piece] * width;
            }
        }
        if piece % 2 == 0 && dash.len() > 1 {
            self.line(&dash, colour, width);
        }
    }

    /// Draws a filled polygon.
    pub fn area(&mut self, path: &[Point], colour: RGBColor) {
        let path: Vec<_> = path.iter().map(|p| fine(*p)).collect();
        let result = self.backend.fill_polygon(path, &colour);
        self.keep(result);
    }

    /// Draws a filled circle.
    pub fn dot(&mut self, centre: Point, radius: f64, colour: RGBColor) {
        self.circle(centre, radius, stroke(colour, 0.0), true);
    }

    /// Draws a circle filled with white.
    pub fn ring(&mut self, centre: Point, radius: f64, colour: RGBColor, width: f64) {
        self.dot(centre, radius, RGBColor(255, 255, 255));
        self.circle(centre, radius, stroke(colour, width), false);
    }

    /// Draws one line of text.
    pub fn text(&mut self, text: &str, label: Label) {
        // The backend divides font sizes by 1.24.
        let size = label.size * UNITS_PER_PIXEL * 1.24;
        let mut font = ("sans-serif", size).into_font();
        if label.upwards {
            font = font.transform(FontTransform::Rotate270);
        }
        let style = TextStyle::from(font)
            .color(&label.colour)
            .pos(Pos::new(label.h, label.v));
        let result = self.backend.draw_text(text, &style, fine(label.at));
        self.keep(result);
    }

    /// Draws a text of the size of tick labels to the right of a place.
    pub fn text_beside(&mut self, text: &str, x: f64, y: f64) {
        self.text(
            text,
            Label {
                size: super::TICK_SIZE,
                h: HPos::Left,
                ..Label::new(x, y)
            },
        );
    }

    fn circle(&mut self, centre: Point, radius: f64, style: ShapeStyle, fill: bool) {
        let result =
            self.backend
                .draw_circle(fine(centre), units(radius).max(1) as u32, &style, fill);
        self.keep(result);
    }

    fn keep<E: std::error::Error + Send + Sync + 'static>(&mut self, result: Result<(), E>) {
        if let Err(error) = result {
            self.error.get_or_insert(io::Error::other(error));
        }
    }
}

/// Simplifies a line by the algorithm of Ramer, Douglas and Peucker. Appends the points after the
/// first that are needed.
fn simplify(path: &[Point], kept: &mut Vec<Point>) {
    /// Tolerance in pixels.
    const TOLERANCE: f64 = 0.2;
    let (a, b) = (path[0], path[path.len() - 1]);
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let square = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
    // Squares of distances.
    let (mut farthest, mut worst) = (0, TOLERANCE * TOLERANCE);
    for (i, p) in path.iter().enumerate() {
        let along = (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / square).clamp(0.0, 1.0);
        let off = (p.0 - a.0 - along * dx).powi(2) + (p.1 - a.1 - along * dy).powi(2);
        if off > worst {
            (farthest, worst) = (i, off);
        }
    }
    if farthest == 0 {
        kept.push(b);
    } else {
        simplify(&path[..=farthest], kept);
        simplify(&path[farthest..], kept);
    }
}

fn stroke(colour: RGBColor, width: f64) -> ShapeStyle {
    ShapeStyle {
        color: colour.to_rgba(),
        filled: false,
        stroke_width: units(width) as u32,
    }
}

fn fine(point: Point) -> (i32, i32) {
    (units(point.0), units(point.1))
}

fn units(pixels: f64) -> i32 {
    (pixels * UNITS_PER_PIXEL).round() as i32
}
