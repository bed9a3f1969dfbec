//! Counted, immutable buffers that Embree reads in place.

use std::ops::Deref;
use std::sync::Arc;

use embree4_sys as sys;

/// Embree may read a whole 16-byte vector from the start of the last element.
const PADDING: usize = 16;

/// A buffer that Rust and Embree share without a copy.
///
/// Cloning counts references. The contents never change, and a scene keeps the buffers of its geometries alive,
/// so that neither dropping nor editing the original can pull data away from under Embree. To change vertices,
/// give the scene another buffer: see [`SceneBuilder::update_vertices`](crate::SceneBuilder::update_vertices).
///
/// ```
/// use embree4::SharedBuffer;
/// let points = SharedBuffer::from(vec![[0.0_f32, 1.0, 2.0], [3.0, 4.0, 5.0]]);
/// let same = points.clone();
/// assert_eq!(points[1], same[1]);
/// ```
///
/// There is no way to keep and change a vector that was given away:
///
/// ```compile_fail,E0382
/// let mut points = vec![[0.0_f32; 3]; 3];
/// let mesh = embree4::TriangleMesh::new(points, vec![[0, 1, 2]]);
/// points[0] = [1.0; 3];
/// ```
///
/// nor to lend one that is freed while Embree reads it:
///
/// ```compile_fail,E0277
/// let points = vec![[0.0_f32; 3]; 3];
/// let mesh = embree4::TriangleMesh::new(&points, vec![[0, 1, 2]]);
/// ```
///
/// nor to write to a shared buffer:
///
/// ```compile_fail,E0594
/// let mut points = embree4::SharedBuffer::from(vec![[0.0_f32; 3]; 3]);
/// points[0] = [1.0; 3];
/// ```
#[derive(Debug)]
pub struct SharedBuffer<T: Element> {
    data: Arc<Vec<T>>,
}

impl<T: Element> SharedBuffer<T> {
    /// Address of the first element; valid for reads up to 16 bytes past the last one.
    pub(crate) fn address(&self) -> *const std::ffi::c_void {
        self.data.as_ptr().cast()
    }
}

impl<T: Element> Clone for SharedBuffer<T> {
    fn clone(&self) -> Self {
        Self { data: Arc::clone(&self.data) }
    }
}

impl<T: Element> Deref for SharedBuffer<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.data
    }
}

impl<T: Element> From<Vec<T>> for SharedBuffer<T> {
    /// Takes the vector over. Nothing is copied if it has room for 16 more bytes; else it grows by that much.
    fn from(mut data: Vec<T>) -> Self {
        let extra = PADDING.div_ceil(size_of::<T>());
        data.reserve_exact(extra);
        for element in &mut data.spare_capacity_mut()[..extra] {
            element.write(T::ZERO);
        }
        Self { data: Arc::new(data) }
    }
}

impl<T: Element> From<&[T]> for SharedBuffer<T> {
    fn from(data: &[T]) -> Self {
        let mut copy = Vec::with_capacity(data.len() + PADDING.div_ceil(size_of::<T>()));
        copy.extend_from_slice(data);
        copy.into()
    }
}

impl<T: Element, const N: usize> From<[T; N]> for SharedBuffer<T> {
    fn from(data: [T; N]) -> Self {
        data.as_slice().into()
    }
}

impl<T: Element> FromIterator<T> for SharedBuffer<T> {
    fn from_iter<I: IntoIterator<Item = T>>(elements: I) -> Self {
        elements.into_iter().collect::<Vec<T>>().into()
    }
}

/// Element types of shared buffers: plain numbers and short arrays of them. Cannot be implemented elsewhere.
pub trait Element: Copy + Send + Sync + std::fmt::Debug + sealed::Sealed + 'static {}

pub(crate) mod sealed {
    use super::sys;

    pub trait Sealed {
        const FORMAT: sys::RTCFormat;
        const ZERO: Self;
    }
}

macro_rules! elements {
    ($($element:ty, $zero:expr, $format:ident;)*) => {$(
        impl sealed::Sealed for $element {
            const FORMAT: sys::RTCFormat = sys::RTCFormat::$format;
            const ZERO: Self = $zero;
        }
        impl Element for $element {}
    )*};
}

elements! {
    u8, 0, RTC_FORMAT_UCHAR;
    u32, 0, RTC_FORMAT_UINT;
    [u32; 2], [0; 2], RTC_FORMAT_UINT2;
    [u32; 3], [0; 3], RTC_FORMAT_UINT3;
    [u32; 4], [0; 4], RTC_FORMAT_UINT4;
    f32, 0.0, RTC_FORMAT_FLOAT;
    [f32; 2], [0.0; 2], RTC_FORMAT_FLOAT2;
    [f32; 3], [0.0; 3], RTC_FORMAT_FLOAT3;
    [f32; 4], [0.0; 4], RTC_FORMAT_FLOAT4;
    [f32; 12], [0.0; 12], RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roomy_vector_is_not_copied_and_a_tight_one_gets_room() {
        let mut roomy = Vec::with_capacity(10);
        roomy.extend([[1.0_f32, 2.0, 3.0]; 3]);
        let before = roomy.as_ptr();
        let buffer = SharedBuffer::from(roomy);
        assert_eq!(buffer.as_ptr(), before);

        let tight = vec![7_u8; 5].into_boxed_slice().into_vec();
        let buffer = SharedBuffer::from(tight);
        assert!(buffer.data.capacity() >= 5 + PADDING);
        assert_eq!(&buffer[..], &[7; 5]);
    }

    #[test]
    fn empty_buffers_have_a_readable_address_too() {
        let buffer = SharedBuffer::<[f32; 3]>::from(Vec::new());
        assert!(buffer.is_empty());
        assert!(buffer.data.capacity() * size_of::<[f32; 3]>() >= PADDING);
    }
}
