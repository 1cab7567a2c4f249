//! From a display to a capture: `ltm-export patterns`, photographs by a simulated camera, and `ltm-export assemble`.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::common::copy_folder;
use crate::session::{Session, run, stderr_text, succeed};

#[test]
fn a_session_becomes_a_capture_that_is_recovered() {
    let session = Session::new();
    let output = session.assemble(&[]);
    assert!(output.status.success(), "{}", stderr_text(&output));
    assert!(
        !stderr_text(&output).contains("warning"),
        "{}",
        stderr_text(&output)
    );
    let manifest = session.manifest();
    assert_eq!(manifest["shots"].as_array().unwrap().len(), 48);
    // The display's response is measured by the ramp: that of gamma 2.2.
    for pair in manifest["light"]["response"].as_array().unwrap() {
        let [code, emission] = [0, 1].map(|i| pair[i].as_f64().unwrap());
        assert!(
            (emission - (code / 255.0).powf(2.2)).abs() < 0.005,
            "{pair}"
        );
    }
    let [capture, file] = ["sequence", "object.ltm"].map(|name| session.text(name));
    let recovered = succeed(&[
        "recover",
        &capture,
        "-o",
        &file,
        "--lossless",
        "--json",
        "--patterns",
        "40",
    ]);
    let report: Value = serde_json::from_slice(&recovered.stdout).unwrap();
    assert_eq!(report["saturated_samples"], 0);
    // The known transport is that of the object.
    copy_folder(
        &session.path("object/truth"),
        &session.path("sequence/truth"),
    );
    let evaluated = succeed(&["evaluate", &file, &capture, "--json"]);
    let evaluated: Value = serde_json::from_slice(&evaluated.stdout).unwrap();
    let snr = evaluated["snr_db"].as_f64().unwrap();
    assert!(snr > 12.0, "{snr}");
    let again = session.assemble(&[]);
    assert!(
        stderr_text(&again).contains("is there already"),
        "{}",
        stderr_text(&again)
    );
}

#[test]
fn photographs_that_do_not_fit_the_sequence_are_refused_by_name() {
    let session = Session::new();
    let hidden = session.path("hidden.png");
    // Dark, flood, 8 of the ramp, and 20 of the Gray code come before the patterns.
    fs::rename(session.photo(14), &hidden).unwrap();
    let error = session.refusal();
    assert!(
        error.contains("there are 87 photographs of 88 pictures"),
        "{error}"
    );
    assert!(
        error.contains("one is missing, of display/0014-graycode-"),
        "{error}"
    );
    fs::rename(&hidden, session.photo(14)).unwrap();
    fs::copy(session.photo(14), session.path("photos/IMG_0015b.png")).unwrap();
    let error = session.refusal();
    assert!(error.contains("one is too many"), "{error}");
    fs::remove_file(session.path("photos/IMG_0015b.png")).unwrap();
    fs::rename(session.photo(0), &hidden).unwrap();
    fs::rename(session.photo(1), session.photo(0)).unwrap();
    fs::rename(&hidden, session.photo(1)).unwrap();
    let error = session.refusal();
    assert!(
        error.contains("IMG_0001.png is not dark, as display/0000-dark.png is"),
        "{error}"
    );
    let forced = session.assemble(&["--force"]);
    assert!(forced.status.success(), "{}", stderr_text(&forced));
    assert!(
        stderr_text(&forced).contains("warning: "),
        "{}",
        stderr_text(&forced)
    );
}

