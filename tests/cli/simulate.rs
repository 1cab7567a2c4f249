//! Simulated captures: reproducibility, agreement with the known transport, and properties of the scenes.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use assert_cmd::Command;
use relightable_photo::calibrate::LightPlaneAxis;
use relightable_photo::capture::{CameraPixelSet, CaptureFolder, LinearPhoto, Pattern};
use relightable_photo::simulate::{
    Camera, EmissionMatrix, PatternImage, RandomStreamId, SceneKind, SimulatedScene,
};
use relightable_photo::transport::{
    CHANNELS, Extent, LightElement, TileRect, TileTransportFunctions,
};

fn simulate(out: &Path, args: &[&str]) -> Command {
    let mut command = Command::cargo_bin("ltm-export").unwrap();
    command.arg("simulate").args(args).arg("-o").arg(out);
    command
}

const SMALL: [&str; 6] = ["--camera", "40x32", "--light", "20x16", "--patterns", "6"];

/// The contents of every file below `root`, by path.
fn contents(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path
                    .strip_prefix(root)
                    .unwrap()
                    .to_string_lossy()
                    .into_owned();
                files.insert(name, std::fs::read(path).unwrap());
            }
        }
    }
    files
}

#[test]
fn a_seed_determines_every_byte_on_any_number_of_threads() {
    let root = tempfile::tempdir().unwrap();
    for scene in ["stained-glass", "cookies"] {
        let make = |name: &str, seed: &str, threads: &str| {
            let out = root.path().join(format!("{scene}-{name}"));
            let mut command = simulate(&out, &[scene]);
            command
                .args(SMALL)
                .args(["--seed", seed])
                .env("RAYON_NUM_THREADS", threads);
            command.assert().success();
            contents(&out)
        };
        let (a, b, c) = (
            make("a", "5", "1"),
            make("b", "5", "3"),
            make("c", "6", "3"),
        );
        assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
        for (name, bytes) in &a {
            assert!(b[name] == *bytes, "{scene}: {name} differs");
            let is_random = ["patterns/", "photos/", "graycode/"]
                .iter()
                .any(|f| name.starts_with(f));
            assert_eq!(
                c[name] != *bytes,
                is_random,
                "{scene}: {name} with another seed"
            );
        }
    }
}

/// y = pT, `[N]`, from the capture's `truth/` folder.
fn picture(folder: &CaptureFolder, light: &[[f64; CHANNELS]]) -> Vec<[f64; CHANNELS]> {
    let truth = folder.truth().unwrap().unwrap();
    let manifest = folder.manifest();
    (0..manifest.camera.extent().area())
        .map(|n| {
            let origin = truth.window_origin(n);
            let mut y = [0.0; CHANNELS];
            for (s, tau) in truth.tau(n).iter().enumerate() {
                let element = truth.window.element(origin, s);
                match element.index_in(manifest.light.extent()) {
                    Some(m) => (0..CHANNELS).for_each(|c| y[c] += tau[c].to_f64() * light[m][c]),
                    None => assert_eq!(
                        tau.map(|t| t.to_f64()),
                        [0.0; 3],
                        "transport outside the light plane"
                    ),
                }
            }
            y
        })
        .collect()
}

