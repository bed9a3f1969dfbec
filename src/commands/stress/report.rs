//! The table of docs/stability.md.

use super::case::{Effort, Outcome, number};
use anyhow::Context;
use sparing_image::atomic::{OutputError, write_atomic};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Writes both tables.
pub(super) fn write(folder: &Path, outcomes: &[Outcome], effort: Effort) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let mut page = String::from("# Numerical stability\n\n");
    let form = effort.of("sparing stress --quick", "sparing stress");
    let _ = writeln!(
        page,
        "Made by `{form} --report docs` of sparing {}, which the table is of. Every case asserts that nothing panics and that what it measures is at most its bound.\n",
        crate::VERSION
    );
    let mut csv = String::from("area,case,measured,bound,unit,holds\n");
    let mut area = "";
    for o in outcomes {
        let c = &o.case;
        if c.area != area {
            area = c.area;
            let _ = write!(
                page,
                "{}## {area}\n\n| case | what it does | measured | at most | |\n| --- | --- | --- | --- | --- |\n",
                if page.ends_with("|\n") { "\n" } else { "" }
            );
        }
        let fails = if o.holds() { "" } else { " **fails**" };
        let (value, bound) = (o.value(), number(c.bound));
        let _ = writeln!(page, "| {} | {} | {value}{fails} | {bound} | {} |", c.name, c.does, c.unit);
        let _ = writeln!(csv, "{},{},{value},{bound},{},{}", c.area, c.name, c.unit, o.holds());
    }
    for (name, text) in [("stability.md", page), ("stability.csv", csv)] {
        let path = folder.join(name);
        write_atomic(&path, |file| file.write_all(text.as_bytes()).map_err(OutputError::io(&path)))?;
    }
    Ok(())
}
