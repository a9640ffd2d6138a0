//! Tests of the program `sweep` on the command line: interrupted and resumed sweeps, sweeps in
//! parts, invalid files and options.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Command for a sweep over a small grid: eight rows of four shoots, simulated for an hour.
fn sweep(out: &Path, options: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sweep"));
    command.args([
        "--lengths",
        "4",
        "--etas",
        "8",
        "--hours",
        "1",
        "--elements",
        "4",
        "--eta-from",
        "20",
    ]);
    command
        .args(options)
        .arg("--out")
        .arg(out)
        .stdin(Stdio::null());
    command
}

fn run(out: &Path, options: &[&str]) -> Output {
    sweep(out, options).output().unwrap()
}

/// Runs a sweep that must succeed.
fn succeed(out: &Path, options: &[&str]) {
    let end = run(out, options);
    assert!(
        end.status.success(),
        "{options:?}: {}",
        String::from_utf8_lossy(&end.stderr)
    );
}

/// Runs a sweep that must fail, and returns its error message.
fn fail(out: &Path, options: &[&str]) -> String {
    let end = run(out, options);
    let message = String::from_utf8_lossy(&end.stderr).into_owned();
    assert!(!end.status.success(), "{options:?} succeeded");
    assert!(
        message.starts_with("error: ") && !message.contains("panicked"),
        "{message}"
    );
    message
}

/// Contents of the table and of the picture.
fn results(out: &Path) -> [Vec<u8>; 2] {
    ["sweep.csv", "sweep.svg"].map(|name| fs::read(out.join(name)).unwrap())
}

/// Number of complete row files.
fn rows(out: &Path) -> usize {
    let names = fs::read_dir(out.join("rows"))
        .map(|all| all.map(|entry| entry.unwrap().file_name()))
        .into_iter();
    names
        .flatten()
        .filter(|name| name.to_string_lossy().starts_with("row-"))
        .count()
}

#[test]
fn results_do_not_depend_on_threads_or_parts() {
    let whole = folder("whole");
    succeed(&whole, &["--threads", "1"]);
    let expected = results(&whole);
    // The table has 33 lines: a header, and eight rows of four shoots.
    assert_eq!(
        expected[0].iter().filter(|byte| **byte == b'\n').count(),
        33
    );

    let threads = folder("threads");
    succeed(&threads, &["--threads", "3"]);
    assert!(results(&threads) == expected, "three threads");

    let parts = folder("parts");
    for part in ["2/3", "1/3"] {
        succeed(&parts, &["--shard", part]);
    }
    let message = fail(&parts, &["--merge"]);
    assert!(
        message.contains("2 of 8 rows are missing: 3, 6"),
        "{message}"
    );
    assert!(!parts.join("sweep.csv").exists());
    // A different division into parts computes the missing rows.
    succeed(&parts, &["--shard", "1/1"]);
    succeed(&parts, &["--merge"]);
    assert!(results(&parts) == expected, "parts");
}

