//! The measurements as CSV and JSON.

use super::{Point, Tradeoff};
use std::fmt::Write as _;

impl Tradeoff {
    /// One line for the full machine and each point. Shares are 0 to 1; accuracies are empty without labels.
    /// The column `rendered_error` is there only when a point has it.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let rendered = self.points.iter().chain([&self.full]).any(|p| p.rendered_error.is_some());
        let mut text = String::from(
            "method,size,vectors,accuracy,balanced_accuracy,auc,agreement,flips,ns_per_query,bytes,pareto",
        );
        text.push_str(if rendered { ",rendered_error\n" } else { "\n" });
        for point in std::iter::once(&self.full).chain(&self.points) {
            line(&mut text, point, rendered);
        }
        text
    }

    /// Everything, with how it was measured.
    ///
    /// # Errors
    /// Never in practice: all fields can be written.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        Ok(text)
    }
}

fn line(text: &mut String, p: &Point, rendered: bool) {
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6}"));
    let _ = write!(
        text,
        "{},{},{},{},{},{},{:.6},{},{:.2},{},{}",
        p.method,
        p.size,
        p.vectors,
        number(p.quality.map(|q| q.accuracy)),
        number(p.quality.and_then(|q| q.balanced_accuracy)),
        number(p.quality.and_then(|q| q.auc)),
        p.agreement,
        p.flips,
        p.ns_per_query,
        p.bytes,
        p.pareto
    );
    if rendered {
        let _ = write!(text, ",{}", number(p.rendered_error));
    }
    text.push('\n');
}
