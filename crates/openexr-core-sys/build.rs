//! Finds OpenEXR 3.1 or later, checks the header's version, generates the bindings and says how to link.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

struct OpenExr {
    include: PathBuf,
    /// Library folder to search; `None` for the system's own.
    lib: Option<PathBuf>,
}

fn main() {
    println!("cargo:rerun-if-env-changed=OPENEXR_DIR");
    println!("cargo:rerun-if-changed=wrapper.h");
    let found = find();
    let version = check_version(&found.include);
    println!("cargo:include={}", found.include.display());
    println!("cargo:version={version}");
    println!("cargo:rustc-link-lib=dylib=OpenEXRCore");
    match &found.lib {
        None => println!("cargo:lib="),
        Some(lib) => {
            println!("cargo:lib={}", lib.display());
            println!("cargo:rustc-link-search=native={}", lib.display());
        }
    }
    generate(&found.include);
}

fn find() -> OpenExr {
    let candidates: Vec<PathBuf> = match env::var_os("OPENEXR_DIR") {
        Some(dir) => vec![PathBuf::from(dir)], // named by the user: nothing else is tried
        None => ["/usr/local", "/usr", "/opt/homebrew"].map(PathBuf::from).into(),
    };
    let mut searched = Vec::new();
    for prefix in candidates {
        let header = prefix.join("include/OpenEXR/openexr.h");
        searched.push(header.display().to_string());
        if header.is_file() {
            // Only a file that is there: a missing one would make cargo run this again every time.
            println!("cargo:rerun-if-changed={}", header.display());
            let lib = (prefix != Path::new("/usr")).then(|| library_folder(&prefix));
            return OpenExr { include: prefix.join("include"), lib };
        }
    }
    fail(&format!("no OpenEXR with its C library found; searched:\n    {}", searched.join("\n    ")))
}

fn library_folder(prefix: &Path) -> PathBuf {
    let folders = ["lib", "lib64", "lib/x86_64-linux-gnu", "lib/aarch64-linux-gnu"];
    let holds_it = |folder: &PathBuf| {
        fs::read_dir(folder)
            .into_iter()
            .flatten()
            .flatten()
            .any(|entry| entry.file_name().to_string_lossy().contains("OpenEXRCore"))
    };
    folders.iter().map(|f| prefix.join(f)).find(holds_it).unwrap_or_else(|| {
        fail(&format!("{} has OpenEXR headers but no libOpenEXRCore in lib or lib64", prefix.display()))
    })
}

fn check_version(include: &Path) -> String {
    let header = include.join("OpenEXR/OpenEXRConfig.h");
    println!("cargo:rerun-if-changed={}", header.display());
    let text = fs::read_to_string(&header)
        .unwrap_or_else(|e| fail(&format!("cannot read {}: {e}", header.display())));
    let number = |name: &str| {
        text.lines()
            .filter_map(|l| l.trim().strip_prefix("#define "))
            .find_map(|l| l.strip_prefix(name)?.trim().parse::<u32>().ok())
            .unwrap_or_else(|| fail(&format!("{} does not define {name}", header.display())))
    };
    let (major, minor) = (number("OPENEXR_VERSION_MAJOR "), number("OPENEXR_VERSION_MINOR "));
    if major != 3 || minor < 1 {
        fail(&format!("{} is of OpenEXR {major}.{minor}, but 3.1 or later 3.x is needed", header.display()));
    }
    format!("{major}.{minor}.{}", number("OPENEXR_VERSION_PATCH "))
}

fn generate(include: &Path) {
    let bindings = bindgen::Builder::default()
        .header("wrapper.h")
        .clang_arg(format!("-I{}", include.display()))
        .clang_arg(format!("-I{}/OpenEXR", include.display()))
        .clang_arg(format!("-I{}/Imath", include.display()))
        // Since 3.2 the headers include one of Imath, which may be installed elsewhere.
        .clang_args(["-idirafter/usr/local/include/Imath", "-idirafter/usr/include/Imath"])
        .allowlist_item("(EXR|exr)_.*")
        .default_enum_style(bindgen::EnumVariation::NewType { is_bitfield: false, is_global: false })
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
    eprintln!("  run scripts/setup.sh in the workspace, or install your distribution's OpenEXR development");
    eprintln!("  package (libopenexr-dev, openexr-devel), or set OPENEXR_DIR to a prefix that holds");
    eprintln!("  include/OpenEXR/openexr.h and lib/libOpenEXRCore.so");
    std::process::exit(1)
}
