//! The lines of a model file before `SV`.

use std::io::BufRead;

use super::read::ModelLimits;
use super::validate::{DENSITY_MARKS, check_kernel};
use super::{Kernel, SvmType};
use crate::error::Result;
use crate::text::{Line, Lines, Word, excerpt};

/// What the header says, checked.
pub(super) struct Header {
    pub(super) svm_type: SvmType,
    pub(super) kernel: Kernel,
    pub(super) classes: usize,
    pub(super) vectors: usize,
    pub(super) labels: Vec<i32>,
    pub(super) class_counts: Vec<usize>,
    pub(super) rho: Vec<f64>,
    pub(super) prob_a: Vec<f64>,
    pub(super) prob_b: Vec<f64>,
    pub(super) prob_density_marks: Vec<f64>,
}

/// A value and the line it came from.
type Entry<T> = Option<(T, usize)>;

#[derive(Default)]
struct Raw {
    svm_type: Entry<SvmType>,
    kernel: Entry<&'static str>,
    degree: Entry<u32>,
    gamma: Entry<f64>,
    coef0: Entry<f64>,
    classes: Entry<usize>,
    vectors: Entry<usize>,
    rho: Entry<Vec<f64>>,
    labels: Entry<Vec<i32>>,
    prob_a: Entry<Vec<f64>>,
    prob_b: Entry<Vec<f64>>,
    marks: Entry<Vec<f64>>,
    class_counts: Entry<Vec<usize>>,
}

/// Reads up to and with the line `SV`.
pub(super) fn read_header<R: BufRead>(lines: &mut Lines<R>, limits: &ModelLimits) -> Result<Header> {
    let mut raw = Raw::default();
    loop {
        let Some(line) = lines.next_line()? else {
            return Err(lines.error("the file ends before the line \"SV\""));
        };
        if line.text.trim_ascii() == "SV" {
            break;
        }
        raw.read_line(line, limits)?;
    }
    raw.check(lines)
}

impl Raw {
    fn read_line(&mut self, line: Line<'_>, limits: &ModelLimits) -> Result<()> {
        let mut words = line.words();
        let Some(key) = words.next() else { return Err(line.error("an empty line in the header")) };
        // No header has more values than there can be pairs of classes, or density marks.
        let most = (limits.classes.saturating_mul(limits.classes) / 2).max(DENSITY_MARKS);
        let rest: Vec<Word<'_>> = words.by_ref().take(most).collect();
        if let Some(word) = words.next() {
            return Err(
                word.error(format!("more than {most} values, too many for {} classes", limits.classes))
            );
        }
        match key.text {
            "svm_type" => set(&mut self.svm_type, key, line, svm_type(one(line, &rest)?)?),
            "kernel_type" => set(&mut self.kernel, key, line, kernel_type(one(line, &rest)?)?),
            "degree" => set(&mut self.degree, key, line, one(line, &rest)?.integer("degree")?),
            "gamma" => set(&mut self.gamma, key, line, one(line, &rest)?.number("gamma")?),
            "coef0" => set(&mut self.coef0, key, line, one(line, &rest)?.number("coef0")?),
            "nr_class" => {
                let word = one(line, &rest)?;
                let count = at_most(word, "nr_class", limits.classes, "classes")?;
                if count < 2 {
                    return Err(word.error(format!("nr_class must be 2 or more, found {count}")));
                }
                set(&mut self.classes, key, line, count)
            }
            "total_sv" => {
                let count = at_most(one(line, &rest)?, "total_sv", limits.vectors, "support vectors")?;
                set(&mut self.vectors, key, line, count)
            }
            "rho" => set(&mut self.rho, key, line, numbers(&rest, "rho")?),
            "probA" => set(&mut self.prob_a, key, line, numbers(&rest, "probA")?),
            "probB" => set(&mut self.prob_b, key, line, numbers(&rest, "probB")?),
            "prob_density_marks" => set(&mut self.marks, key, line, numbers(&rest, "prob_density_marks")?),
            "label" => {
                let labels = rest.iter().map(|w| w.integer("the label")).collect::<Result<Vec<i32>>>()?;
                set(&mut self.labels, key, line, labels)
            }
            "nr_sv" => {
                let counts = rest.iter().map(|w| w.integer("nr_sv")).collect::<Result<Vec<usize>>>()?;
                set(&mut self.class_counts, key, line, counts)
            }
            other => Err(key.error(format!("unknown header {}", excerpt(other)))),
        }
    }

