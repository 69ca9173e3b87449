//! Each layer names only layers to its left in the table of ARCHITECTURE.md.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The table's rows `| layer | may use |`, read from ARCHITECTURE.md so that it stays true.
fn allowed() -> BTreeMap<String, Vec<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("ARCHITECTURE.md is there");
    let rows = text.lines().filter(|line| line.starts_with("| `"));
    rows.map(|line| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        (names(cells[1]).remove(0), names(cells[2]))
    })
    .collect()
}

/// The `quoted` words of a table cell.
fn names(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("src is readable").path());
    paths
        .flat_map(|path| if path.is_dir() { rust_files(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}

/// Every `crate::layer` in the code of a file, comments apart, `use crate::{a, b}` included.
fn edges(source: &str) -> Vec<String> {
    let code: Vec<&str> =
        source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let code = code.join("\n");
    code.split("crate::")
        .skip(1)
        .flat_map(|rest| match rest.strip_prefix('{') {
            Some(group) => {
                group.split('}').next().unwrap_or("").split(',').map(first_word).collect()
            }
            None => vec![first_word(rest)],
        })
        .filter(|layer| !layer.is_empty())
        .collect()
}

fn first_word(text: &str) -> String {
    text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[test]
fn no_layer_imports_one_to_its_right() {
    let allowed = allowed();
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut violations = Vec::new();
    let mut seen = 0;
    for (layer, may_use) in &allowed {
        for file in rust_files(&src.join(layer)) {
            let source = fs::read_to_string(&file).expect("src is readable");
            for edge in edges(&source) {
                seen += 1;
                if edge != *layer && !may_use.contains(&edge) {
                    violations.push(format!("{}: crate::{edge}", file.display()));
                }
            }
        }
    }
    assert!(seen > 20, "the reader of edges found only {seen}");
    assert!(violations.is_empty(), "against ARCHITECTURE.md's table:\n{}", violations.join("\n"));
}

#[test]
fn every_folder_of_src_is_in_the_table() {
    let allowed = allowed();
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(src).expect("src is readable") {
        let path = entry.expect("src is readable").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(!path.is_dir() || allowed.contains_key(&name), "src/{name} is not in the table");
    }
}

#[test]
fn the_library_knows_nothing_of_blender() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for file in rust_files(&src) {
        let source = fs::read_to_string(&file).expect("src is readable").to_lowercase();
        assert!(!source.contains("blender"), "{} names it", file.display());
    }
}
