//! Which rows are held out together.

use std::collections::BTreeMap;

use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::random::Random;

/// A fold for each row: the same for the same seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folds {
    count: usize,
    of_row: Vec<usize>,
}

impl Folds {
    /// Rows in random folds of equal size, for regression and one-class machines.
    ///
    /// # Errors
    /// Fewer than 2 folds, or fewer rows than folds.
    pub fn random(data: &Data, count: usize, seed: u64) -> Result<Self> {
        Self::dealt(vec![(0..data.len()).collect()], data.len(), count, seed)
    }

    /// Every class in equal parts in every fold, up to one row.
    ///
    /// # Errors
    /// As [`Folds::random`]; labels that are no classes.
    pub fn stratified(data: &Data, count: usize, seed: u64) -> Result<Self> {
        super::check::classes(data)?;
        let mut classes: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
        for (i, label) in data.labels.iter().enumerate() {
            classes.entry(*label as i64).or_default().push(i);
        }
        Self::dealt(classes.into_values().collect(), data.len(), count, seed)
    }

    /// Rows with the same group (a scene, say) in the same fold: what is held out was not seen in any form.
    /// The largest groups are placed first, each in the smallest fold.
    ///
    /// # Errors
    /// Fewer than 2 folds, or fewer groups than folds.
    pub fn by_group(groups: &[u64], count: usize, seed: u64) -> Result<Self> {
        let mut sizes: BTreeMap<u64, usize> = BTreeMap::new();
        groups.iter().for_each(|group| *sizes.entry(*group).or_insert(0) += 1);
        check_count(count, sizes.len(), "groups")?;
        let mut order: Vec<(u64, usize)> = sizes.into_iter().collect();
        // Groups of one size come in random order: the sort is stable.
        Random::new(seed).shuffle(&mut order);
        order.sort_by_key(|(_, size)| std::cmp::Reverse(*size));
        let (mut filled, mut fold_of) = (vec![0; count], BTreeMap::new());
        for (group, size) in order {
            let fold = (0..count).min_by_key(|fold| filled[*fold]).unwrap_or(0);
            filled[fold] += size;
            fold_of.insert(group, fold);
        }
        Ok(Self { count, of_row: groups.iter().map(|group| fold_of[group]).collect() })
    }

    /// Deals each list in turn, shuffled; the next list goes on where the last ended.
    fn dealt(lists: Vec<Vec<usize>>, rows: usize, count: usize, seed: u64) -> Result<Self> {
        check_count(count, rows, "rows")?;
        let (mut of_row, mut random, mut next) = (vec![0; rows], Random::new(seed), 0);
        for mut list in lists {
            random.shuffle(&mut list);
            for row in list {
                of_row[row] = next % count;
                next += 1;
            }
        }
        Ok(Self { count, of_row })
    }

    /// Number of folds.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The fold of each row, from 0.
    #[must_use]
    pub fn of_row(&self) -> &[usize] {
        &self.of_row
    }

    /// Rows to train on and rows to test on, when `fold` is held out.
    #[must_use]
    pub fn split(&self, fold: usize) -> (Vec<usize>, Vec<usize>) {
        (0..self.of_row.len()).partition(|&row| self.of_row[row] != fold)
    }
}

fn check_count(count: usize, available: usize, unit: &str) -> Result<()> {
    if count < 2 {
        return Err(SvmError::Parameters(format!("cross-validation needs 2 folds or more, not {count}")));
    }
    if count > available {
        return Err(SvmError::Data(format!("{count} folds for {available} {unit}")));
    }
    Ok(())
}
