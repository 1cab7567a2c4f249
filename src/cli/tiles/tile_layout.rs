//! Names and descriptions of static tiles: Deep Zoom, and IIIF Image API 3 of level 0.

use serde_json::json;

use crate::transport::Extent;

/// Side of the tiles, which do not overlap.
pub const TILE_SIDE: u32 = 512;

/// How tiles of a picture are named.
pub struct TileLayout {
    /// The sizes of the picture, from the whole.
    sizes: Vec<Extent>,
    /// The address of the folder for IIIF; Deep Zoom without.
    id: Option<String>,
}

impl TileLayout {
    /// Deep Zoom, whose last size has one pixel.
    pub fn deep_zoom(picture: Extent) -> Self {
        Self {
            sizes: halvings(picture, 1),
            id: None,
        }
    }

    /// IIIF, whose last size is one tile.
    pub fn iiif(picture: Extent, id: &str) -> Self {
        Self {
            sizes: halvings(picture, TILE_SIDE),
            id: Some(id.to_owned()),
        }
    }

    /// The sizes of the picture, from the whole.
    pub fn sizes(&self) -> &[Extent] {
        &self.sizes
    }

    /// Name and content of the file that describes the tiles.
    pub fn description(&self) -> (String, String) {
        let Extent { width, height } = self.sizes[0];
        let Some(id) = &self.id else {
            let text = format!(
                "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Image xmlns=\"http://schemas.microsoft.com/deepzoom/2008\" \
                 Format=\"jpg\" Overlap=\"0\" TileSize=\"{TILE_SIDE}\"><Size Width=\"{width}\" Height=\"{height}\"/></Image>\n"
            );
            return ("picture.dzi".to_owned(), text);
        };
        let factors: Vec<u32> = (0..self.sizes.len()).map(|size| 1 << size).collect();
        // Sizes that have files of their own; `full/max`, of the whole picture, is one tile or none.
        let last = self.sizes[self.sizes.len() - 1];
        let whole_sizes = match self.sizes.len() {
            1 => json!([]),
            _ => json!([{"width": last.width, "height": last.height}]),
        };
        let info = json!({
            "@context": "http://iiif.io/api/image/3/context.json",
            "id": id,
            "type": "ImageService3",
            "protocol": "http://iiif.io/api/image",
            "profile": "level0",
            "width": width,
            "height": height,
            "sizes": whole_sizes,
            "tiles": [{"width": TILE_SIDE, "scaleFactors": factors}],
        });
        ("info.json".to_owned(), format!("{info:#}\n"))
    }

    /// The path of a tile at this column and row of the size with this number.
    pub fn path(&self, number: usize, [column, row]: [u32; 2]) -> String {
        if self.id.is_none() {
            let level = self.sizes.len() - 1 - number;
            return format!("picture_files/{level}/{column}_{row}.jpg");
        }
        let (whole, own) = (self.sizes[0], self.sizes[number]);
        let [x, y] = [column, row].map(|cell| cell * TILE_SIDE);
        let [width, height] = [own.width - x, own.height - y].map(|side| side.min(TILE_SIDE));
        if own.width <= TILE_SIDE && own.height <= TILE_SIDE {
            return match number {
                0 => "full/max/0/default.jpg".to_owned(),
                _ => format!("full/{width},{height}/0/default.jpg"),
            };
        }
        let scaled = |value: u32| value << number;
        let region = [(x, width, whole.width), (y, height, whole.height)]
            .map(|(first, count, side)| [scaled(first), scaled(count).min(side - scaled(first))]);
        let [[x, region_width], [y, region_height]] = region;
        format!("{x},{y},{region_width},{region_height}/{width},{height}/0/default.jpg")
    }
}

/// The picture, and its halves down to a side of at most `last`.
fn halvings(picture: Extent, last: u32) -> Vec<Extent> {
    let next = |size: &Extent| {
        let is_last = size.width.max(size.height) <= last;
        (!is_last).then(|| Extent::new(size.width.div_ceil(2), size.height.div_ceil(2)))
    };
    std::iter::successors(Some(picture), next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_those_that_viewers_ask_for() {
        let picture = Extent::new(1100, 1030);
        let iiif = TileLayout::iiif(picture, "https://a.example");
        let deep_zoom = TileLayout::deep_zoom(picture);
        for (number, cell, expected) in [
            (0, [0, 0], "0,0,512,512/512,512"),
            (0, [2, 1], "1024,512,76,512/76,512"),
            (0, [2, 2], "1024,1024,76,6/76,6"),
            (1, [0, 0], "0,0,1024,1024/512,512"),
            (1, [1, 0], "1024,0,76,1024/38,512"),
            (1, [1, 1], "1024,1024,76,6/38,3"),
            (2, [0, 0], "full/275,258"),
        ] {
            assert_eq!(iiif.path(number, cell), format!("{expected}/0/default.jpg"));
            let [column, row] = cell;
            let path = format!("picture_files/{}/{column}_{row}.jpg", 11 - number);
            assert_eq!(deep_zoom.path(number, cell), path);
        }
        assert_eq!((iiif.sizes().len(), deep_zoom.sizes().len()), (3, 12));
    }
}
