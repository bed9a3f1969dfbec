//! Rows that were collected already, one file a scene.
//!
//! ```text
//! sparing rows 1
//! settings          what the rows depend on; rows of other settings are collected again
//! count
//! gains features     one line a row, with all digits
//! ```

use anyhow::Context;
use sparing_adaptive::features::Feature;
use sparing_adaptive::training::Row;
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
}

impl Cache {
    pub(super) fn new(folder: PathBuf, settings: &str) -> anyhow::Result<Self> {
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let features: Vec<&str> = Feature::ALL.iter().map(|f| f.name()).collect();
        Ok(Self { folder, settings: format!("{settings} features {}", features.join(",")) })
    }

    fn path(&self, index: u32) -> PathBuf {
        self.folder.join(format!("scene-{index:04}.rows"))
    }

    /// The rows of a scene; `None` if there are none of these settings.
    pub(super) fn read(&self, index: u32) -> anyhow::Result<Option<Vec<Row>>> {
        let path = self.path(index);
        match std::fs::read_to_string(&path) {
            Ok(text) => Ok(self.parse(&text)),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            // A file that is no text is none of ours: its scene is rendered again.
            Err(e) if e.kind() == std::io::ErrorKind::InvalidData => Ok(None),
            Err(e) => Err(e).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    fn parse(&self, text: &str) -> Option<Vec<Row>> {
        let mut lines = text.lines();
        let count: usize = match (lines.next(), lines.next(), lines.next()) {
            (Some(FORMAT), Some(settings), Some(count)) if settings == self.settings => count.parse().ok()?,
            _ => return None,
        };
        let rows: Vec<Row> = lines
            .map(|line| {
                let values: Vec<f64> = line
                    .split(' ')
                    .map(|v| v.parse().ok().filter(|v: &f64| v.is_finite()))
                    .collect::<Option<_>>()?;
                let (gains, features) = values.split_first_chunk()?;
                (features.len() == Feature::ALL.len())
                    .then(|| Row { gains: *gains, features: features.to_vec() })
            })
            .collect::<Option<_>>()?;
        (rows.len() == count).then_some(rows)
    }

    pub(super) fn write(&self, index: u32, rows: &[Row]) -> anyhow::Result<()> {
        let mut text = format!("{FORMAT}\n{}\n{}\n", self.settings, rows.len());
        for row in rows {
            for (i, value) in row.gains.iter().chain(&row.features).enumerate() {
                let _ = write!(text, "{}{value:e}", if i == 0 { "" } else { " " });
            }
            text.push('\n');
        }
        let path = self.path(index);
        write_atomic(&path, |file| file.write_all(text.as_bytes()).map_err(OutputError::io(&path)))?;
        Ok(())
    }
}
