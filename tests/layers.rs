//! The layers of `ARCHITECTURE.md`: a module imports only from below, and files of one folder import each other in no
//! circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// From the ground up; modules of one line do not know each other.
const LAYERS: [&[&str]; 9] = [
    &["error", "pointers", "quadrature", "so3"],
    &["reference_element", "scene"],
    &["rod"],
    &["constitutive", "growth", "load", "tropism"],
    &["equilibrium", "sensing"],
    &["model", "state"],
    &["shoot"],
    &["integrator", "stability"],
    &["guide"],
];

/// All files of the library, with their code up to the unit tests, without comments.
fn sources() -> Vec<(PathBuf, String)> {
    let (mut folders, mut found) = (vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let text = fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]").next().unwrap();
                let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
                found.push((path, code.collect::<Vec<_>>().join("\n")));
            }
        }
    }
    found
}

/// The words that follow `prefix`, each up to the first character that no name has; of a list in braces, its lower-case
/// names.
fn names_after(code: &str, prefix: &str) -> BTreeSet<String> {
    let name = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut found = BTreeSet::new();
    for rest in code.split(prefix).skip(1) {
        match rest.strip_prefix('{') {
            Some(list) => found.extend(list.split('}').next().unwrap().split(',').map(|item| name(item.trim()))),
            None => _ = found.insert(name(rest)),
        }
    }
    found.retain(|name| name.starts_with(|c: char| c.is_lowercase()));
    found
}

/// The module of a file: its folder under `src`, or its name.
fn module(path: &Path) -> String {
    let inside = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap();
    inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs").to_owned()
}

#[test]
fn modules_import_from_below() {
    let layer = |name: &str| LAYERS.iter().position(|layer| layer.contains(&name));
    let mut arrows = 0;
    for (path, code) in sources() {
        let from = module(&path);
        if from == "lib" {
            continue;
        }
        let floor = layer(&from).unwrap_or_else(|| panic!("{from} is in no layer"));
        for to in names_after(&code, "crate::").into_iter().filter(|to| *to != from) {
            let below = layer(&to).unwrap_or_else(|| panic!("{}: crate::{to} is in no layer", path.display()));
            assert!(below < floor, "{} imports {to}, which does not lie below {from}", path.display());
            arrows += 1;
        }
    }
    assert!(arrows > 100, "only {arrows} imports were read");
}

#[test]
fn files_of_a_folder_import_each_other_in_no_circle() {
    let mut imports: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
    for (path, code) in sources() {
        let siblings = names_after(&code, "super::").into_iter().map(|name| path.with_file_name(name + ".rs"));
        imports.insert(path.clone(), siblings.filter(|sibling| sibling.exists() && *sibling != path).collect());
    }
    // Files that import nothing that is left are taken away until none can be.
    loop {
        let free: Vec<PathBuf> = imports.iter().filter(|(_, to)| to.is_empty()).map(|(path, _)| path.clone()).collect();
        if free.is_empty() {
            break;
        }
        for path in free {
            imports.remove(&path);
            imports.values_mut().for_each(|to| _ = to.remove(&path));
        }
    }
    assert!(imports.is_empty(), "circles among {:?}", imports.keys());
}
