//! A simulated scene, its photographs and its true transport, for the site's page on recovery.

use js_sys::Function;
use wasm_bindgen::prelude::wasm_bindgen;

use super::progress::ReportingExecutor;
use crate::capture::{LinearPhoto, Pattern};
use crate::job_executor::Executor;
use crate::simulate::{
    PatternEnsemble, PatternImage, SceneKind, SimulatedCapture, SimulatedScene, emitted_pattern,
};
use crate::transport::{
    CHANNELS, CameraPixel, Extent, Geometry, KnownTransport, SingularValueAnalysis, TileRect,
    TileTransportFunctions, Window, transport_error,
};
use crate::web::CodedError;

/// A scene whose light transport functions are computed once and kept.
struct TabulatedScene {
    geometry: Geometry,
    /// `[N, S]`
    functions: Vec<[f32; CHANNELS]>,
}

impl TabulatedScene {
    fn new(scene: &dyn SimulatedScene, executor: &impl Executor) -> Self {
        let geometry = scene.geometry().clone();
        let tiles: Vec<_> = geometry.tiles().collect();
        let computed = executor.map(tiles.len(), |i| scene.tile(tiles[i]));
        let area = geometry.window.area();
        let mut functions = vec![[0.0; CHANNELS]; geometry.camera.area() * area];
        for tile in computed {
            for (pixel, tau) in tile.rect.pixels().zip(tile.tau.chunks_exact(area)) {
                let first = geometry.camera.index(pixel) * area;
                functions[first..first + area].copy_from_slice(tau);
            }
        }
        Self {
            geometry,
            functions,
        }
    }

    fn function(&self, n: usize) -> &[[f32; CHANNELS]] {
        let area = self.geometry.window.area();
        &self.functions[n * area..(n + 1) * area]
    }
}

impl SimulatedScene for TabulatedScene {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]) {
        tau.copy_from_slice(self.function(self.geometry.camera.index(pixel)));
    }
}

impl KnownTransport for TabulatedScene {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]) {
        SimulatedScene::transport_function(self, pixel, tau);
    }
}

/// A scene in front of a simulated camera.
#[wasm_bindgen]
pub struct Simulation {
    scene: TabulatedScene,
    patterns: Vec<PatternImage>,
    photographs: Vec<LinearPhoto>,
    dark: LinearPhoto,
}

#[wasm_bindgen]
impl Simulation {
    /// Computes the transport of the scene `stained-glass` or `cookies`. `onJob` gets the number of tiles done.
    ///
    /// # Errors
    /// Code `simulation` if there is no such scene, or if the extents do not suit it.
    pub fn build(
        scene: &str,
        width: u32,
        height: u32,
        #[wasm_bindgen(js_name = lightWidth)] light_width: u32,
        #[wasm_bindgen(js_name = lightHeight)] light_height: u32,
        #[wasm_bindgen(js_name = onJob)] on_job: &Function,
    ) -> Result<Self, CodedError> {
        let kind = match scene {
            "stained-glass" => SceneKind::StainedGlass,
            "cookies" => SceneKind::Cookies,
            _ => return Err(invalid("scene", scene, "stained-glass or cookies")),
        };
        let (camera, light) = (
            Extent::new(width, height),
            Extent::new(light_width, light_height),
        );
        let scene = kind
            .build(camera, light)
            .map_err(|error| CodedError::new("simulation", error.to_string()))?;
        let scene = ReportingExecutor::run(on_job, |executor| {
            TabulatedScene::new(scene.as_ref(), executor)
        });
        Ok(Self {
            scene,
            patterns: Vec::new(),
            photographs: Vec::new(),
            dark: LinearPhoto::new(),
        })
    }

    /// Photographs the scene under random patterns, `gaussian` or `bernoulli`, with the noise of a camera that counts
    /// `electrons` at full scale. Patterns and noise of a photograph do not depend on the number of photographs. `onJob`
    /// gets the number of jobs done: one for each tile, then one for each photograph.
    ///
    /// # Errors
    /// Code `simulation` if there is no such ensemble.
    pub fn photograph(
        &mut self,
        ensemble: &str,
        count: usize,
        electrons: f64,
        seed: u32,
        #[wasm_bindgen(js_name = onJob)] on_job: &Function,
    ) -> Result<(), CodedError> {
        let ensemble = match ensemble {
            "gaussian" => PatternEnsemble::Gaussian,
            "bernoulli" => PatternEnsemble::Bernoulli,
            _ => return Err(invalid("ensemble", ensemble, "gaussian or bernoulli")),
        };
        let capture = SimulatedCapture {
            scene: &self.scene,
            electrons,
            seed: u64::from(seed),
        };
        let patterns = capture.pattern_codes(ensemble, count);
        let photographs = ReportingExecutor::run(on_job, |executor| {
            capture.raw_photographs(&patterns, executor)
        });
        let dark = capture.dark();
        (self.patterns, self.photographs, self.dark) = (patterns, photographs, dark);
        Ok(())
    }

