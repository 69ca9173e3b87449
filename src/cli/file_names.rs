//! File names made of material names.

use std::collections::HashSet;

/// A file name for each material: letters, digits and `-_.@` of its name remain, and a number is
/// added where the name is taken, by another material or one of `taken`. Names that differ only in
/// case count as one, because many file systems take them so.
pub fn file_names<'n>(
    names: impl IntoIterator<Item = &'n str>,
    affixes: [&str; 2],
    taken: &[&str],
) -> Vec<String> {
    let mut taken: HashSet<String> = taken.iter().map(|name| name.to_lowercase()).collect();
    names.into_iter().map(|name| free_name(&plain(name), affixes, &mut taken)).collect()
}

fn free_name(name: &str, [start, end]: [&str; 2], taken: &mut HashSet<String>) -> String {
    let mut free = format!("{start}{name}{end}");
    let mut number = 2;
    while !taken.insert(free.to_lowercase()) {
        free = format!("{start}{name}-{number}{end}");
        number += 1;
    }
    free
}

/// The name without the characters that mean something to a path, a terminal or a link.
fn plain(name: &str) -> String {
    let plain: String = name
        .chars()
        .map(|c| if c.is_alphanumeric() || "-_.@".contains(c) { c } else { '-' })
        .collect();
    // A leading dot would hide the file, and `.` and `..` are folders.
    if plain.is_empty() || plain.starts_with('.') { format!("-{plain}") } else { plain }
}

#[cfg(test)]
mod tests {
    use super::file_names;

    #[test]
    fn no_two_materials_share_a_file() {
        let names = ["chrome", "chrome", "Chrome", "index", "a/b\u{1b}", "..", ""];
        let files = file_names(names, ["", ".html"], &["index.html"]);
        let expected = [
            "chrome.html",
            "chrome-2.html",
            "Chrome-3.html",
            "index-2.html",
            "a-b-.html",
            "-...html",
            "-.html",
        ];
        assert_eq!(files, expected);
    }
}
