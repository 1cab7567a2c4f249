//! The page: everything in one file, which prints as well.

use std::fmt::Write;

use anyhow::Result;

use super::QualityReport;
use super::conclusion::Grade;
use super::figures::{error_map, histogram_chart, photograph, series};
use super::predictions::{HeldOutAccuracy, Predictions};
use crate::cli::file_hash::checksum_lines;
use crate::cli::output_file::REPORT_START;
use crate::cli::report::format_bytes;
use crate::transport::{Decibels, Extent};

/// Error relative to noise that the map shows as the largest.
const LARGEST_ERROR: f64 = 4.0;
const STYLES: &str = include_str!("report.css");

/// The page of a report.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn html(report: &QualityReport, predictions: &Predictions) -> Result<String> {
    let title = title(report);
    let mut page = format!(
        "{REPORT_START}\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLES}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n"
    );
    let parts = [
        conclusion(report),
        pictures(predictions)?,
        held_out(report.held_out.as_ref(), predictions)?,
        photographs(report, predictions),
        findings(report),
        provenance(report),
    ];
    page += &parts.concat();
    page += "</main>\n</body>\n</html>\n";
    Ok(page)
}

fn title(report: &QualityReport) -> String {
    let named = report.provenance.metadata["title"].as_str();
    let name = named.filter(|title| !title.is_empty());
    escape(name.unwrap_or(&report.provenance.file.path))
}

fn conclusion(report: &QualityReport) -> String {
    let conclusion = &report.conclusion;
    let class = match conclusion.grade {
        Grade::Measurement | Grade::Display => "good",
        Grade::Preview | Grade::Untested => "fair",
        Grade::Unusable => "poor",
    };
    let mut html = format!(
        "<p class=\"conclusion {class}\">{}</p>\n",
        escape(&conclusion.sentence)
    );
    if let Some(cause) = &conclusion.cause {
        html += &format!("<p>{}</p>\n", escape(cause));
    }
    if !conclusion.limits.is_empty() {
        html += "<h2>What limits its use</h2>\n<ul>\n";
        for limit in &conclusion.limits {
            html += &format!("<li>{}</li>\n", escape(limit));
        }
        html += "</ul>\n";
    }
    html
}

fn pictures(predictions: &Predictions) -> Result<String> {
    let mut html = "<h2>Pictures</h2>\n<div class=\"pictures\">\n".to_owned();
    let flood = predictions.flood.as_ref().map(|(picture, _)| picture);
    if let Some(flood) = flood {
        html += &photograph(flood, flood.white)?;
    }
    for (i, picture) in predictions.relit.iter().enumerate() {
        // As bright as the photograph of the same light; a torch is darker than all elements.
        let white = flood.filter(|_| i == 0).unwrap_or(picture).white;
        html += &photograph(picture, white)?;
    }
    Ok(html + "</div>\n<p>Colours are the camera’s own.</p>\n")
}

fn held_out(accuracy: Option<&HeldOutAccuracy>, predictions: &Predictions) -> Result<String> {
    let mut html = "<h2>Accuracy</h2>\n".to_owned();
    let Some(accuracy) = accuracy else {
        return Ok(html + "<p>The recovery used all photographs.</p>\n");
    };
    html += &format!(
        "<p>{} photographs were held out of the recovery, and are predicted by the file. The signal-to-noise ratio (SNR) compares the \
         photographs with the error of their predictions: 20 dB is an error of 10 % of the brightness, 30 dB of 3 %, 40 dB of 1 %. The second \
         number counts: a shutter that is a little faster is no fault of the file.</p>\n<table>\n",
        accuracy.photographs.len()
    );
    let decibels = |snr: Option<Decibels>| snr.map_or("unknown".to_owned(), |snr| snr.to_string());
    let fitted = match accuracy.standard_error_db {
        Some(error) => format!("{} ± {error:.1} dB", decibels(accuracy.fitted_snr_db)),
        None => decibels(accuracy.fitted_snr_db),
    };
    for (name, value) in [
        ("SNR of the predictions", decibels(accuracy.snr_db)),
        ("with the exposure of each photograph fitted", fitted),
        (
            "if noise were the only error",
            decibels(accuracy.noise_limit_db),
        ),
        (
            "SNR of the predicted flood photograph",
            decibels(accuracy.flood_snr_db),
        ),
    ] {
        html += &format!("<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>\n");
    }
    html += "</table>\n";
    html += &map(predictions, accuracy.noise_limit_db.is_some())?;
    html += "<details><summary>Each of these photographs</summary>\n<table>\n<tr><th>Photograph</th><th>Exposure</th><th>Stray light</th>\
             <th>SNR</th><th>with its exposure</th></tr>\n";
    for photo in &accuracy.photographs {
        html += &format!(
            "<tr><td>{}</td><td>{:.3}</td><td>{:.4}</td><td>{}</td><td>{}</td></tr>\n",
            escape(&photo.photo),
            photo.gain,
            photo.stray_light,
            decibels(photo.snr_db),
            decibels(photo.fitted_snr_db)
        );
    }
    Ok(html + "</table>\n</details>\n")
}

