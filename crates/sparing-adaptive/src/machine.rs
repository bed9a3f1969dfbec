//! A support vector machine ready to decide about pixels: the model, what its features are, how they are scaled.

use crate::features::{Feature, FeatureMatrix, Query, fill_rows};
use crate::view::View;
use rayon::prelude::*;
use sparing_svm::model::ReadOptions;
use sparing_svm::{Card, Evaluator, Model, Scaling, SvmError};
use std::path::Path;

/// Why a machine cannot decide about pixels.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// The model or its card cannot be read, or they do not fit each other.
    #[error(transparent)]
    Svm(#[from] SvmError),
    /// It is sound, but of another kind.
    #[error("the model cannot decide about pixels: {0}")]
    Unfit(String),
}

/// Rows that are computed, scaled and evaluated together.
const BATCH: usize = 128;

/// A model of two classes, +1 for pixels that go on, with the scaling of its features. Shared by threads as it is.
#[derive(Clone, Debug)]
pub struct Classifier {
    evaluator: Evaluator,
    scaling: Scaling,
    /// What turns the model's decision value into one that is positive for +1.
    sign: f64,
}

impl Classifier {
    /// From a model and its card.
    ///
    /// # Errors
    /// The card names another number of features than the model has, or no scaling; the model does not tell +1 from -1.
    pub fn new(model: &Model, card: &Card) -> Result<Self, MachineError> {
        let unfit = |message: String| Err(MachineError::Unfit(message));
        let features = card.features.len();
        if features != model.features {
            return unfit(format!("it has {} features, its card names {features}", model.features));
        }
        let sign = match (model.svm_type.is_classifier(), &model.labels[..]) {
            (true, [1, -1]) => 1.0,
            (true, [-1, 1]) => -1.0,
            _ => return unfit("it must tell the classes +1 and -1 apart".to_owned()),
        };
        let Some(scaling) = card.scaling() else {
            return unfit("its card has no scaling of the features".to_owned());
        };
        if scaling.features.len() != features {
            return unfit(format!("{features} features and a scaling of {}", scaling.features.len()));
        }
        Ok(Self { evaluator: Evaluator::new(model)?, scaling, sign })
    }

    /// Number of support vectors.
    #[must_use]
    pub fn vectors(&self) -> usize {
        self.evaluator.model().len()
    }

    /// One decision value a row, positive for pixels that go on. Features are scaled and held within the scaling's
    /// range first: a machine extrapolates badly.
    ///
    /// # Panics
    /// When the rows have another number of features.
    #[must_use]
    pub fn decide(&self, matrix: FeatureMatrix) -> Vec<f64> {
        assert_eq!(matrix.features, self.scaling.features.len(), "as many features as the machine has");
        let width = matrix.features.max(1);
        let mut rows = matrix.values;
        let mut out = vec![0.0; rows.len() / width];
        let parts = rows.par_chunks_mut(BATCH * width).zip(out.par_chunks_mut(BATCH));
        parts.for_each(|(rows, out)| self.decide_rows(rows, out));
        out
    }

    /// The same by this thread alone; scales the rows in place.
    fn decide_rows(&self, rows: &mut [f64], out: &mut [f64]) {
        for row in rows.chunks_exact_mut(self.scaling.features.len().max(1)) {
            scale(&self.scaling, row);
        }
        self.evaluator.decide(rows, out);
        out.iter_mut().for_each(|v| *v *= self.sign);
    }
}

/// A classifier with the features that its card names.
#[derive(Clone, Debug)]
pub struct Machine {
    classifier: Classifier,
    features: Vec<Feature>,
}

impl Machine {
    /// From a model and its card.
    ///
    /// # Errors
    /// The card names features that are not known; as [`Classifier::new`].
    pub fn new(model: &Model, card: &Card) -> Result<Self, MachineError> {
        let known = |name: &String| {
            Feature::from_name(name)
                .ok_or_else(|| MachineError::Unfit(format!("the feature {name:?} is not known")))
        };
        let features = card.features.iter().map(known).collect::<Result<_, _>>()?;
        Ok(Self { classifier: Classifier::new(model, card)?, features })
    }

    /// Reads a model file and the card beside it.
    ///
    /// # Errors
    /// As [`Model::read_with_card`] and [`Machine::new`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, MachineError> {
        let path = path.as_ref();
        let names = Card::read(path)?.features;
        let (model, card) = Model::read_with_card(path, &names)?;
        Self::new(&model, &card)
    }

    /// From the texts of both files.
    ///
    /// # Errors
    /// As [`Machine::read`], but that the card's hash is not looked at.
    pub fn from_text(model: &str, card: &str) -> Result<Self, MachineError> {
        let (model, card) = parse(model, card)?;
        Self::new(&model, &card)
    }

    /// The features that it wants, in order.
    #[must_use]
    pub fn features(&self) -> &[Feature] {
        &self.features
    }

    /// What decides by features.
    #[must_use]
    pub fn classifier(&self) -> &Classifier {
        &self.classifier
    }

    /// The decision values of pixels, positive for those that go on, by this thread alone: features, scaling and machine a
    /// batch at a time, so that rows stay in the cache.
    ///
    /// # Panics
    /// When there are not as many values as queries, or a query is outside of the view.
    pub fn decide(&self, view: &View, queries: &[Query], values: &mut [f64]) {
        assert_eq!(queries.len(), values.len(), "one value a query");
        let width = self.features.len();
        let mut rows = vec![0.0; width * BATCH.min(queries.len())];
        for (queries, values) in queries.chunks(BATCH).zip(values.chunks_mut(BATCH)) {
            let rows = &mut rows[..width * queries.len()];
            fill_rows(view, queries, &self.features, rows);
            self.classifier.decide_rows(rows, values);
        }
    }
}

/// A model and its card from their texts.
pub(crate) fn parse(model: &str, card: &str) -> Result<(Model, Card), MachineError> {
    let card = Card::from_text(card, "the model's card")?;
    let options = ReadOptions { features: Some(card.features.len()), ..ReadOptions::default() };
    Ok((Model::read_from(model.as_bytes(), "the model", &options)?, card))
}

/// Scales a row and clips it to the scaling's range.
pub(crate) fn scale(scaling: &Scaling, row: &mut [f64]) {
    // The lengths are equal: `Classifier::new` has checked it. A row of another length would stay as it is.
    let _ = scaling.apply(row);
    row.iter_mut().for_each(|v| *v = v.clamp(scaling.lower, scaling.upper));
}
