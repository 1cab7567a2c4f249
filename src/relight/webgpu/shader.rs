//! The shaders' source, as it goes with the program: without comments and indentation.

/// The first file is WebGL2's source as well.
const SOURCE: &str = concat!(
    include_str!("../shaders/relight.wgsl"),
    include_str!("../shaders/see.wgsl")
);
const LENGTH: usize = bare(SOURCE.as_bytes(), &mut [0; SOURCE.len()]);
const BARE: [u8; LENGTH] = {
    let mut text = [0; LENGTH];
    bare(SOURCE.as_bytes(), &mut text);
    text
};

/// The module of all shaders, in WGSL.
pub(super) const SHADER: &str = match std::str::from_utf8(&BARE) {
    Ok(text) => text,
    Err(_) => panic!("whole characters are left out or none of them"),
};

/// Copies `source` but for comments, indentation and empty lines; how many bytes that are.
const fn bare(source: &[u8], text: &mut [u8]) -> usize {
    let (mut from, mut to) = (0, 0);
    let mut line_begins = true;
    while from < source.len() {
        let byte = source[from];
        if byte == b'/' && from + 1 < source.len() && source[from + 1] == b'/' {
            while from < source.len() && source[from] != b'\n' {
                from += 1;
            }
            continue;
        }
        if !(line_begins && (byte == b' ' || byte == b'\n')) {
            text[to] = byte;
            to += 1;
            line_begins = byte == b'\n';
        }
        from += 1;
    }
    to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_comments_and_indentation_are_left_out() {
        let code = |line: &str| {
            line.split("//")
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned()
        };
        let lines = SOURCE.lines().map(code).filter(|line| !line.is_empty());
        assert!(SHADER.lines().map(str::trim_end).eq(lines));
    }
}
