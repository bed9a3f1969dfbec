//! Finds Embree 4, checks the header's version, generates the bindings and says how to link.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

struct Embree {
    include: PathBuf,
    /// Library folder to search and to put into run paths; `None` for the system's own.
    lib: Option<PathBuf>,
}

fn main() {
    println!("cargo:rerun-if-env-changed=EMBREE_DIR");
    println!("cargo:rerun-if-changed=wrapper.h");
    let embree = find();
    let version = check_version(&embree.include);
    println!("cargo:include={}", embree.include.display());
    println!("cargo:version={version}");
    link(&embree);
    generate(&embree.include);
}

fn find() -> Embree {
    let mut searched = Vec::new();
    let mut candidates: Vec<PathBuf> = Vec::new();
    if let Some(dir) = env::var_os("EMBREE_DIR") {
        candidates.push(PathBuf::from(dir)); // named by the user: nothing else is tried
    } else {
        let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
        candidates.push(manifest.join("../../.deps/embree4"));
        candidates.extend(["/usr/local", "/usr", "/opt/homebrew"].map(PathBuf::from));
    }
    for prefix in candidates {
        let header = prefix.join("include/embree4/rtcore_config.h");
        searched.push(header.display().to_string());
        if header.is_file() {
            // Only a file that is there: a missing one would make cargo run this again every time.
            println!("cargo:rerun-if-changed={}", header.display());
            let system = prefix == Path::new("/usr");
            let prefix = prefix.canonicalize().unwrap_or(prefix);
            let lib = (!system).then(|| library_folder(&prefix));
            return Embree { include: prefix.join("include"), lib };
        }
    }
    fail(&format!("no Embree 4 found; searched:\n    {}", searched.join("\n    ")))
}

fn library_folder(prefix: &Path) -> PathBuf {
    let folders = ["lib", "lib64", "lib/x86_64-linux-gnu", "lib/aarch64-linux-gnu"];
    let names = ["libembree4.so", "libembree4.dylib", "embree4.lib"];
    folders.iter().map(|f| prefix.join(f)).find(|f| names.iter().any(|n| f.join(n).exists())).unwrap_or_else(
        || fail(&format!("{} has Embree 4 headers but no libembree4 in lib or lib64", prefix.display())),
    )
}

fn check_version(include: &Path) -> String {
    let header = include.join("embree4/rtcore_config.h");
    let text = fs::read_to_string(&header)
        .unwrap_or_else(|e| fail(&format!("cannot read {}: {e}", header.display())));
    let number = |name: &str| {
        text.lines()
            .filter_map(|l| l.trim().strip_prefix("#define "))
            .find_map(|l| l.strip_prefix(name)?.trim().parse::<u32>().ok())
            .unwrap_or_else(|| fail(&format!("{} does not define {name}", header.display())))
    };
    let major = number("RTC_VERSION_MAJOR ");
    if major != 4 {
        fail(&format!("{} is of Embree {major}, but version 4 is needed", header.display()));
    }
    format!("{major}.{}.{}", number("RTC_VERSION_MINOR "), number("RTC_VERSION_PATCH "))
}

fn link(embree: &Embree) {
    println!("cargo:rustc-link-lib=dylib=embree4");
    let Some(lib) = &embree.lib else {
        println!("cargo:lib=");
        return;
    };
    println!("cargo:lib={}", lib.display());
    // cargo puts search folders inside the target directory on the run-time library path of tests,
    // examples and benches: links there spare every crate of the workspace a run path.
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("lib");
    fs::create_dir_all(&out).unwrap_or_else(|e| fail(&format!("cannot create {}: {e}", out.display())));
    for entry in fs::read_dir(lib).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name.to_string_lossy().contains(".so") || name.to_string_lossy().contains(".dylib") {
            let target = out.join(&name);
            let _ = fs::remove_file(&target);
            #[cfg(unix)]
            std::os::unix::fs::symlink(entry.path(), &target)
                .unwrap_or_else(|e| fail(&format!("cannot link {}: {e}", target.display())));
        }
    }
    println!("cargo:rustc-link-search=native={}", out.display());
    println!("cargo:rustc-link-search=native={}", lib.display());
}

fn generate(include: &Path) {
    let bindings = bindgen::Builder::default()
        .header("wrapper.h")
        .clang_arg(format!("-I{}", include.display()))
        .allowlist_item("(RTC|rtc).*")
        .default_enum_style(bindgen::EnumVariation::NewType { is_bitfield: false, is_global: false })
        .bitfield_enum("RTC.*Flags")
        .derive_default(true)
        .layout_tests(true)
        .generate_comments(true)
        .generate()
        .unwrap_or_else(|e| fail(&format!("bindgen failed ({e}); is libclang installed?")));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("bindings.rs");
    bindings.write_to_file(&out).unwrap_or_else(|e| fail(&format!("cannot write {}: {e}", out.display())));
}

fn fail(message: &str) -> ! {
    eprintln!("error: {message}");
    eprintln!("  run scripts/setup.sh in the workspace, or install your distribution's Embree 4 development");
    eprintln!("  package, or set EMBREE_DIR to a prefix that holds include/embree4 and lib/libembree4.so");
    std::process::exit(1)
}
