//! A picture of a level of a file, one row of shards at a time: pictures and lights may be larger than memory.

use std::cell::RefCell;
use std::fs::File;
use std::ops::Range;

use anyhow::{Context, Result, ensure};

use super::light_image::LightSource;
use super::{Colors, PictureArgs};
use crate::cli::ltm_file::read_range;
use crate::cli::output_file::InputError;
use crate::pyramid::{PyramidReader, Shard};
use crate::relight::{Light, Rgba8Picture, TorchSpot};
use crate::transport::{Extent, LightPosition, LightRegion, TileRect};

/// A level of a file of several.
pub struct Level<'a> {
    args: &'a PictureArgs,
    file: RefCell<File>,
    reader: PyramidReader,
}

impl<'a> Level<'a> {
    /// The level that `args` ask for.
    pub fn new(args: &'a PictureArgs, file: File, reader: PyramidReader) -> Result<Self> {
        let number = args.level;
        let levels = reader.table().levels();
        ensure!(
            number < levels,
            "{}: has levels 0 to {}; there is no --level {number}",
            args.file.display(),
            levels - 1,
        );
        Ok(Self {
            args,
            file: RefCell::new(file),
            reader,
        })
    }

    /// Its pixels.
    pub fn camera(&self) -> Extent {
        self.reader.table().camera(self.args.level)
    }

    /// Draws a region, row by row.
    pub fn draw(
        &self,
        region: TileRect,
        row: &mut dyn FnMut(&[[u8; 4]]) -> Result<()>,
    ) -> Result<()> {
        let colors = Colors::new(self.args, self.reader.root()).map_err(InputError)?;
        let source = LightSource::load(&self.args.light).map_err(InputError)?;
        let torch = self.torch();
        let light_on = |region| match torch {
            Some(spot) => Ok(Light::torch(region, spot)),
            None => self.args.light_on(&source, region),
        };
        let light_on = |region| Ok(colors.convert(light_on(region)?));
        let side = self.reader.table().shard_side();
        let (mut y, end) = (region.y, region.y + region.extent.height);
        while y < end {
            let next = (y / side * side).saturating_add(side).min(end);
            let rows = TileRect {
                y,
                extent: Extent::new(region.extent.width, next - y),
                ..region
            };
            let picture = self.relight_rows(rows, &light_on, &colors);
            let picture = picture.map_err(InputError)?;
            let mut rows = picture.pixels.chunks_exact(region.extent.width as usize);
            rows.try_for_each(&mut *row)?;
            y = next;
        }
        Ok(())
    }

    /// The torch that `args` place, if they place one.
    fn torch(&self) -> Option<TorchSpot> {
        let [x, y] = self.args.at?;
        let (table, number) = (self.reader.table(), self.args.level);
        // The correspondence of the root, whose pixels and elements are larger, at the place on level 0.
        let root = &self.reader.root().header.geometry;
        let (whole, level_0) = (table.camera(0), f64::from(1 << (table.levels() - 1)));
        let LightPosition { u, v } = root.correspondence.map(
            x * f64::from(whole.width) / level_0,
            y * f64::from(whole.height) / level_0,
        );
        let elements = f64::from(1 << (table.levels() - 1 - number));
        Some(TorchSpot {
            centre: LightPosition {
                u: u * elements,
                v: v * elements,
            },
            ..TorchSpot::central(table.light(number))
        })
    }

    /// The picture of some rows, which lie in one row of shards.
    fn relight_rows(
        &self,
        rows: TileRect,
        light_on: &dyn Fn(LightRegion) -> Result<Light>,
        colors: &Colors,
    ) -> Result<Rgba8Picture> {
        let fetch = |range: Range<u64>| read_range(&mut self.file.borrow_mut(), range);
        let mut picture = Rgba8Picture::filled(rows.extent, [0; 4]);
        let width = rows.extent.width as usize;
        for id in self.reader.shards_in(self.args.level, rows) {
            let shard = self.reader.shard(id, rows, fetch);
            let Shard { rect, transport } =
                shard.with_context(|| format!("{}: {id}", self.args.file.display()))?;
            let light = light_on(transport.geometry.light_region())?;
            let relit = self.args.backend.picture(transport, &light, colors);
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
