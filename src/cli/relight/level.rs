//! A picture of a level of a file, one row of shards at a time: pictures may be larger than memory. The light is not.

use std::cell::RefCell;
use std::fs::File;
use std::io::Write;
use std::ops::Range;

use anyhow::{Context, Result, ensure};

use super::{Colors, RelightArgs, write_png};
use crate::cli::ltm_file::{LIMITS, read_range};
use crate::cli::output_file::InputError;
use crate::pyramid::{PyramidReader, Shard};
use crate::relight::{Light, Rgba8Picture, TorchSpot};
use crate::transport::{Extent, LightPosition, TileRect};

/// Bytes of a light element in memory.
const LIGHT_ELEMENT_BYTES: u64 = 16;

/// A level of a file of several.
pub struct Level {
    file: RefCell<File>,
    reader: PyramidReader,
    region: TileRect,
}

impl Level {
    /// The level and the region that `args` ask for.
    pub fn new(args: &RelightArgs, file: File, reader: PyramidReader) -> Result<Self> {
        let levels = reader.table().levels();
        ensure!(
            args.level < levels,
            "{}: has levels 0 to {}; there is no --level {}",
            args.file.display(),
            levels - 1,
            args.level
        );
        Ok(Self {
            region: args.region_in(reader.table().camera(args.level))?,
            file: RefCell::new(file),
            reader,
        })
    }

    /// Relights the region, and writes it as a PNG.
    pub fn write(&self, args: &RelightArgs, out: &mut impl Write) -> Result<()> {
        let colors = Colors::new(args, self.reader.root()).map_err(InputError)?;
        let light = colors.convert(self.light(args).map_err(InputError)?);
        let region = self.region;
        write_png(out, region.extent, |write_rows| {
            let side = self.reader.table().shard_side();
            let (mut y, end) = (region.y, region.y + region.extent.height);
            while y < end {
                let next = (y / side * side).saturating_add(side).min(end);
                let rows = TileRect {
                    y,
                    extent: Extent::new(region.extent.width, next - y),
                    ..region
                };
                let picture = self.relight_rows(args, rows, &light, &colors);
                let picture = picture.map_err(InputError)?;
                let (x, y_in_picture) = (0, 0);
                write_rows(
                    &picture,
                    TileRect {
                        x,
                        y: y_in_picture,
                        extent: rows.extent,
                    },
                )?;
                y = next;
            }
            Ok(())
        })
    }

    /// The light on the light plane of the level.
    fn light(&self, args: &RelightArgs) -> Result<Light> {
        let table = self.reader.table();
        let plane = table.light(args.level);
        // Unlike a shard, it is in memory as a whole.
        let fits = |level: u32| {
            let Extent { width, height } = table.light(level);
            u64::from(width) * u64::from(height) * LIGHT_ELEMENT_BYTES <= LIMITS.decoded_bytes
        };
        ensure!(
            fits(args.level),
            "{}: level {} has {plane} light elements, which do not fit in memory; give a larger --level",
            args.file.display(),
            args.level
        );
        let Some([x, y]) = args.at else {
            return args.light_on(plane);
        };
        // The correspondence of the root, whose pixels and elements are larger, at the place on level 0.
        let root = &self.reader.root().header.geometry;
        let (whole, level_0) = (table.camera(0), f64::from(1 << (table.levels() - 1)));
        let LightPosition { u, v } = root.correspondence.map(
            x * f64::from(whole.width) / level_0,
            y * f64::from(whole.height) / level_0,
        );
        let elements = f64::from(1 << (table.levels() - 1 - args.level));
        let centre = LightPosition {
            u: u * elements,
            v: v * elements,
        };
        let spot = TorchSpot {
            centre,
            ..TorchSpot::central(plane)
        };
        Ok(Light::torch(plane, spot))
    }

    /// The picture of some rows, which lie in one row of shards.
    fn relight_rows(
        &self,
        args: &RelightArgs,
        rows: TileRect,
        light: &Light,
        colors: &Colors,
    ) -> Result<Rgba8Picture> {
        let fetch = |range: Range<u64>| read_range(&mut self.file.borrow_mut(), range);
        let mut picture = Rgba8Picture::filled(rows.extent, [0; 4]);
        let width = rows.extent.width as usize;
        for id in self.reader.shards_in(args.level, rows) {
            let shard = self.reader.shard(id, rows, fetch);
            let Shard { rect, transport } =
                shard.with_context(|| format!("{}: {id}", args.file.display()))?;
            let geometry = &transport.geometry;
            let light = light.crop(geometry.correspondence.origin.light, geometry.light);
            let relit = args.backend.picture(transport, &light, colors);
            let [left, right] = [rows.x, rows.x + rows.extent.width]
                .map(|x| x.clamp(rect.x, rect.x + rect.extent.width));
            for y in rows.y..rows.y + rows.extent.height {
                let from =
                    (y - rect.y) as usize * rect.extent.width as usize + (left - rect.x) as usize;
                let to = (y - rows.y) as usize * width + (left - rows.x) as usize;
                let count = (right - left) as usize;
                picture.pixels[to..to + count].copy_from_slice(&relit.pixels[from..from + count]);
            }
        }
        Ok(picture)
    }
}
