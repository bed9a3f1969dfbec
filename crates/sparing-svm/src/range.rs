//! Scaling of features to one range, and svm-scale's range files.
//!
//! ```text
//! y                      only if the labels are scaled too
//! lower upper            of the scaled label
//! min max                of the label in the data
//! x
//! lower upper            of the scaled features
//! index min max          one line a feature; those that were constant are left out
//! ```

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::atomic::write_file;
use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::text::{Lines, excerpt, push_number};

/// Larger indices are refused.
const MAX_FEATURES: usize = 1_000_000;

/// Smallest and largest value in the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

/// How labels are scaled (regression).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetScaling {
    /// What the smallest label becomes.
    pub lower: f64,
    /// What the largest label becomes.
    pub upper: f64,
    /// The labels in the data.
    pub data: Interval,
}

/// How each feature is brought into `[lower, upper]`, with svm-scale's arithmetic. Values beyond what the fit
/// has seen land beyond the range; they are not clamped.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaling {
    /// What the smallest value of a feature becomes.
    pub lower: f64,
    /// What the largest value of a feature becomes.
    pub upper: f64,
    /// The range of each feature; `None` where it was constant: such a feature becomes 0 whatever its value,
    /// as svm-scale drops it.
    pub features: Vec<Option<Interval>>,
    /// How labels are scaled, if they are. [`Scaling::apply`] leaves labels alone; see
    /// [`Scaling::apply_target`].
    pub target: Option<TargetScaling>,
}

impl Scaling {
    /// The ranges of all features of `data`, to be brought into `[lower, upper]`; svm-scale's default is
    /// \[-1, 1\].
    ///
    /// # Errors
    /// There is no row, a value is not finite, a feature spans more than a double can hold, or `lower` is not
    /// below `upper`.
    pub fn fit(data: &Data, lower: f64, upper: f64) -> Result<Self> {
        data.validate()?;
        if data.is_empty() {
            return Err(SvmError::Data("there is no row".to_owned()));
        }
        let features = (0..data.features)
            .map(|j| {
                let column = data.rows.iter().skip(j).step_by(data.features);
                let range = interval(column);
                Some(range).filter(|range| range.min != range.max)
            })
            .collect();
        let scaling = Self { lower, upper, features, target: None };
        scaling.validate()?;
        Ok(scaling)
    }

    /// Adds the scaling of labels into `[lower, upper]`.
    ///
    /// # Errors
    /// As [`Scaling::fit`].
    pub fn with_target(mut self, data: &Data, lower: f64, upper: f64) -> Result<Self> {
        data.validate()?;
        if data.is_empty() {
            return Err(SvmError::Data("there is no row".to_owned()));
        }
        self.target = Some(TargetScaling { lower, upper, data: interval(data.labels.iter()) });
        self.validate()?;
        Ok(self)
    }

    /// Scales one row in place.
    ///
    /// # Errors
    /// The row has another number of features.
    pub fn apply(&self, row: &mut [f64]) -> Result<()> {
        if row.len() != self.features.len() {
            return Err(SvmError::Data(format!(
                "a row of {} features, and the scaling is for {}",
                row.len(),
                self.features.len()
            )));
        }
        for (value, range) in row.iter_mut().zip(&self.features) {
            *value = range.map_or(0.0, |range| scaled(*value, range, self.lower, self.upper));
        }
        Ok(())
    }

    /// Scales all rows, and the labels if there is a scaling for them.
    ///
    /// # Errors
    /// The data have another number of features.
    pub fn apply_data(&self, mut data: Data) -> Result<Data> {
        if data.features != self.features.len() {
            return Err(SvmError::Data(format!(
                "rows of {} features, and the scaling is for {}",
                data.features,
                self.features.len()
            )));
        }
        if data.features > 0 {
            data.rows.chunks_exact_mut(data.features).try_for_each(|row| self.apply(row))?;
        }
        data.labels.iter_mut().for_each(|label| *label = self.apply_target(*label));
        Ok(data)
    }

    /// The scaled label; the label itself if there is no scaling for labels.
    #[must_use]
    pub fn apply_target(&self, label: f64) -> f64 {
        self.target.map_or(label, |t| scaled(label, t.data, t.lower, t.upper))
    }

