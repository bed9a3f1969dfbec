//! Data files of libSVM and svmlight, read: `label index:value ...`, indices from 1, ascending, zeros left
//! out.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use super::Data;
use crate::error::{Result, SvmError};
use crate::text::{FeatureLimit, Lines};

/// Guards against absurd or hostile files. Reading takes up to three times the memory of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataLimits {
    /// Most rows. Default 100,000,000.
    pub rows: usize,
    /// Largest feature index. Default 1,000,000.
    pub features: usize,
    /// Most values of all rows together; [`Data`] is dense, 8 bytes a value. Default 2^28, two GiB.
    pub values: usize,
}

impl Default for DataLimits {
    fn default() -> Self {
        Self { rows: 100_000_000, features: 1_000_000, values: 1 << 28 }
    }
}

/// How to read data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DataOptions {
    /// The number of features; `None` takes the largest index in the file.
    pub features: Option<usize>,
    /// Guards.
    pub limits: DataLimits,
}

/// One row as it stands in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRow {
    /// The class or the value to be learned.
    pub label: f64,
    /// Index (from 1, ascending) and value of the features that are there; the others are zero.
    pub features: Vec<(u32, f64)>,
}

/// Reads row by row, in constant memory. Comments from `#` to the end of the line, and lines without anything
/// else, are skipped; `qid:`, which only ranking has, is refused.
pub struct DataReader<R> {
    lines: Lines<R>,
    limit: FeatureLimit,
    failed: bool,
}

impl DataReader<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(path: impl AsRef<Path>, options: &DataOptions) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(SvmError::reading(path))?;
        Ok(Self::new(BufReader::with_capacity(1 << 18, file), &path.display().to_string(), options))
    }
}

impl<R: BufRead> DataReader<R> {
    /// Reads from any reader; `name` is what messages call it.
    pub fn new(reader: R, name: &str, options: &DataOptions) -> Self {
        let limit = FeatureLimit {
            count: options.features.unwrap_or(options.limits.features).min(u32::MAX as usize),
            asked: options.features.is_some(),
        };
        Self { lines: Lines::new(reader, name), limit, failed: false }
    }

    /// Reads the next row into `row`, reusing its memory; `false` after the last.
    ///
    /// # Errors
    /// The line is malformed; the message has its number.
    pub fn read_row(&mut self, row: &mut SparseRow) -> Result<bool> {
        while let Some(line) = self.lines.next_line()? {
            let mut words = line.before('#').words();
            let Some(label) = words.next() else { continue };
            if label.text.contains(':') {
                return Err(label.error("the line has no label"));
            }
            row.label = label.number("the label")?;
            row.features.clear();
            let mut previous = 0;
            for word in words {
                if word.text.starts_with("qid:") {
                    return Err(word.error("qid is for ranking, which is not supported; remove it"));
                }
                let (index, value) = word.feature(previous, self.limit)?;
                previous = index;
                // The limit is at most u32::MAX.
                row.features.push((index as u32, value));
            }
            return Ok(true);
        }
        Ok(false)
    }
}

impl<R: BufRead> Iterator for DataReader<R> {
    type Item = Result<SparseRow>;

    /// After an error there is nothing more.
    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let mut row = SparseRow::default();
        match self.read_row(&mut row) {
            Ok(true) => Some(Ok(row)),
            Ok(false) => None,
            Err(error) => {
                self.failed = true;
                Some(Err(error))
            }
        }
    }
}

impl Data {
    /// Reads a data file whole.
    ///
    /// # Errors
    /// The file cannot be read, a line is malformed, or the data are beyond the limits; the message has the
    /// line.
    pub fn read(path: impl AsRef<Path>, options: &DataOptions) -> Result<Self> {
        Self::collect(DataReader::open(path, options)?, options)
    }

    /// Reads data from any reader; `name` is what messages call it.
    ///
    /// # Errors
    /// As [`Data::read`].
    pub fn read_from(reader: impl BufRead, name: &str, options: &DataOptions) -> Result<Self> {
        Self::collect(DataReader::new(reader, name, options), options)
    }

    fn collect<R: BufRead>(mut reader: DataReader<R>, options: &DataOptions) -> Result<Self> {
        let limits = &options.limits;
        let (mut labels, mut ends, mut entries) = (Vec::new(), Vec::new(), Vec::new());
        let mut largest = options.features.unwrap_or(0);
        let mut row = SparseRow::default();
        while reader.read_row(&mut row)? {
            largest = largest.max(row.features.last().map_or(0, |f| f.0 as usize));
            labels.push(row.label);
            entries.extend_from_slice(&row.features);
            ends.push(entries.len());
            if labels.len() > limits.rows {
                return Err(reader.lines.error(format!("more rows than the limit of {}", limits.rows)));
            }
            if labels.len().saturating_mul(largest) > limits.values {
                return Err(reader.lines.error(format!(
                    "the data need more than the limit of {} values: {} rows of {largest} features",
                    limits.values,
                    labels.len()
                )));
            }
        }
        let mut rows = vec![0.0; labels.len() * largest];
        let mut start = 0;
        for (i, end) in ends.into_iter().enumerate() {
            for (index, value) in &entries[start..end] {
                rows[i * largest + *index as usize - 1] = *value;
            }
            start = end;
        }
        Ok(Self { features: largest, rows, labels, weights: None })
    }
}
