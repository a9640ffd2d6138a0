//! Tests of the layers of `ARCHITECTURE.md`. A module imports only from lower layers, and imports
//! within a folder have no cycles.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the lowest to the highest layer. Modules of one layer do not import each other.
const LAYERS: [&[&str]; 14] = [
    &["compositions", "error", "numerics", "pointers", "so3"],
    &["reference_element", "scene", "section"],
    &["support"],
    &["rod"],
    &["constitutive", "growth", "load", "tropism"],
    &["check"],
    &["equilibrium", "profile", "sensing", "tracking"],
    &["model", "state"],
    &["checkpoint", "shoot"],
    &["linearisation"],
    &["integrator", "stability"],
    &["cycle", "ensemble"],
    &["fit"],
    &["guide"],
];

/// Paths of all files of the library with their code. Comments and unit tests at the end of a file
/// are removed.
fn sources() -> Vec<(PathBuf, String)> {
    let (mut folders, mut found) = (
        vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../src")],
        Vec::new(),
    );
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|kind| kind == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]").next().unwrap();
                let code = code
                    .lines()
                    .filter(|line| !line.trim_start().starts_with("//"));
                found.push((path, code.collect::<Vec<_>>().join("\n")));
            }
        }
    }
    found
}

/// Identifiers that follow `prefix`. For a list in braces the result contains the first identifier
/// of each item.
fn names_after(code: &str, prefix: &str) -> BTreeSet<String> {
    let name = |text: &str| {
        text.chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect::<String>()
    };
    let mut found = BTreeSet::new();
    for rest in code.split(prefix).skip(1) {
        let Some(list) = rest.strip_prefix('{') else {
            found.insert(name(rest));
            continue;
        };
        // Text in nested braces is part of the preceding item and is skipped.
        let (mut depth, mut item) = (0, String::new());
        for c in list.chars() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => _ = found.insert(name(std::mem::take(&mut item).trim())),
                _ if depth == 0 => item.push(c),
                _ => {}
            }
        }
        found.insert(name(item.trim()));
    }
    found.remove("");
    found
}

/// Map from each name that `mod.rs` of a folder re-exports to the file that defines it.
fn reexported(folder: &Path) -> BTreeMap<String, PathBuf> {
    let text = fs::read_to_string(folder.join("mod.rs")).unwrap_or_default();
    let mut found = BTreeMap::new();
    for rest in text.split("use ").skip(1) {
        let (file, names) = rest
            .split(';')
            .next()
            .unwrap()
            .split_once("::")
            .unwrap_or_default();
        let path = folder.join(file.to_owned() + ".rs");
        if path.exists() {
            found.extend(
                names_after(&format!("::{names}"), "::")
                    .into_iter()
                    .map(|name| (name, path.clone())),
            );
        }
    }
    found
}

/// Name of the module of a file: the folder in `src`, or the file name without extension.
fn module(path: &Path) -> String {
    let inside = path
        .strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("../src"))
        .unwrap();
    inside
        .iter()
        .next()
        .unwrap()
        .to_str()
        .unwrap()
        .trim_end_matches(".rs")
        .to_owned()
}

#[test]
fn modules_import_only_from_lower_layers() {
    let layer = |name: &str| LAYERS.iter().position(|layer| layer.contains(&name));
    let mut imports = 0;
    for (path, code) in sources() {
        let from = module(&path);
        if from == "lib" {
            continue;
        }
        let own = layer(&from).unwrap_or_else(|| panic!("{from} is in no layer"));
        let lower = |name: &String| name.starts_with(|c: char| c.is_lowercase());
        for to in names_after(&code, "crate::")
            .into_iter()
            .filter(|to| lower(to) && *to != from)
        {
            let below = layer(&to)
                .unwrap_or_else(|| panic!("{}: crate::{to} is in no layer", path.display()));
            assert!(
                below < own,
                "{} imports {to}, which is not in a lower layer than {from}",
                path.display()
            );
            imports += 1;
        }
    }
    assert!(imports > 100, "only {imports} imports were read");
}

#[test]
fn imports_between_files_of_a_folder_have_no_cycles() {
    let mut imports: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
    for (path, code) in sources() {
        // A name is either the name of a file or is re-exported by `mod.rs` from a file.
        let exported = reexported(path.parent().unwrap());
        let sibling = |name: String| match exported.get(&name) {
            Some(file) => file.clone(),
            None => path.with_file_name(name + ".rs"),
        };
        let siblings = names_after(&code, "super::").into_iter().map(sibling);
        imports.insert(
            path.clone(),
            siblings
                .filter(|file| file.exists() && *file != path)
                .collect(),
        );
    }
    remove_acyclic(&mut imports);
    assert!(
        imports.is_empty(),
        "cyclic imports among {:?}",
        imports.keys()
    );
}

/// All files of a folder inside a module are one node of the import graph.
#[test]
fn imports_between_folders_of_a_module_have_no_cycles() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../src");
    let mut imports: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
    for (path, code) in sources() {
        let inside: Vec<_> = path.strip_prefix(&root).unwrap().iter().collect();
        let ([own, ..], true) = (&inside[..], inside.len() > 1) else {
            continue;
        };
        // The file or folder names its siblings by the path from the crate or from the parent
        // module.
        let room = root.join(own).join(inside[1]);
        let mut named = names_after(&code, &format!("crate::{}::", own.to_str().unwrap()));
        match inside.len() {
            2 => named.extend(names_after(&code, "super::")),
            3 if path.ends_with("mod.rs") => named.extend(names_after(&code, "super::")),
            _ => {}
        }
        let beside = |name: String| {
            let folder = root.join(own).join(&name);
            if folder.is_dir() {
                folder
            } else {
                folder.with_extension("rs")
            }
        };
        let found = named
            .into_iter()
            .map(beside)
            .filter(|to| to.exists() && *to != room);
        // `mod.rs` of a module is excluded, because it imports the parts of the module to re-export
        // them.
        if !room.ends_with("mod.rs") {
            imports.entry(room.clone()).or_default().extend(found);
        }
    }
    assert!(
        imports.keys().filter(|room| room.is_dir()).count() >= 5,
        "too few folders were found"
    );
    remove_acyclic(&mut imports);
    assert!(imports.is_empty(), "cyclic imports among {imports:?}");
}

/// Repeatedly removes all entries without imports from the remaining entries. The final entries are
/// those of cycles, and entries that import from cycles.
fn remove_acyclic(imports: &mut BTreeMap<PathBuf, BTreeSet<PathBuf>>) {
    loop {
        let free: Vec<PathBuf> = imports
            .iter()
            .filter(|(_, to)| to.is_empty())
            .map(|(path, _)| path.clone())
            .collect();
        if free.is_empty() {
            break;
        }
        for path in free {
            imports.remove(&path);
            imports.values_mut().for_each(|to| _ = to.remove(&path));
        }
    }
}
