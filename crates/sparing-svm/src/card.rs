//! The model card: a TOML file beside every model that says what its numbers mean. A model whose features are
//! not those that the caller computes would decide at random without any sign of it; the card makes that an
//! error.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::atomic::write_file;
use crate::error::{Result, SvmError};
use crate::model::{Model, ReadOptions};
use crate::range::{Interval, Scaling};

/// The format that this version writes and reads.
pub const CARD_FORMAT: u32 = 1;

/// A longer card is refused.
const MAX_CARD_BYTES: u64 = 16 << 20;

/// What a model is and where it comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    /// [`CARD_FORMAT`].
    pub format: u32,
    /// SHA-256 of the model file in lower-case hexadecimal; filled in by [`Card::write`].
    pub sha256: String,
    /// The features' names in the order of their indices.
    pub features: Vec<String>,
    /// What the label is, in words.
    pub label: String,
    /// Where the training data come from.
    pub data: Vec<String>,
    /// The licence of the model, an SPDX expression.
    pub licence: String,
    /// The command that made the model.
    pub command: String,
    /// Seed of everything random in training, at most 2^63 - 1.
    pub seed: u64,
    /// How the features are scaled before the model sees them; absent if they are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scaling: Option<CardScaling>,
    /// Measured figures, for example "accuracy": finite.
    #[serde(default)]
    pub metrics: BTreeMap<String, f64>,
}

/// [`Scaling`] as the card holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CardScaling {
    /// What the smallest value of a feature becomes.
    pub lower: f64,
    /// What the largest value of a feature becomes.
    pub upper: f64,
    /// Smallest value of each feature.
    pub min: Vec<f64>,
    /// Largest value of each feature; equal to the smallest where the feature was constant and is dropped.
    pub max: Vec<f64>,
}

impl From<&Scaling> for CardScaling {
    /// A scaling of labels is not part of it.
    fn from(scaling: &Scaling) -> Self {
        let ends = |end: fn(&Interval) -> f64| {
            scaling.features.iter().map(|range| range.as_ref().map_or(0.0, end)).collect()
        };
        Self { lower: scaling.lower, upper: scaling.upper, min: ends(|r| r.min), max: ends(|r| r.max) }
    }
}

impl Card {
    /// Where the card of a model is: the model's path with `.toml` appended.
    #[must_use]
    pub fn path(model: &Path) -> PathBuf {
        let mut name = model.as_os_str().to_owned();
        name.push(".toml");
        name.into()
    }

    /// Writes the card beside its model, with the model file's hash. It appears only when it is complete.
    ///
    /// # Errors
    /// The model file cannot be read, the card is not valid, or it cannot be written.
    pub fn write(&mut self, model: impl AsRef<Path>) -> Result<()> {
        let model = model.as_ref();
        let path = Self::path(model);
        self.sha256 = hash(&fs::read(model).map_err(SvmError::reading(model))?);
        let text = self.to_text()?;
        write_file(&path, |file| file.write_all(text.as_bytes()).map_err(SvmError::writing(&path)))
    }

    /// The card as TOML.
    ///
    /// # Errors
    /// The card is not valid.
    pub fn to_text(&self) -> Result<String> {
        self.validate("the card")?;
        toml::to_string(self)
            .map_err(|e| SvmError::Card { file: "the card".to_owned(), message: e.to_string() })
    }

    /// Reads the card of a model and checks that it belongs to this very file.
    ///
    /// # Errors
    /// There is no card, it is malformed (with the line), or the model file has another hash.
    pub fn read(model: impl AsRef<Path>) -> Result<Self> {
        let model = model.as_ref();
        let bytes = fs::read(model).map_err(SvmError::reading(model))?;
        Self::read_for(model, &bytes)
    }

    fn read_for(model: &Path, bytes: &[u8]) -> Result<Self> {
        let path = Self::path(model);
        let fail = SvmError::reading(&path);
        if fs::metadata(&path).map_err(&fail)?.len() > MAX_CARD_BYTES {
            let message = format!("the card is longer than the limit of {MAX_CARD_BYTES} bytes");
            return Err(SvmError::Card { file: path.display().to_string(), message });
        }
        let text = fs::read_to_string(&path).map_err(&fail)?;
        let name = path.display().to_string();
        let card = Self::from_text(&text, &name)?;
        let found = hash(bytes);
        if card.sha256 != found {
            let message = format!(
                "the card is for another model file: its sha256 is {}, that of {} is {found}",
                card.sha256,
                model.display()
            );
            return Err(SvmError::Card { file: name, message });
        }
        Ok(card)
    }

