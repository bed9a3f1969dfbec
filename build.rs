//! Puts Embree's and OpenEXR's folders on the run path of the binary, and stamps the version with the commit.

use std::process::Command;

fn main() {
    for variable in ["DEP_EMBREE4_LIB", "DEP_OPENEXRCORE_LIB"] {
        println!("cargo:rerun-if-env-changed={variable}");
        if let Some(lib) = std::env::var(variable).ok().filter(|lib| !lib.is_empty()) {
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
