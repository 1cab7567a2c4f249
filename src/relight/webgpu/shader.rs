//! The WGSL of all pipelines in one module, as compiled in: without comments and indentation.

const SOURCE: &str = concat!(
    include_str!("../shaders/fullscreen.wgsl"),
    include_str!("../shaders/frame_uniforms.wgsl"),
    include_str!("../shaders/basis_function_uniforms.wgsl"),
    include_str!("../shaders/correlate.wgsl"),
    include_str!("../shaders/downsample.wgsl"),
    include_str!("../shaders/relight.wgsl"),
);
const LENGTH: usize = strip_comments(SOURCE.as_bytes(), &mut [0; SOURCE.len()]);
const STRIPPED: [u8; LENGTH] = {
    let mut text = [0; LENGTH];
    strip_comments(SOURCE.as_bytes(), &mut text);
    text
};

/// The shader module's WGSL.
pub(super) const SHADER: &str = match std::str::from_utf8(&STRIPPED) {
    Ok(text) => text,
    Err(_) => panic!("comments are removed as whole characters"),
};

/// Copies `source` without comments, indentation and empty lines. Returns the number of bytes copied.
const fn strip_comments(source: &[u8], text: &mut [u8]) -> usize {
    let (mut from, mut to) = (0, 0);
    let mut is_line_start = true;
    while from < source.len() {
        let byte = source[from];
        if byte == b'/' && from + 1 < source.len() && source[from + 1] == b'/' {
            while from < source.len() && source[from] != b'\n' {
                from += 1;
            }
            continue;
        }
        if !(is_line_start && (byte == b' ' || byte == b'\n')) {
            text[to] = byte;
            to += 1;
            is_line_start = byte == b'\n';
        }
        from += 1;
    }
    to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_comments_and_indentation_are_removed() {
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
