//! Progress for people while a large scene is loaded, on standard error.

use indicatif::ProgressBar;
use sparing_scene::LoadProgress;
use std::io::{IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Scenes that load faster say nothing.
const PATIENCE: Duration = Duration::from_secs(1);
/// Between lines where nothing can be overwritten.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// Runs `load`, which counts into `progress`, and shows the counts meanwhile.
pub fn watched<T>(progress: &LoadProgress, load: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let (done, finished) = channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            if finished.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
                return;
            }
            let spinner = std::io::stderr().is_terminal().then(ProgressBar::new_spinner);
            let pause = if spinner.is_some() { Duration::from_millis(200) } else { BETWEEN_LINES };
            loop {
                let text = message(progress.counts(), start.elapsed());
                match &spinner {
                    Some(spinner) => {
                        spinner.set_message(text);
                        spinner.tick();
                    }
                    // Nobody reads it: no reason to stop.
                    None => drop(writeln!(std::io::stderr(), "{text}")),
                }
                if finished.recv_timeout(pause) != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
            if let Some(spinner) = spinner {
                spinner.finish_and_clear();
            }
        });
        let result = load();
        drop(done);
        result
    })
}

fn message([files, bytes, triangles]: [u64; 3], elapsed: Duration) -> String {
    format!(
        "loading: {files} files, {:.1} MiB, {:.2} million triangles, {:.0} s",
        bytes as f64 / 1_048_576.0,
        triangles as f64 / 1e6,
        elapsed.as_secs_f64()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_counts_what_is_read_and_the_result_comes_back() {
        let seconds = Duration::from_millis(2400);
        assert_eq!(
            message([3, 5 << 20, 1_230_000], seconds),
            "loading: 3 files, 5.0 MiB, 1.23 million triangles, 2 s"
        );
        assert_eq!(watched(&LoadProgress::default(), || 7), 7);
    }
}
