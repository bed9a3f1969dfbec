//! Safe reading and writing of single-part OpenEXR images through the OpenEXRCore C library (3.1 or later).
//!
//! * [`write()`] writes scan lines with ZIP compression to anything that is [`std::io::Write`] and
//!   [`std::io::Seek`]; chunks are compressed on all threads of the current rayon pool, and the bytes do not
//!   depend on how many there are.
//! * [`read()`] decodes bytes that nobody vouched for: single part, flat (not deep), scan lines or tiles (the full
//!   resolution of mip maps), no subsampling, lossless compression. Everything else is an [`Error`], and
//!   nothing is allocated that a header alone asks for ([`Limits`]).
//!
//! ```
//! use openexr_core::{Attribute, Channel, Image, Limits, Samples, Window};
//! let mut image = Image::new(Window::of_size(2, 1));
//! image.channels.push(Channel { name: "Y".into(), samples: Samples::F32(vec![0.25, f32::INFINITY]) });
//! image.attributes.push(("comments".into(), Attribute::String("two pixels".into())));
//! let mut file = std::io::Cursor::new(Vec::new());
//! openexr_core::write(&mut file, &image)?;
//! let back = openexr_core::read(file.get_ref(), &Limits::default())?;
//! assert_eq!(back, image);
//! # Ok::<(), openexr_core::Error>(())
//! ```

mod attribute;
mod check;
mod context;
mod error;
pub mod half;
mod image;
mod read;
mod write;

pub use error::Error;
pub use image::{Attribute, Channel, Compression, Image, ImageRef, Samples, SamplesRef, Window};
pub use read::{Limits, read, read_header, read_header_from};
pub use write::write;

/// The four bytes that every OpenEXR file begins with.
pub const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
