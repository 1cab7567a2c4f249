//! The WebAssembly surface in a browser: files are decoded, each backend draws into a canvas, and the canvas is compared
//! with the double precision reference.
//!
//! Runs under wasm-bindgen-test-runner with ChromeDriver. The flags in webdriver.json enable WebGL2 and WebGPU on machines
//! without a GPU, by SwiftShader; without the two flags for Vulkan, WebGPU cannot draw into canvases.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::sync::OnceLock;

use common::relit::{self, TileContents};
use common::{bent, tiled};
use js_sys::{Float32Array, Object, Reflect, Uint8ClampedArray};
use relightable_photo::format::{
    EncodedFile, EncoderInput, EncodingTarget, Limits, LtmReader, Metadata,
};
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::relight::{self, BuiltinLight, Rgba8Picture, reference};
use relightable_photo::transport::{Extent, FunctionCodes, Geometry, Tile, Transport};
use relightable_photo::web::{
    CanvasRelighter, CodedError, Decoder, GraphicsDevice, Photo, WebLight, WebOutputTransform,
};
use wasm_bindgen::convert::TryFromJsValue;
use wasm_bindgen::{JsCast, JsValue};
use wasm_bindgen_futures::JsFuture;
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

wasm_bindgen_test_configure!(run_in_browser);

const BACKENDS: [&str; 3] = ["cpu", "webgl2", "webgpu"];

/// Extents that no tile divides, windows smaller and larger than the light plane, correspondences that rotate and shift so
/// that windows hang over every edge, one that bends, more codes than a texture layer holds, windows that miss the light plane.
fn geometries() -> [Geometry; 6] {
    [
        bent(tiled(
            [37, 23],
            [19, 14],
            15,
            16,
            [[0.55, -0.12, -1.3], [0.1, 0.6, 0.4]],
        )),
        tiled(
            [40, 9],
            [13, 21],
            1,
            8,
            [[0.4, 0.2, -2.0], [-0.3, 1.9, 6.6]],
        ),
        tiled(
            [11, 30],
            [9, 7],
            17,
            8,
            [[-0.8, 0.0, 8.9], [0.0, 0.25, -0.75]],
        ),
        tiled(
            [64, 64],
            [32, 32],
            15,
            32,
            [[0.0, 0.7, -6.2], [-0.7, 0.0, 38.1]],
        ),
        // The second texture layer begins in the middle of pixel (16, 92)'s window, where it is brightest.
        tiled(
            [152, 140],
            [64, 64],
            15,
            32,
            [[0.43, 0.0, 0.0], [0.0, 0.45, 0.0]],
        ),
        tiled([8, 12], [6, 5], 3, 8, [[0.0, 0.0, 1e300], [0.0, 0.4, 0.0]]),
    ]
}

/// The transport of one of the [`geometries`].
fn transport(i: usize) -> Transport {
    let geometry = geometries()[i].clone();
    use TileContents::{Direct, Factored, Mixed};
    let contents = [Mixed, Factored, Direct, Factored, Direct, Mixed][i];
    let mut transport = relit::asymmetric_transport(geometry.clone(), contents, i as u64);
    if geometry.camera.area() > 10_000 {
        // Dark tiles save a minute of compression. One column of tiles stays lit, from the first texture layer to the last.
        let across = geometry.tile_grid().width as usize;
        for (i, tile) in transport.tiles.iter_mut().enumerate() {
            if i % across > 0 {
                tile.functions = FunctionCodes::dark(tile.rect());
            }
        }
    }
    transport
}

/// Lets the browser and the test's driver run.
async fn next_task() {
    let later = js_sys::Promise::new(&mut |resolve, _| {
        let window = web_sys::window().unwrap();
        window
            .set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, 0)
            .unwrap();
    });
    JsFuture::from(later).await.unwrap();
}

fn file(transport: &Transport, metadata: &Metadata) -> Vec<u8> {
    let geometry = transport.geometry.clone();
    let tile = |i: usize| Ok(transport.tiles[i].dequantise(&geometry, &transport.basis));
    let factored = transport
        .tiles
        .iter()
        .any(|tile| !tile.coefficients.is_dark());
    let source = EncoderInput {
        geometry: geometry.clone(),
        basis: factored.then_some(&transport.basis),
        tile: &tile,
        metadata: metadata.clone(),
        extensions: Vec::new(),
    };
    let mut bytes = Vec::new();
    let file = EncodedFile::new(source, EncodingTarget::Lossless, &SequentialExecutor).unwrap();
    file.write(&mut bytes).unwrap();
    bytes
}