    /// Number of tiles, of which each is a job.
    #[wasm_bindgen(getter)]
    pub fn tiles(&self) -> usize {
        self.scene.geometry.tile_grid().area()
    }

    /// Side of the window that holds the band, in light elements.
    #[wasm_bindgen(getter)]
    pub fn window(&self) -> u32 {
        self.scene.geometry.window.side()
    }

    /// The map from camera pixels to light elements: `a, b, c, d, e, f` with `u = a(x+½) + b(y+½) + c` and
    /// `v = d(x+½) + e(y+½) + f`.
    #[wasm_bindgen(getter)]
    pub fn correspondence(&self) -> Vec<f64> {
        self.scene.geometry.correspondence.affine.concat()
    }

    /// The emission of a pattern, `[M]`.
    ///
    /// # Errors
    /// Code `simulation` if there is no such pattern.
    pub fn pattern(&self, index: usize) -> Result<Vec<f32>, CodedError> {
        let codes = self.patterns.get(index).ok_or_else(no_such_shot)?;
        Ok(match emitted_pattern(codes) {
            Pattern::Grey(emission) => emission,
            Pattern::Rgb([red, ..]) => red,
        })
    }

    /// A photograph, `[N, 3]`, 1 at full scale, NaN where it is saturated. The dark frame is not subtracted.
    ///
    /// # Errors
    /// Code `simulation` if there is no such photograph.
    pub fn photo(&self, index: usize) -> Result<Vec<f32>, CodedError> {
        let photo = self.photographs.get(index).ok_or_else(no_such_shot)?;
        Ok(photo.as_flattened().to_vec())
    }

    /// The photograph under no light, `[N, 3]`.
    #[wasm_bindgen(getter)]
    pub fn dark(&self) -> Vec<f32> {
        self.dark.as_flattened().to_vec()
    }

    /// The true picture, `[N, 3]`, without noise, under a light with linear RGB, `[M, 3]`.
    ///
    /// # Errors
    /// Code `simulation` if the light has another number of values.
    pub fn picture(&self, light: &[f32]) -> Result<Vec<f32>, CodedError> {
        let geometry = &self.scene.geometry;
        let (light, rest) = light.as_chunks::<CHANNELS>();
        if !rest.is_empty() || light.len() != geometry.light.area() {
            let message = format!(
                "the light has not three values for each of {}",
                geometry.light
            );
            return Err(CodedError::new("simulation", message));
        }
        let mut picture = Vec::with_capacity(CHANNELS * geometry.camera.area());
        for (x, y) in geometry.camera.cells() {
            let pixel = CameraPixel { x, y };
            let tau = self.scene.function(geometry.camera.index(pixel));
            let mut sum = [0.0; CHANNELS];
            for (s, m) in geometry.elements_of_window(geometry.window_origin(pixel)) {
                (0..CHANNELS).for_each(|c| sum[c] += tau[s][c] * light[m][c]);
            }
            picture.extend(sum);
        }
        Ok(picture)
    }

    /// The true light transport functions of a rectangle of camera pixels, `[pixel, S, 3]`.
    ///
    /// # Errors
    /// Code `simulation` if the picture lacks some of the pixels.
    pub fn functions(
        &self,
        x: u32,
        y: u32,
        width: u32,
        height: u32,
    ) -> Result<Vec<f32>, CodedError> {
        let camera = self.scene.geometry.camera;
        let rect = rect_in(camera, [x, y, width, height])?;
        let functions = rect
            .pixels()
            .map(|pixel| self.scene.function(camera.index(pixel)));
        Ok(functions
            .flat_map(|tau| tau.as_flattened())
            .copied()
            .collect())
    }

    /// Energy of the true functions of a tile, and of their difference to `functions`, `[pixel, S, 3]` in windows of side
    /// `window`: the ratio of their sums over all tiles is the SNR.
    ///
    /// # Errors
    /// Code `simulation` if there is no such tile or the functions have another number of values.
    #[wasm_bindgen(js_name = tileError)]
    pub fn tile_error(
        &self,
        x: u32,
        y: u32,
        width: u32,
        height: u32,
        window: u32,
        functions: &[f32],
    ) -> Result<Vec<f64>, CodedError> {
        let geometry = with_window(&self.scene.geometry, window)?;
        let functions = tile_functions(&geometry, [x, y, width, height], functions)?;
        let error = transport_error(&self.scene, &geometry, &functions);
        Ok(vec![error.signal, error.error])
    }
}

/// Shows the structure of a transport: where its elements are, and its singular values.
#[wasm_bindgen]
pub struct TransportAnalysis {
    geometry: Geometry,
    singular_values: SingularValueAnalysis,
    /// Cells along each side of the band's picture.
    cells: u32,
    band: Vec<f32>,
}

