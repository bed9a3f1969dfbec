//! Memory of this process and of the machine, as Linux tells it.

/// Largest resident memory of this process so far; 0 where the system does not say.
#[must_use]
pub fn peak_bytes() -> u64 {
    of("/proc/self/status", "VmHWM:").unwrap_or(0)
}

/// Resident memory of this process now; 0 where the system does not say.
#[must_use]
pub fn resident_bytes() -> u64 {
    of("/proc/self/status", "VmRSS:").unwrap_or(0)
}

/// What the machine, or the control group that this process runs in, could still give; `None` where unknown.
#[must_use]
pub fn available_bytes() -> Option<u64> {
    let number = |path| std::fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let machine = of("/proc/meminfo", "MemAvailable:")
        .map(|free| free.saturating_add(of("/proc/meminfo", "SwapFree:").unwrap_or(0)));
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(max, used)| max.saturating_sub(used));
    machine.into_iter().chain(group).min()
}

/// Whether this many bytes could be allocated now.
///
/// # Errors
/// A message that says why not. `what` begins it.
pub fn check(what: &str, bytes: u64) -> Result<(), String> {
    let gib = |b: u64| format!("{:.1} GiB", b as f64 / (1u64 << 30) as f64);
    if let Some(free) = available_bytes().filter(|free| *free < bytes) {
        return Err(format!("{what} needs {} of memory, but only {} are free", gib(bytes), gib(free)));
    }
    // Limits of the process and of the address space show only when one tries; nothing is touched.
    let fits = usize::try_from(bytes).is_ok_and(|n| Vec::<u8>::new().try_reserve_exact(n).is_ok());
    if fits { Ok(()) } else { Err(format!("{what} needs {} of memory: more than allowed", gib(bytes))) }
}

fn of(path: &str, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix(key))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_much_is_refused() {
        assert_eq!(check("it", 1 << 20), Ok(()));
        assert!(check("it", 1 << 60).is_err_and(|e| e.starts_with("it needs 1073741824.0 GiB of memory")));
        // Not compared with each other: other tests allocate meanwhile, and the kernel counts in batches.
        assert!(peak_bytes() > 0 && resident_bytes() > 0);
    }
}