    fn check<R: BufRead>(self, lines: &Lines<R>) -> Result<Header> {
        let svm_type = required(self.svm_type, "svm_type", lines)?.0;
        let kernel_name = required(self.kernel, "kernel_type", lines)?.0;
        let (classes, class_line) = required(self.classes, "nr_class", lines)?;
        let vectors = required(self.vectors, "total_sv", lines)?.0;
        let rho = required(self.rho, "rho", lines)?;

        if !svm_type.is_classifier() && classes != 2 {
            let message = format!("nr_class is 2 for {}, found {classes}", svm_type.name());
            return Err(lines.error_at(class_line, message));
        }
        let wants = |name| match name {
            "degree" => kernel_name == "polynomial",
            "gamma" => kernel_name != "linear",
            _ => matches!(kernel_name, "polynomial" | "sigmoid"),
        };
        let present = [
            ("degree", self.degree.map(|e| e.1)),
            ("gamma", self.gamma.map(|e| e.1)),
            ("coef0", self.coef0.map(|e| e.1)),
        ];
        for (name, line) in present {
            match line {
                Some(line) if !wants(name) => {
                    return Err(
                        lines.error_at(line, format!("{name} has no meaning with the {kernel_name} kernel"))
                    );
                }
                None if wants(name) => {
                    return Err(lines
                        .error(format!("the header {name} is missing; the {kernel_name} kernel needs it")));
                }
                _ => {}
            }
        }
        let value = |entry: Entry<f64>| entry.map_or(0.0, |e| e.0);
        let (gamma, coef0) = (value(self.gamma), value(self.coef0));
        let kernel = match kernel_name {
            "linear" => Kernel::Linear,
            "polynomial" => Kernel::Polynomial { degree: self.degree.map_or(0, |e| e.0), gamma, coef0 },
            "rbf" => Kernel::Rbf { gamma },
            _ => Kernel::Sigmoid { gamma, coef0 },
        };
        check_kernel(&kernel).map_err(|message| {
            let line = if message.starts_with("degree") {
                self.degree.map(|e| e.1)
            } else {
                self.gamma.map(|e| e.1)
            };
            lines.error_at(line.unwrap_or(1), message)
        })?;

        let machines = classes * (classes - 1) / 2;
        let pairs = "one for each pair of classes";
        let rho = counted(Some(rho), "rho", machines, pairs, lines)?;
        let prob_a = counted(self.prob_a, "probA", machines, pairs, lines)?;
        let prob_b = counted(self.prob_b, "probB", machines, pairs, lines)?;
        let marks = counted(self.marks, "prob_density_marks", DENSITY_MARKS, "as libSVM writes", lines)?;
        let (labels, class_counts) = if svm_type.is_classifier() {
            let labels = required(self.labels, "label", lines)?;
            let label_line = labels.1;
            let labels = counted(Some(labels), "label", classes, "one for each class", lines)?;
            let mut sorted = labels.clone();
            sorted.sort_unstable();
            if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
                return Err(lines.error_at(label_line, format!("label {} occurs twice", pair[0])));
            }
            let counts = required(self.class_counts, "nr_sv", lines)?;
            let count_line = counts.1;
            let counts = counted(Some(counts), "nr_sv", classes, "one for each class", lines)?;
            if counts.iter().try_fold(0_usize, |sum, c| sum.checked_add(*c)) != Some(vectors) {
                return Err(
                    lines.error_at(count_line, format!("nr_sv does not add up to total_sv, {vectors}"))
                );
            }
            (labels, counts)
        } else {
            let name = svm_type.name();
            let lines_of = [("label", self.labels.map(|e| e.1)), ("nr_sv", self.class_counts.map(|e| e.1))];
            for (header, line) in lines_of {
                if let Some(line) = line {
                    return Err(lines.error_at(line, format!("{header} has no meaning with {name}")));
                }
            }
            (Vec::new(), Vec::new())
        };
        Ok(Header {
            svm_type,
            kernel,
            classes,
            vectors,
            labels,
            class_counts,
            rho,
            prob_a,
            prob_b,
            prob_density_marks: marks,
        })
    }
}

fn set<T>(entry: &mut Entry<T>, key: Word<'_>, line: Line<'_>, value: T) -> Result<()> {
    if let Some((_, before)) = entry {
        return Err(key.error(format!("the header {} is there twice, first in line {before}", key.text)));
    }
    *entry = Some((value, line.number));
    Ok(())
}

fn one<'a>(line: Line<'_>, words: &[Word<'a>]) -> Result<Word<'a>> {
    match words {
        [word] => Ok(*word),
        [] => Err(line.error("the header has no value")),
        [_, second, ..] => {
            Err(second.error(format!("one value expected, then found {}", excerpt(second.text))))
        }
    }
}

fn at_most(word: Word<'_>, what: &str, limit: usize, unit: &str) -> Result<usize> {
    let count = word.integer(what)?;
    if count > limit {
        return Err(word.error(format!("{what} {count} is beyond the limit of {limit} {unit}")));
    }
    Ok(count)
}

fn numbers(words: &[Word<'_>], what: &str) -> Result<Vec<f64>> {
    words.iter().map(|word| word.number(what)).collect()
}

fn svm_type(word: Word<'_>) -> Result<SvmType> {
    let all = [SvmType::CSvc, SvmType::NuSvc, SvmType::OneClass, SvmType::EpsilonSvr, SvmType::NuSvr];
    all.into_iter().find(|t| t.name() == word.text).ok_or_else(|| {
        let names = all.map(SvmType::name).join(", ");
        word.error(format!("unknown svm_type {}; known are {names}", excerpt(word.text)))
    })
}

fn kernel_type(word: Word<'_>) -> Result<&'static str> {
    match word.text {
        "linear" => Ok("linear"),
        "polynomial" => Ok("polynomial"),
        "rbf" => Ok("rbf"),
        "sigmoid" => Ok("sigmoid"),
        "precomputed" => Err(word.error(
            "models with a precomputed kernel hold no vectors to compute with; train with another kernel",
        )),
        other => Err(word.error(format!(
            "unknown kernel_type {}; known are linear, polynomial, rbf, sigmoid",
            excerpt(other)
        ))),
    }
}

fn required<T, R: BufRead>(entry: Entry<T>, name: &str, lines: &Lines<R>) -> Result<(T, usize)> {
    entry.ok_or_else(|| lines.error(format!("the header {name} is missing")))
}

/// The list, if it has the right length; an absent one is empty.
fn counted<T, R: BufRead>(
    entry: Entry<Vec<T>>,
    name: &str,
    count: usize,
    why: &str,
    lines: &Lines<R>,
) -> Result<Vec<T>> {
    match entry {
        Some((values, line)) if values.len() != count => {
            Err(lines.error_at(line, format!("{name} has {} values instead of {count}, {why}", values.len())))
        }
        Some((values, _)) => Ok(values),
        None => Ok(Vec::new()),
    }
}
