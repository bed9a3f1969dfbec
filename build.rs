//! Puts Embree's and OpenEXR's folders on the run path of the binary, and stamps the version with the commit.

use std::process::Command;

fn main() {
    for variable in ["DEP_EMBREE4_LIB", "DEP_OPENEXRCORE_LIB"] {
        println!("cargo:rerun-if-env-changed={variable}");
        if let Some(lib) = std::env::var(variable).ok().filter(|lib| !lib.is_empty()) {
            println!("cargo:rustc-link-arg=-Wl,-rpath,{lib}");
        }
    }
    let log =
        git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|path| std::path::Path::new(path).is_file());
    println!("cargo:rerun-if-changed={}", log.as_deref().unwrap_or("build.rs"));
    let commit = git(&["rev-parse", "--short=10", "HEAD"]);
    let version = env!("CARGO_PKG_VERSION");
    let stamp = commit.map_or(version.to_owned(), |c| format!("{version} ({c})"));
    println!("cargo:rustc-env=SPARING_VERSION={stamp}");
}

/// What git prints, trimmed; `None` without git or outside a checkout.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
