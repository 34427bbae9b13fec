//! The page's script, built by `web/build.sh` from `web/src` and three.js.

/// The viewer's script (with its styles inside), for one inline `<script>` after every
/// [`crate::viewer_element`] of a page. It contains no `</script`, reads nothing from the network,
/// and starts a viewer in each element when it comes near the screen.
///
/// three.js is inside, with its MIT licence text.
pub fn viewer_script() -> &'static str {
    include_str!("../web/dist/srrf-view.js")
}

#[cfg(test)]
mod tests {
    use sha2::{Digest, Sha256};

    use super::*;

    /// A bundle that was edited by hand, or built without its checksum, does not pass.
    #[test]
    fn the_bundle_is_the_one_that_was_built() {
        let sum: String = Sha256::digest(viewer_script()).iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(include_str!("../web/dist/SHA256SUMS"), format!("{sum}  srrf-view.js\n"));
    }

    #[test]
    fn the_bundle_is_safe_to_inline_and_carries_its_licence() {
        let script = viewer_script();
        let lower = script.to_ascii_lowercase();
        assert!(!lower.contains("</script") && !lower.contains("<!--"));
        assert!(script.contains("three.js authors") && script.contains("Permission is hereby granted"));
        assert!(script.len() < 800_000, "{} bytes", script.len());
    }
}
