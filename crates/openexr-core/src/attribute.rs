//! Header attributes to and from the library.

use std::ffi::{CStr, CString, c_char};

use openexr_core_sys as sys;

use crate::context::Context;
use crate::error::check;
use crate::image::Attribute;
use crate::read::LAYOUT_ATTRIBUTES;
use crate::{Error, check as checked};

/// Sets one attribute of part 0 of a file being written.
pub(crate) fn set(context: &Context<'_>, key: &str, value: &Attribute) -> Result<(), Error> {
    let name = checked::name("attribute", key)?;
    let (c, n) = (context.raw(), name.as_ptr());
    macro_rules! set_plain {
        ($function:ident, $value:expr) => {
            // SAFETY: the context is open for writing, part 0 exists, the name is a C string; the structs of
            // numbers have the layout of the array given (packed, no padding), and the call copies them.
            check(unsafe { sys::$function(c, 0, n, std::ptr::from_ref($value).cast()) })
        };
    }
    match value {
        Attribute::String(s) => {
            let s = checked::text(key, s)?;
            // SAFETY: as above; the text is a C string that the call copies.
            check(unsafe { sys::exr_attr_set_string(c, 0, n, s.as_ptr()) })
        }
        // SAFETY: the context is open for writing, part 0 exists, the name is a C string.
        Attribute::Int(v) => check(unsafe { sys::exr_attr_set_int(c, 0, n, *v) }),
        // SAFETY: likewise.
        Attribute::Float(v) => check(unsafe { sys::exr_attr_set_float(c, 0, n, *v) }),
        // SAFETY: likewise.
        Attribute::Double(v) => check(unsafe { sys::exr_attr_set_double(c, 0, n, *v) }),
        Attribute::V2i(v) => set_plain!(exr_attr_set_v2i, v),
        Attribute::V2f(v) => set_plain!(exr_attr_set_v2f, v),
        Attribute::V3i(v) => set_plain!(exr_attr_set_v3i, v),
        Attribute::V3f(v) => set_plain!(exr_attr_set_v3f, v),
        Attribute::M44f(v) => set_plain!(exr_attr_set_m44f, v),
        Attribute::Chromaticities(v) => set_plain!(exr_attr_set_chromaticities, v),
        Attribute::FloatVector(v) => {
            // SAFETY: as above; the call copies `len` floats, and the length was checked to fit.
            check(unsafe { sys::exr_attr_set_float_vector(c, 0, n, v.len() as i32, v.as_ptr()) })
        }
        Attribute::StringVector(v) => {
            let texts: Vec<CString> = v.iter().map(|s| checked::text(key, s)).collect::<Result<_, _>>()?;
            let mut pointers: Vec<*const c_char> = texts.iter().map(|s| s.as_ptr()).collect();
            let count = i32::try_from(texts.len())
                .map_err(|_| Error::Invalid(format!("attribute {key:?} has {} texts", texts.len())))?;
            // SAFETY: as above; the call copies `count` C strings.
            check(unsafe { sys::exr_attr_set_string_vector(c, 0, n, count, pointers.as_mut_ptr()) })
        }
    }
}

/// All attributes of part 0 besides the layout ones, in file order; types not in [`Attribute`] are left out.
pub(crate) fn all(context: &Context<'_>) -> Result<Vec<(String, Attribute)>, Error> {
    let mut count = 0;
    // SAFETY: the context is open and part 0 exists.
    check(unsafe { sys::exr_get_attribute_count(context.raw(), 0, &mut count) })?;
    let mut out = Vec::new();
    for index in 0..count {
        let mut raw = std::ptr::null();
        let order = sys::exr_attr_list_access_mode::EXR_ATTR_LIST_FILE_ORDER;
        // SAFETY: the context is open, part 0 exists and `index` is below the count just asked.
        check(unsafe { sys::exr_get_attribute_by_index(context.raw(), 0, order, index, &mut raw) })?;
        // SAFETY: on success the pointer is to an attribute that lives as long as the context, unchanged in reading.
        let Some(raw) = (unsafe { raw.as_ref() }) else { continue };
        if raw.name.is_null() {
            continue;
        }
        // SAFETY: names are C strings owned by the attribute.
        let name = unsafe { CStr::from_ptr(raw.name) }.to_string_lossy();
        if LAYOUT_ATTRIBUTES.contains(&name.as_ref()) {
            continue;
        }
        if let Some(value) = value(raw) {
            out.push((name.into_owned(), value));
        }
    }
    Ok(out)
}

