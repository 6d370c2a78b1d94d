//! Paths as URIs.

use std::fmt::Write;

/// The URI of an absolute path, the URI reference of a relative one (RFC 3986): unreserved characters
/// and the slash stand for themselves, all other bytes are escaped.
pub(crate) fn reference(path: &str) -> String {
    let mut uri = String::from(if path.starts_with('/') { "file://" } else { "" });
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(uri, "%{byte:02X}");
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_becomes_a_uri_reference() {
        // RFC 3986: unreserved characters and the slash stand for themselves; ü is C3 BC in UTF-8.
        assert_eq!(reference("axis 1/für:x.tmc"), "axis%201/f%C3%BCr%3Ax.tmc");
        assert_eq!(reference("/srv/a.tmc"), "file:///srv/a.tmc");
    }
}