#[test]
fn wrong_input_is_named_with_its_remedy() {
    let session = Session::new();
    let (sequence, photos) = (session.text("sequence"), session.text("photos"));
    let error = |arguments: &[&str]| {
        let output = run(arguments);
        assert!(!output.status.success(), "{arguments:?}");
        stderr_text(&output)
    };
    for (arguments, part) in [
        (
            &["assemble", &photos, "--photos", &photos][..],
            "is this a folder that `ltm-export patterns` wrote?",
        ),
        (
            &["assemble", &sequence, "--photos", &sequence],
            "has no raw, PNG, TIFF or OpenEXR files",
        ),
        (
            &["assemble", &sequence, "--photos", "none.png"],
            "none.png: there is no such file or folder",
        ),
        (
            &[
                "assemble", &sequence, "--photos", &photos, "--crop", "0,0,99x9",
            ],
            "has 48x48 pixels, but --crop keeps 99x9",
        ),
        (
            &[
                "assemble",
                &sequence,
                "--photos",
                &photos,
                "--undistort",
                "60,60,200,24,-0.1",
            ],
            "has 48x48 pixels, but the centre of --undistort is (200, 24)",
        ),
        (
            &[
                "assemble",
                &sequence,
                "--photos",
                &photos,
                "--undistort",
                "60,60",
            ],
            "as OpenCV's calibrateCamera does",
        ),
        (
            &[
                "assemble", &sequence, "--photos", &photos, "--black", "9", "--white", "9",
            ],
            "--white must be above --black",
        ),
        (
            &[
                "patterns", "-o", "x", "--screen", "100x100", "--light", "200x10",
            ],
            "use at most 100x100",
        ),
    ] {
        let error = error(arguments);
        assert!(error.contains(part), "no {part}: {error}");
    }
    let photo = session.photo(3);
    image::open(&photo)
        .unwrap()
        .into_rgb8()
        .save(&photo)
        .unwrap();
    let message = session.refusal();
    assert!(
        message.contains("IMG_0004.png: has 8 bits a sample"),
        "{message}"
    );
    assert!(message.contains("--response srgb"), "{message}");
    let content = fs::read(&photo).unwrap();
    fs::write(&photo, &content[..content.len() / 2]).unwrap();
    let message = session.refusal();
    assert!(
        message.contains("IMG_0004.png: cannot be decoded as PNG: it is cut off or damaged; copy"),
        "{message}"
    );
    fs::write(&photo, "text").unwrap();
    assert!(
        session
            .refusal()
            .contains("IMG_0004.png: cannot be decoded")
    );
    let raw = photo.with_extension("CR2");
    fs::rename(&photo, &raw).unwrap();
    let names = (0..88).map(|i| {
        if i == 3 {
            raw.clone()
        } else {
            session.photo(i)
        }
    });
    let names: Vec<String> = names
        .map(|path| path.to_str().unwrap().to_owned())
        .collect();
    let mut arguments = vec!["assemble", &sequence, "--photos"];
    arguments.extend(names.iter().map(String::as_str));
    let message = error(&arguments);
    assert!(
        message.contains("IMG_0004.CR2: dcraw_emu cannot convert it"),
        "{message}"
    );
    assert!(session.refusal().contains("has raw files beside PNG"));
    // Another file of a folder is no photograph.
    fs::rename(&raw, photo.with_extension("JPG")).unwrap();
    assert!(session.refusal().contains("one is missing"));
    fs::create_dir(session.path("sequence/photos")).unwrap();
    fs::write(session.path("sequence/photos/mine.tif"), "").unwrap();
    let output = session.assemble(&[]);
    let message = stderr_text(&output);
    assert!(
        message.contains("photos: is there already, but photos/, graycode/ and"),
        "{message}"
    );
}

#[test]
fn photographs_of_other_types_are_read() {
    let session = Session::new();
    // 8 bits with the curve of sRGB, of which some are grey, and some have an alpha channel, as TIFF.
    for i in 0..88 {
        let photo = session.photo(i);
        let linear = image::open(&photo).unwrap().into_rgb16();
        let encoded = image::RgbImage::from_fn(48, 48, |x, y| {
            image::Rgb(linear.get_pixel(x, y).0.map(|code| {
                let y = ((f64::from(code) - 512.0) / 59_488.0).clamp(0.0, 1.0);
                let curve = match y {
                    y if y <= 0.003_130_8 => 12.92 * y,
                    y => 1.055 * y.powf(1.0 / 2.4) - 0.055,
                };
                (255.0 * curve).round() as u8
            }))
        });
        fs::remove_file(&photo).unwrap();
        let image = image::DynamicImage::ImageRgb8(encoded);
        match i % 2 {
            0 => image.save(&photo).unwrap(),
            _ => image
                .into_rgba8()
                .save(photo.with_extension("tif"))
                .unwrap(),
        }
    }
    let [sequence, photos] = ["sequence", "photos"].map(|name| session.text(name));
    // One with 16 bits is not like the others.
    let first = session.photo(0);
    let encoded = image::open(&first).unwrap();
    encoded.to_rgb16().save(&first).unwrap();
    let mixed = run(&[
        "assemble",
        &sequence,
        "--photos",
        &photos,
        "--response",
        "srgb",
    ]);
    assert!(
        stderr_text(&mixed).contains("export all photographs alike"),
        "{}",
        stderr_text(&mixed)
    );
    encoded.save(&first).unwrap();
    succeed(&[
        "assemble",
        &sequence,
        "--photos",
        &photos,
        "--response",
        "srgb",
        "--bin",
        "2",
    ]);
    let manifest = session.manifest();
    assert_eq!(manifest["camera"]["width"], 24);
    assert_eq!(manifest["camera"].get("response"), None);
    let response = &manifest["light"]["response"];
    let middle = response
        .as_array()
        .unwrap()
        .iter()
        .find(|pair| pair[0] == 128.0)
        .unwrap();
    assert!(
        (middle[1].as_f64().unwrap() - 0.2195).abs() < 0.01,
        "{middle}"
    );
}

