//! Tests that all files are compiled. Cargo ignores files without an entry in a manifest or a module
//! declaration.

use std::fs;
use std::path::{Path, PathBuf};

/// Rust files and subfolders of a folder, each with its name without extension.
fn entries(folder: &Path) -> Vec<(PathBuf, String)> {
    let paths = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let rust =
        paths.filter(|path| path.is_dir() || path.extension().is_some_and(|ending| ending == "rs"));
    rust.map(|path| {
        (
            path.clone(),
            path.file_stem().unwrap().to_str().unwrap().to_owned(),
        )
    })
    .collect()
}

/// Fails unless every file below `folder` is declared in the module `parent` or in a module that it
/// declares. Returns the number of files.
fn check_modules(folder: &Path, parent: &Path) -> usize {
    let declared = fs::read_to_string(parent).unwrap();
    let mut files = 0;
    for (path, name) in entries(folder) {
        // These entries are crate roots of other programs, or contain data.
        if path == parent || ["lib", "browser", "reference"].contains(&&*name) {
            continue;
        }
        let found = declared
            .lines()
            .any(|line| line.trim_start_matches("pub ") == format!("mod {name};"));
        assert!(found, "{} has no line `mod {name};`", parent.display());
        files += if path.is_dir() {
            check_modules(&path, &path.join("mod.rs"))
        } else {
            1
        };
    }
    files
}

#[test]
fn every_file_of_tests_is_compiled() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    assert!(check_modules(tests, &tests.join("main.rs")) > 50);
}

#[test]
fn every_benchmark_is_in_the_manifest() {
    let benches = Path::new(env!("CARGO_MANIFEST_DIR")).join("../benches");
    let manifest = fs::read_to_string(benches.join("Cargo.toml")).unwrap();
    let files: Vec<_> = entries(&benches)
        .into_iter()
        .filter(|(path, _)| path.is_file())
        .collect();
    assert!(!files.is_empty());
    for (_, name) in files {
        assert!(
            manifest.contains(&format!("path = \"{name}.rs\"")),
            "benches/Cargo.toml does not name {name}.rs"
        );
    }
}

/// The macro of the standard library panics if the output is closed or full.
#[test]
fn examples_print_by_the_macro_of_morphorod_plot() {
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples")];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for (path, name) in entries(&folder)
            .into_iter()
            .filter(|(_, name)| name != "plot")
        {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            let code: String = text
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"))
                .collect();
            let imports = code
                .split("use morphorod_plot::")
                .skip(1)
                .map(|rest| rest.split(';').next().unwrap());
            let imported = imports.into_iter().any(|list| list.contains("println"));
            assert!(
                imported || !code.contains("println!("),
                "{} does not import println",
                path.display()
            );
            assert!(
                !code.replace("println!(", "").contains("print!("),
                "{name} calls print!"
            );
            files += 1;
        }
    }
    assert!(files > 50, "only {files} files were read");
}
