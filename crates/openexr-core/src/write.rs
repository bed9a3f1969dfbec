//! The writer: scan lines, ZIP, one part.

use std::ffi::CString;
use std::io::{Seek, Write};

use openexr_core_sys as sys;
use rayon::prelude::*;

use crate::context::{Context, Sink};
use crate::error::check;
use crate::image::{Compression, ImageRef, SamplesRef, Window};
use crate::{Error, attribute, check as checked};

/// Deflate level: OpenEXR 3's own default, near the best ratio for float data at twice the speed of level 6.
const ZIP_LEVEL: i32 = 4;

/// Writes an [`Image`](crate::Image) (or a borrowed [`ImageRef`]) as a single-part scan-line file, ZIP compressed (16 lines a chunk).
///
/// The stream is written from its start, with seeks back to fill in the chunk table, and flushed.
///
/// # Errors
/// [`Error::Invalid`] before anything is written if the image cannot be stored, [`Error::Io`] if the stream
/// fails, [`Error::Library`] for anything else. The stream's contents are then useless.
pub fn write<'a, W: Write + Seek>(out: W, image: impl Into<ImageRef<'a>>) -> Result<(), Error> {
    let image = &image.into();
    checked::image(image)?;
    let mut sink = Sink::new(out);
    let result = write_to(&mut sink, image);
    if let Some(panic) = sink.panic.take() {
        std::panic::resume_unwind(panic);
    }
    // The stream's own error says more than what the library made of it.
    if let Some(error) = sink.error.take() {
        return Err(error.into());
    }
    result?;
    sink.flush()?;
    Ok(())
}

fn write_to<W: Write + Seek>(sink: &mut Sink<W>, image: &ImageRef<'_>) -> Result<(), Error> {
    let context = Context::write(sink, ZIP_LEVEL)?;
    write_header(&context, image)?;
    let mut lines_per_chunk = 0;
    // SAFETY: the context is open and part 0 exists.
    check(unsafe { sys::exr_get_scanlines_per_chunk(context.raw(), 0, &mut lines_per_chunk) })?;
    let lines_per_chunk = u32::try_from(lines_per_chunk)
        .ok()
        .filter(|n| *n > 0)
        .ok_or_else(|| Error::Damaged("the library's chunks have no lines".into()))?;
    let starts: Vec<u32> = (0..image.data.size[1]).step_by(lines_per_chunk as usize).collect();
    let shared = Shared(context.raw());
    // A few chunks a thread at a time: compressed together, then written in order.
    for batch in starts.chunks(4 * rayon::current_num_threads()) {
        let chunks: Vec<Vec<u8>> =
            batch.par_iter().map(|line| encode(&shared, image, *line)).collect::<Result<_, _>>()?;
        for (line, chunk) in batch.iter().zip(&chunks) {
            let y = image.data.origin[1] + *line as i32;
            // SAFETY: the header is written, `y` is the first line of a chunk, and the bytes live during the call.
            check(unsafe {
                sys::exr_write_scanline_chunk(context.raw(), 0, y, chunk.as_ptr().cast(), chunk.len() as u64)
            })?;
        }
    }
    context.finish()
}

fn write_header(context: &Context<'_>, image: &ImageRef<'_>) -> Result<(), Error> {
    let c = context.raw();
    let names = image.channels.iter().map(|c| c.0).chain(image.attributes.iter().map(|a| a.0.as_str()));
    let long_names = names.into_iter().any(|name| name.len() > checked::MAX_SHORT_NAME);
    let mut part = 0;
    let center = sys::exr_attr_v2f_t::default();
    let (display, data) = (to_box(&image.display), to_box(&image.data));
    // SAFETY: the context is open for writing; pointers are to live values; a single part may be nameless.
    unsafe {
        // Before any name longer than 31 bytes is given to the library.
        check(sys::exr_set_longname_support(c, i32::from(long_names)))?;
        check(sys::exr_add_part(c, std::ptr::null(), sys::exr_storage_t::EXR_STORAGE_SCANLINE, &mut part))?;
        check(sys::exr_initialize_required_attr(
            c,
            part,
            &display,
            &data,
            1.0,
            &center,
            1.0,
            sys::exr_lineorder_t::EXR_LINEORDER_INCREASING_Y,
            match image.compression {
                Compression::Zip => sys::exr_compression_t::EXR_COMPRESSION_ZIP,
                Compression::None => sys::exr_compression_t::EXR_COMPRESSION_NONE,
            },
        ))?;
    }
    for (channel, samples) in &image.channels {
        let name = checked::name("channel", channel)?;
        let kind = match samples {
            SamplesRef::F32(_) => sys::exr_pixel_type_t::EXR_PIXEL_FLOAT,
            SamplesRef::Half(_) => sys::exr_pixel_type_t::EXR_PIXEL_HALF,
            SamplesRef::U32(_) => sys::exr_pixel_type_t::EXR_PIXEL_UINT,
        };
        let treatment = sys::exr_perceptual_treatment_t::EXR_PERCEPTUALLY_LOGARITHMIC;
        // SAFETY: the context is open for writing, the part exists, the name is a C string that is copied.
        check(unsafe { sys::exr_add_channel(c, part, name.as_ptr(), kind, treatment, 1, 1) })?;
    }
    for (key, value) in image.attributes {
        attribute::set(context, key, value)?;
    }
    // SAFETY: the context is open for writing and its one part has all that is required.
    check(unsafe { sys::exr_write_header(c) })
}

