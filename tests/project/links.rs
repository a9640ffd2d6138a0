//! Tests of the links of README and chapters, as read in the repository, in the packaged crate and
//! in the built documentation. rustdoc itself checks the links of the documentation to items.

use std::fs;
use std::path::{Path, PathBuf};

/// Root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// Files with links, relative to the root.
fn files() -> Vec<String> {
    let chapters = fs::read_dir(root().join("docs"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name());
    let chapters = chapters
        .map(|name| format!("docs/{}", name.to_str().unwrap()))
        .filter(|name| name.ends_with(".md"));
    let others = [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "benches/peers/README.md",
    ];
    chapters.chain(others.map(String::from)).collect()
}

/// Lines of a text outside of blocks of code.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// Targets of the links within a text.
fn inline(text: &str) -> Vec<String> {
    let text: Vec<&str> = prose(text).collect();
    let text = text.join("\n");
    let targets = text
        .split("](")
        .skip(1)
        .map(|rest| rest.split(')').next().unwrap().to_owned());
    // Formulas contain brackets, too.
    targets
        .filter(|target| target.contains(['.', '#', ':']))
        .collect()
}

/// Labels and targets of the definitions of links.
fn definitions(text: &str) -> Vec<(String, String)> {
    let parts = prose(text).filter_map(|line| line.strip_prefix('[')?.split_once("]: "));
    parts
        .map(|(label, target)| (label.to_owned(), target.to_owned()))
        .collect()
}

/// Anchors of the headings of a text, as GitHub and rustdoc form them.
fn anchors(text: &str) -> Vec<String> {
    let headings = prose(text)
        .filter(|line| line.starts_with('#'))
        .map(|line| line.trim_start_matches('#').trim());
    let letter = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    headings
        .map(|heading| {
            heading
                .to_lowercase()
                .replace(' ', "-")
                .chars()
                .filter(|c| letter(*c))
                .collect()
        })
        .collect()
}

/// Beginnings of the names of files in the packaged crate. Cargo leaves out folders that are
/// packages themselves.
fn packaged() -> Vec<String> {
    let manifest = read("Cargo.toml");
    let list = manifest
        .split("include = [")
        .nth(1)
        .unwrap()
        .split("\n]")
        .next()
        .unwrap();
    list.lines()
        .filter_map(|line| {
            Some(
                line.trim()
                    .strip_prefix("\"/")?
                    .trim_end_matches("\",")
                    .to_owned(),
            )
        })
        .collect()
}

#[test]
fn links_lead_to_files_and_headings_in_the_repository_and_in_the_packaged_crate() {
    let (mut count, packaged) = (0, packaged());
    let is_packaged = |file: &str| {
        packaged
            .iter()
            .any(|start| Path::new(file).starts_with(start))
    };
    for file in files() {
        let text = read(&file);
        let folder = Path::new(&file).parent().unwrap();
        for target in inline(&text)
            .into_iter()
            .chain(definitions(&text).into_iter().map(|(_, target)| target))
        {
            if target.starts_with("https://") {
                continue;
            }
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let mut found = if path.is_empty() {
                PathBuf::from(&file)
            } else {
                folder.join(path)
            };
            if let Ok(rest) = found
                .strip_prefix("docs/..")
                .or(found.strip_prefix("benches/peers/../.."))
            {
                found = rest.into();
            }
            let found = found.to_str().unwrap();
            assert!(root().join(found).exists(), "{file}: no file {target}");
            assert!(
                anchor.is_empty() || anchors(&read(found)).iter().any(|a| a == anchor),
                "{file}: no {target}"
            );
            assert!(
                !is_packaged(&file) || is_packaged(found),
                "{file}: {target} is not packaged"
            );
            count += 1;
        }
    }
    assert!(count > 200, "only {count} links were read");
}

#[test]
fn definitions_of_links_to_items_name_the_file_of_the_item() {
    for file in files() {
        for (label, target) in definitions(&read(&file)) {
            let Some(path) = label
                .strip_prefix('`')
                .and_then(|label| label.strip_suffix('`'))
            else {
                continue;
            };
            let text = read(target.trim_start_matches("../"));
            let name = path.rsplit("::").next().unwrap();
            assert!(
                text.contains(name) || target.contains(name),
                "{file}: {target} does not contain {path}"
            );
        }
    }
}

#[test]
fn chapters_of_the_documentation_have_no_links_to_files() {
    let (guide, links) = (read("src/guide.rs"), read("src/links.md"));
    let chapters: Vec<&str> = guide
        .split("chapter!(\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    assert!(chapters.len() >= 14, "{chapters:?}");
    for file in chapters {
        let text = read(file);
        for target in inline(&text) {
            assert!(
                target.starts_with("https://") || target.starts_with('#'),
                "{file}: {target}"
            );
        }
        for (label, _) in definitions(&text) {
            let defined = links
                .lines()
                .any(|line| line.starts_with(&format!("[{label}]: ")));
            assert!(defined, "{file}: src/links.md does not define [{label}]");
        }
    }
}
