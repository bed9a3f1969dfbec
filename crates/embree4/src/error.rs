//! What can go wrong, as one error type.

use embree4_sys as sys;

use crate::GeometryId;

/// Why an operation failed. Ray queries never fail, so none of them returns this.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Embree itself reported an error.
    #[error("Embree: {code}: {message}")]
    Embree {
        /// The kind of error.
        code: ErrorCode,
        /// Embree's own words.
        message: String,
    },
    /// The library found at run time is too old or of another major version.
    #[error("Embree {}.{}.{} was loaded, but 4.3 or a later 4.x is needed", found.0, found.1, found.2)]
    UnsupportedVersion {
        /// Version of the loaded library.
        found: (u32, u32, u32),
    },
    /// The library was built with options that change the layout of its ray or hit structures.
    #[error("this build of Embree lays out its hit structure differently: {reason}")]
    UnsupportedLayout {
        /// What the check found.
        reason: String,
    },
    /// A device option does not exist or has no such value.
    #[error("bad device configuration: {reason}")]
    InvalidConfig {
        /// Which option, and why.
        reason: String,
    },
    /// An index buffer points outside of the buffer that it indexes.
    #[error("{what} {index} at position {position} is out of range, only {limit} exist")]
    IndexOutOfRange {
        /// Which kind of index.
        what: &'static str,
        /// Where in the index buffer.
        position: usize,
        /// The bad index.
        index: u32,
        /// Number of elements that can be indexed.
        limit: usize,
    },
    /// Two buffers that belong together differ in length.
    #[error("{what}: {found} elements where {expected} are needed")]
    LengthMismatch {
        /// Which buffer.
        what: &'static str,
        /// Elements needed.
        expected: usize,
        /// Elements given.
        found: usize,
    },
    /// A count is above what Embree can handle.
    #[error("{what}: {count} is more than the {limit} that are possible")]
    TooLarge {
        /// What was counted.
        what: &'static str,
        /// How many were asked for.
        count: usize,
        /// How many are possible.
        limit: usize,
    },
    /// A number that must be finite is infinite or not a number.
    #[error("{what}: not a finite number at position {position}")]
    NotFinite {
        /// Which value.
        what: &'static str,
        /// Where in it.
        position: usize,
    },
    /// An option has a value that makes no sense.
    #[error("{what}: {reason}")]
    InvalidOption {
        /// Which option.
        what: &'static str,
        /// Why it is refused.
        reason: &'static str,
    },
    /// No geometry with this id is attached to the scene.
    #[error("no geometry with id {0} in this scene")]
    NoSuchGeometry(GeometryId),
    /// The id is in use, or is beyond [`GeometryId::MAX`].
    #[error("geometry id {0} is taken or too large")]
    GeometryIdUnavailable(GeometryId),
    /// The operation does not exist for this kind of geometry.
    #[error("{0}")]
    Unsupported(&'static str),
    /// A scene that contains instances cannot be instanced itself: Embree is built for one level.
    #[error("a scene that contains instances cannot be instanced")]
    NestedInstance,
    /// Objects of two different devices cannot be mixed.
    #[error("scene and instanced scene belong to different devices")]
    DifferentDevice,
}

/// Embree's error codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorCode {
    /// An error that Embree does not classify.
    Unclassified,
    /// An argument was not acceptable.
    InvalidArgument,
    /// The operation is not allowed on this object now.
    InvalidOperation,
    /// Memory ran out, or the memory monitor refused an allocation.
    OutOfMemory,
    /// The processor does not have the instructions asked for.
    UnsupportedCpu,
    /// The progress callback asked to stop.
    Cancelled,
    /// A GPU driver lacks ray tracing.
    MissingGpuSupport,
    /// A code that this crate does not know.
    Unknown(i32),
}

impl From<i32> for ErrorCode {
    fn from(code: i32) -> Self {
        const CODES: [(sys::RTCError, ErrorCode); 7] = [
            (sys::RTCError::RTC_ERROR_UNKNOWN, ErrorCode::Unclassified),
            (sys::RTCError::RTC_ERROR_INVALID_ARGUMENT, ErrorCode::InvalidArgument),
            (sys::RTCError::RTC_ERROR_INVALID_OPERATION, ErrorCode::InvalidOperation),
            (sys::RTCError::RTC_ERROR_OUT_OF_MEMORY, ErrorCode::OutOfMemory),
            (sys::RTCError::RTC_ERROR_UNSUPPORTED_CPU, ErrorCode::UnsupportedCpu),
            (sys::RTCError::RTC_ERROR_CANCELLED, ErrorCode::Cancelled),
            (sys::RTCError(7), ErrorCode::MissingGpuSupport), // not in the headers before 4.3.3
        ];
        CODES
            .iter()
            .find(|(raw, _)| i32::try_from(raw.0) == Ok(code))
            .map_or(Self::Unknown(code), |&(_, known)| known)
    }
}

impl std::fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Unclassified => "unclassified error",
            Self::InvalidArgument => "invalid argument",
            Self::InvalidOperation => "invalid operation",
            Self::OutOfMemory => "out of memory",
            Self::UnsupportedCpu => "unsupported processor",
            Self::Cancelled => "cancelled",
            Self::MissingGpuSupport => "GPU ray tracing support is missing",
            Self::Unknown(code) => return write!(f, "unknown error code {code}"),
        })
    }
}

impl Error {
    pub(crate) fn embree(code: sys::RTCError, message: impl Into<String>) -> Self {
        let code = ErrorCode::from(i32::try_from(code.0).unwrap_or(i32::MAX));
        Self::Embree { code, message: message.into() }
    }

    /// Embree's error code, when the error came from Embree.
    #[must_use]
    pub fn code(&self) -> Option<ErrorCode> {
        match self {
            Self::Embree { code, .. } => Some(*code),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_map_both_ways_and_the_unknown_survive() {
        assert_eq!(ErrorCode::from(2), ErrorCode::InvalidArgument);
        assert_eq!(ErrorCode::from(4), ErrorCode::OutOfMemory);
        assert_eq!(ErrorCode::from(6), ErrorCode::Cancelled);
        assert_eq!(ErrorCode::from(99), ErrorCode::Unknown(99));
        assert_eq!(ErrorCode::from(-3), ErrorCode::Unknown(-3));
        assert_eq!(ErrorCode::Unknown(99).to_string(), "unknown error code 99");
    }
}
