//! What is written reads back the same, here and in an independent reader.

use std::cell::Cell;
use std::io::{Cursor, Read, Seek, SeekFrom};

use exr::prelude::*;
use openexr_core::{
    Attribute, Channel, Error, Image, Limits, Samples, Window, read, read_header, read_header_from, write,
};

fn bytes_of(image: &openexr_core::Image) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write(&mut file, image).expect("a valid image");
    file.into_inner()
}

/// A crop with every type of channel and attribute, and long names.
fn sample(width: u32, height: u32) -> Image {
    let n = width * height;
    let wild = [0.0, -0.0, 1.0, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE / 4.0, f32::MAX, 0.1];
    let floats = (0..n).map(|i| wild[i as usize % 8] + if i % 8 == 7 { i as f32 } else { 0.0 }).collect();
    let halves = (0..n).map(|i| (i * 7 % 0x7c00) as u16).collect();
    let long = "ALayerWithAVeryLongName.thatWouldNotFitInto31Bytes.R";
    let channel = |name: &str, samples| Channel { name: name.into(), samples };
    Image {
        display: Window { origin: [-5, 7], size: [200, 100] },
        data: Window { origin: [3, 11], size: [width, height] },
        channels: vec![
            channel("Z", Samples::F32(floats)),
            channel("A", Samples::Half(halves)),
            channel("SampleCount.Y", Samples::U32((0..n).map(|i| u32::MAX - i).collect())),
            channel(long, Samples::F32((0..n).map(|i| (i as f32).sin()).collect())),
        ],
        attributes: vec![
            ("owner".into(), Attribute::String("Grüße, 世界".into())),
            ("empty".into(), Attribute::String(String::new())),
            ("seed".into(), Attribute::Int(i32::MIN)),
            ("exposure".into(), Attribute::Float(-0.5)),
            ("seconds".into(), Attribute::Double(1.0 / 3.0)),
            ("size".into(), Attribute::V2i([1, -2])),
            ("center".into(), Attribute::V2f([0.5, f32::INFINITY])),
            ("cell".into(), Attribute::V3i([1, 2, 3])),
            ("eye".into(), Attribute::V3f([1.0, 2.0, 3.0])),
            ("worldToCamera".into(), Attribute::M44f(std::array::from_fn(|i| i as f32))),
            (
                "chromaticities".into(),
                Attribute::Chromaticities([0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.31, 0.33]),
            ),
            ("curve".into(), Attribute::FloatVector(vec![1.0, -1.0, 0.25])),
            ("parts".into(), Attribute::StringVector(vec!["one".into(), "two".into()])),
            ("anAttributeNameThatIsLongerThan31BytesToo".into(), Attribute::Int(7)),
        ],
    }
}

fn sorted(mut image: Image) -> Image {
    image.channels.sort_by(|a, b| a.name.cmp(&b.name));
    image
}

#[test]
fn everything_survives() {
    // One line, one chunk, several chunks with a short last one, many.
    for (width, height) in [(1, 1), (33, 1), (1, 33), (16, 16), (37, 53), (90, 400)] {
        let image = sample(width, height);
        let back = read(&bytes_of(&image), &Limits::default()).unwrap();
        assert_eq!(back, sorted(image), "{width} x {height}");
    }
}

#[test]
fn incompressible_chunks_survive() {
    let mut x = 1u32;
    let mut noise = || {
        x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        x.rotate_left(13) ^ x
    };
    let mut image = Image::new(Window::of_size(61, 47));
    image
        .channels
        .push(Channel { name: "Y".into(), samples: Samples::U32((0..61 * 47).map(|_| noise()).collect()) });
    assert_eq!(read(&bytes_of(&image), &Limits::default()).unwrap(), image);
}

#[test]
fn the_header_alone_reads() {
    let image = sample(37, 53);
    let header = read_header(&bytes_of(&image), &Limits::default()).unwrap();
    assert_eq!(header.attributes, image.attributes);
    assert_eq!((header.display, header.data), (image.display, image.data));
    assert!(header.channels.iter().all(|c| c.samples.is_empty()));
    assert_eq!(header.channels.len(), 4);
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let image = sample(90, 400);
    let with =
        |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| bytes_of(&image));
    let one = with(1);
    assert!([2, 3, 8].into_iter().all(|n| with(n) == one));
}

#[test]
fn an_independent_reader_agrees() {
    let image = sample(37, 53);
    let bytes = bytes_of(&image);
    let theirs = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .unwrap();
    assert_eq!(theirs.attributes.display_window.position, Vec2(-5, 7));
    assert_eq!(theirs.attributes.display_window.size, Vec2(200, 100));
    let layer = &theirs.layer_data;
    assert_eq!(layer.attributes.layer_position, Vec2(3, 11));
    assert_eq!(layer.size, Vec2(37, 53));
    assert_eq!(layer.encoding.compression, Compression::ZIP16);
    let owner = layer.attributes.owner.as_ref().map(|text| text.as_slice().to_vec());
    assert_eq!(owner.as_deref(), Some("Grüße, 世界".as_bytes()));
    assert_eq!(layer.channel_data.list.len(), 4);
    for (theirs, ours) in layer.channel_data.list.iter().zip(&sorted(image).channels) {
        assert_eq!(theirs.name.to_string(), ours.name);
        match (&theirs.sample_data, &ours.samples) {
            (FlatSamples::F32(a), Samples::F32(b)) => assert_eq!(a, b),
            (FlatSamples::U32(a), Samples::U32(b)) => assert_eq!(a, b),
            (FlatSamples::F16(a), Samples::Half(b)) => {
                assert!(a.iter().map(|h| h.to_bits()).eq(b.iter().copied()));
            }
            _ => panic!("{} has another type", ours.name),
        }
    }
}

