//! Files that a scene names. Only those within its own folder are followed.

use std::{
    fmt::Write as _,
    io,
    path::{Component, Path, PathBuf},
};

use crate::scene::SceneError;

/// A file named by a relative address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Resource {
    /// The address as it stands in the scene.
    pub uri: String,
    /// The file, relative to the scene's folder.
    pub path: PathBuf,
}

impl Resource {
    /// A resource for a `uri`; `None` for a data URI.
    ///
    /// # Errors
    /// [`SceneError::Uri`] for network addresses, absolute paths, drive letters and `..`, percent
    /// encoded or not.
    pub fn new(uri: &str) -> Result<Option<Self>, SceneError> {
        if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
            return Ok(None);
        }
        let decoded = percent_decode(uri);
        // Both spellings, as readers differ in whether they decode `%2e%2e/` or `c%3A`.
        match refusal(uri).or_else(|| refusal(&decoded)) {
            Some(reason) => Err(SceneError::Uri { uri: uri.to_owned(), reason }),
            None => {
                let path = PathBuf::from(decoded.replace('\\', "/"));
                Ok(Some(Resource { uri: uri.to_owned(), path }))
            }
        }
    }

    /// The file under `folder`, symbolic links followed.
    ///
    /// # Errors
    /// [`SceneError::Missing`], and [`SceneError::Uri`] for a link that leaves the folder.
    pub fn locate(&self, folder: &Path) -> Result<PathBuf, SceneError> {
        let folder = folder.canonicalize().map_err(|source| self.missing(source))?;
        let file = folder.join(&self.path).canonicalize().map_err(|source| self.missing(source))?;
        // A link may lead out of the folder.
        if !file.starts_with(&folder) {
            let reason = "is a link out of the scene's folder";
            return Err(SceneError::Uri { uri: self.uri.clone(), reason });
        }
        // Opening a pipe would wait for a writer.
        if !file.is_file() {
            return Err(self.missing(io::Error::other("not a regular file")));
        }
        Ok(file)
    }

    fn missing(&self, source: io::Error) -> SceneError {
        SceneError::Missing { uri: self.uri.clone(), source }
    }
}

fn refusal(uri: &str) -> Option<&'static str> {
    let scheme = uri.split_once(':').filter(|(scheme, _)| {
        // A scheme as in RFC 3986.
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+.-".contains(c))
    });
    let unified = uri.replace('\\', "/");
    let path = Path::new(&unified);
    match scheme {
        Some((letter, _)) if letter.len() == 1 => Some("has a drive letter"),
        Some(_) => Some("is a network address"),
        None if unified.starts_with("//") => Some("is a network address"),
        // On Windows a path from `/` is not absolute, for want of a drive, but leaves the folder.
        None if path.is_absolute() || unified.starts_with('/') => Some("is an absolute path"),
        None if path.components().any(|part| part == Component::ParentDir) => {
            Some("leaves the scene's folder")
        }
        None if uri.is_empty() || uri.contains('\0') => Some("is not a file name"),
        None => None,
    }
}

/// `%41` → `A`; other text, and escapes that would not be UTF-8, stay.
fn percent_decode(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let escaped = match rest {
            [b'%', high, low, ..] => hex(*high).zip(hex(*low)).map(|(h, l)| 16 * h + l),
            _ => None,
        };
        bytes.push(escaped.unwrap_or(*first));
        rest = if escaped.is_some() { &rest[3..] } else { tail };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| uri.to_owned())
}

fn hex(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).map(|value| value as u8)
}

/// A file name as a URI: every byte that is not unreserved is percent encoded.
pub(super) fn percent_encode(name: &str) -> String {
    let mut uri = String::with_capacity(name.len());
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            let _ = write!(uri, "%{byte:02X}");
        }
    }
    uri
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn addresses_outside_the_folder_are_refused() {
        for uri in [
            "../a.png",
            "a/../../b",
            "..\\a",
            "%2e%2e/a",
            "a/%2E%2E/%2e./b",
            "/etc/passwd",
            "\\a",
            "%2Fetc",
            "C:\\a.png",
            "c:/a",
            "c%3A/a",
            "http://x/a.png",
            "HTTPS://x",
            "//host/a",
            "file:///a",
            "",
            "a\0b",
            "%00",
        ] {
            assert!(matches!(Resource::new(uri), Err(SceneError::Uri { .. })), "{uri:?}");
        }
    }

    #[test]
    fn relative_files_and_data_are_taken() {
        for (uri, path) in
            [("a%20b.png", "a b.png"), ("t\\a.png", "t/a.png"), ("%zz%", "%zz%"), ("a..b", "a..b")]
        {
            assert_eq!(Resource::new(uri).unwrap().unwrap().path, Path::new(path));
        }
        assert_eq!(Resource::new("data:image/png;base64,AA==").unwrap(), None);
        assert_eq!(percent_encode("a b/ü.png"), "a%20b/%C3%BC.png");
    }
}