#[wasm_bindgen]
impl TransportAnalysis {
    /// Of a transport with windows of side `window` around [`correspondence`](Simulation::correspondence). The picture of
    /// the band has `cells` × `cells` cells.
    ///
    /// # Errors
    /// Code `simulation` for impossible extents.
    #[wasm_bindgen(constructor)]
    pub fn new(
        width: u32,
        height: u32,
        #[wasm_bindgen(js_name = lightWidth)] light_width: u32,
        #[wasm_bindgen(js_name = lightHeight)] light_height: u32,
        window: u32,
        correspondence: &[f64],
        cells: u32,
    ) -> Result<Self, CodedError> {
        let &[a, b, c, d, e, f] = correspondence else {
            let message = "the correspondence must have six numbers";
            return Err(CodedError::new("simulation", message));
        };
        let base = Geometry {
            camera: Extent::new(width, height),
            light: Extent::new(light_width, light_height),
            window: Window::new(1).map_err(unsuitable)?,
            correspondence: crate::transport::Correspondence::from_affine([[a, b, c], [d, e, f]]),
            tile_side: Geometry::DEFAULT_TILE_SIDE,
        };
        let geometry = with_window(&base, window)?;
        Ok(Self {
            geometry: geometry.clone(),
            singular_values: SingularValueAnalysis::new(geometry),
            cells,
            band: vec![0.0; (cells * cells) as usize],
        })
    }

    /// Adds the functions of a tile, `[pixel, S, 3]`.
    ///
    /// # Errors
    /// Code `simulation` if there is no such tile or the functions have another number of values.
    #[wasm_bindgen(js_name = addTile)]
    pub fn add_tile(
        &mut self,
        x: u32,
        y: u32,
        width: u32,
        height: u32,
        functions: &[f32],
    ) -> Result<(), CodedError> {
        let Geometry {
            camera,
            light,
            window,
            ..
        } = self.geometry;
        let functions = tile_functions(&self.geometry, [x, y, width, height], functions)?;
        self.singular_values.add(&functions);
        let cell = |i: usize, of: usize| i * self.cells as usize / of;
        let by_pixel = functions.tau.chunks_exact(window.area());
        for (pixel, tau) in functions.rect.pixels().zip(by_pixel) {
            let column = cell(camera.index(pixel), camera.area());
            let origin = self.geometry.window_origin(pixel);
            for (s, m) in self.geometry.elements_of_window(origin) {
                let target = &mut self.band[cell(m, light.area()) * self.cells as usize + column];
                *target = target.max(tau[s].iter().sum::<f32>() / CHANNELS as f32);
            }
        }
        Ok(())
    }

    /// The largest element of T, as a mean over channels, in each cell: camera pixels from left to right, light elements
    /// from top to bottom, both row by row.
    #[wasm_bindgen(getter)]
    pub fn band(&self) -> Vec<f32> {
        self.band.clone()
    }

    /// Light elements of the rows of T that the singular values are of: columns and rows of a block in the middle.
    #[wasm_bindgen(getter)]
    pub fn block(&self) -> Vec<u32> {
        let block = self.singular_values.block();
        vec![block.width, block.height]
    }

    /// The singular values, largest first.
    #[wasm_bindgen(js_name = singularValues)]
    pub fn singular_values(self) -> Vec<f64> {
        self.singular_values.singular_values()
    }
}

fn with_window(geometry: &Geometry, window: u32) -> Result<Geometry, CodedError> {
    let geometry = Geometry {
        window: Window::new(window).map_err(unsuitable)?,
        ..geometry.clone()
    };
    geometry.validate().map_err(unsuitable)
}

fn tile_functions(
    geometry: &Geometry,
    rect: [u32; 4],
    values: &[f32],
) -> Result<TileTransportFunctions, CodedError> {
    let rect = rect_in(geometry.camera, rect)?;
    let (tau, rest) = values.as_chunks::<CHANNELS>();
    if !rest.is_empty() || tau.len() != rect.extent.area() * geometry.window.area() {
        let message = "the functions are not those of a tile";
        return Err(CodedError::new("simulation", message));
    }
    Ok(TileTransportFunctions {
        rect,
        tau: tau.to_vec(),
    })
}

/// The rectangle of `x`, `y`, width and height.
fn rect_in(camera: Extent, [x, y, width, height]: [u32; 4]) -> Result<TileRect, CodedError> {
    let fits = |first: u32, length: u32, side: u32| {
        first.checked_add(length).is_some_and(|end| end <= side)
    };
    if !fits(x, width, camera.width) || !fits(y, height, camera.height) {
        return Err(CodedError::new(
            "simulation",
            "the picture has no such pixels",
        ));
    }
    Ok(TileRect {
        x,
        y,
        extent: Extent::new(width, height),
    })
}

fn unsuitable(error: crate::transport::GeometryError) -> CodedError {
    CodedError::new("simulation", error.to_string())
}

fn no_such_shot() -> CodedError {
    CodedError::new("simulation", "there is no such photograph")
}

fn invalid(field: &str, value: &str, allowed: &str) -> CodedError {
    let message = format!("{field} is \"{value}\"; it must be {allowed}");
    CodedError::new("simulation", message)
}
