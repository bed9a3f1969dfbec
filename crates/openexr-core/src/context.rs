//! The library's context: one open stream, closed on drop.

use std::any::Any;
use std::ffi::{CStr, c_void};
use std::io::{Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};

use openexr_core_sys as sys;

use crate::Error;
use crate::error::{check, keep_message};

/// The name that the library believes the stream has.
pub(crate) const STREAM_NAME: &str = "image";
const STREAM_NAME_C: &CStr = c"image";

/// An open context. `'a` is the life of the stream that its callbacks use.
pub(crate) struct Context<'a> {
    raw: sys::exr_context_t,
    stream: PhantomData<&'a mut ()>,
}

impl<'a> Context<'a> {
    /// Opens a file in memory and parses its header.
    pub(crate) fn read(bytes: &'a &'a [u8], max_side: u32) -> Result<Self, Error> {
        let mut options = options(std::ptr::from_ref(bytes).cast_mut().cast());
        options.read_fn = Some(read_bytes);
        options.size_fn = Some(size_of_bytes);
        // SAFETY: the user data is the slice that `read_bytes` and `size_of_bytes` expect, borrowed for as long as the
        // context lives.
        unsafe { Self::start_read(options, max_side) }
    }

    /// Opens a file and parses its header; nothing else of it is read until it is asked for.
    pub(crate) fn read_from<R: Read + Seek>(source: &'a mut Source<R>, max_side: u32) -> Result<Self, Error> {
        let mut options = options(std::ptr::from_mut(source).cast());
        options.read_fn = Some(read_source::<R>);
        options.size_fn = Some(size_of_source::<R>);
        // SAFETY: the user data is the source that both functions of `R` expect, exclusively borrowed for as long as the
        // context lives.
        unsafe { Self::start_read(options, max_side) }
    }

    /// # Safety
    /// The functions and the user data of `options` fit each other for the life `'a`.
    unsafe fn start_read(mut options: sys::exr_context_initializer_t, max_side: u32) -> Result<Self, Error> {
        let max_side = i32::try_from(max_side).unwrap_or(i32::MAX);
        options.max_image_width = max_side;
        options.max_image_height = max_side;
        options.max_tile_width = max_side;
        options.max_tile_height = max_side;
        options.flags = sys::EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION as i32;
        let mut raw = std::ptr::null_mut();
        // SAFETY: the name is a C string, `options` is initialised with its size, and its functions get what they expect.
        check(unsafe { sys::exr_start_read(&mut raw, STREAM_NAME_C.as_ptr(), &options) })?;
        Ok(Self { raw, stream: PhantomData })
    }

    /// Begins a file on `sink`.
    pub(crate) fn write<W: Write + Seek>(sink: &'a mut Sink<W>, zip_level: i32) -> Result<Self, Error> {
        let mut options = options(std::ptr::from_mut(sink).cast());
        options.write_fn = Some(write_bytes::<W>);
        options.zip_level = zip_level;
        let mut raw = std::ptr::null_mut();
        let mode = sys::exr_default_write_mode::EXR_WRITE_FILE_DIRECTLY;
        // SAFETY: the name is a C string, `options` is initialised with its size, and the user data is the sink that `write_bytes::<W>` expects, exclusively borrowed
        // for as long as the context lives.
        check(unsafe { sys::exr_start_write(&mut raw, STREAM_NAME_C.as_ptr(), mode, &options) })?;
        Ok(Self { raw, stream: PhantomData })
    }

    pub(crate) fn raw(&self) -> sys::exr_context_t {
        self.raw
    }

    /// Closes; a written file is only complete if this succeeds.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        // SAFETY: `raw` came from exr_start_read or exr_start_write and is closed once: the call sets it to null.
        check(unsafe { sys::exr_finish(&mut self.raw) })
    }
}

impl Drop for Context<'_> {
    fn drop(&mut self) {
        if !self.raw.is_null() {
            // SAFETY: `raw` came from exr_start_read or exr_start_write and was not closed.
            let _ = check(unsafe { sys::exr_finish(&mut self.raw) });
        }
    }
}

fn options(user_data: *mut c_void) -> sys::exr_context_initializer_t {
    sys::exr_context_initializer_t {
        size: size_of::<sys::exr_context_initializer_t>(),
        error_handler_fn: Some(keep_message),
        user_data,
        zip_level: -2,     // the library's own default
        dwa_quality: -1.0, // likewise
        ..Default::default()
    }
}

unsafe extern "C" fn read_bytes(
    _context: sys::exr_const_context_t,
    user_data: *mut c_void,
    buffer: *mut c_void,
    size: u64,
    offset: u64,
    _error: sys::exr_stream_error_func_ptr_t,
) -> i64 {
    // SAFETY: the user data of a reading context is a slice that outlives it; it is only read.
    let bytes: &[u8] = unsafe { *user_data.cast::<&[u8]>() };
    let start = usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
    let rest = &bytes[start..];
    let rest = &rest[..usize::try_from(size).unwrap_or(usize::MAX).min(rest.len())];
    if !rest.is_empty() {
        // SAFETY: the library's buffer holds `size` bytes, and no more are copied; it cannot overlap the slice.
        unsafe { std::ptr::copy_nonoverlapping(rest.as_ptr(), buffer.cast::<u8>(), rest.len()) };
    }
    rest.len() as i64
}