fn decode(bytes: &[u8], piece: usize) -> Result<Photo, CodedError> {
    let mut decoder = Decoder::new(None, None);
    for (i, bytes) in bytes.chunks(piece).enumerate() {
        decoder.feed((i * piece) as f64, bytes)?;
    }
    decoder.finish()
}

/// The file of one of the transports. Encoding takes much longer than drawing, so all tests share the files.
fn transport_file(i: usize) -> &'static [u8] {
    static FILES: [OnceLock<Vec<u8>>; 6] = [const { OnceLock::new() }; 6];
    FILES[i].get_or_init(|| file(&transport(i), &Metadata::default()))
}

fn photo(i: usize) -> Photo {
    decode(transport_file(i), 1 << 16).unwrap()
}

/// The transport of [`photo`]: that of [`transport`], rounded to half precision.
fn decoded_transport(i: usize) -> Transport {
    let mut reader = LtmReader::new(Limits::default());
    reader.feed(0, transport_file(i)).unwrap();
    reader.finish().unwrap().0
}

fn new_canvas() -> HtmlCanvasElement {
    let document = web_sys::window().unwrap().document().unwrap();
    let canvas = document.create_element("canvas").unwrap();
    document
        .document_element()
        .unwrap()
        .append_child(&canvas)
        .unwrap();
    canvas.unchecked_into()
}

/// A relighter, with the device that it needs.
struct DeviceRelighter {
    relighter: CanvasRelighter,
    _device: Option<GraphicsDevice>,
}

impl DeviceRelighter {
    fn render(&mut self, light: &WebLight, exposure: f64) -> Result<(), CodedError> {
        self.render_in_quality(light, exposure, 1.0)
    }

    fn render_in_quality(
        &mut self,
        light: &WebLight,
        exposure: f64,
        quality: f64,
    ) -> Result<(), CodedError> {
        let output = plain_output(exposure)?;
        self.relighter.render(light, &output, quality)
    }
}

async fn open_device(backend: &str) -> Option<GraphicsDevice> {
    match backend {
        "webgpu" => {
            let device = JsFuture::from(GraphicsDevice::webgpu()).await.unwrap();
            Some(GraphicsDevice::try_from_js_value(device).expect("a GraphicsDevice"))
        }
        "webgl2" => Some(GraphicsDevice::webgl2(new_canvas()).unwrap()),
        _ => None,
    }
}

async fn relighter_on(
    device: &GraphicsDevice,
    photo: &Photo,
    canvas: &HtmlCanvasElement,
    gamut: &str,
) -> Result<CanvasRelighter, JsValue> {
    let relighter = device.draw(photo, canvas.clone(), gamut.into());
    let relighter = JsFuture::from(relighter).await?;
    Ok(CanvasRelighter::try_from_js_value(relighter).expect("a CanvasRelighter"))
}

async fn open_relighter(
    backend: &str,
    photo: &Photo,
    canvas: &HtmlCanvasElement,
) -> Result<DeviceRelighter, JsValue> {
    let device = open_device(backend).await;
    let relighter = match &device {
        Some(device) => relighter_on(device, photo, canvas, "srgb").await?,
        None => CanvasRelighter::new(photo, canvas.clone(), "srgb")?,
    };
    Ok(DeviceRelighter {
        relighter,
        _device: device,
    })
}

/// As the page makes it, with an exposure only.
fn plain_output(exposure: f64) -> Result<WebOutputTransform, CodedError> {
    let matrix = relight::OutputTransform::diagonal([exposure as f32; 3]);
    WebOutputTransform::new(matrix.as_flattened(), "clip", "srgb")
}

/// The output transform of pages, with dither.
fn page_output(exposure: f64) -> relight::OutputTransform {
    let plain = relight::OutputTransform::srgb(exposure as f32);
    relight::OutputTransform {
        dither: true,
        ..plain
    }
}

