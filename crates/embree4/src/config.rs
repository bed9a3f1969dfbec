//! Options of a device.

use std::ffi::CString;

use crate::memory::MemoryMonitor;
use crate::{Device, Error, MemoryEvent};

/// A family of vector instructions that Embree has kernels for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say it")]
pub enum Isa {
    Sse2,
    Sse42,
    Avx,
    Avx2,
    Avx512,
}

impl Isa {
    const ALL: [(Self, &'static str); 5] = [
        (Self::Sse2, "sse2"),
        (Self::Sse42, "sse4.2"),
        (Self::Avx, "avx"),
        (Self::Avx2, "avx2"),
        (Self::Avx512, "avx512"),
    ];

    fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// Options for [`Device::builder`].
#[derive(Default)]
#[must_use]
pub struct DeviceBuilder {
    options: Vec<String>,
    monitor: Option<Box<dyn Fn(MemoryEvent) -> bool + Send + Sync>>,
}

impl DeviceBuilder {
    /// Number of threads that build scenes; 0 means all of the machine.
    pub fn threads(self, count: usize) -> Self {
        self.option("threads", count)
    }

    /// How many of those threads are the caller's own, which help through
    /// [`SceneBuilder::commit_with`](crate::SceneBuilder::commit_with). With as many as `threads`, Embree
    /// starts none itself.
    pub fn user_threads(self, count: usize) -> Self {
        self.option("user_threads", count)
    }

    /// Uses the kernels for this instruction set, or the nearest below that the processor has.
    pub fn isa(self, isa: Isa) -> Self {
        self.option("isa", isa.name())
    }

    /// How much Embree prints on standard output: 0 is nothing, 3 is a lot.
    pub fn verbose(self, level: u32) -> Self {
        self.option("verbose", level)
    }

    /// Whether build threads are bound to cores.
    pub fn set_affinity(self, yes: bool) -> Self {
        self.option("set_affinity", u8::from(yes))
    }

    /// Whether build threads start with the device rather than with the first commit.
    pub fn start_threads(self, yes: bool) -> Self {
        self.option("start_threads", u8::from(yes))
    }

    /// Options as one string in Embree's own notation, such as `threads=1,isa=avx2`.
    pub fn config(mut self, text: &str) -> Self {
        self.options.extend(text.split(',').map(str::trim).filter(|o| !o.is_empty()).map(String::from));
        self
    }

    /// Calls `monitor` for every allocation and release of Embree's own data, from any thread. Returning false
    /// for an allocation refuses it, and the operation ends with [`ErrorCode::OutOfMemory`](crate::ErrorCode).
    ///
    /// The closure lives until the last object of the device is gone. It must not call Embree. A panic in it
    /// refuses the allocation and can be fetched with [`Device::take_panic`].
    pub fn set_memory_monitor(
        mut self,
        monitor: impl Fn(MemoryEvent) -> bool + Send + Sync + 'static,
    ) -> Self {
        self.monitor = Some(Box::new(monitor));
        self
    }

    /// Creates the device.
    ///
    /// # Errors
    /// [`Error::InvalidConfig`] for options that Embree does not have (it would ignore them silently),
    /// [`Error::UnsupportedVersion`] and [`Error::UnsupportedLayout`] for a library that does not fit the
    /// headers this crate was built with, [`Error::Embree`] if Embree refuses, for instance because the
    /// processor is too old.
    pub fn build(self) -> Result<Device, Error> {
        for option in &self.options {
            check(option)?;
        }
        let text = CString::new(self.options.join(","))
            .map_err(|_| Error::InvalidConfig { reason: "an option contains NUL".into() })?;
        Device::create(&text, MemoryMonitor::new(self.monitor))
    }

    fn option(mut self, name: &str, value: impl std::fmt::Display) -> Self {
        self.options.push(format!("{name}={value}"));
        self
    }
}

fn check(option: &str) -> Result<(), Error> {
    const COUNTS: [&str; 2] = ["threads", "user_threads"];
    const LEVELS: [&str; 2] = ["verbose", "tessellation_cache_size"];
    const SWITCHES: [&str; 4] = ["set_affinity", "start_threads", "hugepages", "ignore_config_files"];
    let bad = |why: &str| Err(Error::InvalidConfig { reason: format!("{option:?}: {why}") });
    let Some((name, value)) = option.split_once('=') else { return bad("not of the form name=value") };
    let number = value.parse::<u32>().ok();
    match name {
        _ if COUNTS.contains(&name) && number.is_none_or(|n| n > 4096) => bad("not a number up to 4096"),
        _ if LEVELS.contains(&name) && number.is_none() => bad("not a number"),
        _ if SWITCHES.contains(&name) && number.is_none_or(|n| n > 1) => bad("neither 0 nor 1"),
        "isa" | "max_isa" if Isa::ALL.iter().all(|(_, n)| *n != value) => bad("no such instruction set"),
        "frequency_level" if !["simd128", "simd256", "simd512"].contains(&value) => bad("no such level"),
        "isa" | "max_isa" | "frequency_level" => Ok(()),
        _ if COUNTS.contains(&name) || LEVELS.contains(&name) || SWITCHES.contains(&name) => Ok(()),
        _ => bad("no such option"),
    }
}
