//! Writing files of several levels.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use anyhow::{Result, ensure};

use super::output_file::temporary_beside;
use crate::format::{FormatError, LevelTable, Spool};
use crate::job_executor::Executor;
use crate::pyramid::{
    FetchShard, PyramidLayout, PyramidSource, SHARD_SIDE, least_level_count, level_count,
    write_pyramid,
};
use crate::transport::Extent;

/// The number of levels of a picture of `camera` pixels: `asked`, or the usual one.
pub fn levels_of(asked: Option<u32>, camera: Extent) -> Result<u32> {
    let Some(levels) = asked else {
        return Ok(level_count(camera));
    };
    // The last level is one shard.
    let least = least_level_count(camera, SHARD_SIDE);
    ensure!(
        levels == 1 || levels >= least,
        "has {camera} pixels, which need --levels {least} or more"
    );
    Ok(levels)
}

/// Writes a file of one level as one of several; `made` gives the shards that are made already. Temporary files are kept
/// beside the output.
///
/// # Errors
/// Those of [`write_pyramid`].
pub fn write_levels(
    output: &Path,
    source: PyramidSource<'_>,
    made: &FetchShard<'_>,
    layout: PyramidLayout,
    executor: &impl Executor,
    out: &mut impl Write,
) -> Result<LevelTable, FormatError> {
    let spools = [temporary_spool(output)?, temporary_spool(output)?];
    write_pyramid(source, made, layout, spools, executor, out)
}

/// An unnamed temporary file in the folder of a path.
///
/// # Errors
/// [`FormatError::Spool`].
pub fn temporary_spool(beside: &Path) -> Result<Spool<File>, FormatError> {
    let (_, folder) = temporary_beside(beside, 0o600);
    tempfile::tempfile_in(folder)
        .map(Spool::new)
        .map_err(FormatError::Spool)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_have_levels_down_to_a_shard() {
        let levels = |asked, width, height| levels_of(asked, Extent::new(width, height)).ok();
        assert_eq!(levels(None, 1024, 700), Some(1));
        assert_eq!(levels(None, 700, 1025), Some(3));
        assert_eq!(levels(None, 16384, 16384), Some(6));
        assert_eq!(levels(Some(1), 16384, 16384), Some(1));
        assert_eq!(levels(Some(5), 16384, 16384), None);
        assert_eq!(levels(Some(7), 16384, 16384), Some(7));
        assert_eq!(levels(Some(2), 40, 40), Some(2));
    }
}