#[test]
fn photographs_and_relit_pictures_match_the_known_transport() {
    let root = tempfile::tempdir().unwrap();
    for (scene, ensemble) in [("stained-glass", "bernoulli"), ("cookies", "gaussian")] {
        let out = root.path().join(scene);
        let mut command = simulate(&out, &[scene, "--ensemble", ensemble]);
        command.args(SMALL).assert().success();
        let folder = CaptureFolder::open(&out).unwrap();
        assert_eq!(folder.manifest().shots.len(), 6);

        let pixels = CameraPixelSet::all(folder.manifest().camera.extent());
        let dark = folder.read_dark(&pixels).unwrap();
        let (mut squares, mut samples) = (0.0, 0.0);
        for i in 0..6 {
            let Pattern::Grey(pattern) = folder.read_pattern(i).unwrap() else {
                panic!("patterns are grey")
            };
            let (mut shot, mut photo) = (folder.open_shot(i).unwrap(), LinearPhoto::new());
            shot.read(&pixels, &dark, &mut photo).unwrap();
            assert_eq!(shot.finish().unwrap().saturated, 0, "saturated samples");
            let light: Vec<_> = pattern.iter().map(|&p| [f64::from(p); CHANNELS]).collect();
            for (expected, measured) in picture(&folder, &light).iter().zip(&photo) {
                for c in 0..CHANNELS {
                    // Shot noise, and the read noise of this photograph and of the dark one.
                    let variance = expected[c] * 40_000.0 + 2.0 * 64.0;
                    squares +=
                        ((f64::from(measured[c]) - expected[c]) * 40_000.0).powi(2) / variance;
                    samples += 1.0;
                }
            }
        }
        let ratio = squares / samples;
        assert!(
            (0.93..1.07).contains(&ratio),
            "{scene}: the noise variance is {ratio} times the expected one"
        );

        let truth = folder.truth().unwrap().unwrap();
        assert_eq!(
            truth.lights().unwrap(),
            ["checker", "colour", "fire", "flood", "stripes"]
        );
        for name in truth.lights().unwrap() {
            let light = truth.light(&name).unwrap().rgb();
            let light: Vec<_> = light
                .chunks_exact(3)
                .map(|l| [l[0], l[1], l[2]].map(f64::from))
                .collect();
            let relit = truth.relit(&name).unwrap();
            for (expected, measured) in picture(&folder, &light).iter().zip(&relit) {
                for c in 0..CHANNELS {
                    let error = (expected[c] - measured[c]).abs();
                    assert!(
                        error < 0.6 / (0.9 * 65535.0),
                        "{scene} {name}: off by {error}"
                    );
                }
            }
        }
    }
}

#[test]
fn gray_code_decodes_to_the_correspondence() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("cookies");
    simulate(&out, &["cookies"]).args(SMALL).assert().success();
    let folder = CaptureFolder::open(&out).unwrap();
    let manifest = folder.manifest();
    let read = |name: &str| image::open(out.join(name)).unwrap().into_rgb16();
    let sum = |p: &image::Rgb<u16>| p.0.iter().map(|&c| u32::from(c)).sum::<u32>();
    let flood = read("photos/flood.png");
    for (axis, top_bit) in [(LightPlaneAxis::X, 4), (LightPlaneAxis::Y, 3)] {
        let shots: Vec<_> = manifest
            .graycode
            .iter()
            .filter(|g| g.axis == axis)
            .collect();
        let photos: Vec<_> = shots.iter().map(|g| read(&g.photo)).collect();
        let (mut near, mut decoded) = (0, 0);
        for (x, y, lit) in flood.enumerate_pixels() {
            if sum(lit) < 3 * 3000 {
                continue;
            }
            // Most significant bit first, each photograph followed by its inverse.
            let mut element = 0;
            for pair in photos.chunks_exact(2) {
                let bit = u32::from(sum(pair[0].get_pixel(x, y)) > sum(pair[1].get_pixel(x, y)));
                element = element << 1 | (bit ^ element & 1);
            }
            let at = f64::from(if axis == LightPlaneAxis::X { x } else { y }) * 0.5;
            decoded += 1;
            // Parallax displaces it by up to four elements in one direction.
            near += u32::from((-5.5..=1.0).contains(&(f64::from(element) - at)));
        }
        assert!(decoded > 700, "{decoded} pixels are lit");
        assert!(
            f64::from(near) > 0.95 * f64::from(decoded),
            "{axis}: {near} of {decoded}"
        );
        assert_eq!(shots[0].bit, top_bit);
        assert!(!shots[0].inverted && shots[1].inverted);
    }
}

