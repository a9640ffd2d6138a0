//! Every test and every benchmark is in the manifest: Cargo runs what stands there, and looks for no other.

use std::fs;
use std::path::Path;

#[test]
fn every_file_is_in_the_manifest() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = fs::read_to_string(tests.join("Cargo.toml")).unwrap();
    for (folder, place) in [(tests.to_owned(), ""), (tests.join("../benches"), "../benches/")] {
        let mut files = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".rs") {
                let line = format!("path = \"{place}{name}\"");
                assert!(manifest.lines().any(|found| found == line), "tests/Cargo.toml has no line {line}");
                files += 1;
            }
        }
        assert!(files > 0, "no files in {place}");
    }
}