fn to_box(window: &Window) -> sys::exr_attr_box2i_t {
    let v2i = |arr| {
        let mut v = sys::exr_attr_v2i_t::default();
        v.__bindgen_anon_1.arr = arr;
        v
    };
    let last = |axis: usize| window.origin[axis] + window.size[axis] as i32 - 1; // checked to fit
    sys::exr_attr_box2i_t { min: v2i(window.origin), max: v2i([last(0), last(1)]) }
}

/// A context in the state where the library allows encoding from many threads.
struct Shared(sys::exr_context_t);

// SAFETY: once the header is written, OpenEXRCore documents that chunks of one part may be encoded concurrently,
// each with its own pipeline; nothing else is done through this handle while the threads run.
unsafe impl Sync for Shared {}

/// An encode pipeline, destroyed on drop.
struct Pipeline {
    context: sys::exr_context_t,
    raw: sys::exr_encode_pipeline_t,
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: the pipeline was initialised with this context, or is all zero, which destroys nothing.
        let _ = check(unsafe { sys::exr_encoding_destroy(self.context, &mut self.raw) });
    }
}

/// Packs and compresses the chunk that begins `line` lines below the top of the data window.
fn encode(context: &Shared, image: &ImageRef<'_>, line: u32) -> Result<Vec<u8>, Error> {
    let context = context.0;
    let [width, height] = image.data.size;
    let mut info = sys::exr_chunk_info_t::default();
    let y = image.data.origin[1] + line as i32;
    let mut pipeline = Pipeline { context, raw: sys::exr_encode_pipeline_t::default() };
    // SAFETY: the context is writing data, part 0 exists, the pointers are to live values; the pipeline is not
    // moved between initialisation and destruction (it may point into itself).
    let channels = unsafe {
        check(sys::exr_write_scanline_chunk_info(context, 0, y, &mut info))?;
        check(sys::exr_encoding_initialize(context, 0, &info, &mut pipeline.raw))?;
        if pipeline.raw.channels.is_null() || pipeline.raw.channel_count < 1 {
            return Err(Error::Damaged("the library lost the channels".into()));
        }
        std::slice::from_raw_parts_mut(pipeline.raw.channels, pipeline.raw.channel_count as usize)
    };
    for channel in channels {
        // The library keeps channels sorted; ours are found by name.
        // SAFETY: the name is a C string owned by the context.
        let name: CString = unsafe { std::ffi::CStr::from_ptr(channel.channel_name) }.to_owned();
        let ours = image.channels.iter().find(|(ours, _)| ours.as_bytes() == name.as_bytes());
        let lines = u32::try_from(channel.height).unwrap_or(u32::MAX);
        let fits = channel.width as u32 == width && lines <= height - line;
        let Some((_, samples)) = ours.filter(|_| fits) else {
            return Err(Error::Damaged("the library's channels are not those it was given".into()));
        };
        let first = line as usize * width as usize;
        let range = first..first + lines as usize * width as usize;
        let (pointer, bytes): (*const u8, i32) = match samples {
            SamplesRef::F32(v) => (v[range].as_ptr().cast(), 4),
            SamplesRef::Half(v) => (v[range].as_ptr().cast(), 2),
            SamplesRef::U32(v) => (v[range].as_ptr().cast(), 4),
        };
        channel.user_bytes_per_element = bytes as i16;
        channel.user_data_type = channel.data_type;
        channel.user_pixel_stride = bytes;
        channel.user_line_stride = i32::try_from(i64::from(bytes) * i64::from(width))
            .map_err(|_| Error::Invalid(format!("lines of {width} pixels are too long")))?;
        channel.__bindgen_anon_1.encode_from_ptr = pointer;
    }
    // SAFETY: every channel points to `height` lines of `width` values that outlive the call, in the type that
    // was declared; without a write function the result stays in the pipeline's buffer.
    unsafe {
        check(sys::exr_encoding_choose_default_routines(context, 0, &mut pipeline.raw))?;
        pipeline.raw.yield_until_ready_fn = None;
        pipeline.raw.write_fn = None;
        check(sys::exr_encoding_run(context, 0, &mut pipeline.raw))?;
    }
    let (buffer, bytes) = (pipeline.raw.compressed_buffer.cast::<u8>(), pipeline.raw.compressed_bytes);
    if buffer.is_null() || bytes == 0 {
        return Err(Error::Damaged("the library compressed a chunk to nothing".into()));
    }
    // SAFETY: after a successful run the buffer holds that many initialised bytes, until the pipeline is destroyed.
    Ok(unsafe { std::slice::from_raw_parts(buffer, bytes) }.to_vec())
}