#[test]
fn the_distortion_of_a_lens_is_undone() {
    let session = Session::simulated(
        &["--camera", "96x96", "--distortion", "10"],
        "96x96",
        "200x150",
        "4",
    );
    // The simulated lens in OpenCV's terms: the focal length is the distance of the corners from the centre.
    let lens = "67.882,67.882,47.5,47.5,-0.11111,0.03704,0,0,-0.01646";
    let residual = |undistort: &[&str]| {
        let assembled = session.assemble(undistort);
        assert!(assembled.status.success(), "{}", stderr_text(&assembled));
        let sequence = session.text("sequence");
        let report = succeed(&["calibrate", &sequence, "--force", "--json"]).stdout;
        let report: Value = serde_json::from_slice(&report).unwrap();
        for name in ["photos", "graycode"] {
            fs::remove_dir_all(session.path("sequence").join(name)).unwrap();
        }
        fs::remove_file(session.path("sequence/capture.json")).unwrap();
        report["affine_residual"]["percentile_95"].as_f64().unwrap()
    };
    let (bent, straight) = (residual(&[]), residual(&["--undistort", lens]));
    // Scattering leaves three quarters of it.
    assert!(straight < 0.85 * bent, "{straight} {bent}");
}

/// The tray of cookies hardly scatters.
#[test]
fn a_display_that_blurs_single_lines_is_noted() {
    for (fault, is_noted) in [(None, false), (Some("smooth=0.5"), true)] {
        let folder = TempDir::new().unwrap();
        let [object, sequence, photos] = ["object", "sequence", "photos"]
            .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
        let light = ["--light", "24x24", "--patterns", "4"];
        let simulate = ["simulate", "cookies", "-o", &object, "--camera", "48x48"];
        succeed(&[&simulate[..], &light].concat());
        let patterns = ["patterns", "-o", &sequence, "--screen", "100x100"];
        succeed(&[&patterns[..], &light].concat());
        let photograph = [
            "photograph",
            &object,
            "--sequence",
            &sequence,
            "-o",
            &photos,
        ];
        let fault: Vec<&str> = fault.iter().flat_map(|fault| ["--fault", fault]).collect();
        succeed(&[&photograph[..], &fault].concat());
        let levels = ["--black", "512", "--white", "60000"];
        let assembled =
            succeed(&[&["assemble", &sequence, "--photos", &photos], &levels[..]].concat());
        let text = stderr_text(&assembled);
        assert_eq!(
            text.contains("note: lines of one light element"),
            is_noted,
            "{text}"
        );
    }
}