#[test]
fn killed_sweep_resumes_to_the_results_of_an_uninterrupted_sweep() {
    let whole = folder("uninterrupted");
    succeed(&whole, &[]);
    let expected = results(&whole);

    let killed = folder("killed");
    // Random delays by a linear congruential generator (Knuth, The Art of Computer Programming 2,
    // 3.3.4). The seed is taken from the clock, so that the delays differ in every run.
    let mut seed = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap()
        .subsec_nanos() as u64;
    let mut kills = Vec::new();
    while rows(&killed) < 8 && kills.len() < 30 {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let delay = Duration::from_millis(seed >> 32 & 0x1f);
        let mut child = sweep(&killed, &["--threads", "1"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(delay);
        child.kill().unwrap();
        let _ = child.wait().unwrap();
        kills.push((delay, rows(&killed)));
    }
    // All files in the folder are valid, so that this run succeeds and keeps the existing rows.
    succeed(&killed, &[]);
    assert!(
        results(&killed) == expected,
        "killed at (delay, number of rows) {kills:?}"
    );
    assert!(
        kills.len() > 1,
        "the sweep ended before it was killed twice: {kills:?}"
    );
}

#[test]
fn existing_rows_are_not_computed_again() {
    let out = folder("skipped");
    succeed(&out, &["--shard", "1/2"]);
    let end = run(&out, &[]);
    let text = String::from_utf8(end.stdout).unwrap();
    assert!(
        text.contains("4 of 8 rows are there already") && text.contains("16 shoots on"),
        "{text}"
    );
}

#[test]
fn invalid_row_files_are_refused_and_kept() {
    let out = folder("invalid");
    succeed(&out, &[]);
    let file = out.join("rows/row-0007.csv");
    let valid = fs::read(&file).unwrap();
    let mut changed = valid.clone();
    changed[valid.len() / 2] ^= 4;
    let invalid: [(&str, &[u8]); 5] = [
        ("cut short", &valid[..valid.len() / 2]),
        ("damaged", &changed),
        ("not a row of a sweep", b""),
        ("not text", &[0xff; 100]),
        (
            "has format",
            &String::from_utf8(valid.clone())
                .unwrap()
                .replace("format 1", "format 7")
                .into_bytes(),
        ),
    ];
    for (reason, bytes) in invalid {
        fs::write(&file, bytes).unwrap();
        for options in [&[][..], &["--merge"], &["--shard", "7/8"]] {
            let message = fail(&out, options);
            assert!(
                message.contains("row-0007.csv") && message.contains(reason),
                "{message}"
            );
        }
        assert_eq!(
            fs::read(&file).unwrap(),
            bytes,
            "{reason}: the file has changed"
        );
    }
    // A row of another position in the grid and a row of a sweep with other settings are rejected.
    fs::copy(out.join("rows/row-0008.csv"), &file).unwrap();
    let message = fail(&out, &[]);
    assert!(
        message.contains("row-0007.csv") && message.contains("row: 8 of 8"),
        "{message}"
    );
    fs::write(&file, &valid).unwrap();
    let before = results(&out);
    let message = fail(&out, &["--beta", "1.5"]);
    assert!(
        message.contains("row-0001.csv") && message.contains("gravitropic sensitivity: 1.5e0"),
        "{message}"
    );
    assert!(results(&out) == before && rows(&out) == 8);
    succeed(&out, &["--merge"]);
}

#[test]
fn invalid_options_are_refused_by_name() {
    let out = folder("refused");
    for part in ["0/4", "5/4", "a/b", "4", "1/0"] {
        let message = fail(&out, &["--shard", part]);
        assert!(
            message.contains(&format!("--shard has the value '{part}'"))
                && message.contains("1 <= i <= n"),
            "{message}"
        );
    }
    let message = fail(&out, &["--shard", "1/2", "--merge"]);
    assert!(
        message.contains("--merge") && message.contains("--shard"),
        "{message}"
    );
    for (option, value) in [
        ("--etas", "1"),
        ("--length-to", "3"),
        ("--threads", "0"),
        ("--hours", "nan"),
    ] {
        let message = fail(&out, &[option, value]);
        assert!(message.contains(option), "{message}");
    }
    assert_eq!(rows(&out), 0);
}

/// An output that nobody reads and one that is full.
#[cfg(target_os = "linux")]
#[test]
fn closed_and_full_outputs_end_without_a_panic() {
    let out = folder("outputs");
    // The other end of the pipe is closed before the program writes.
    let mut child = sweep(&out, &[])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let end = child.wait_with_output().unwrap();
    assert!(
        end.status.success() && end.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&end.stderr)
    );
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let end = sweep(&out, &[])
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    let message = String::from_utf8(end.stderr).unwrap();
    assert!(
        !end.status.success() && message.lines().count() == 1,
        "{message}"
    );
    assert!(
        message.starts_with("error: the standard output"),
        "{message}"
    );
}
