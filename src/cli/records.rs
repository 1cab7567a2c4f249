//! Files of numbered records: checkpoints, and what the stages of a recovery leave for one another.
//!
//! A record has its number, the length of its content, the CRC-32C of these two and the content (4 bytes each,
//! little-endian), and the content. Records are only appended, so that a process that ends leaves at most one incomplete
//! record, the last.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

use anyhow::{Context, Result};

/// Bytes before the content of a record: number, length, checksum.
pub const RECORD_HEAD_BYTES: usize = 12;

/// A record that was read.
pub struct Record {
    pub number: u32,
    pub content: Vec<u8>,
    /// Of its content in the file.
    pub range: Range<u64>,
    /// Whether the content is as it was written.
    pub is_intact: bool,
}

/// What precedes a record's content.
pub struct RecordHead {
    pub number: u32,
    pub length: u32,
    /// Of the content in the file, which may end before.
    pub range: Range<u64>,
    bytes: [u8; RECORD_HEAD_BYTES],
}

/// Reads records one after the other.
pub struct RecordReader<R> {
    reader: R,
    position: u64,
    file_bytes: u64,
}

impl<R: Read> RecordReader<R> {
    /// Of a file of so many bytes, which `reader` reads from `position` on.
    pub fn new(reader: R, position: u64, file_bytes: u64) -> Self {
        Self {
            reader,
            position,
            file_bytes,
        }
    }

    /// The next record's head; `None` at the end of the file, or if it ends within the head.
    pub fn head(&mut self) -> io::Result<Option<RecordHead>> {
        let start = self.position + RECORD_HEAD_BYTES as u64;
        if self.file_bytes < start {
            return Ok(None);
        }
        let mut bytes = [0; RECORD_HEAD_BYTES];
        self.reader.read_exact(&mut bytes)?;
        let (words, _) = bytes.as_chunks();
        let [number, length] = [0, 1].map(|i| u32::from_le_bytes(words[i]));
        Ok(Some(RecordHead {
            number,
            length,
            range: start..start + u64::from(length),
            bytes,
        }))
    }

    /// The record of the head that was just read; `None` if the file ends before its end.
    pub fn record(&mut self, head: RecordHead) -> io::Result<Option<Record>> {
        if self.file_bytes < head.range.end {
            return Ok(None);
        }
        let mut content = vec![0; head.length as usize];
        self.reader.read_exact(&mut content)?;
        self.position = head.range.end;
        let (fields, crc) = head.bytes.split_at(RECORD_HEAD_BYTES - 4);
        Ok(Some(Record {
            number: head.number,
            is_intact: crc == checksum(fields, &content),
            content,
            range: head.range,
        }))
    }

    /// The next record; `None` if the file ends before its end.
    pub fn next(&mut self) -> io::Result<Option<Record>> {
        match self.head()? {
            Some(head) => self.record(head),
            None => Ok(None),
        }
    }
}

/// Reads the content of a record at its [range](Record::range).
///
/// # Errors
/// If the file cannot be read, or ends before.
pub fn read_content(mut file: &File, range: &Range<u64>) -> io::Result<Vec<u8>> {
    let mut content = vec![0; (range.end - range.start) as usize];
    file.seek(SeekFrom::Start(range.start))?;
    file.read_exact(&mut content)?;
    Ok(content)
}

/// The bytes of a record.
pub fn encode_record(number: u32, content: &[u8]) -> Result<Vec<u8>> {
    let length = u32::try_from(content.len()).context("a record is too large")?;
    let mut bytes = [number, length].map(u32::to_le_bytes).concat();
    let crc = checksum(&bytes, content);
    bytes.extend(crc);
    bytes.extend(content);
    Ok(bytes)
}

fn checksum(fields: &[u8], content: &[u8]) -> [u8; 4] {
    crc32c::crc32c_append(crc32c::crc32c(fields), content).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_read_to_the_last_complete_one() {
        let contents = [vec![1, 2, 3], vec![], vec![7; 100]];
        let records = contents.iter().zip(5..);
        let records = records.map(|(content, number)| encode_record(number, content).unwrap());
        let bytes = records.collect::<Vec<_>>().concat();
        for length in 0..=bytes.len() {
            let mut reader = RecordReader::new(&bytes[..length], 0, length as u64);
            let mut end = 0;
            for (content, number) in contents.iter().zip(5..) {
                end += RECORD_HEAD_BYTES + content.len();
                let record = reader.next().unwrap();
                assert_eq!(record.is_some(), end <= length);
                let Some(record) = record else { break };
                assert_eq!((&record.content, record.number), (content, number));
                assert_eq!(record.range.end, end as u64);
                assert!(record.is_intact);
            }
        }
        let mut damaged = bytes;
        damaged[RECORD_HEAD_BYTES] ^= 1;
        let end = damaged.len() as u64;
        let record = RecordReader::new(&damaged[..], 0, end).next().unwrap();
        assert!(!record.unwrap().is_intact);
    }
}
