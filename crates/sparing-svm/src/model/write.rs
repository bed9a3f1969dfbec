//! libSVM's text format, written.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use super::{Kernel, Model};
use crate::atomic::write_file;
use crate::error::{Result, SvmError};
use crate::text::push_number;

impl Model {
    /// Writes a libSVM model file. It appears under its name only when it is complete.
    ///
    /// Numbers have the fewest digits that read back as the same bits, so a model that is read again is
    /// identical. Zeros are left out, as libSVM does, but for one: where the last feature is zero in all
    /// vectors, the first vector says so explicitly (`8:0`), and the number of features is not lost.
    ///
    /// libSVM before 3.3 cannot read models with `prob_density_marks`.
    ///
    /// # Errors
    /// The model is not valid, or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        self.validate()?;
        write_file(path, |file| {
            self.write_chunks(|text| file.write_all(text.as_bytes())).map_err(SvmError::writing(path))
        })
    }

    /// Writes the text of [`Model::write`].
    ///
    /// # Errors
    /// The model is not valid, or the writer refuses.
    pub fn write_to(&self, writer: &mut impl Write) -> Result<()> {
        self.validate()?;
        self.write_chunks(|text| writer.write_all(text.as_bytes())).map_err(|source| SvmError::Io {
            action: "write",
            file: "the model".to_owned(),
            source,
        })
    }

    /// The text of [`Model::write`].
    ///
    /// # Errors
    /// The model is not valid.
    pub fn to_text(&self) -> Result<String> {
        let mut bytes = Vec::new();
        self.write_to(&mut bytes)?;
        String::from_utf8(bytes).map_err(|e| SvmError::Model(e.to_string()))
    }

    fn write_chunks(&self, mut put: impl FnMut(&str) -> std::io::Result<()>) -> std::io::Result<()> {
        let mut text = self.header();
        let mut explicit_zero = self.last_feature_is_zero();
        for i in 0..self.len() {
            for row in &self.coefficients {
                push_number(&mut text, row[i]);
                text.push(' ');
            }
            for (j, value) in self.support_vector(i).iter().enumerate() {
                // A negative zero is written: its bits differ.
                if value.to_bits() != 0 || (explicit_zero && j + 1 == self.features) {
                    let _ = write!(text, "{}:", j + 1);
                    push_number(&mut text, *value);
                    text.push(' ');
                }
            }
            explicit_zero = false;
            text.push('\n');
            if text.len() > 1 << 16 {
                put(&text)?;
                text.clear();
            }
        }
        put(&text)
    }

    fn last_feature_is_zero(&self) -> bool {
        self.features > 0
            && self.support_vectors.chunks_exact(self.features).all(|v| v[self.features - 1].to_bits() == 0)
    }

    fn header(&self) -> String {
        let mut text = format!("svm_type {}\nkernel_type {}\n", self.svm_type.name(), self.kernel.name());
        let (degree, gamma, coef0) = match self.kernel {
            Kernel::Linear => (None, None, None),
            Kernel::Polynomial { degree, gamma, coef0 } => (Some(degree), Some(gamma), Some(coef0)),
            Kernel::Rbf { gamma } => (None, Some(gamma), None),
            Kernel::Sigmoid { gamma, coef0 } => (None, Some(gamma), Some(coef0)),
        };
        if let Some(degree) = degree {
            let _ = writeln!(text, "degree {degree}");
        }
        for (name, value) in [("gamma", gamma), ("coef0", coef0)] {
            if let Some(value) = value {
                push_list(&mut text, name, &[value]);
            }
        }
        let classes = if self.svm_type.is_classifier() { self.labels.len() } else { 2 };
        let _ = writeln!(text, "nr_class {classes}\ntotal_sv {}", self.len());
        push_list(&mut text, "rho", &self.rho);
        push_words(&mut text, "label", &self.labels);
        push_list(&mut text, "probA", &self.prob_a);
        push_list(&mut text, "probB", &self.prob_b);
        push_list(&mut text, "prob_density_marks", &self.prob_density_marks);
        push_words(&mut text, "nr_sv", &self.class_counts);
        text.push_str("SV\n");
        text
    }
}

fn push_list(text: &mut String, name: &str, values: &[f64]) {
    if values.is_empty() {
        return;
    }
    text.push_str(name);
    for value in values {
        text.push(' ');
        push_number(text, *value);
    }
    text.push('\n');
}

fn push_words(text: &mut String, name: &str, values: &[impl ToString]) {
    if !values.is_empty() {
        text.push_str(name);
        for value in values {
            text.push(' ');
            text.push_str(&value.to_string());
        }
        text.push('\n');
    }
}