fn value(raw: &sys::exr_attribute_t) -> Option<Attribute> {
    use sys::exr_attribute_type_t as Type;
    let union = &raw.__bindgen_anon_1;
    macro_rules! plain {
        ($variant:ident, $field:ident) => {{
            // SAFETY: the type tag names this field of the union.
            let pointer = unsafe { union.$field };
            if pointer.is_null() {
                return None;
            }
            let mut array = Default::default();
            // SAFETY: the library allocated the struct of numbers that the tag names there; its layout is that
            // of the array (packed, no padding, any bits valid), and the copy needs no alignment.
            unsafe { copy_bytes(pointer.cast(), &mut array) };
            Some(Attribute::$variant(array))
        }};
    }
    match raw.type_ {
        // SAFETY: the type tag names this field of the union, which holds the value itself.
        Type::EXR_ATTR_INT => Some(Attribute::Int(unsafe { union.i })),
        // SAFETY: likewise.
        Type::EXR_ATTR_FLOAT => Some(Attribute::Float(unsafe { union.f })),
        // SAFETY: likewise.
        Type::EXR_ATTR_DOUBLE => Some(Attribute::Double(unsafe { union.d })),
        Type::EXR_ATTR_V2I => plain!(V2i, v2i),
        Type::EXR_ATTR_V2F => plain!(V2f, v2f),
        Type::EXR_ATTR_V3I => plain!(V3i, v3i),
        Type::EXR_ATTR_V3F => plain!(V3f, v3f),
        Type::EXR_ATTR_M44F => plain!(M44f, m44f),
        Type::EXR_ATTR_CHROMATICITIES => plain!(Chromaticities, chromaticities),
        Type::EXR_ATTR_STRING => {
            // SAFETY: the type tag names this field of the union; it points into the attribute.
            let string = unsafe { union.string.as_ref() }?;
            Some(Attribute::String(text(string)))
        }
        Type::EXR_ATTR_STRING_VECTOR => {
            // SAFETY: likewise.
            let vector = unsafe { union.stringvector.as_ref() }?;
            let strings = items(vector.strings, vector.n_strings);
            Some(Attribute::StringVector(strings.iter().map(text).collect()))
        }
        Type::EXR_ATTR_FLOAT_VECTOR => {
            // SAFETY: likewise.
            let vector = unsafe { union.floatvector.as_ref() }?;
            Some(Attribute::FloatVector(items(vector.arr, vector.length).to_vec()))
        }
        _ => None,
    }
}

/// Copies `N` numbers from `source`.
///
/// # Safety
/// `source` is readable for `N` values of `T`, and any bits are a valid `T`.
unsafe fn copy_bytes<T: Copy, const N: usize>(source: *const u8, out: &mut [T; N]) {
    // SAFETY: both sides hold that many bytes by the caller's promise; they cannot overlap.
    unsafe { std::ptr::copy_nonoverlapping(source, out.as_mut_ptr().cast(), size_of::<[T; N]>()) };
}

fn text(string: &sys::exr_attr_string_t) -> String {
    let bytes: &[u8] = items(string.str_.cast(), string.length);
    String::from_utf8_lossy(bytes).into_owned()
}

/// The library's pair of pointer and length as a slice, tied to the attribute it was read from.
fn items<'a, T>(first: *const T, count: i32) -> &'a [T] {
    match usize::try_from(count) {
        // SAFETY: only called for pairs inside an attribute of an open context, where the library keeps `count`
        // initialised items at `first`, aligned by its allocator; the callers copy before the context closes.
        Ok(count) if count > 0 && !first.is_null() => unsafe { std::slice::from_raw_parts(first, count) },
        _ => &[],
    }
}
