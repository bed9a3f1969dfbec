//! Puts Embree's folder on the run path of the binary, and stamps the version with the commit.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-env-changed=DEP_EMBREE4_LIB");
    if let Ok(lib) = std::env::var("DEP_EMBREE4_LIB") {
        if !lib.is_empty() {
            println!("cargo:rustc-link-arg=-Wl,-rpath,{lib}");
        }
    }
    println!("cargo:rerun-if-changed=.git/HEAD");
    let commit = Command::new("git")
        .args(["rev-parse", "--short=10", "HEAD"])
        .output()
        .ok()
        .filter(|o| o.status.success())
        .and_then(|o| String::from_utf8(o.stdout).ok());
    let version = env!("CARGO_PKG_VERSION");
    let stamp = commit.map_or(version.to_owned(), |c| format!("{version} ({})", c.trim()));
    println!("cargo:rustc-env=SPARING_VERSION={stamp}");
}
