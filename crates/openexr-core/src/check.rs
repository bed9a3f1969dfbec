//! What must hold before an image is handed to the library for writing.

use std::collections::HashSet;
use std::ffi::CString;

use crate::Error;
use crate::image::{Attribute, ImageRef, Window};
use crate::read::LAYOUT_ATTRIBUTES;

/// Longest name that the format can hold, bytes.
pub(crate) const MAX_NAME: usize = 255;
/// Longest name without the long-name flag, bytes.
pub(crate) const MAX_SHORT_NAME: usize = 31;
/// Longest text attribute accepted, bytes.
const MAX_TEXT: usize = 16 << 20;
/// The format wants coordinates within half of the i32 range.
const MAX_COORDINATE: i64 = (i32::MAX / 2) as i64;

pub(crate) fn image(image: &ImageRef<'_>) -> Result<(), Error> {
    window("display", &image.display)?;
    window("data", &image.data)?;
    if image.channels.is_empty() {
        return Err(Error::Invalid("it has no channels".into()));
    }
    let mut names = HashSet::new();
    for (channel, samples) in &image.channels {
        name("channel", channel)?;
        if !names.insert(*channel) {
            return Err(Error::Invalid(format!("two channels are named {channel:?}")));
        }
        if samples.len() as u64 != image.data.pixels() {
            let (len, want) = (samples.len(), image.data.pixels());
            return Err(Error::Invalid(format!("channel {channel:?} has {len} values for {want} pixels")));
        }
    }
    let mut names = HashSet::new();
    for (key, value) in image.attributes {
        name("attribute", key)?;
        if LAYOUT_ATTRIBUTES.contains(&key.as_str()) || !names.insert(key) {
            return Err(Error::Invalid(format!("attribute {key:?} is set by the writer or given twice")));
        }
        match value {
            Attribute::String(s) => text(key, s).map(drop)?,
            Attribute::StringVector(v) => v.iter().try_for_each(|s| text(key, s).map(drop))?,
            Attribute::FloatVector(v) if v.len() > MAX_TEXT / 4 => {
                return Err(Error::Invalid(format!("attribute {key:?} has {} values", v.len())));
            }
            _ => {}
        }
    }
    Ok(())
}

fn window(what: &str, window: &Window) -> Result<(), Error> {
    for axis in 0..2 {
        let (first, size) = (i64::from(window.origin[axis]), i64::from(window.size[axis]));
        if size == 0 || first < -MAX_COORDINATE || first + size > MAX_COORDINATE {
            return Err(Error::Invalid(format!("its {what} window is {window:?}")));
        }
    }
    Ok(())
}

/// A C string of a name that the format allows.
pub(crate) fn name(what: &str, name: &str) -> Result<CString, Error> {
    match CString::new(name) {
        Ok(c) if (1..=MAX_NAME).contains(&name.len()) => Ok(c),
        _ => Err(Error::Invalid(format!("{what} name {name:?} is empty, too long or holds a NUL"))),
    }
}

/// A C string of an attribute's text.
pub(crate) fn text(key: &str, text: &str) -> Result<CString, Error> {
    match CString::new(text) {
        Ok(c) if text.len() <= MAX_TEXT => Ok(c),
        _ => Err(Error::Invalid(format!("the text of attribute {key:?} is too long or holds a NUL"))),
    }
}
