//! `ltm-export report`: a page that says what a file may be used for, and where it comes from.

use std::fs;

use serde_json::Value;

use crate::session::{Session, run, stderr_text, succeed};

/// A session that is recovered from 40 of its 48 patterns.
fn recovered() -> Session {
    let session = Session::new();
    assert!(session.assemble(&[]).status.success());
    let mut manifest = session.manifest();
    manifest["title"] = "Rose <window>".into();
    manifest["notes"] = serde_json::json!({"lens": "105 mm"});
    manifest["rihgts"] = "none".into();
    let text = serde_json::to_string(&manifest).unwrap();
    fs::write(session.path("sequence/capture.json"), text).unwrap();
    let [capture, file] = ["sequence", "object.ltm"].map(|name| session.text(name));
    let options = ["--patterns", "40", "--window", "9"];
    let output = succeed(&[&["recover", &capture, "-o", &file], &options[..]].concat());
    let said = stderr_text(&output);
    assert!(said.contains(r#"rihgts (is it "rights"?)"#), "{said}");
    assert!(!said.contains("notes"), "{said}");
    session
}

fn report(session: &Session, more: &[&str]) -> Value {
    let [capture, file, page] =
        ["sequence", "object.ltm", "report.html"].map(|name| session.text(name));
    let arguments = ["report", &file, &capture, "-o", &page, "--json"];
    let output = succeed(&[&arguments[..], more].concat());
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_report_says_what_a_file_is_worth_and_where_it_comes_from() {
    let session = recovered();
    let report = report(&session, &[]);
    let held_out = &report["held_out"];
    assert_eq!(held_out["photographs"].as_array().unwrap().len(), 8);
    let number = |value: &Value| value.as_f64().unwrap();
    let snr = number(&held_out["fitted_snr_db"]);
    let limit = number(&held_out["noise_limit_db"]);
    // Of these few patterns, the recovery is worse than the noise.
    assert!(snr > 13.0 && snr < limit + 1.0, "{snr} of {limit}");
    let error = number(&held_out["standard_error_db"]);
    assert!(error > 0.0 && error < 2.0, "{error}");
    let grade = report["conclusion"]["grade"].as_str().unwrap();
    let expected = if snr >= 30.0 {
        "measurement"
    } else if snr >= 20.0 {
        "display"
    } else {
        "preview"
    };
    assert_eq!(grade, expected);
    // The hash in the file is that of the report's list.
    let origin = &report["provenance"]["metadata"]["origin"];
    assert_eq!(origin["notes"], r#"{"lens":"105 mm"}"#);
    let inputs = report["provenance"]["inputs"].as_array().unwrap();
    // The manifest, dark, flood, 20 photographs of Gray code, and 40 patterns with their photographs.
    assert_eq!(inputs.len(), 1 + 2 + 20 + 2 * 40);
    assert_eq!(report["provenance"]["are_inputs_unchanged"], true);
    assert_eq!(origin["inputs_sha256"].as_str().unwrap().len(), 64);
    let page = fs::read_to_string(session.path("report.html")).unwrap();
    for part in [
        "<title>Rose &lt;window&gt;</title>",
        "Relit: torch in the middle",
        "<figcaption>Photograph</figcaption>",
        "Error of the predictions",
        "Exposure of each photograph",
        "105 mm",
    ] {
        assert!(page.contains(part), "no {part}");
    }
    // Nothing is loaded.
    assert!(!page.contains("http") && !page.contains("<script"));
}

#[test]
fn a_report_names_what_is_wrong() {
    let session = recovered();
    // One held-out photograph is of another pattern.
    fs::copy(
        session.path("sequence/photos/0041.png"),
        session.path("sequence/photos/0044.png"),
    )
    .unwrap();
    let report = report(&session, &[]);
    let cause = report["conclusion"]["cause"].as_str().unwrap();
    assert!(cause.contains("photos/0044.png"), "{cause}");
    let limits = report["conclusion"]["limits"].to_string();
    assert!(limits.contains("0044.png"), "{limits}");
    // The recovery has not read it.
    assert_eq!(report["provenance"]["are_inputs_unchanged"], true);
    let manifest = session.path("sequence/capture.json");
    let text = fs::read_to_string(&manifest).unwrap() + "\n";
    fs::write(&manifest, text).unwrap();
    let [capture, file, page] =
        ["sequence", "object.ltm", "report.html"].map(|name| session.text(name));
    let output = succeed(&["report", &file, &capture, "-o", &page, "--json"]);
    let changed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(changed["provenance"]["are_inputs_unchanged"], false);
    assert_eq!(changed["conclusion"]["grade"], "untested");
    assert!(stderr_text(&output).contains("is this its capture?"));
}

#[test]
fn files_of_others_are_not_overwritten_and_other_captures_refused() {
    let session = recovered();
    let [capture, file, page] =
        ["sequence", "object.ltm", "notes.html"].map(|name| session.text(name));
    fs::write(&page, "<html>").unwrap();
    let output = run(&["report", &file, &capture, "-o", &page]);
    assert!(stderr_text(&output).contains("is not a report written by this program"));
    let other = session.text("object");
    let output = run(&["report", &file, &other, "-o", &session.text("r.html")]);
    let message = stderr_text(&output);
    assert!(
        message.contains("was recovered from more shots than the 1"),
        "{message}"
    );
    assert!(!output.status.success());
    assert!(!session.path("r.html").exists());
}
