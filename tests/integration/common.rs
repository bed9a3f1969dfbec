//! Running the binary, reading what it wrote.

use exr::meta::attribute::AttributeValue;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What a run of the command gave.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    /// Standard output as one JSON value.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in {}", self.stdout))
    }
}

/// The repository's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Path of a scene below `scenes/`.
pub fn scene(name: &str) -> PathBuf {
    root().join("scenes").join(name)
}

/// Arguments of a command line; `@NAME` is a scene of the repository, which may use what is there.
pub fn arguments(line: &str) -> Vec<PathBuf> {
    let word = |w: &str| w.strip_prefix('@').map_or_else(|| w.into(), scene);
    let mut words: Vec<PathBuf> = line.split_whitespace().map(word).collect();
    let loads = ["render", "info", "study", "convert"].iter().any(|command| line.starts_with(command));
    if loads && line.contains(" @") {
        words.extend(["--allow-path".into(), root().to_owned()]);
    }
    words
}

/// Runs `sparing` in a folder. Panics if it takes more than two minutes, dies of a signal, or panics itself.
pub fn run(folder: &Path, line: &str) -> Run {
    let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_sparing"))
        .current_dir(folder)
        .args(arguments(line))
        .env_remove("SPARING_LOG")
        .env("COLUMNS", "110")
        .timeout(Duration::from_secs(120))
        .output()
        .unwrap_or_else(|e| panic!("{line}: {e}"));
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap_or_else(|e| panic!("{line}: {e}"));
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    for trace in ["panicked", "RUST_BACKTRACE", "memory allocation"] {
        assert!(!stderr.contains(trace), "{line}: {stderr}");
    }
    let code = output.status.code().unwrap_or_else(|| panic!("{line}: {}\n{stderr}", output.status));
    Run { code, stdout, stderr }
}

/// Runs and expects success.
pub fn ok(folder: &Path, line: &str) -> Run {
    let r = run(folder, line);
    assert_eq!(r.code, 0, "{line}: {}", r.stderr);
    r
}

/// A folder that vanishes with the test.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Names of all files in a folder, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// An EXR read by the `exr` crate, which shares no code with the writer: first part, channels as floats by name.
pub struct Exr {
    pub size: [usize; 2],
    pub origin: [i32; 2],
    pub display: [usize; 2],
    pub channels: Vec<(String, Vec<f32>)>,
    pub attributes: Vec<(String, AttributeValue)>,
}

impl Exr {
    pub fn read(path: &Path) -> Self {
        use exr::prelude::{ReadChannels, ReadLayers};
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_file(path)
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let layer = &image.layer_data;
        let own = &layer.attributes;
        let channels = layer.channel_data.list.iter();
        // Standard attributes have fields of their own in the reader.
        let standard = [
            ("software", own.software_name.clone().map(AttributeValue::Text)),
            ("worldToCamera", own.world_to_camera.map(AttributeValue::Matrix4x4)),
        ];
        let other = own.other.iter().chain(&image.attributes.other).map(|(k, v)| (k.to_string(), v.clone()));
        let mut attributes: Vec<_> = other.collect();
        attributes.extend(standard.into_iter().filter_map(|(k, v)| Some((k.to_owned(), v?))));
        attributes.sort_by(|a, b| a.0.cmp(&b.0));
        Self {
            size: [layer.size.0, layer.size.1],
            origin: [own.layer_position.0, own.layer_position.1],
            display: [image.attributes.display_window.size.0, image.attributes.display_window.size.1],
            channels: channels
                .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
                .collect(),
            attributes,
        }
    }

    /// Values of a channel.
    pub fn channel(&self, name: &str) -> &[f32] {
        let found = self.channels.iter().find(|c| c.0 == name);
        &found.unwrap_or_else(|| panic!("no channel {name} in {:?}", self.names())).1
    }

    pub fn names(&self) -> Vec<&str> {
        self.channels.iter().map(|c| c.0.as_str()).collect()
    }

    /// Mean of the channels R, G and B, and its variance from the layer of that name.
    pub fn brightness(&self) -> (f64, f64) {
        let sum = |names: [&str; 3]| -> f64 {
            names.iter().flat_map(|n| self.channel(n)).map(|v| f64::from(*v)).sum()
        };
        let n = (3 * self.size[0] * self.size[1]) as f64;
        (sum(["R", "G", "B"]) / n, sum(["Variance.R", "Variance.G", "Variance.B"]) / (n * n))
    }
}

/// Two-sided p-value of two means with known variances being equal.
pub fn p_value(a: (f64, f64), b: (f64, f64)) -> f64 {
    testkit::special::normal_two_sided((a.0 - b.0) / (a.1 + b.1).sqrt().max(f64::MIN_POSITIVE))
}
