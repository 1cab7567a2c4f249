//! What the integration tests share: small transports made from nothing.
#![allow(dead_code)] // each test binary uses its own part
#![allow(clippy::unwrap_used)]

pub mod relit;

use relightable_photo::transport::{
    Correspondence, DirectTile, Extent, Geometry, RecoveredTile, TransportFunctions, Window,
};

/// A reproducible stream of numbers in 0..1.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A geometry with tiles of 8 pixels.
pub fn geometry(camera: [u32; 2], light: [u32; 2], window: u32, affine: [[f64; 3]; 2]) -> Geometry {
    tiled(camera, light, window, 8, affine)
}

pub fn tiled(
    camera: [u32; 2],
    light: [u32; 2],
    window: u32,
    tile_side: u32,
    affine: [[f64; 3]; 2],
) -> Geometry {
    let extent = |[width, height]: [u32; 2]| Extent { width, height };
    Geometry {
        camera: extent(camera),
        light: extent(light),
        window: Window::new(window).unwrap(),
        correspondence: Correspondence { affine },
        tile_side,
    }
    .validate()
    .unwrap()
}

/// Light transport functions of peaks and noise, masked to the display; the first tile is all dark.
pub fn functions(geometry: Geometry, seed: u64) -> Vec<TransportFunctions> {
    let mut noise = Noise(seed);
    let (side, area) = (geometry.window.side() as usize, geometry.window.area());
    let tiles = geometry.tiles().enumerate().map(|(i, rect)| {
        let mut functions = TransportFunctions::zeros(rect, area);
        for (p, pixel) in rect.pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            for s in 0..area {
                let element = geometry.window.element(origin, s);
                let lit = i > 0 && element.index_in(geometry.light).is_some();
                let tau = std::array::from_fn(|_| noise.next().powi(4) as f32 / side as f32);
                if lit {
                    functions.tau[p * area + s] = tau;
                }
            }
        }
        functions
    });
    tiles.collect()
}

/// The transport of a tile's own values, as a solver would yield it.
pub fn recovered(tile: &DirectTile, area: usize) -> RecoveredTile {
    let texels = 0..tile.rect.extent.area() * area;
    RecoveredTile::Direct(TransportFunctions {
        rect: tile.rect,
        tau: texels.map(|i| tile.tau(area, i / area, i % area)).collect(),
    })
}
