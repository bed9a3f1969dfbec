//! Damaged files give an error or a picture, never a crash.

mod common;

use common::{foreign, kinds};
use openexr_core::{Limits, read, read_header};
use proptest::prelude::*;

/// Keeps single cases fast and small.
const LIMITS: Limits = Limits { max_side: 4096, max_channels: 64, max_bytes: 64 << 20 };

fn files() -> &'static [Vec<u8>] {
    static FILES: std::sync::LazyLock<Vec<Vec<u8>>> =
        std::sync::LazyLock::new(|| kinds().into_iter().map(|(m, b)| foreign((40, 37), m, b)).collect());
    &FILES
}

fn survives(bytes: &[u8]) {
    let _ = read_header(bytes, &LIMITS);
    if let Ok(image) = read(bytes, &LIMITS) {
        assert!(image.channels.iter().all(|c| c.samples.len() as u64 == image.data.pixels()));
    }
}

#[test]
fn every_truncation() {
    for file in files() {
        for length in (0..file.len()).step_by(7) {
            survives(&file[..length]);
        }
    }
}

#[test]
fn every_header_byte() {
    for file in files() {
        for at in 0..file.len().min(700) {
            for value in [0, 1, 0x7f, 0x80, 0xff] {
                let mut bytes = file.clone();
                bytes[at] = value;
                survives(&bytes);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn mutations(
        which in 0..10usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        cut in prop::option::weighted(0.1, any::<prop::sample::Index>()),
    ) {
        let mut bytes = files()[which].clone();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        survives(&bytes);
    }

    #[test]
    fn noise_after_the_magic_number(noise in prop::collection::vec(any::<u8>(), 0..600)) {
        survives(&[&openexr_core::MAGIC[..], &[2, 0, 0, 0], &noise].concat());
    }
}
