//! A table of faults of rigs: how well captures with each of them are recovered, and what the recovery reports.

use super::error::StudyError;
use super::section::{MarkdownTable, ReportSection, snr_cell};
use crate::transport::Decibels;

/// What recovery makes of a capture with a fault.
#[derive(Clone, Debug, PartialEq)]
pub enum FaultOutcome {
    /// The capture cannot have the fault.
    Inapplicable,
    /// The capture is recovered.
    Recovered {
        /// SNR of the recovered transport against the known one.
        snr: Option<Decibels>,
        /// The same with `--trust estimated`, if that differs.
        trusted_snr: Option<Decibels>,
        /// Names of what the recovery corrects, leaves out and warns of.
        findings: Vec<String>,
    },
    /// The capture is refused, for this reason.
    Refused(String),
}

impl FaultOutcome {
    /// SNR of the recovered transport, if there is one.
    pub fn snr(&self) -> Option<Decibels> {
        match self {
            Self::Recovered { snr, .. } => *snr,
            Self::Inapplicable | Self::Refused(_) => None,
        }
    }

    /// What the recovery reports; empty if nothing.
    pub fn report(&self) -> String {
        match self {
            Self::Inapplicable => "—".to_owned(),
            Self::Recovered {
                findings,
                trusted_snr,
                ..
            } => {
                let trusted = trusted_snr.map(|snr| format!("{snr} with the estimate"));
                let parts: Vec<String> = findings.iter().cloned().chain(trusted).collect();
                parts.join(", ")
            }
            Self::Refused(reason) => format!("refused: {reason}"),
        }
    }
}

/// A capture, and its outcomes with each fault.
#[derive(Clone, Debug)]
pub struct FaultedCapture {
    /// The capture's name.
    pub name: String,
    /// One for each row of the table.
    pub outcomes: Vec<FaultOutcome>,
}

/// The section with the outcomes of `captures`, a row for each of `faults`, and its CSV file `file_name`.
///
/// # Errors
/// [`StudyError`] if the table cannot be written as CSV.
pub fn fault_table(
    file_name: &str,
    faults: &[String],
    captures: &[FaultedCapture],
) -> Result<ReportSection, StudyError> {
    let columns = captures.iter().map(|capture| {
        let name = &capture.name;
        format!(" | {name} (dB) | {name}: reported")
    });
    let mut table = MarkdownTable::new(&format!("fault{}", columns.collect::<String>()));
    for (i, fault) in faults.iter().enumerate() {
        let outcomes = captures.iter().map(|capture| &capture.outcomes[i]);
        let cells = outcomes.flat_map(|outcome| [snr_cell(outcome.snr()), outcome.report()]);
        table.add_row(std::iter::once(fault.clone()).chain(cells));
    }
    let names: Vec<&str> = captures.iter().map(|c| c.name.as_str()).collect();
    let mut section = ReportSection::new(&format!("Faults of rigs: {}", names.join(", ")));
    section.add_paragraph(
        "`ltm-export photograph --fault` photographs a capture again with each fault, and `ltm-export recover --lossless` \
         recovers it: SNR of T in dB, and what `recover` reports. `gain`, `stray_light` and `shift` of photographs are \
         corrected, and `hot_pixels` and `dead_pixels` filled; the other words are codes of warnings and of photographs that are left out, with \
         their numbers (docs/capture.md explains faults and codes). Where a response is told that differs from the declared one, \
         `--trust estimated` recovers with the estimate. “—”: the capture cannot have this fault.",
    );
    section.add_paragraph(&table.markdown());
    section.add_csv(file_name, &table)?;
    Ok(section)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_row_for_each_fault_and_two_columns_for_each_capture() {
        let outcomes = vec![
            FaultOutcome::Recovered {
                snr: Some(Decibels(30.0)),
                trusted_snr: Some(Decibels(31.0)),
                findings: vec!["gain".to_owned(), "low-snr".to_owned()],
            },
            FaultOutcome::Refused("too dark".to_owned()),
            FaultOutcome::Inapplicable,
        ];
        let capture = FaultedCapture {
            name: "tray".to_owned(),
            outcomes,
        };
        let faults = ["jitter", "slip", "gamma"].map(str::to_owned);
        let section = fault_table("faults", &faults, &[capture]).unwrap();
        let (path, csv) = &section.files[0];
        assert_eq!(path, "faults.csv");
        assert_eq!(
            String::from_utf8_lossy(csv),
            "fault,tray (dB),tray: reported\njitter,30.00,\"gain, low-snr, 31.00 dB with the estimate\"\nslip,,refused: too dark\ngamma,,—\n"
        );
        assert!(
            section
                .markdown
                .contains("| jitter | 30.00 | gain, low-snr, 31.00 dB with the estimate |")
        );
    }
}
