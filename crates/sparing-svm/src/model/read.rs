//! libSVM's text format, read: strictly, because a number that is dropped in silence is a wrong decision
//! later.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use super::Model;
use super::header::{Header, read_header};
use crate::error::{Result, SvmError};
use crate::text::{FeatureLimit, Lines};

/// Guards against absurd or hostile files. Reading takes up to three times the memory of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelLimits {
    /// Most support vectors. Default 4,000,000.
    pub vectors: usize,
    /// Largest feature index. Default 1,000,000.
    pub features: usize,
    /// Most classes. Default 1,000.
    pub classes: usize,
    /// Most values of all support vectors and coefficients together; models are dense in memory, 8 bytes a
    /// value. Default 2^27, one GiB.
    pub values: usize,
}

impl Default for ModelLimits {
    fn default() -> Self {
        Self { vectors: 4_000_000, features: 1_000_000, classes: 1_000, values: 1 << 27 }
    }
}

/// How to read a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The number of features, as the range file or the card knows it. `None` takes the largest index in the
    /// file, which is too few where the last features are zero in all support vectors and the writer left
    /// them out.
    pub features: Option<usize>,
    /// Guards.
    pub limits: ModelLimits,
}

impl Model {
    /// Reads a libSVM model file.
    ///
    /// # Errors
    /// The file cannot be read, or anything in it is malformed, contradictory or beyond the default limits;
    /// the message has the line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::read_with(path, &ReadOptions::default())
    }

    /// Reads a libSVM model file with a known number of features, or with limits of one's own.
    ///
    /// # Errors
    /// As [`Model::read`], and an index beyond the number of features.
    pub fn read_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(SvmError::reading(path))?;
        Self::read_from(BufReader::with_capacity(1 << 18, file), &path.display().to_string(), options)
    }

    /// Reads a model from its text.
    ///
    /// # Errors
    /// As [`Model::read`]; the messages call the text "model".
    pub fn from_text(text: &str) -> Result<Self> {
        Self::read_from(text.as_bytes(), "model", &ReadOptions::default())
    }

    /// Reads a model from any reader; `name` is what messages call it.
    ///
    /// # Errors
    /// As [`Model::read_with`].
    pub fn read_from(reader: impl BufRead, name: &str, options: &ReadOptions) -> Result<Self> {
        let mut lines = Lines::new(reader, name);
        let header = read_header(&mut lines, &options.limits)?;
        let vectors = read_vectors(&mut lines, &header, options)?;
        let model = vectors.into_model(header, options, &lines)?;
        model.validate().map_err(|e| lines.error(e.to_string()))?;
        Ok(model)
    }
}

/// The support vectors as they stand in the file.
struct SparseVectors {
    coefficients: Vec<Vec<f64>>,
    /// All (index from 1, value), row after row.
    entries: Vec<(u32, f64)>,
    /// Where each row's entries end.
    ends: Vec<usize>,
    largest: usize,
}

fn read_vectors<R: BufRead>(
    lines: &mut Lines<R>,
    header: &Header,
    options: &ReadOptions,
) -> Result<SparseVectors> {
    let limits = &options.limits;
    let limit = FeatureLimit {
        count: options.features.unwrap_or(limits.features).min(u32::MAX as usize),
        asked: options.features.is_some(),
    };
    let rows = header.classes - 1;
    // The header's count is a claim: memory grows with what is really there.
    let expected = header.vectors.min(1 << 16);
    let mut result = SparseVectors {
        coefficients: vec![Vec::with_capacity(if rows < 16 { expected } else { 0 }); rows],
        entries: Vec::new(),
        ends: Vec::with_capacity(expected),
        largest: 0,
    };
    while let Some(line) = lines.next_line()? {
        let done = result.ends.len();
        if done == header.vectors {
            if line.text.trim_ascii().is_empty() {
                continue;
            }
            return Err(line.error(format!("text after the last of {} support vectors", header.vectors)));
        }
        let mut words = line.words();
        for (j, row) in result.coefficients.iter_mut().enumerate() {
            let word = words.next().filter(|word| !word.text.contains(':')).ok_or_else(|| {
                line.error(format!("{} of {rows} coefficients of support vector {}", j, done + 1))
            })?;
            row.push(word.number("the coefficient")?);
        }
        let mut previous = 0;
        for word in words {
            let (index, value) = word.feature(previous, limit)?;
            previous = index;
            result.entries.push((index as u32, value));
        }
        result.largest = result.largest.max(previous);
        result.ends.push(result.entries.len());
        let values = (done + 1).saturating_mul(result.largest.saturating_add(rows));
        if values > limits.values {
            return Err(line.error(format!(
                "the model needs more than the limit of {} values: {} vectors of {} features",
                limits.values,
                done + 1,
                result.largest
            )));
        }
    }
    if result.ends.len() < header.vectors {
        return Err(lines.error(format!(
            "the file ends after {} of {} support vectors",
            result.ends.len(),
            header.vectors
        )));
    }
    if !lines.ended_with_newline() {
        return Err(lines.error("the file ends in the middle of a line: it was cut short"));
    }
    Ok(result)
}

impl SparseVectors {
    fn into_model<R: BufRead>(
        self,
        header: Header,
        options: &ReadOptions,
        lines: &Lines<R>,
    ) -> Result<Model> {
        let features = options.features.unwrap_or(self.largest);
        let size = self.ends.len().checked_mul(features).filter(|size| *size <= options.limits.values);
        let size = size.ok_or_else(|| {
            lines.error(format!(
                "the model needs more than the limit of {} values: {} vectors of {features} features",
                options.limits.values,
                self.ends.len()
            ))
        })?;
        let mut support_vectors = vec![0.0; size];
        let mut start = 0;
        for (i, end) in self.ends.iter().enumerate() {
            for (index, value) in &self.entries[start..*end] {
                support_vectors[i * features + *index as usize - 1] = *value;
            }
            start = *end;
        }
        Ok(Model {
            svm_type: header.svm_type,
            kernel: header.kernel,
            labels: header.labels,
            class_counts: header.class_counts,
            rho: header.rho,
            prob_a: header.prob_a,
            prob_b: header.prob_b,
            prob_density_marks: header.prob_density_marks,
            features,
            support_vectors,
            coefficients: self.coefficients,
        })
    }
}
