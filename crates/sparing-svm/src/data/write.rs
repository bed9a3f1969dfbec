//! Data files of libSVM and svmlight, written.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use super::Data;
use crate::atomic::write_file;
use crate::error::{Result, SvmError};
use crate::text::push_number;

/// Writes row by row. Numbers have the fewest digits that read back as the same bits. Zeros are left out, but
/// the first row names its last feature even if that is zero, so that the number of features is not lost.
pub struct DataWriter<W> {
    writer: W,
    name: String,
    features: usize,
    rows: usize,
    text: String,
}

impl<W: Write> DataWriter<W> {
    /// Writes rows of `features` values; `name` is what messages call the writer, which should be buffered.
    pub fn new(writer: W, name: &str, features: usize) -> Self {
        Self { writer, name: name.to_owned(), features, rows: 0, text: String::new() }
    }

    /// Writes one row.
    ///
    /// # Errors
    /// The row has another length, a value is not finite, or the writer refuses.
    pub fn write_row(&mut self, label: f64, row: &[f64]) -> Result<()> {
        if row.len() != self.features {
            return Err(SvmError::Data(format!(
                "row {} has {} values instead of {}",
                self.rows,
                row.len(),
                self.features
            )));
        }
        if !label.is_finite() {
            return Err(SvmError::Data(format!("the label of row {} is not finite: {label}", self.rows)));
        }
        if let Some(j) = row.iter().position(|v| !v.is_finite()) {
            let (i, value) = (self.rows, row[j]);
            return Err(SvmError::Data(format!("feature {} of row {i} is not finite: {value}", j + 1)));
        }
        self.text.clear();
        push_number(&mut self.text, label);
        for (j, value) in row.iter().enumerate() {
            // A negative zero is written: its bits differ.
            if value.to_bits() != 0 || (self.rows == 0 && j + 1 == self.features) {
                let _ = write!(self.text, " {}:", j + 1);
                push_number(&mut self.text, *value);
            }
        }
        self.text.push('\n');
        self.rows += 1;
        let written = self.writer.write_all(self.text.as_bytes());
        written.map_err(|source| SvmError::Io { action: "write", file: self.name.clone(), source })
    }

    /// Gives the writer back. It is not flushed.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

impl Data {
    /// Writes a data file, without the weights. It appears under its name only when it is complete.
    ///
    /// # Errors
    /// The data are not valid, or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        self.validate()?;
        write_file(path, |file| self.write_rows(file, &path.display().to_string()))
    }

    /// The text of [`Data::write`].
    ///
    /// # Errors
    /// The data are not valid.
    pub fn to_text(&self) -> Result<String> {
        self.validate()?;
        let mut bytes = Vec::new();
        self.write_rows(&mut bytes, "the data")?;
        String::from_utf8(bytes).map_err(|e| SvmError::Data(e.to_string()))
    }

    fn write_rows(&self, writer: &mut dyn Write, name: &str) -> Result<()> {
        let mut writer = DataWriter::new(writer, name, self.features);
        for (i, label) in self.labels.iter().enumerate() {
            writer.write_row(*label, self.row(i))?;
        }
        Ok(())
    }
}
