//! Rows that were collected already, one file a scene.
//!
//! ```text
//! sparing rows 1
//! settings          what the rows depend on; rows of other settings are collected again
//! count
//! numbers            one line a row, with all digits
//! ```

use anyhow::Context;
use sparing_image::atomic::{OutputError, write_atomic};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

/// To be raised when rows of the same settings come out otherwise.
const FORMAT: &str = "sparing rows 1";

/// The folder of the rows.
pub(super) struct Cache {
    folder: PathBuf,
    settings: String,
    columns: usize,
}

impl Cache {
    /// For rows of so many numbers. Rows of other settings are not read.
    pub(super) fn new(folder: PathBuf, settings: String, columns: usize) -> anyhow::Result<Self> {
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        Ok(Self { folder, settings, columns })
    }

    fn path(&self, index: u32) -> PathBuf {
        self.folder.join(format!("scene-{index:04}.rows"))
    }

    /// The rows of a scene; `None` if there are none of these settings.
    pub(super) fn read(&self, index: u32) -> anyhow::Result<Option<Vec<Vec<f64>>>> {
        let path = self.path(index);
        match std::fs::read_to_string(&path) {
            Ok(text) => Ok(self.parse(&text)),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            // A file that is no text is none of ours: its scene is rendered again.
            Err(e) if e.kind() == std::io::ErrorKind::InvalidData => Ok(None),
            Err(e) => Err(e).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    fn parse(&self, text: &str) -> Option<Vec<Vec<f64>>> {
        let mut lines = text.lines();
        let count: usize = match (lines.next(), lines.next(), lines.next()) {
            (Some(FORMAT), Some(settings), Some(count)) if settings == self.settings => count.parse().ok()?,
            _ => return None,
        };
        let number = |v: &str| v.parse().ok().filter(|v: &f64| v.is_finite());
        let row = |line: &str| line.split(' ').map(number).collect::<Option<Vec<f64>>>();
        let rows: Vec<Vec<f64>> =
            lines.map(|l| row(l).filter(|r| r.len() == self.columns)).collect::<Option<_>>()?;
        (rows.len() == count).then_some(rows)
    }

    pub(super) fn write(&self, index: u32, rows: &[Vec<f64>]) -> anyhow::Result<()> {
        let mut text = format!("{FORMAT}\n{}\n{}\n", self.settings, rows.len());
        for row in rows {
            for (i, value) in row.iter().enumerate() {
                let _ = write!(text, "{}{value:e}", if i == 0 { "" } else { " " });
            }
            text.push('\n');
        }
        let path = self.path(index);
        write_atomic(&path, |file| file.write_all(text.as_bytes()).map_err(OutputError::io(&path)))?;
        Ok(())
    }
}
