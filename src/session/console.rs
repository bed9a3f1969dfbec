//! Text on standard output and standard error. A reader that goes away early (`sparing info FILE | head`) is no
//! error and never a panic.

use std::fmt::Display;
use std::io::{ErrorKind, Write};

/// Writes text and a line end to standard output. A closed pipe is success.
///
/// # Errors
/// Anything else, such as a full disk behind a redirection.
pub fn print(text: impl Display) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(anyhow::anyhow!("cannot write to standard output: {e}"))
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error, if anyone can still read it.
pub fn note(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