unsafe extern "C" fn size_of_bytes(_context: sys::exr_const_context_t, user_data: *mut c_void) -> i64 {
    // SAFETY: as in `read_bytes`.
    let bytes: &[u8] = unsafe { *user_data.cast::<&[u8]>() };
    bytes.len() as i64
}

/// A stream to read from, with what went wrong on it.
pub(crate) struct Source<R> {
    input: R,
    length: u64,
    pub(crate) error: Option<std::io::Error>,
    pub(crate) panic: Option<Box<dyn Any + Send>>,
}

impl<R: Read + Seek> Source<R> {
    pub(crate) fn new(mut input: R) -> std::io::Result<Self> {
        let length = input.seek(SeekFrom::End(0))?;
        Ok(Self { input, length, error: None, panic: None })
    }

    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Fills as much of the buffer as the stream has from `offset` on.
    fn read_at(&mut self, buffer: &mut [u8], offset: u64) -> std::io::Result<usize> {
        self.input.seek(SeekFrom::Start(offset))?;
        let mut filled = 0;
        while filled < buffer.len() {
            match self.input.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(filled)
    }
}

unsafe extern "C" fn read_source<R: Read + Seek>(
    _context: sys::exr_const_context_t,
    user_data: *mut c_void,
    buffer: *mut c_void,
    size: u64,
    offset: u64,
    _error: sys::exr_stream_error_func_ptr_t,
) -> i64 {
    // SAFETY: the user data of such a context is its source, exclusively borrowed by the context, and this crate makes
    // the library read from one thread at a time.
    let source = unsafe { &mut *user_data.cast::<Source<R>>() };
    let length = usize::try_from(size.min(source.length)).unwrap_or(0);
    if length == 0 {
        return 0;
    }
    // SAFETY: the library's buffer holds `size` bytes and is nobody else's meanwhile; it is initialised here, since a
    // reader may look at what it is given.
    let buffer = unsafe {
        buffer.cast::<u8>().write_bytes(0, length);
        std::slice::from_raw_parts_mut(buffer.cast::<u8>(), length)
    };
    match catch_unwind(AssertUnwindSafe(|| source.read_at(buffer, offset))) {
        Ok(Ok(filled)) => filled as i64,
        Ok(Err(error)) => {
            source.error.get_or_insert(error);
            -1
        }
        Err(panic) => {
            source.panic.get_or_insert(panic);
            -1
        }
    }
}

unsafe extern "C" fn size_of_source<R>(_context: sys::exr_const_context_t, user_data: *mut c_void) -> i64 {
    // SAFETY: as in `read_source`; a field is read.
    let source = unsafe { &*user_data.cast::<Source<R>>() };
    i64::try_from(source.length).unwrap_or(i64::MAX)
}

/// A stream to write to, with what went wrong on it.
pub(crate) struct Sink<W> {
    out: W,
    /// Where the stream stands.
    position: Option<u64>,
    pub(crate) error: Option<std::io::Error>,
    pub(crate) panic: Option<Box<dyn Any + Send>>,
}

impl<W: Write + Seek> Sink<W> {
    pub(crate) fn new(out: W) -> Self {
        Self { out, position: None, error: None, panic: None }
    }

    fn write_at(&mut self, bytes: &[u8], offset: u64) -> std::io::Result<()> {
        if self.position != Some(offset) {
            self.out.seek(SeekFrom::Start(offset))?;
        }
        self.position = None; // unknown if the next line fails
        self.out.write_all(bytes)?;
        self.position = Some(offset + bytes.len() as u64);
        Ok(())
    }

    pub(crate) fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

unsafe extern "C" fn write_bytes<W: Write + Seek>(
    _context: sys::exr_const_context_t,
    user_data: *mut c_void,
    buffer: *const c_void,
    size: u64,
    offset: u64,
    _error: sys::exr_stream_error_func_ptr_t,
) -> i64 {
    let length = usize::try_from(size).unwrap_or(0);
    if length == 0 {
        return 0;
    }
    // SAFETY: the user data of a writing context is its sink, exclusively borrowed by the context, and this
    // crate makes the library write from one thread at a time.
    let sink = unsafe { &mut *user_data.cast::<Sink<W>>() };
    // SAFETY: the library passes a buffer of `size` initialised bytes that it does not change meanwhile.
    let bytes = unsafe { std::slice::from_raw_parts(buffer.cast::<u8>(), length) };
    match catch_unwind(AssertUnwindSafe(|| sink.write_at(bytes, offset))) {
        Ok(Ok(())) => size as i64,
        Ok(Err(error)) => {
            sink.error.get_or_insert(error);
            -1
        }
        Err(panic) => {
            sink.panic.get_or_insert(panic);
            -1
        }
    }
}
