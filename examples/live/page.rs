//! HTML page that simulates a shoot, with sliders for its parameters. The user can tilt the base,
//! apply a force to the tip, and drag a pole into the path of the shoot.
//!
//! The shoot of `examples/live/shoot.rs` is compiled to WebAssembly and embedded in one HTML file,
//! which needs no network.
//!
//! # What to see
//! Select the preset of the second video and simulate a day. Large oscillations due to the delays
//! replace the small circles due to the oscillator. Then halve the reaction time. Within half a
//! day, the large oscillations decay, and only those due to the oscillator remain. From about 55 h
//! on, the shoot is long enough to oscillate again, with a period of 65 min.
//!
//! # What to try
//! Select the preset of the fourth video, set the length to 6.4 cm and restart. The oscillation
//! after the two pulses decays. At 6.5 cm, it persists. The critical length with statoliths is 6.46
//! cm; the orange line of the scale shows it.

mod compress;
// This program uses only the part of the modules that is needed for the option `--tip`.
#[allow(dead_code)]
mod pole;
#[allow(dead_code)]
mod shoot;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use compress::compressed;
use morphorod_plot::file::write_whole;
use morphorod_plot::film::{SCENE, STYLE, base64, fill};
use morphorod_plot::{Opt, Options, println};
use shoot::Live;

const TARGET: &str = "wasm32-unknown-unknown";

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "live_page",
        "a page in which a shoot runs, for a browser without a network",
        &[Opt::value(
            "tip",
            "H",
            "",
            "only print the tip (m) after so many hours, as this machine computes it: a check of the page",
        )],
    );
    if options.flag("tip") {
        let hours = options.positive("tip");
        let mut live = Live::new()?;
        for _ in 0..(30.0 * hours).round() as usize {
            live.advance(120.0)?;
        }
        let tip = live.tip();
        println!("{:e} {:e} {:e}", tip.x, tip.y, tip.z);
        return Ok(());
    }
    let wasm = std::fs::read(compiled()?)?;
    let page = fill(
        include_str!("page.html"),
        &[
            ("css", STYLE),
            ("size", &wasm.len().to_string()),
            ("wasm", &base64(&compressed(&wasm))),
            ("scene", SCENE),
            ("hand", include_str!("hand.js")),
            ("pole", include_str!("pole.js")),
            ("panel", include_str!("panel.js")),
            ("live", include_str!("live.js")),
        ],
    );
    let file = options.out_dir().join("live.html");
    write_whole(&file, &page)?;
    println!(
        "{} ({:.2} MB) plays in a browser",
        file.display(),
        page.len() as f64 / 1e6
    );
    Ok(())
}

/// Compiles the shoot to WebAssembly and returns the path of the file.
fn compiled() -> Result<PathBuf, Box<dyn Error>> {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    // The page does not need the names of the functions.
    let arguments = [
        "build",
        "--release",
        "--config",
        "profile.release.strip=true",
        "--example",
        "live",
        "--target",
        TARGET,
    ];
    let status = Command::new(cargo)
        .args(arguments)
        .current_dir(home)
        .status()?;
    if !status.success() {
        let what = format!(
            "the shoot was not compiled for {TARGET}; if the target is missing, `rustup target add {TARGET}`"
        );
        return Err(what.into());
    }
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| home.join("target"), PathBuf::from);
    Ok(target.join(TARGET).join("release/examples/live.wasm"))
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
