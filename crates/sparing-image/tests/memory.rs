//! What pictures take while they are read. In one test, since the numbers are those of the process.
#![cfg(target_os = "linux")]

use sparing_image::exr::{ExrImage, write_exr};
use sparing_image::picture::{MAX_BYTES, Picture};

/// Most memory that the process has had (`VmHWM`) or reserved (`VmPeak`).
fn peak(key: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find_map(|l| l.strip_prefix(key)).unwrap();
    line.trim_matches([':', ' ', '\t']).strip_suffix("kB").unwrap().trim().parse::<u64>().unwrap() * 1024
}

/// An uncompressed TGA file without its pixels: grey, colour or colour with alpha.
fn tga(size: [u16; 2], bits: u8) -> Vec<u8> {
    let mut header = vec![0, 0, if bits == 8 { 3 } else { 2 }, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    header.extend(size.iter().flat_map(|v| v.to_le_bytes()));
    header.extend([bits, 0x20 | if bits == 32 { 8 } else { 0 }]);
    header
}

fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut crc = !0_u32;
    for byte in kind.iter().chain(data) {
        crc ^= u32::from(*byte);
        (0..8).for_each(|_| crc = crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 });
    }
    [&(data.len() as u32).to_be_bytes()[..], kind, data, &(!crc).to_be_bytes()].concat()
}

/// A PNG file of the header and some bytes that are no pixels.
fn png(size: [u32; 2], depth: u8, color: u8) -> Vec<u8> {
    let [width, height] = size.map(u32::to_be_bytes);
    let header = [&width[..], &height, &[depth, color, 0, 0, 0]].concat();
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &header),
        chunk(b"IDAT", &[0x78, 0x9c]),
        chunk(b"IEND", &[]),
    ]
    .concat()
}

fn jpeg([width, height]: [u16; 2]) -> Vec<u8> {
    let mut file = vec![0xff, 0xd8, 0xff, 0xc0, 0, 17, 8];
    file.extend([height, width].iter().flat_map(|v| v.to_be_bytes()));
    file.extend([3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0, 0xff, 0xda, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, 63, 0]);
    file
}

/// An OpenEXR file of one pixel whose header says that they are 65,536 by 65,536.
fn exr() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = ExrImage { width: 1, height: 1, display_size: [1, 1], ..ExrImage::default() };
    image.push_vector("", ["R", "G", "B"], &[[1.0; 3]]);
    write_exr(&path, &image).unwrap();
    let mut file = std::fs::read(&path).unwrap();
    let mark = b"dataWindow\0box2i\0";
    let at = file.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len() + 4;
    file[at + 8..at + 16].copy_from_slice(&[65_535_u32.to_le_bytes(); 2].concat());
    file
}

#[test]
fn one_copy_and_nothing_for_what_is_refused() {
    // A file that claims more than the limit is refused before any of it is reserved.
    let before = peak("VmPeak");
    let side = 65_535;
    let hdr = |w: u32, h: u32| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {h} +X {w}\n").into_bytes();
    let refused = [
        ("a.tga", tga([side, side], 8), 65_535_u64 * 65_535 * 4),
        ("a.tga", tga([side, side], 24), 65_535 * 65_535 * 4),
        ("a.png", png([65_536, 65_536], 8, 0), 1 << 34),
        ("a.png", png([32_769, 32_768], 8, 6), 4 * 32_769 * 32_768),
        ("a.png", png([32_768, 16_385], 16, 6), 8 * 32_768 * 16_385),
        ("a.jpg", jpeg([side, side]), 65_535 * 65_535 * 4),
        ("a.hdr", hdr(32_768, 10_923), 12 * 32_768 * 10_923),
    ];
    for (name, file, bytes) in refused {
        let said = Picture::decode(&file, name).expect_err(name).to_string();
        let wanted = format!(" pixels take {bytes} bytes in memory, the limit is MAX_BYTES = {MAX_BYTES}");
        assert!(said.starts_with(&format!("cannot decode {name}: ")) && said.ends_with(&wanted), "{said}");
    }
    let said = Picture::decode(&exr(), "a.exr").expect_err("more than there is").to_string();
    assert!(
        said.starts_with("cannot decode a.exr: ") && said.ends_with("4096 chunks in 370 bytes"),
        "{said}"
    );
    // A thread's arena and OpenEXR reserve some 70 MiB.
    let taken = peak("VmPeak") - before;
    assert!(taken < 1 << 30, "{taken} bytes were reserved");

    // Just within: there are no pixels in the file, which is another message; and their memory is not touched.
    let resident = peak("VmHWM");
    for (name, file) in [("a.png", png([32_768, 32_768], 8, 6)), ("a.hdr", hdr(32_768, 10_922))] {
        let said = Picture::decode(&file, name).expect_err(name).to_string();
        assert!(!said.contains("MAX_BYTES"), "{said}");
    }
    let touched = peak("VmHWM") - resident;
    assert!(touched < 64 << 20, "{touched} bytes were touched");

    // 64 Mi pixels of one byte in the file, four in memory, and no more than these.
    let mut file = tga([8192, 8192], 8);
    file.resize(file.len() + 8192 * 8192, 7);
    let before = peak("VmHWM");
    let picture = Picture::decode(&file, "a.tga").expect("it is decoded");
    let (taken, kept) = (peak("VmHWM") - before, 4 * 8192 * 8192);
    assert_eq!((picture.width, picture.height), (8192, 8192));
    assert!(taken < kept + (32 << 20), "{taken} bytes for {kept}");
}