#[test]
fn the_player_has_the_sequence_and_the_pictures_have_whole_elements() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("session");
    let output = succeed(&[
        "patterns",
        "-o",
        path.to_str().unwrap(),
        "--screen",
        "100x60",
        "--light",
        "12x8",
        "--patterns",
        "3",
        "--screen-width",
        "250",
        "--spread",
        "30",
        "--camera",
        "600x400",
    ]);
    let plan = String::from_utf8(output.stdout).unwrap();
    for part in [
        "7 x 7 display pixels",
        "17.50 mm wide",
        "window of 7 x 7",
        "averaging",
    ] {
        assert!(plan.contains(part), "no {part}: {plan}");
    }
    let sequence: Value =
        serde_json::from_slice(&fs::read(path.join("sequence.json")).unwrap()).unwrap();
    let pictures = sequence["pictures"].as_array().unwrap();
    let player = fs::read_to_string(path.join("player.html")).unwrap();
    for picture in pictures {
        let name = picture["picture"].as_str().unwrap();
        assert!(player.contains(name), "{name}");
        let shown = image::open(path.join(name)).unwrap().into_luma8();
        assert_eq!(shown.dimensions(), (100, 60));
        if let Some(pattern) = picture["pattern"].as_str() {
            let pattern = image::open(path.join(pattern)).unwrap().into_luma8();
            assert_eq!(pattern.dimensions(), (12, 8));
            for (u, v, code) in pattern.enumerate_pixels() {
                let square = (0..49).map(|i| shown.get_pixel(8 + 7 * u + i % 7, 2 + 7 * v + i / 7));
                assert!(
                    square.into_iter().all(|shown| shown == code),
                    "{name}: {u} {v}"
                );
            }
        }
    }
    assert!(!player.contains("/* player."));
}

/// The stand-in for a camera that `ltm-export shoot` releases.
#[test]
fn one_picture_is_photographed_as_in_its_sequence() {
    let session = Session::new();
    let [object, sequence, photo] =
        ["object", "sequence", "one.png"].map(|name| session.text(name));
    // The first random pattern.
    let picture = session.text("sequence/display/0030-pattern-0000.png");
    let start = ["photograph", &object, "--sequence", &sequence];
    let photograph = |picture: &str, exposure: &str| {
        let options = ["--picture", picture, "-o", &photo, "--exposure", exposure];
        run(&[&start[..], &options, &["--seed", "7"]].concat())
    };
    let mean = |path: &std::path::Path| {
        let samples = image::open(path).unwrap().into_rgb16().into_raw();
        let sum: f64 = samples.iter().map(|code| f64::from(*code) - 512.0).sum();
        sum / samples.len() as f64
    };
    assert!(photograph(&picture, "1/15").status.success());
    let own = mean(&session.path("one.png"));
    let listed = mean(&session.photo(30));
    assert!((own / listed - 1.0).abs() < 0.01, "{own} {listed}");
    assert!(photograph(&picture, "1/30").status.success());
    let half = mean(&session.path("one.png"));
    assert!((half / own - 0.5).abs() < 0.01, "{half}");
    let other = session.text("sequence/patterns/0000.png");
    let message = stderr_text(&photograph(&other, "1/15"));
    assert!(
        message.contains("0000.png: has another size than the display, 200x150"),
        "{message}"
    );
    let message = stderr_text(&photograph(&picture, "fast"));
    assert!(message.contains("a fraction of them"), "{message}");
}

/// Without a page and a camera, `shoot` says what it needs.
#[test]
fn wrong_options_of_a_session_are_named_with_their_remedy() {
    let session = Session::new();
    let sequence = session.text("sequence");
    for (options, part) in [
        (&["--camera", "nikon"][..], "neither a preset"),
        (
            &["--camera", "a {file} {exposrue}"],
            "{exposrue} is not known",
        ),
        (
            &["--camera", "sh {file} {exposure}"],
            "list the camera's in --exposures",
        ),
        (
            &["--camera", "sh {file}", "--exposures", "1/60"],
            "needs a --camera with {exposure}",
        ),
        (
            &["--camera", "sh {file}", "--extension", "jpg"],
            "--extension jpg: is of no photograph that can be read",
        ),
        (&["--camera", "watch:/no/such/folder"], "is no folder"),
    ] {
        let output = run(&[&["shoot", &sequence, "--port", "0"], options].concat());
        let message = stderr_text(&output);
        assert!(!output.status.success());
        assert!(message.contains(part), "no {part}: {message}");
    }
    fs::remove_file(session.path("sequence/display/0003-ramp-032.png")).unwrap();
    let output = run(&["shoot", &sequence, "--camera", "sh {file}", "--port", "0"]);
    let message = stderr_text(&output);
    assert!(
        message.contains("0003-ramp-032.png: is missing"),
        "{message}"
    );
}
