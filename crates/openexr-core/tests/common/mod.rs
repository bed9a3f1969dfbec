//! Files that another library wrote.

use std::io::Cursor;

use exr::prelude::*;

/// An image of this size written by the `exr` crate.
pub fn foreign(size: (usize, usize), compression: Compression, blocks: Blocks) -> Vec<u8> {
    let values = |k: usize| (0..size.0 * size.1).map(move |i| ((i * k) as f32 * 0.01).sin());
    let list = vec![
        AnyChannel::new("B", FlatSamples::F32(values(1).collect())),
        AnyChannel::new("G", FlatSamples::F16(values(2).map(f16::from_f32).collect())),
        AnyChannel::new("R", FlatSamples::U32((0..(size.0 * size.1) as u32).collect())),
    ];
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let channels = AnyChannels::sort(list.into_iter().collect());
    let layer = Layer::new(size, LayerAttributes::named("x"), encoding, channels);
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut file).expect("written");
    file.into_inner()
}

/// All kinds that are read: compression methods, scan lines and tiles.
pub fn kinds() -> Vec<(Compression, Blocks)> {
    let methods = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
    ];
    let blocks = [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 8))];
    methods.into_iter().flat_map(|m| blocks.map(|b| (m, b))).collect()
}