    /// What a scaled label stands for: the inverse of [`Scaling::apply_target`] up to rounding.
    #[must_use]
    pub fn restore_target(&self, scaled_label: f64) -> f64 {
        self.target.map_or(scaled_label, |t| {
            t.data.min + (t.data.max - t.data.min) * (scaled_label - t.lower) / (t.upper - t.lower)
        })
    }

    /// Checks a scaling that was put together by hand.
    ///
    /// # Errors
    /// [`SvmError::Data`]: a number is not finite, a range is empty or too wide, `lower` is not below
    /// `upper`.
    pub fn validate(&self) -> Result<()> {
        check_bounds(self.lower, self.upper).map_err(SvmError::Data)?;
        if let Some(target) = &self.target {
            check_bounds(target.lower, target.upper).map_err(SvmError::Data)?;
            check_interval("the label", target.data).map_err(SvmError::Data)?;
        }
        for (j, range) in self.features.iter().enumerate() {
            if let Some(range) = range {
                let name = format!("feature {}", j + 1);
                check_interval(&name, *range).map_err(SvmError::Data)?;
                if range.min == range.max {
                    return Err(SvmError::Data(format!("{name} is constant: its range must be None")));
                }
            }
        }
        Ok(())
    }

    /// Reads a range file. `features` is the number of features; `None` takes the largest index in the file,
    /// which is too few where the last features were constant.
    ///
    /// # Errors
    /// The file cannot be read or anything in it is malformed; the message has the line.
    pub fn read(path: impl AsRef<Path>, features: Option<usize>) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(SvmError::reading(path))?;
        Self::read_from(BufReader::new(file), &path.display().to_string(), features)
    }

    /// Reads a range file from any reader; `name` is what messages call it.
    ///
    /// # Errors
    /// As [`Scaling::read`].
    pub fn read_from(reader: impl BufRead, name: &str, features: Option<usize>) -> Result<Self> {
        let mut lines = Lines::new(reader, name);
        let mut target = None;
        let mut section = keyword(&mut lines, "\"x\" or \"y\"")?;
        if section == "y" {
            let (lower, upper) = bounds(&mut lines)?;
            let [min, max] = numbers(&mut lines, ["the smallest label", "the largest label"])?;
            let data = Interval { min, max };
            check_interval("the label", data).map_err(|message| lines.error(message))?;
            target = Some(TargetScaling { lower, upper, data });
            section = keyword(&mut lines, "\"x\"")?;
        }
        if section != "x" {
            return Err(lines.error(format!("expected the line \"x\", found {}", excerpt(&section))));
        }
        let (lower, upper) = bounds(&mut lines)?;
        let ranges = feature_lines(&mut lines, features)?;
        if !lines.ended_with_newline() {
            return Err(lines.error("the file ends in the middle of a line: it was cut short"));
        }
        Ok(Self { lower, upper, features: ranges, target })
    }

    /// Writes a range file that svm-scale reads. It appears under its name only when it is complete. The
    /// number of features is not part of it; see [`Scaling::read`].
    ///
    /// # Errors
    /// The scaling is not valid, or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let text = self.to_text()?;
        write_file(path, |file| file.write_all(text.as_bytes()).map_err(SvmError::writing(path)))
    }

    /// The text of [`Scaling::write`].
    ///
    /// # Errors
    /// The scaling is not valid.
    pub fn to_text(&self) -> Result<String> {
        self.validate()?;
        let mut text = String::new();
        let pair = |text: &mut String, a: f64, b: f64| {
            push_number(text, a);
            text.push(' ');
            push_number(text, b);
            text.push('\n');
        };
        if let Some(t) = &self.target {
            text.push_str("y\n");
            pair(&mut text, t.lower, t.upper);
            pair(&mut text, t.data.min, t.data.max);
        }
        text.push_str("x\n");
        pair(&mut text, self.lower, self.upper);
        for (j, range) in self.features.iter().enumerate() {
            if let Some(range) = range {
                text.push_str(&format!("{} ", j + 1));
                pair(&mut text, range.min, range.max);
            }
        }
        Ok(text)
    }
}