#[test]
fn invalid_arguments_are_errors_and_write_nothing() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let cases: [(&[&str], &str, i32); 8] = [
        (
            &["stained-glass", "--patterns", "0"],
            "0 is not in 1..=10000",
            2,
        ),
        (
            &["cookies", "--patterns", "9999", "--camera", "512x512"],
            "fewer --patterns",
            1,
        ),
        (&["cookies", "--camera", "0x128"], "between 8 and 1024", 2),
        (&["cookies", "--camera", "128"], "WIDTHxHEIGHT", 2),
        (&["cookies", "--light", "64x100000"], "between 4 and 512", 2),
        (&["cookies", "--electrons", "0"], "--electrons", 2),
        (&["marble"], "stained-glass", 2),
        (&["cookies", "--ensemble", "cauchy"], "bernoulli", 2),
    ];
    for (args, message, code) in cases {
        let output = simulate(&out, args)
            .assert()
            .code(code)
            .get_output()
            .clone();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(stderr.contains(message), "{args:?}: {stderr}");
        assert!(output.stdout.is_empty());
    }
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    let output = simulate(&out, &["cookies"])
        .assert()
        .code(1)
        .get_output()
        .clone();
    assert!(String::from_utf8_lossy(&output.stderr).contains("is not empty"));
    assert_eq!(
        contents(root.path()).keys().collect::<Vec<_>>(),
        ["out/notes.txt"]
    );
}

const fn extent(width: u32, height: u32) -> Extent {
    Extent { width, height }
}

/// The functions of all pixels.
fn all_functions(scene: &dyn SimulatedScene) -> TileTransportFunctions {
    scene.tile(TileRect {
        x: 0,
        y: 0,
        extent: scene.geometry().camera,
    })
}

/// A scene's pictures under flood light without noise, `[N]`.
struct FloodPictures {
    kind: SceneKind,
    /// 128 pixels wide and high.
    coarse: Vec<[f32; CHANNELS]>,
    /// 256 pixels wide and high.
    fine: Vec<[f32; CHANNELS]>,
}

static FLOOD_PICTURES: LazyLock<[FloodPictures; 2]> = LazyLock::new(|| {
    [SceneKind::StainedGlass, SceneKind::Cookies].map(|kind| {
        let [coarse, fine] = [128, 256].map(|side| {
            let scene = kind
                .build(extent(side, side), extent(side / 2, side / 2))
                .unwrap();
            let light = scene.geometry().light;
            let emissions = EmissionMatrix::new(light, &[PatternImage::uniform(light, 255)]);
            let functions = all_functions(scene.as_ref());
            emissions.pictures(scene.geometry(), &functions).remove(0)
        });
        FloodPictures { kind, coarse, fine }
    })
});

#[test]
fn transport_is_finite_non_negative_and_inside_the_window() {
    for kind in [SceneKind::StainedGlass, SceneKind::Cookies] {
        for (camera, light) in [
            (extent(128, 128), extent(64, 64)),
            (extent(36, 20), extent(36, 20)),
            (extent(24, 40), extent(48, 40)),
        ] {
            let scene = kind.build(camera, light).unwrap();
            let geometry = scene.geometry();
            let side = geometry.window.side() as usize;
            let functions = all_functions(scene.as_ref());
            let (mut all, mut border) = (0.0, 0.0);
            let pixels = functions.rect.pixels();
            for (pixel, tau) in pixels.zip(functions.tau.chunks_exact(side * side)) {
                let origin = geometry.window_origin(pixel);
                for (s, tau) in tau.iter().enumerate() {
                    let (i, j) = (s % side, s / side);
                    assert!(tau.iter().all(|t| t.is_finite() && *t >= 0.0));
                    let element = LightElement {
                        u: origin.u + i as i32,
                        v: origin.v + j as i32,
                    };
                    if element.index_in(light).is_none() {
                        assert_eq!(*tau, [0.0; CHANNELS], "{kind:?} outside the light plane");
                    }
                    let energy = f64::from(tau.iter().sum::<f32>());
                    all += energy;
                    if i == 0 || j == 0 || i + 1 == side || j + 1 == side {
                        border += energy;
                    }
                }
            }
            assert!(border < 0.004 * all, "{kind:?} {camera}: {}", border / all);
        }
    }
}

/// The quantile `share` of `values`.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

#[test]
fn flood_light_fills_the_cameras_range_without_clipping() {
    for FloodPictures { kind, coarse, fine } in &*FLOOD_PICTURES {
        for picture in [coarse, fine] {
            // The brightest channel, as saturated colours have dark channels.
            let brightest = |p: &[f32; 3]| f64::from(p[0].max(p[1]).max(p[2]));
            let values: Vec<_> = picture.iter().map(brightest).collect();
            let [low, middle, high, top] =
                [0.45, 0.6, 0.95, 1.0].map(|q| quantile(values.clone(), q));
            assert!(low > 0.08 && middle > 0.25, "{kind:?}: {low} {middle}");
            assert!(high > 0.6 && top < 0.97, "{kind:?}: {high} {top}");
        }
    }
}