/// The error at each pixel, relative to noise if that is known, else to the largest error.
fn map(predictions: &Predictions, is_relative: bool) -> Result<String> {
    let errors = predictions.errors.iter();
    let relative = |[error, noise]: &[f32; 2]| f64::from((error / noise.max(1e-12)).sqrt());
    let values: Vec<f64> = match is_relative {
        true => errors.map(relative).collect(),
        false => errors.map(|[error, _]| f64::from(error.sqrt())).collect(),
    };
    let (caption, largest) = match is_relative {
        true => (
            "Error of the predictions: dark blue is none, yellow is four times the noise and more",
            LARGEST_ERROR,
        ),
        false => (
            "Error of the predictions: dark blue is none, yellow is the largest",
            values.iter().copied().fold(f64::MIN_POSITIVE, f64::max),
        ),
    };
    error_map(caption, predictions.camera, &values, largest)
}

fn photographs(report: &QualityReport, predictions: &Predictions) -> String {
    let mut html = "<h2>Photographs</h2>\n<table>\n".to_owned();
    let mut row = |name: &str, value: String| {
        html += &format!("<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>\n");
    };
    let Extent { width, height } = predictions.camera;
    row("Camera pixels", format!("{width} × {height}"));
    if let Some(examined) = &report.check.examined {
        let [width, height] = examined.light;
        row("Light elements", format!("{width} × {height}"));
        let used = report.provenance.metadata["shots_used"].as_array();
        row(
            "Photographs",
            format!(
                "{}, of which {} were used for the file",
                examined.photographs,
                used.map_or(0, Vec::len)
            ),
        );
        let noise = examined.noise.gain.iter().zip(&examined.noise.floor);
        let noise: Vec<String> = noise
            .map(|(gain, floor)| format!("{:.2}", 100.0 * (0.5 * gain + floor).sqrt()))
            .collect();
        row(
            "Noise at half of white (red, green, blue)",
            format!("{} % of white", noise.join(", ")),
        );
    }
    if let Some(residual) = &report.correspondence_residual {
        row(
            "Distance of camera pixels from the light elements that their Gray code names; 0.4 to 0.9 is usual",
            format!(
                "median {:.2}, 95 % below {:.2} light elements",
                residual.median, residual.percentile_95
            ),
        );
    }
    let shots = &report.check.shot_reports;
    let gains: Vec<f64> = shots.iter().filter_map(|shot| shot.gain).collect();
    if let Some((low, high)) = range(&gains) {
        row(
            "Exposures, relative to one another",
            format!("{low:.3} to {high:.3}"),
        );
    }
    let shifts = shots.iter().filter_map(|shot| shot.shift);
    let shift = shifts.map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
    row(
        "Largest shift of a photograph",
        format!("{shift:.2} pixels"),
    );
    html += "</table>\n<div class=\"pictures\">\n";
    if let Some((low, high)) = range(&gains) {
        let margin = (0.1 * (high - low)).max(0.01);
        html += &series(
            &format!(
                "Exposure of each photograph, {:.3} (bottom) to {:.3} (top)",
                low - margin,
                high + margin
            ),
            &gains,
            [low - margin, high + margin],
        );
    }
    if let Some((_, histogram)) = &predictions.flood {
        let label = "Samples of the flood photograph, on a logarithmic scale";
        html += &histogram_chart(label, histogram);
    }
    html + "</div>\n"
}

