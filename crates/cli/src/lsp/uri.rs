//! Names of files and URIs.
//!
//! A file on disk is known by its path, any other document by its URI as the editor writes it.

use std::path::Path;

use lsp_types::Uri;

use crate::uri;

/// The name of what a URI stands for.
pub(super) fn name(uri: &Uri) -> String {
    let is_file = uri.scheme().is_some_and(|scheme| scheme.as_str().eq_ignore_ascii_case("file"));
    let path = uri.path().as_estr().decode().into_string_lossy();
    if is_file && Path::new(path.as_ref()).is_absolute() {
        return path.into_owned();
    }
    uri.as_str().to_owned()
}

/// The URI of a file on disk; none for what is not one.
pub(super) fn of_file(name: &str) -> Option<Uri> {
    if !Path::new(name).is_absolute() {
        return None;
    }
    uri::reference(name).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn reads(uri: &str, expected: &str) {
        assert_eq!(name(&uri.parse().unwrap()), expected);
    }

    #[test]
    fn a_file_is_known_by_its_path_however_its_uri_is_written() {
        reads("file:///home/me/a%20b.tmc", "/home/me/a b.tmc");
        reads("file:///home/me/%61.tmc", "/home/me/a.tmc");
        reads("FILE:///z%C3%A4hler.tmc", "/zähler.tmc");
        reads("file://localhost/a.tmc", "/a.tmc");
    }

    #[test]
    fn what_is_no_file_is_known_by_its_uri() {
        reads("untitled:Untitled-1", "untitled:Untitled-1");
        reads("git:/a.tmc?%7B%7D", "git:/a.tmc?%7B%7D");
        assert_eq!(of_file("untitled:Untitled-1"), None);
    }

    #[test]
    fn every_path_has_a_uri_and_comes_back() {
        for path in ["/a/b.tmc", "/with blank/ä?#%.inc", "/[x]&;=.tmc"] {
            let uri = of_file(path).unwrap();
            assert_eq!(name(&uri), path);
        }
        assert_eq!(of_file("/a b.tmc").unwrap().as_str(), "file:///a%20b.tmc");
    }
}
