//! Processor time of this process, as Linux tells it.

/// Seconds that the threads which are alive now have spent on a processor, all together; `None` where the system does not
/// say. Exact to nanoseconds, unlike the ticks of `/proc/self/stat`.
#[must_use]
pub fn thread_seconds() -> Option<f64> {
    let mut sum = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        // A thread that has ended meanwhile is left out.
        let Ok(text) = std::fs::read_to_string(thread.ok()?.path().join("schedstat")) else { continue };
        sum += text.split_whitespace().next()?.parse::<u64>().ok()? as f64 * 1e-9;
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_time() {
        let before = thread_seconds().expect("Linux");
        let begin = std::time::Instant::now();
        while begin.elapsed().as_millis() < 30 {
            std::hint::black_box(begin);
        }
        // The time of a running thread is brought up to date a few hundred times a second.
        assert!(thread_seconds().expect("Linux") > before);
    }
}