/// The canvas as `drawImage` copies it, in the task that rendered it.
fn read_back(canvas: &HtmlCanvasElement) -> Rgba8Picture {
    read_back_in(canvas, "srgb")
}

/// The same in a colour space.
fn read_back_in(canvas: &HtmlCanvasElement, color_space: &str) -> Rgba8Picture {
    let copy = new_canvas();
    let settings = Object::new();
    Reflect::set(&settings, &"colorSpace".into(), &color_space.into()).unwrap();
    copy.set_width(canvas.width());
    copy.set_height(canvas.height());
    let context = copy.get_context_with_context_options("2d", &settings);
    let context: CanvasRenderingContext2d = context.unwrap().unwrap().unchecked_into();
    // Transparent pixels become red.
    context.set_fill_style_str("red");
    let (width, height) = (canvas.width(), canvas.height());
    context.fill_rect(0.0, 0.0, f64::from(width), f64::from(height));
    context
        .draw_image_with_html_canvas_element(canvas, 0.0, 0.0)
        .unwrap();
    let data = context.get_image_data(0.0, 0.0, f64::from(width), f64::from(height));
    let bytes = data.unwrap().data();
    copy.remove();
    Rgba8Picture {
        extent: Extent { width, height },
        pixels: bytes.as_chunks().0.to_vec(),
    }
}

#[track_caller]
fn code_of(thrown: &JsValue) -> String {
    assert!(thrown.is_instance_of::<js_sys::Error>(), "{thrown:?}");
    let message = thrown.unchecked_ref::<js_sys::Error>().message();
    assert!(message.length() > 10, "the message is too short: {message}");
    let code = Reflect::get(thrown, &"code".into()).unwrap();
    code.as_string().expect("a code")
}

#[track_caller]
fn coded<T>(result: Result<T, CodedError>) -> String {
    code_of(&result.err().expect("an error").into())
}

async fn assert_backend_draws_the_reference(backend: &str) {
    for (i, geometry) in geometries().into_iter().enumerate() {
        let (transport, photo) = (decoded_transport(i), photo(i));
        let canvas = new_canvas();
        let mut relighter = open_relighter(backend, &photo, &canvas).await.unwrap();
        for (j, (name, light)) in relit::lights(geometry.light).into_iter().enumerate() {
            let values: Vec<f32> = light
                .elements()
                .iter()
                .flat_map(|e| [e[0], e[1], e[2]])
                .collect();
            let values = Float32Array::from(&values[..]);
            let Extent { width, height } = geometry.light;
            let web_light = WebLight::from_linear(&photo, &values, width, height, None).unwrap();
            let exposure = [1.0, 0.4, 2.5][j % 3];
            relighter.render(&web_light, exposure).unwrap();
            let want = reference::picture(&transport, &light, &page_output(exposure));
            let context = format!(
                "{backend} ({}), geometry {i}, {name}",
                relighter.relighter.kernel()
            );
            relit::assert_within_one_code(&read_back(&canvas), &want, &context);
            next_task().await;
        }
        canvas.remove();
    }
}

#[wasm_bindgen_test]
async fn cpu_draws_the_reference() {
    assert_backend_draws_the_reference("cpu").await;
}

#[wasm_bindgen_test]
async fn webgl2_draws_the_reference() {
    assert_backend_draws_the_reference("webgl2").await;
}

#[wasm_bindgen_test]
async fn webgpu_draws_the_reference() {
    assert_backend_draws_the_reference("webgpu").await;
}

#[wasm_bindgen_test]
async fn lower_quality_is_the_first_components_whatever_came_before() {
    let transport = decoded_transport(0);
    let quads = transport.basis.rank().div_ceil(4);
    assert!(quads > 1);
    for backend in BACKENDS {
        let photo = photo(0);
        let canvas = new_canvas();
        let mut relighter = open_relighter(backend, &photo, &canvas).await.unwrap();
        for name in ["flood", "spectrum"] {
            let light = WebLight::builtin(&photo, name).unwrap();
            let native_light = BuiltinLight::from_name(name)
                .unwrap()
                .render(transport.geometry.light);
            for used in [1, quads, 1] {
                let quality = used as f64 / quads as f64;
                relighter.render_in_quality(&light, 1.0, quality).unwrap();
                let coarse = relit::first_quads(&transport, used);
                let want = reference::picture(&coarse, &native_light, &page_output(1.0));
                let context = format!("{backend}, {name}, {used} of {quads}");
                relit::assert_within_one_code(&read_back(&canvas), &want, &context);
                next_task().await;
            }
        }
        canvas.remove();
    }
}

