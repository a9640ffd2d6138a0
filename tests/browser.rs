//! Test program that opens films and the live page in headless Chromium and checks their contents.
//!
//! ```sh
//! cargo run --release --example growing_shoot -- --film
//! cargo run --release --example live_page
//! cargo run --release -p morphorod-tests --bin browser -- --pages target/out \
//!     --tip "$(cargo run --release --example live_page -- --tip 2)"
//! ```
//!
//! The program opens each film at three times. It checks that the images are not empty, that they
//! differ, and that the console is empty. The live page simulates two hours. Its tip position must
//! agree with the result of the native program, a slider must change it, and the simulation must be
//! sufficiently fast. A shoot that grows beside a pole must touch it without an overlap. A
//! simulated user (`tests/browser/user.js`) must catch the moving tip with a reaction time of 250
//! ms. If Chromium is not installed, the program reports this and returns no error.

use std::error::Error;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use morphorod_plot::{Opt, Options, finish};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// Upper limits of the size of a film and of the live page, bytes.
const FILM: u64 = 3_000_000;
const LIVE: u64 = 2_500_000;
/// Simulated time of the live page (h), upper limit of the distance between its tip and that of the
/// native program (m), and lower limit of its simulation speed (simulated hours per second). The
/// two programs differ only in the mathematical functions.
const HOURS: f64 = 2.0;
const SAME_TIP: f64 = 1e-9;
const SPEED: f64 = 10.0;
/// Largest gap and largest overlap (m) of a pole and a shoot that touch: 1e-5 of the length, as in
/// the tests of contacts. A shoot that passes through the pole has an overlap of millimetres.
const GAP: f64 = 1e-6;
/// Script of a simulated user who catches the tip, the smallest number of tries, and the smallest
/// number of successes.
const USER: &str = include_str!("browser/user.js");
const TRIES: f64 = 20.0;
const CAUGHT: f64 = 18.0;
/// Colour of the growth zone. At least `DRAWN` of the 800 000 pixels must have this colour, and at
/// least `MOVED` pixels must gain or lose it between two times. The legend has about `DRAWN`/3
/// pixels of this colour.
const ZONE: [u8; 3] = [0, 158, 115];
const DRAWN: usize = 300;
const MOVED: usize = 100;

fn run() -> Outcome {
    let about = "opens films and the live page in headless Chromium, and looks at what they show";
    let command = "cargo run --release -p morphorod-tests --bin browser";
    let options = Options::parse_for(
        command,
        "browser",
        about,
        &[
            Opt::value(
                "pages",
                "DIR",
                "target/out",
                "folder in which films, film*.html, and live.html are looked for",
            ),
            Opt::value(
                "tip",
                "'X Y Z'",
                "",
                "the tip that the live page must reach in 2 h, m: what `live_page --tip 2` prints",
            ),
        ],
    );
    let Some(browser) = Browser::installed(options.out_dir()) else {
        println!("skipped: Chromium is not installed");
        return Ok(());
    };
    let (mut films, mut lives) = (Vec::new(), Vec::new());
    find(Path::new(options.text("pages")), &mut |file| match file
        .file_name()
        .and_then(|name| name.to_str())
    {
        Some(name) if name.starts_with("film") && name.ends_with(".html") => {
            films.push(file.to_path_buf())
        }
        Some("live.html") => lives.push(file.to_path_buf()),
        _ => {}
    })?;
    if films.is_empty() && lives.is_empty() {
        return Err(format!("no film or live.html in {}", options.text("pages")).into());
    }
    for film in &films {
        let last =
            check_film(&browser, film).map_err(|error| format!("{}: {error}", film.display()))?;
        println!("{}: plays, {last} h", film.display());
    }
    for live in &lives {
        let said = check_live(&browser, live, options.text("tip"));
        println!(
            "{}: {}",
            live.display(),
            said.map_err(|error| format!("{}: {error}", live.display()))?
        );
    }
    Ok(())
}

/// Calls `visit` for all files of a folder and of its subfolders.
fn find(folder: &Path, visit: &mut impl FnMut(&Path)) -> Outcome {
    let mut entries: Vec<_> = fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(fs::DirEntry::path);
    for entry in entries {
        if entry.file_type()?.is_dir() {
            find(&entry.path(), visit)?
        } else {
            visit(&entry.path())
        }
    }
    Ok(())
}

/// Returns the text of a page, or an error if the page is too large or loads other files.
fn check_page(file: &Path, most: u64) -> Outcome<String> {
    let (size, page) = (fs::metadata(file)?.len(), fs::read_to_string(file)?);
    if size >= most {
        return Err(format!("{size} bytes are more than {most}").into());
    }
    match ["http:", "https:", "src=", "@import"]
        .iter()
        .find(|word| page.contains(*word))
    {
        Some(word) => Err(format!("it may ask for something from elsewhere: '{word}'").into()),
        None => Ok(page),
    }
}

fn check_film(browser: &Browser, file: &Path) -> Outcome<f64> {
    let page = check_page(file, FILM)?;
    let times = page
        .split("\"times\":[")
        .nth(1)
        .and_then(|rest| rest.split(']').next())
        .ok_or("no times")?;
    let last: f64 = times.rsplit(',').next().ok_or("no times")?.parse()?;
    let mut before: Option<Vec<bool>> = None;
    for part in [0.1, 0.5, 1.0] {
        let seen = browser.screenshot(file, &format!("t={}", part * last))?;
        let zone: Vec<bool> = seen.chunks(3).map(|pixel| pixel == ZONE).collect();
        let drawn = zone.iter().filter(|is| **is).count();
        if drawn < DRAWN {
            return Err(format!("{drawn} pixels of a growth zone at {} h", part * last).into());
        }
        if let Some(before) = before.replace(zone.clone()) {
            let moved = before.iter().zip(&zone).filter(|(a, b)| a != b).count();
            if moved < MOVED {
                return Err(format!(
                    "only {moved} pixels of the growth zone move up to {} h",
                    part * last
                )
                .into());
            }
        }
    }
    Ok(last)
}