fn range(values: &[f64]) -> Option<(f64, f64)> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (!values.is_empty()).then_some((low, high))
}

fn findings(report: &QualityReport) -> String {
    let check = &report.check;
    let mut html = format!(
        "<h2>Check of the capture</h2>\n<p>{}</p>\n",
        escape(&check.verdict)
    );
    if !check.findings.is_empty() {
        html += "<ul>\n";
        for finding in &check.findings {
            html += &format!(
                "<li>{}: {}</li>\n",
                finding.severity,
                escape(&finding.message)
            );
        }
        html += "</ul>\n";
    }
    html
}

fn provenance(report: &QualityReport) -> String {
    let provenance = &report.provenance;
    let mut html = "<h2>Origin</h2>\n<table>\n".to_owned();
    let mut row = |name: &str, value: &str| {
        if !value.is_empty() {
            // Writing to a string does not fail.
            let _ = writeln!(
                html,
                "<tr><th scope=\"row\">{name}</th><td>{}</td></tr>",
                escape(value)
            );
        }
    };
    let text = |field: &str| {
        provenance.metadata[field]
            .as_str()
            .unwrap_or_default()
            .to_owned()
    };
    let file = &provenance.file;
    row(
        "File",
        &format!("{}, {}", file.path, format_bytes(file.bytes)),
    );
    row("SHA-256 of the file", &file.sha256);
    for (name, field) in [
        ("Creator", "creator"),
        ("Rights", "rights"),
        ("Written by", "writer"),
        ("Method", "method"),
    ] {
        row(name, &text(field));
    }
    if let Some(shooting) = &provenance.shooting {
        let taken = |at: Option<&serde_json::Value>| {
            let taken = at.and_then(|photo| photo["taken"].as_str());
            taken.unwrap_or_default().to_owned()
        };
        let photos = shooting["photographs"].as_array();
        let (first, last) = (
            taken(photos.and_then(|photos| photos.first())),
            taken(photos.and_then(|photos| photos.last())),
        );
        row("Photographed", &format!("{first} to {last}"));
        let exposure = shooting["exposure"].as_str();
        row(
            "Exposure time",
            &exposure.map_or(String::new(), |exposure| format!("{exposure} s")),
        );
        let again = photos.into_iter().flatten();
        let again = again
            .filter(|photo| photo["attempts"].as_u64() > Some(1))
            .count();
        row(
            "Photographs that were taken more than once",
            &again.to_string(),
        );
    }
    if let Some(unchanged) = provenance.are_inputs_unchanged {
        row(
            "Photographs, patterns and manifest",
            match unchanged {
                true => "as they were when the file was recovered",
                false => "not what they were when the file was recovered",
            },
        );
    }
    row("Report written by", provenance.program);
    row("Report written", &report.written);
    html += "</table>\n";
    let json = |value: &serde_json::Value| serde_json::to_string_pretty(value).unwrap_or_default();
    html += &details("Metadata of the file", &json(&provenance.metadata));
    html += &details("Manifest of the capture", &json(&provenance.manifest));
    let hashes = checksum_lines(&provenance.inputs);
    html += &details(
        "SHA-256 of the inputs (sha256sum --check reads it)",
        &hashes,
    );
    html
}

fn details(summary: &str, text: &str) -> String {
    format!(
        "<details><summary>{summary}</summary>\n<pre>{}</pre>\n</details>\n",
        escape(text)
    )
}

/// Text as HTML.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            _ => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_files_is_no_markup() {
        assert_eq!(
            escape("<b title=\"x\">&"),
            "&lt;b title=&quot;x&quot;&gt;&amp;"
        );
    }
}