#[wasm_bindgen_test]
async fn built_in_lights_are_drawn_by_name() {
    let (transport, photo) = (transport(0), photo(0));
    let canvas = new_canvas();
    let mut relighter = open_relighter("cpu", &photo, &canvas).await.unwrap();
    for (name, light) in relit::lights(transport.geometry.light) {
        match WebLight::builtin(&photo, name) {
            Ok(built_in) => relighter.render(&built_in, 1.0).unwrap(),
            Err(error) => {
                assert_eq!(error.code, "light-name");
                assert!(["random", "corner"].contains(&name));
                assert!(error.message.contains("spectrum"), "{}", error.message);
                continue;
            }
        }
        let want = reference::picture(&transport, &light, &page_output(1.0));
        relit::assert_within_one_code(&read_back(&canvas), &want, name);
    }
}

#[wasm_bindgen_test]
async fn the_torch_is_behind_its_point_of_the_picture() {
    // Rotated by 90°: picture (x, y) lies in front of light (y, 1 - x).
    let affine = [[0.0, 0.5, 0.0], [-0.5, 0.0, 16.0]];
    let geometry = tiled([32, 32], [16, 16], 3, 8, affine);
    let transport = relit::asymmetric_transport(geometry, TileContents::Factored, 4);
    let photo = decode(&file(&transport, &Metadata::default()), 1 << 16).unwrap();
    let canvas = new_canvas();
    let mut relighter = open_relighter("cpu", &photo, &canvas).await.unwrap();
    for (x, y) in [(0.25, 0.75), (0.5, 0.5), (0.8, 0.2)] {
        let behind = photo.behind(x, y);
        let torch = WebLight::torch(&photo, behind[0], behind[1], Some(0.1)).unwrap();
        relighter.render(&torch, 1.0).unwrap();
        let picture = read_back(&canvas);
        let (mut centroid, mut total) = ([0.0; 2], 0.0);
        for (i, [r, ..]) in picture.pixels.iter().enumerate() {
            let weight = f64::from(*r).powi(4);
            centroid[0] += weight * ((i % 32) as f64 + 0.5) / 32.0;
            centroid[1] += weight * ((i / 32) as f64 + 0.5) / 32.0;
            total += weight;
        }
        let error = (centroid[0] / total - x).hypot(centroid[1] / total - y);
        assert!(
            error < 0.05,
            "the torch at ({x}, {y}) is drawn {error} away"
        );
    }
    for (x, y, size) in [
        (f64::NAN, 0.5, 0.1),
        (0.5, f64::INFINITY, 0.1),
        (0.5, 0.5, 0.0),
        (0.5, 0.5, f64::NAN),
    ] {
        assert_eq!(
            coded(WebLight::torch(&photo, x, y, Some(size))),
            "light-value"
        );
    }
}