fn check_live(browser: &Browser, file: &Path, tip: &str) -> Outcome<String> {
    let page = check_page(file, LIVE)?;
    let native: Vec<f64> = tip
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    if native.len() != 3 {
        return Err("--tip is needed: what `live_page --tip 2` prints".into());
    }
    // The script of the simulated user is added to a copy of the page.
    let with_user = browser.out.join("live_with_user.html");
    fs::write(
        &with_user,
        page.replace("</body>", &format!("<script>{USER}</script></body>")),
    )?;
    let dom = browser.dom(&with_user, &format!("check={HOURS}"))?;
    let list = |name: &str| -> Outcome<Vec<f64>> {
        let rest = dom
            .split(&format!("\"{name}\":"))
            .nth(1)
            .ok_or_else(|| format!("the page wrote no '{name}'"))?;
        let text = rest
            .trim_start_matches('[')
            .split([']', '}'])
            .next()
            .unwrap_or_default();
        let numbers = text.split(',').take_while(|word| !word.starts_with('"'));
        Ok(numbers.map(str::parse).collect::<Result<_, _>>()?)
    };
    let distance = |a: &[f64]| {
        a.iter()
            .zip(&native)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let (off, moved, speed) = (
        distance(&list("tip")?),
        distance(&list("moved")?),
        list("perSecond")?[0],
    );
    if !(off < SAME_TIP) {
        return Err(format!("its tip is {off:e} m from that of this machine").into());
    }
    if !(moved > SAME_TIP.sqrt()) {
        return Err(format!("a slider that is moved changes the tip by {moved:e} m only").into());
    }
    if !(speed > SPEED) {
        return Err(format!("it simulates {speed:.1} h in a second").into());
    }
    let (gap, frames) = (list("gap")?[0], list("framesPerSecond")?[0]);
    if !(gap.abs() <= GAP) {
        return Err(format!(
            "the smallest gap between a pole and a shoot that touches it is {gap:e} m"
        )
        .into());
    }
    let (caught, tries) = (list("caught")?[0], list("tries")?[0]);
    if !(tries >= TRIES && caught >= CAUGHT) {
        return Err(format!(
            "a user who needs 250 ms catches the tip in {caught} of {tries} tries"
        )
        .into());
    }
    let same =
        format!("tip {off:.0e} m from that of this machine, {speed:.0} h simulated in a second");
    let pole = format!("{frames:.0} frames in a second at a pole");
    Ok(format!(
        "{same}, {pole}, tip caught in {caught} of {tries} tries"
    ))
}

/// Headless Chromium.
struct Browser {
    program: &'static str,
    out: PathBuf,
}

impl Browser {
    /// First installed browser of a list of names. `None` if no browser is installed.
    fn installed(out: PathBuf) -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let answers = |name: &&str| {
            Command::new(name)
                .arg("--version")
                .output()
                .is_ok_and(|out| out.status.success())
        };
        Some(Self {
            program: names.into_iter().find(answers)?,
            out,
        })
    }

    /// Opens a page at `#place` with the option `what`. Returns an error if the page writes to the
    /// console.
    fn open(&self, page: &Path, place: &str, what: &str) -> Outcome<Output> {
        let profile = fs::canonicalize(&self.out)?.join("profile");
        let url = format!("file://{}#{place}", fs::canonicalize(page)?.display());
        let output = Command::new(self.program)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--no-first-run",
                "--disable-background-networking",
            ])
            .args([
                "--hide-scrollbars",
                "--window-size=1000,800",
                "--enable-logging=stderr",
                what,
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg(url)
            .output()?;
        let log = String::from_utf8_lossy(&output.stderr);
        match log.lines().find(|line| line.contains("CONSOLE")) {
            Some(line) => Err(format!("the console says: {line}").into()),
            None => Ok(output),
        }
    }

    fn dom(&self, page: &Path, place: &str) -> Outcome<String> {
        Ok(String::from_utf8(
            self.open(page, place, "--dump-dom")?.stdout,
        )?)
    }

    /// Screenshot of a page: red, green and blue values of all pixels, row by row.
    fn screenshot(&self, page: &Path, place: &str) -> Outcome<Vec<u8>> {
        let file = fs::canonicalize(&self.out)?.join("seen.png");
        // A previous screenshot is removed, so that it cannot be mistaken for the new one.
        let _ = fs::remove_file(&file);
        self.open(page, place, &format!("--screenshot={}", file.display()))?;
        let mut decoder = png::Decoder::new(BufReader::new(File::open(&file)?));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info()?;
        let mut bytes = vec![
            0;
            reader
                .output_buffer_size()
                .ok_or("a picture that is too large")?
        ];
        let info = reader.next_frame(&mut bytes)?;
        let samples = info.color_type.samples();
        Ok(bytes[..info.buffer_size()]
            .chunks(samples)
            .flat_map(|pixel| pixel[..3.min(samples)].to_vec())
            .collect())
    }
}

fn main() -> ExitCode {
    finish(run())
}