#[test]
fn impossible_images_are_refused() {
    let good = sample(4, 4);
    type Case = (&'static str, fn(&mut Image));
    let cases: Vec<Case> = vec![
        ("no channels", |i| i.channels.clear()),
        ("short channel", |i| i.channels[0].samples = Samples::F32(vec![0.0; 15])),
        ("double channel", |i| i.channels[1].name = "Z".into()),
        ("empty name", |i| i.channels[1].name = String::new()),
        ("NUL in a name", |i| i.channels[1].name = "a\0b".into()),
        ("endless name", |i| i.channels[1].name = "n".repeat(256)),
        ("double attribute", |i| i.attributes[1].0 = "owner".into()),
        ("layout attribute", |i| i.attributes[1].0 = "dataWindow".into()),
        ("NUL in a text", |i| i.attributes[0].1 = Attribute::String("a\0b".into())),
        ("no pixels", |i| i.data.size = [0, 4]),
        ("far away", |i| i.data.origin = [i32::MAX - 2, 0]),
        ("endless", |i| i.display.size = [u32::MAX, 1]),
    ];
    for (what, change) in cases {
        let mut image = good.clone();
        change(&mut image);
        let mut file = Cursor::new(Vec::new());
        assert!(matches!(write(&mut file, &image), Err(Error::Invalid(_))), "{what}");
        assert!(file.get_ref().is_empty(), "{what}");
    }
}

/// Takes a number of bytes, then fails as a full disk does.
struct Full(Cursor<Vec<u8>>, usize);

impl std::io::Write for Full {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.0.get_ref().len() + bytes.len() > self.1 {
            return Err(std::io::ErrorKind::StorageFull.into());
        }
        self.0.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for Full {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_full_disk_is_one_clear_error() {
    let image = sample(37, 53);
    let size = bytes_of(&image).len();
    for limit in [0, 3, 100, 1500, size / 2, size - 1] {
        let error = write(Full(Cursor::new(Vec::new()), limit), &image).unwrap_err();
        assert!(
            matches!(&error, Error::Io(e) if e.kind() == std::io::ErrorKind::StorageFull),
            "{limit}: {error}"
        );
    }
}

#[test]
fn a_panicking_stream_panics_here_and_not_in_c() {
    struct Panics;
    impl std::io::Write for Panics {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            panic!("stream");
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    impl std::io::Seek for Panics {
        fn seek(&mut self, _: std::io::SeekFrom) -> std::io::Result<u64> {
            Ok(0)
        }
    }
    assert!(std::panic::catch_unwind(|| write(Panics, &sample(4, 4))).is_err());
}

/// A file that counts what is read of it, and does as it is told from some byte on.
struct Watched<'a> {
    file: Cursor<Vec<u8>>,
    read: &'a Cell<usize>,
    at: u64,
    then: fn() -> std::io::Result<usize>,
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.file.position() >= self.at {
            return (self.then)();
        }
        // Bit by bit, as pipes and networks give it.
        let part = buffer.len().min(700);
        let n = self.file.read(&mut buffer[..part])?;
        self.read.set(self.read.get() + n);
        Ok(n)
    }
}

impl Seek for Watched<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(to)
    }
}

#[test]
fn a_header_is_read_without_the_rest() {
    let image = sample(300, 400);
    let bytes = bytes_of(&image);
    let watched = |read, at, then| Watched { file: Cursor::new(bytes.clone()), read, at, then };
    let limits = Limits::default();
    let read = Cell::new(0);
    let found = read_header_from(watched(&read, u64::MAX, || Ok(0)), &limits).expect("a header");
    assert_eq!(found, read_header(&bytes, &limits).expect("a header"));
    assert_eq!(found.attributes, image.attributes);
    assert!(
        (200..20_000).contains(&read.get()) && bytes.len() > 200_000,
        "{} of {}",
        read.get(),
        bytes.len()
    );
    // Files that fail, end or panic on the way.
    let broken = || Err(std::io::Error::other("the network is gone"));
    match read_header_from(watched(&read, 50, broken), &limits) {
        Err(Error::Io(e)) => assert_eq!(e.to_string(), "the network is gone"),
        other => panic!("{other:?}"),
    }
    assert!(matches!(read_header_from(watched(&read, 50, || Ok(0)), &limits), Err(Error::Library { .. })));
    let panics = std::panic::catch_unwind(|| {
        let read = Cell::new(0);
        let file =
            Watched { file: Cursor::new(bytes.clone()), read: &read, at: 0, then: || panic!("stream") };
        drop(read_header_from(file, &Limits::default()));
    });
    assert_eq!(panics.expect_err("it comes back").downcast_ref::<&str>(), Some(&"stream"));
    assert!(read_header_from(Cursor::new(&bytes[..0]), &limits).is_err());
}