#[wasm_bindgen_test]
fn a_file_decodes_in_pieces_of_any_size() {
    let metadata = Metadata {
        writer: "test".into(),
        ..Metadata::default()
    };
    let bytes = file(&transport(0), &metadata);
    for piece in [1, 777, bytes.len()] {
        let photo = decode(&bytes, piece).unwrap();
        assert_eq!((photo.width(), photo.height()), (37, 23));
        assert_eq!((photo.light_width(), photo.light_height()), (19, 14));
        let tiles = transport(0).tiles;
        assert_eq!(
            photo.decoded_bytes(),
            tiles.iter().map(Tile::bytes).sum::<usize>() as f64
        );
        assert!(photo.metadata().contains(r#""writer":"test""#));
    }
    let mut decoder = Decoder::new(None, None);
    assert_eq!((decoder.bytes_fed(), decoder.file_bytes()), (0.0, None));
    decoder.feed(0.0, &bytes[..500]).unwrap();
    let whole = Some(bytes.len() as f64);
    assert_eq!((decoder.bytes_fed(), decoder.file_bytes()), (500.0, whole));
}

#[wasm_bindgen_test]
async fn a_photo_is_transferred_to_another_module_tile_by_tile() {
    let (transport, mut sent) = (decoded_transport(0), photo(0));
    let (geometry, basis) = (sent.pack_geometry(), sent.pack_basis());
    let mut received = Photo::receive(&geometry, &basis).unwrap();
    assert_eq!(
        (received.tiles(), received.decoded_bytes()),
        (sent.tiles(), 0.0)
    );
    let bytes = sent.decoded_bytes();
    let tiles: Vec<_> = (0..sent.tiles())
        .map(|i| sent.take_tile(i).unwrap())
        .collect();
    assert_eq!(sent.decoded_bytes(), 0.0);
    for (i, tile) in tiles.iter().enumerate() {
        received.put_tile(i, tile).unwrap();
    }
    assert_eq!(received.decoded_bytes(), bytes);
    let canvas = new_canvas();
    let mut relighter = open_relighter("cpu", &received, &canvas).await.unwrap();
    let light = WebLight::builtin(&received, "spectrum").unwrap();
    relighter.render(&light, 1.0).unwrap();
    let (_, light) = relit::lights(transport.geometry.light).swap_remove(4);
    let want = reference::picture(&transport, &light, &page_output(1.0));
    relit::assert_within_one_code(&read_back(&canvas), &want, "received");
    // A photograph in use and corrupt tiles are refused.
    assert_eq!(coded(received.put_tile(0, &tiles[0])), "internal");
    assert_eq!(coded(sent.put_tile(99, &tiles[0])), "internal");
    // Without the last bytes, with bytes after them, and with another tile's pixels.
    let (whole, last) = (tiles[1].clone(), tiles.len() - 1);
    for corrupt in [
        &whole[..whole.len() - 1],
        &[&whole[..], &[0]].concat(),
        &tiles[last],
        &[],
    ] {
        assert_eq!(coded(sent.put_tile(1, corrupt)), "internal");
    }
    // After six words of steps: two lengths, coefficients, and entries of two words, whose last half is the slot.
    let word = |i: usize| u32::from_le_bytes(whole[4 * i..4 * i + 4].try_into().unwrap()) as usize;
    let entries = 8 + 2 * word(6)..8 + 2 * word(6) + 2 * word(7);
    assert_eq!(entries.end, whole.len() / 4);
    for i in 0..entries.end {
        let mut corrupt = whole.clone();
        corrupt[4 * i..4 * i + 4].fill(0xFF);
        let is_slot = entries.contains(&i) && (i - entries.start) % 2 == 1;
        let is_refused = (6..8).contains(&i) || is_slot;
        assert_eq!(sent.put_tile(1, &corrupt).is_err(), is_refused, "word {i}");
    }
    assert_eq!(coded(Photo::receive(&geometry[1..], &basis)), "internal");
    assert_eq!(coded(Photo::receive(&geometry, &basis[1..])), "internal");
}

#[wasm_bindgen_test]
fn a_decoder_asks_for_each_byte_once() {
    let transport = relit::asymmetric_transport(geometries()[0].clone(), TileContents::Direct, 0);
    let bytes = file(&transport, &Metadata::default());
    let mut decoder = Decoder::new(None, None);
    let mut asked = Vec::new();
    loop {
        let wanted = decoder.wants();
        let (ranges, []) = wanted.as_chunks() else {
            panic!("{wanted:?}");
        };
        let Some(&[start, end]) = ranges.first() else {
            break;
        };
        assert_eq!(decoder.scans_done(), 0);
        assert!(decoder.preview().unwrap().is_none());
        let end = end.min(bytes.len() as f64);
        decoder
            .feed(start, &bytes[start as usize..end as usize])
            .unwrap();
        asked.push((start, end));
    }
    let (first, size) = (f64::from(1 << 14), bytes.len() as f64);
    assert_eq!(asked, [(0.0, first), (first, size)]);
    assert_eq!(decoder.bytes_fed(), size);
    assert!(decoder.scans_done() > 0);
    assert!(decoder.preview().unwrap().is_none(), "the file is complete");
    // Bytes may arrive twice.
    decoder.feed(100.0, &bytes[100..20_000]).unwrap();
    assert_eq!(decoder.bytes_fed(), size);
    decoder.finish().unwrap();
}

#[wasm_bindgen_test]
fn each_kind_of_invalid_file_has_its_code() {
    let good = transport_file(0);
    let damaged = |at: usize, to: u8| {
        let mut bytes = good.to_vec();
        bytes[at] = to;
        coded(decode(&bytes, 4096))
    };
    assert_eq!(
        coded(decode(b"<!doctype html><title>404</title>", 9)),
        "format-magic"
    );
    assert_eq!(damaged(8, b'\n'), "format-text-mode");
    assert_eq!(damaged(12, 9), "format-version");
    assert_eq!(damaged(20, 99), "format-checksum");
    assert_eq!(
        damaged(good.len() - 3, !good[good.len() - 3]),
        "format-checksum"
    );
    assert_eq!(
        coded(decode(&good[..good.len() - 1], 4096)),
        "format-truncated"
    );
    assert_eq!(coded(decode(&[], 1)), "format-truncated");
    assert_eq!(
        coded(decode(&[good, b"more"].concat(), 4096)),
        "format-invalid"
    );
    let limited = Decoder::new(Some(1e5), None).feed(0.0, good);
    assert_eq!(coded(limited), "format-limit");
    let gap = Decoder::new(None, None).feed(1000.0, &good[1000..]);
    assert_eq!(coded(gap), "format-invalid");
}

#[wasm_bindgen_test]
async fn invalid_lights_and_exposures_are_refused() {
    let [one, other] = [0, 1].map(photo);
    let linear = |values: &[f32], width, height| {
        WebLight::from_linear(&one, &Float32Array::from(values), width, height, None)
    };
    let srgb =
        |codes: &[u8], width| WebLight::from_srgb(&one, &Uint8ClampedArray::from(codes), width, 1);
    assert_eq!(coded(linear(&[1.0; 5], 1, 2)), "light-size");
    assert_eq!(coded(linear(&[], 0, 3)), "light-size");
    assert_eq!(coded(linear(&[1.0, -1.0, 1.0], 1, 1)), "light-value");
    assert_eq!(coded(srgb(&[255; 4], u32::MAX)), "light-size");
    assert!(srgb(&[255; 8], 2).is_ok());
    for backend in BACKENDS {
        let mut relighter = open_relighter(backend, &one, &new_canvas()).await.unwrap();
        let foreign = WebLight::builtin(&other, "flood").unwrap();
        assert_eq!(coded(relighter.render(&foreign, 1.0)), "light-size");
        let own = WebLight::builtin(&one, "flood").unwrap();
        for exposure in [f64::NAN, f64::INFINITY, 1e39] {
            assert_eq!(coded(relighter.render(&own, exposure)), "light-value");
        }
        relighter.render(&own, 1.0).unwrap();
    }
    let short = WebOutputTransform::new(&[1.0; 8], "clip", "srgb");
    assert_eq!(coded(short), "light-value");
}

#[wasm_bindgen_test]
async fn a_canvas_in_use_is_refused() {
    let photo = photo(0);
    for (backend, used_for) in [("webgpu", "2d"), ("webgl2", "webgl2"), ("cpu", "webgl2")] {
        let canvas = new_canvas();
        let taken: Option<Object> = canvas.get_context(used_for).unwrap();
        assert!(taken.is_some());
        let thrown = open_relighter(backend, &photo, &canvas)
            .await
            .err()
            .unwrap();
        assert_eq!(code_of(&thrown), "backend-unavailable");
    }
}

#[wasm_bindgen_test]
async fn a_photo_can_be_freed_and_replaced() {
    for backend in BACKENDS {
        for i in [0, 2] {
            // Each relighter needs a new canvas.
            let canvas = new_canvas();
            let (transport, photo) = (transport(i), photo(i));
            let light = WebLight::builtin(&photo, "spectrum").unwrap();
            let mut relighter = open_relighter(backend, &photo, &canvas).await.unwrap();
            drop(photo);
            relighter.render(&light, 1.0).unwrap();
            let (_, light) = relit::lights(transport.geometry.light).swap_remove(4);
            let want = reference::picture(&transport, &light, &page_output(1.0));
            relit::assert_within_one_code(&read_back(&canvas), &want, backend);
        }
    }
}

#[wasm_bindgen_test]
async fn a_lost_webgl2_context_is_reported() {
    let photo = photo(0);
    let light = WebLight::builtin(&photo, "flood").unwrap();
    let hidden = new_canvas();
    let device = GraphicsDevice::webgl2(hidden.clone()).unwrap();
    let output = plain_output(1.0).unwrap();
    let mut relighter = relighter_on(&device, &photo, &new_canvas(), "srgb")
        .await
        .unwrap();
    relighter.render(&light, &output, 1.0).unwrap();
    let gl = hidden.get_context("webgl2").unwrap().unwrap();
    let gl: web_sys::WebGl2RenderingContext = gl.unchecked_into();
    let extension = gl.get_extension("WEBGL_lose_context").unwrap().unwrap();
    let lose = Reflect::get(&extension, &"loseContext".into()).unwrap();
    let lose: js_sys::Function = lose.unchecked_into();
    lose.call0(&extension).unwrap();
    assert_eq!(
        coded(relighter.render(&light, &output, 1.0)),
        "backend-lost"
    );
}

#[wasm_bindgen_test]
async fn photographs_share_one_device() {
    for backend in ["webgl2", "webgpu"] {
        let device = open_device(backend).await.unwrap();
        let output = plain_output(1.0).unwrap();
        let mut relighters = Vec::new();
        for i in [0, 1, 2, 0] {
            let transport = decoded_transport(i);
            let (photo, canvas) = (photo(i), new_canvas());
            let relighter = relighter_on(&device, &photo, &canvas, "srgb")
                .await
                .unwrap();
            relighters.push((relighter, photo, canvas, transport));
        }
        for round in 0..3 {
            for (i, (relighter, photo, canvas, transport)) in relighters.iter_mut().enumerate() {
                let (name, light) =
                    relit::lights(transport.geometry.light).swap_remove((i + round) % 6);
                let web_light = WebLight::builtin(photo, name).unwrap();
                relighter.render(&web_light, &output, 1.0).unwrap();
                let want = reference::picture(transport, &light, &page_output(1.0));
                let context = format!("{backend}, photo {i}, round {round}, {name}");
                relit::assert_within_one_code(&read_back(canvas), &want, &context);
            }
            // Dropping one must not affect the others.
            relighters.remove(0);
        }
    }
}

#[wasm_bindgen_test]
async fn all_output_transforms_match_the_reference() {
    let (transport, photo) = (decoded_transport(0), photo(0));
    let (name, light) = relit::lights(transport.geometry.light).swap_remove(4);
    let web_light = WebLight::builtin(&photo, name).unwrap();
    let matrix = [[1.9, -0.7, -0.2], [-0.2, 1.5, -0.3], [0.0, -0.6, 1.6]];
    for backend in BACKENDS {
        let device = open_device(backend).await;
        for gamut in [relight::Gamut::Srgb, relight::Gamut::DisplayP3] {
            let (canvas, space) = (new_canvas(), gamut.color_space());
            let mut relighter = match &device {
                Some(device) => relighter_on(device, &photo, &canvas, space).await.unwrap(),
                None => CanvasRelighter::new(&photo, canvas.clone(), space).unwrap(),
            };
            assert_eq!(relighter.gamut(), space);
            let curves = [relight::ToneCurve::Clip, relight::ToneCurve::Filmic];
            for (name, curve) in ["clip", "filmic"].into_iter().zip(curves) {
                let output = WebOutputTransform::new(matrix.as_flattened(), name, space).unwrap();
                relighter.render(&web_light, &output, 1.0).unwrap();
                let reference_output = relight::OutputTransform {
                    matrix,
                    gamut,
                    curve,
                    dither: true,
                };
                let want = reference::picture(&transport, &light, &reference_output);
                let context = format!("{backend}, {space}, {name}");
                relit::assert_within_one_code(&read_back_in(&canvas, space), &want, &context);
            }
        }
    }
}
