//! What a loader ignored or changed, bounded in number.

use crate::source::Span;

/// Collects warnings; after the limit it only counts.
#[derive(Debug)]
pub(crate) struct Warnings {
    texts: Vec<String>,
    limit: usize,
    more: usize,
}

impl Warnings {
    pub fn new(limit: usize) -> Self {
        Self { texts: Vec::new(), limit, more: 0 }
    }

    /// A warning about a place.
    pub fn at(&mut self, span: &Span, text: impl AsRef<str>) {
        if self.texts.len() < self.limit {
            self.texts.push(format!("{}: {}", span.place(), text.as_ref()));
        } else {
            self.more += 1;
        }
    }

    /// A warning about the file as a whole; the same text is said once.
    pub fn add(&mut self, text: String) {
        if self.texts.contains(&text) {
        } else if self.texts.len() < self.limit {
            self.texts.push(text);
        } else {
            self.more += 1;
        }
    }

    /// Adds those of another list.
    pub fn append(&mut self, other: Self) {
        self.more += other.more;
        other.texts.into_iter().for_each(|text| self.add(text));
    }

    pub fn into_vec(mut self) -> Vec<String> {
        if self.more > 0 {
            self.texts.push(format!("{} more warnings", self.more));
        }
        self.texts
    }
}
