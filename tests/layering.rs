//! Each layer names only layers to its left in the table of ARCHITECTURE.md.

use std::collections::{BTreeMap, BTreeSet};
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

/// The code of a file as the graph reads it: no comments, no unit tests.
fn code(path: &Path) -> String {
    let source = fs::read_to_string(path).expect("src is readable");
    let source = source.split("#[cfg(test)]").next().unwrap_or("").to_owned();
    let lines = source.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// `lut/bake.rs` → `lut::bake`, `lut/mod.rs` → `lut`.
fn module(src: &Path, file: &Path) -> String {
    let path = file.strip_prefix(src).expect("below src").with_extension("");
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let parts = if parts.last().is_some_and(|last| last == "mod") {
        &parts[..parts.len() - 1]
    } else {
        &parts
    };
    parts.join("::")
}

/// The paths of a use tree, `a::{b, c::{d, e}}` → `a::b`, `a::c::d`, `a::c::e`, new names dropped.
fn expand(tree: &str, before: &str, out: &mut Vec<String>) {
    let mut depth = 0;
    let items = tree.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    for item in items.map(str::trim).filter(|item| !item.is_empty()) {
        match item.split_once('{') {
            Some((head, rest)) => {
                let inner = rest.trim_end().strip_suffix('}').unwrap_or(rest);
                expand(inner, &format!("{before}{}", head.trim()), out);
            }
            None => {
                out.push(format!("{before}{}", item.split(" as ").next().unwrap_or(item).trim()));
            }
        }
    }
}

/// The paths of all `use` lines, those that re-export apart from the rest.
fn uses(code: &str) -> (Vec<String>, Vec<String>) {
    let (mut imports, mut exports) = (Vec::new(), Vec::new());
    for statement in code.split(';') {
        let Some(start) = statement.rfind("use ") else { continue };
        let (before, tree) = (statement[..start].trim_end(), &statement[start + 4..]);
        let exported = before.ends_with("pub") || before.ends_with("pub(crate)");
        expand(tree, "", if exported { &mut exports } else { &mut imports });
    }
    (imports, exports)
}

/// The modules of the library, each with those that its file uses by `crate::` or as a child.
fn graph() -> BTreeMap<String, BTreeSet<String>> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files = rust_files(&src).into_iter().map(|file| (module(&src, &file), code(&file)));
    let outside = |name: &str| name == "lib" || name == "main" || name.starts_with("cli");
    let files: BTreeMap<String, String> = files.filter(|(name, _)| !outside(name)).collect();
    let uses: BTreeMap<&str, _> = files.iter().map(|(name, code)| (&**name, uses(code))).collect();
    let absolute = |of: &str, path: &str| match path.strip_prefix("crate::") {
        Some(path) => path.to_owned(),
        None => format!("{of}::{path}"),
    };
    let mut exported = BTreeMap::new();
    for (of, (_, exports)) in &uses {
        for path in exports {
            let name = path.rsplit("::").next().unwrap_or(path);
            exported.insert(format!("{of}::{name}"), absolute(of, path));
        }
    }
    // The file that defines a path: its longest known prefix, through re-exports.
    let defines = |path: &str| {
        let mut path = path.to_owned();
        loop {
            if files.contains_key(&path) {
                return Some(path);
            }
            path = match exported.get(&path) {
                Some(origin) if *origin != path => origin.clone(),
                _ => path.rsplit_once("::")?.0.to_owned(),
            };
        }
    };
    let edges = |of: &str| {
        let imports = uses[of].0.iter().map(|path| absolute(of, path));
        imports.filter_map(|path| defines(&path)).filter(|to| to != of).collect()
    };
    files.keys().map(|of| (of.clone(), edges(of))).collect()
}

/// Everything that can be reached from a module.
fn reached(graph: &BTreeMap<String, BTreeSet<String>>, from: &str) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    let mut open: Vec<&str> = vec![from];
    while let Some(module) = open.pop() {
        open.extend(graph[module].iter().filter(|to| seen.insert((*to).clone())).map(|to| &**to));
    }
    seen
}

#[test]
fn no_circle_of_files() {
    let graph = graph();
    assert!(graph.values().map(BTreeSet::len).sum::<usize>() > 200, "the reader of uses is broken");
    let reached: BTreeMap<&str, _> = graph.keys().map(|m| (&**m, reached(&graph, m))).collect();
    let in_circle = |m: &&str| reached[*m].contains(*m);
    let circle = |m: &str| -> Vec<&str> {
        let both =
            reached.keys().filter(|to| reached[m].contains(**to) && reached[*to].contains(m));
        both.copied().collect()
    };
    let found: BTreeSet<Vec<&str>> =
        reached.keys().copied().filter(|m| in_circle(m)).map(circle).collect();
    assert!(found.is_empty(), "files that use each other: {found:?}");
}