#[test]
fn cookies_are_sparse_and_glass_is_not() {
    let sparsity = |kind: SceneKind| {
        let scene = kind.build(extent(96, 96), extent(48, 48)).unwrap();
        let functions = all_functions(scene.as_ref());
        let effective = functions
            .tau
            .chunks_exact(scene.geometry().window.area())
            .filter_map(|tau| {
                let sum: f64 = tau.iter().map(|t| f64::from(t[1])).sum();
                let squares: f64 = tau.iter().map(|t| f64::from(t[1]).powi(2)).sum();
                (sum > 0.05).then(|| sum * sum / squares)
            });
        let effective: Vec<f64> = effective.collect();
        [0.5, 0.9].map(|q| quantile(effective.clone(), q))
    };
    let [median, high] = sparsity(SceneKind::Cookies);
    assert!(median < 2.2 && high < 4.5, "cookies: {median}, {high}");
    let [median, high] = sparsity(SceneKind::StainedGlass);
    assert!(median > 7.0 && high > 15.0, "glass: {median}, {high}");
}

#[test]
fn the_picture_is_the_same_at_every_resolution() {
    for FloodPictures { kind, coarse, fine } in &*FLOOD_PICTURES {
        // The mean of 2x2 pixels of the fine picture.
        let mut reduced = vec![[0.0; CHANNELS]; 128 * 128];
        for (n, pixel) in fine.iter().enumerate() {
            for c in 0..CHANNELS {
                reduced[n / 256 / 2 * 128 + n % 256 / 2][c] += pixel[c] / 4.0;
            }
        }
        for c in 0..CHANNELS {
            let plane = |p: &[[f32; 3]]| p.iter().map(|p| f64::from(p[c])).collect::<Vec<_>>();
            let r = correlation(&plane(coarse), &plane(&reduced));
            assert!(r > 0.88, "{kind:?} channel {c}: correlation {r}");
        }
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let product = |x: &[f64], mx: f64, y: &[f64], my: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum()
    };
    product(a, ma, b, mb) / (product(a, ma, a, ma) * product(b, mb, b, mb)).sqrt()
}

#[test]
fn height_displaces_direct_light_and_casts_shadows() {
    let scene = SceneKind::Cookies
        .build(extent(128, 128), extent(64, 64))
        .unwrap();
    let geometry = scene.geometry();
    let functions = all_functions(scene.as_ref());
    let side = geometry.window.side() as usize;
    let half = (side / 2) as f64;
    let (mut shifts, mut shadows) = (Vec::new(), 0);
    for tau in functions.tau.chunks_exact(side * side) {
        let (mut sum, mut shift) = (0.0, 0.0);
        for (s, tau) in tau.iter().enumerate() {
            sum += f64::from(tau[0]);
            shift += f64::from(tau[0]) * ((s % side) as f64 - half);
        }
        if sum > 0.08 {
            shifts.push(-shift / sum);
        } else if sum > 0.0005 {
            // Interreflections only.
            shadows += 1;
        }
    }
    let [tray, top] = [0.2, 0.95].map(|q| quantile(shifts.clone(), q));
    assert!(
        tray.abs() < 0.5,
        "direct light on the tray is off the window's centre: {tray}"
    );
    assert!(
        (2.0..4.5).contains(&top),
        "displacement on the tallest cookies: {top}"
    );
    assert!(shadows > 300, "{shadows} pixels in shadow");
}

#[test]
fn fewer_electrons_are_noisier() {
    let spread = |electrons| {
        let camera = Camera { electrons };
        let mut noise = RandomStreamId::Photograph(0).start(1);
        let codes = camera.photograph(&[[0.5; CHANNELS]; 5000], &mut noise);
        let codes: Vec<f64> = codes.into_iter().flatten().map(f64::from).collect();
        quantile(codes.clone(), 0.84) - quantile(codes, 0.16)
    };
    let ratio = spread(400.0) / spread(40_000.0);
    assert!((8.0..13.0).contains(&ratio), "{ratio}");
}
