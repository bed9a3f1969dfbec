//! Files of other libraries: what is read, and what is refused with a reason.

mod common;

use std::io::Cursor;

use common::{foreign, kinds};
use exr::prelude::{Blocks, Compression, SpecificChannels, WritableImage};
use openexr_core::{Error, Limits, Samples, half, read};

#[test]
fn lossless_scan_lines_and_tiles_read() {
    for (method, blocks) in kinds() {
        let image = read(&foreign((53, 37), method, blocks), &Limits::default())
            .unwrap_or_else(|e| panic!("{method} {blocks:?}: {e}"));
        assert_eq!(image.data.size, [53, 37]);
        let names: Vec<&str> = image.channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["B", "G", "R"]);
        for i in 0..53 * 37usize {
            let k = |k: usize| ((i * k) as f32 * 0.01).sin();
            let [b, g, r] = [0, 1, 2].map(|c: usize| &image.channels[c].samples);
            assert!(matches!(b, Samples::F32(v) if v[i] == k(1)), "{method} {blocks:?}");
            assert!(matches!(g, Samples::Half(v) if v[i] == half::from_f32(k(2))), "{method} {blocks:?}");
            assert!(matches!(r, Samples::U32(v) if v[i] == i as u32), "{method} {blocks:?}");
        }
    }
}

#[test]
fn lossy_files_are_refused_by_name() {
    let file = foreign((20, 20), Compression::PXR24, Blocks::ScanLines);
    let error = read(&file, &Limits::default()).unwrap_err();
    assert!(matches!(&error, Error::Unsupported(why) if why.contains("PXR24")), "{error}");
}

#[test]
fn limits_hold() {
    let file = foreign((53, 37), Compression::ZIP16, Blocks::ScanLines);
    let with = |limits| read(&file, &limits);
    assert!(with(Limits { max_side: 52, ..Limits::default() }).is_err());
    assert!(with(Limits { max_side: 53, ..Limits::default() }).is_ok());
    assert!(matches!(with(Limits { max_channels: 2, ..Limits::default() }), Err(Error::TooLarge(_))));
    assert!(matches!(
        with(Limits { max_bytes: 53 * 37 * 10 - 1, ..Limits::default() }),
        Err(Error::TooLarge(_))
    ));
}

#[test]
fn a_header_cannot_claim_more_than_its_file_can_hold() {
    let mut file = Cursor::new(Vec::new());
    let pixels = SpecificChannels::rgb(|_| (0.0f32, 0.0f32, 0.0f32));
    exr::prelude::Image::from_channels((64, 64), pixels).write().to_buffered(&mut file).unwrap();
    let mut bytes = file.into_inner();
    // The data window's last column and row follow its name, type and size.
    let key = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len() + 8;
    bytes[at..at + 4].copy_from_slice(&30_000i32.to_le_bytes());
    bytes[at + 4..at + 8].copy_from_slice(&30_000i32.to_le_bytes());
    assert!(read(&bytes, &Limits::default()).is_err());
}

#[test]
fn other_bytes_are_errors() {
    for bytes in [&b""[..], b"v", &openexr_core::MAGIC, b"\x89PNG\r\n\x1a\n", &[0; 4096]] {
        assert!(read(bytes, &Limits::default()).is_err());
    }
}