    /// Reads a card from its text; `name` is what messages call it.
    ///
    /// # Errors
    /// The text is malformed or a value is out of its range; the message has the line.
    pub fn from_text(text: &str, name: &str) -> Result<Self> {
        let card: Self = toml::from_str(text).map_err(|e| {
            let before = e.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            let line = before.matches('\n').count() + 1;
            let column = before.len() - before.rfind('\n').map_or(0, |i| i + 1) + 1;
            SvmError::text(name, line, e.span().map(|_| column), e.message().trim())
        })?;
        card.validate(name)?;
        Ok(card)
    }

    /// Refuses the model when its features are not exactly these, in this order.
    ///
    /// # Errors
    /// [`SvmError::Card`] that says which features differ and how.
    pub fn check_features(&self, names: &[impl AsRef<str>]) -> Result<()> {
        let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
        if self.features == names {
            return Ok(());
        }
        let missing: Vec<&str> =
            self.features.iter().map(String::as_str).filter(|f| !names.contains(f)).collect();
        let extra: Vec<&str> =
            names.iter().copied().filter(|n| !self.features.iter().any(|f| f == n)).collect();
        let mut parts = Vec::new();
        if !missing.is_empty() {
            parts.push(format!("the model needs {}", missing.join(", ")));
        }
        if !extra.is_empty() {
            parts.push(format!("it does not know {}", extra.join(", ")));
        }
        if parts.is_empty() {
            let first = self.features.iter().zip(&names).position(|(f, n)| f != n);
            parts.push(match first {
                Some(i) => {
                    format!(
                        "feature {} is {:?} in the model and {:?} here: the order differs",
                        i + 1,
                        self.features[i],
                        names[i]
                    )
                }
                None => format!("the model has {} features, here are {}", self.features.len(), names.len()),
            });
        }
        Err(SvmError::Card {
            file: "the model's card".to_owned(),
            message: format!("the features differ: {}", parts.join("; ")),
        })
    }

    /// The scaling of the features, if there is one.
    #[must_use]
    pub fn scaling(&self) -> Option<Scaling> {
        let scaling = self.scaling.as_ref()?;
        let range = |(&min, &max): (&f64, &f64)| Some(Interval { min, max }).filter(|_| min != max);
        let features = scaling.min.iter().zip(&scaling.max).map(range).collect();
        Some(Scaling { lower: scaling.lower, upper: scaling.upper, features, target: None })
    }

    fn validate(&self, name: &str) -> Result<()> {
        let fail = |message: String| Err(SvmError::Card { file: name.to_owned(), message });
        if self.format != CARD_FORMAT {
            return fail(format!("format {} is not known; this version reads {CARD_FORMAT}", self.format));
        }
        if self.sha256.len() != 64 || !self.sha256.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f')) {
            return fail("sha256 must be 64 lower-case hexadecimal digits".to_owned());
        }
        if i64::try_from(self.seed).is_err() {
            return fail(format!("the seed is beyond what TOML can hold, 2^63 - 1: {}", self.seed));
        }
        if self.features.is_empty() {
            return fail("there are no features".to_owned());
        }
        let mut seen = std::collections::BTreeSet::new();
        for feature in &self.features {
            if feature.trim().is_empty() {
                return fail("a feature has no name".to_owned());
            }
            if !seen.insert(feature) {
                return fail(format!("feature {feature:?} occurs twice"));
            }
        }
        if let Some((key, value)) = self.metrics.iter().find(|(_, value)| !value.is_finite()) {
            return fail(format!("the metric {key:?} is not finite: {value}"));
        }
        if let Some(scaling) = &self.scaling {
            for (end, values) in [("min", &scaling.min), ("max", &scaling.max)] {
                if values.len() != self.features.len() {
                    return fail(format!(
                        "scaling.{end} has {} values for {} features",
                        values.len(),
                        self.features.len()
                    ));
                }
                if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                    return fail(format!(
                        "scaling.{end} of {:?} is not finite: {}",
                        self.features[i], values[i]
                    ));
                }
            }
        }
        if let Some(Err(error)) = self.scaling().map(|scaling| scaling.validate()) {
            return fail(format!("scaling: {error}"));
        }
        Ok(())
    }
}

impl Model {
    /// Reads a model with its card, and refuses it when its features are not exactly `features`, in this
    /// order. The number of features is the card's, so that features which are zero in all support vectors
    /// are not lost.
    ///
    /// # Errors
    /// As [`Card::read`], [`Card::check_features`] and [`Model::read_with`].
    pub fn read_with_card(path: impl AsRef<Path>, features: &[impl AsRef<str>]) -> Result<(Self, Card)> {
        let path = path.as_ref();
        let bytes = fs::read(path).map_err(SvmError::reading(path))?;
        let card = Card::read_for(path, &bytes)?;
        card.check_features(features)?;
        let options = ReadOptions { features: Some(card.features.len()), ..ReadOptions::default() };
        Ok((Self::read_from(&bytes[..], &path.display().to_string(), &options)?, card))
    }
}

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