/// svm-scale's `output`: the ends are hit exactly.
fn scaled(value: f64, range: Interval, lower: f64, upper: f64) -> f64 {
    if value == range.min {
        lower
    } else if value == range.max {
        upper
    } else {
        lower + (upper - lower) * (value - range.min) / (range.max - range.min)
    }
}

fn interval<'a>(values: impl Iterator<Item = &'a f64>) -> Interval {
    values.fold(Interval { min: f64::INFINITY, max: f64::NEG_INFINITY }, |range, &value| Interval {
        min: range.min.min(value),
        max: range.max.max(value),
    })
}

fn check_bounds(lower: f64, upper: f64) -> std::result::Result<(), String> {
    if lower < upper && (upper - lower).is_finite() {
        Ok(())
    } else {
        Err(format!("the range [{lower}, {upper}] is empty or not finite"))
    }
}

fn check_interval(what: &str, range: Interval) -> std::result::Result<(), String> {
    let Interval { min, max } = range;
    if min > max {
        return Err(format!("{what}: the smallest value, {min}, is above the largest, {max}"));
    }
    if !(max - min).is_finite() {
        return Err(format!("{what} spans more than a double can hold: {min} to {max}"));
    }
    Ok(())
}

fn keyword<R: BufRead>(lines: &mut Lines<R>, expected: &str) -> Result<String> {
    let Some(line) = lines.next_line()? else {
        return Err(lines.error(format!("the file ends where {expected} is expected")));
    };
    let text = line.text.trim_ascii();
    if matches!(text, "x" | "y") {
        return Ok(text.to_owned());
    }
    Err(line.error(format!("expected {expected}, found {}", excerpt(text))))
}

fn numbers<R: BufRead>(lines: &mut Lines<R>, names: [&str; 2]) -> Result<[f64; 2]> {
    let Some(line) = lines.next_line()? else {
        return Err(lines.error(format!("the file ends before {}", names[0])));
    };
    let words: Vec<_> = line.words().collect();
    if words.len() != 2 {
        return Err(line.error(format!(
            "expected {} and {}, found {} numbers",
            names[0],
            names[1],
            words.len()
        )));
    }
    Ok([words[0].number(names[0])?, words[1].number(names[1])?])
}

fn bounds<R: BufRead>(lines: &mut Lines<R>) -> Result<(f64, f64)> {
    let [lower, upper] = numbers(lines, ["the lower end", "the upper end"])?;
    check_bounds(lower, upper).map_err(|message| lines.error(message))?;
    Ok((lower, upper))
}

fn feature_lines<R: BufRead>(lines: &mut Lines<R>, features: Option<usize>) -> Result<Vec<Option<Interval>>> {
    let mut ranges: Vec<Option<Interval>> = Vec::new();
    while let Some(line) = lines.next_line()? {
        let words: Vec<_> = line.words().collect();
        let [index, min, max] = words[..] else {
            return Err(line
                .error(format!("expected index, smallest and largest value, found {} words", words.len())));
        };
        let number: usize = index.integer("the feature index")?;
        if number == 0 {
            return Err(index.error("feature indices begin at 1, found 0"));
        }
        if number <= ranges.len() {
            return Err(index.error(format!("feature {number} comes after feature {}", ranges.len())));
        }
        if let Some(features) = features.filter(|features| number > *features) {
            return Err(index.error(format!("feature {number} is beyond the number of features, {features}")));
        }
        if number > MAX_FEATURES {
            return Err(
                index.error(format!("feature {number} is beyond the limit of features, {MAX_FEATURES}"))
            );
        }
        let range =
            Interval { min: min.number("the smallest value")?, max: max.number("the largest value")? };
        check_interval(&format!("feature {number}"), range).map_err(|message| line.error(message))?;
        ranges.resize(number - 1, None);
        ranges.push(Some(range).filter(|range| range.min != range.max));
    }
    if let Some(features) = features {
        if features > MAX_FEATURES {
            return Err(lines.error(format!("{features} features are beyond the limit of {MAX_FEATURES}")));
        }
        ranges.resize(features, None);
    }
    Ok(ranges)
}
