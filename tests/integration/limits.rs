//! What docs/limits.md says happens past each limit: one message that names it, and nothing written. One step over it, where that can be
//! had without the memory.

use crate::common::{files, folder, ok, run};
use openexr_core::{Channel, Image, Samples, Window};
use sparing::image::openexr_core;
use std::fmt::Write as _;
use std::path::Path;

/// Runs the lines, which must fail with this code and message.
fn refused(folder: &Path, lines: &[(&str, i32, &str)]) {
    let before = files(folder);
    for (line, code, wanted) in lines {
        let r = run(folder, line);
        let said = r.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(r.code, *code, "{line}: {said}");
        assert!(said.starts_with("error: ") && said.contains(wanted), "{line}: {said}");
    }
    assert_eq!(files(folder), before);
}

#[test]
fn options() {
    let f = folder();
    let render = |rest: &str| format!("render @cornell-box.pbrt -o a.exr {rest}");
    let lines = [
        (
            "--size 65537x8",
            2,
            "a picture of 65537x8 is too large: at most 65536 a side and 1073741824 pixels",
        ),
        ("--size 65536x16385", 2, "at most 65536 a side and 1073741824 pixels"),
        ("--spp 1048577", 2, "1048577 samples per pixel are not possible: use 1 to 1048576"),
        ("--threads 1025", 2, "1025 threads are too many: use at most 1024"),
        ("--max-depth 10001", 2, "10001 is not in 0..=10000"),
        ("--size 64x64 --shard 1/9", 2, "8 rows of tiles cannot be split in 9"),
        ("--spp 4096 --shard 1/9 --shard-by samples", 2, "there can be 8 shards at most"),
        ("--spp 64 --shard 1/8 --shard-by samples", 2, "of a multiple of 16 samples each"),
    ];
    for (rest, code, wanted) in lines {
        refused(f.path(), &[(&render(rest), code, wanted)]);
    }
    // The limits themselves are within.
    ok(f.path(), &render("--size 8x65536 --crop 0,65528,8,65536 --spp 1 --threads 1024 --progress none"));
    let r =
        run(f.path(), &render("--size 16384x65536 --spp 1 --max-depth 10000 --pixel 16383,65535 --sample 0"));
    assert!(r.code == 0 || r.stderr.contains("of memory"), "{}", r.stderr);
}

#[test]
fn scenes() {
    let f = folder();
    let write = |name: &str, text: String| std::fs::write(f.path().join(name), text).expect("a file");
    write("nested.pbrt", format!("WorldBegin\n{}", "AttributeBegin ".repeat(1001)));
    for k in 0..=33 {
        write(&format!("include-{k}.pbrt"), format!("Include \"include-{}.pbrt\"\n", k + 1));
    }
    write("includes.pbrt", "WorldBegin\nInclude \"include-0.pbrt\"\n".to_owned());
    // A file with a hole: its length is looked at first.
    let sparse = std::fs::File::create(f.path().join("sparse.pbrt")).expect("a file");
    sparse.set_len((4 << 30) + 1).expect("a length");
    refused(
        f.path(),
        &[
            ("info nested.pbrt", 1, "max_nesting = 1000"),
            ("info includes.pbrt", 1, "max_include_depth = 32"),
            ("info sparse.pbrt", 1, "max_file_bytes = 4294967296"),
        ],
    );
}

#[test]
fn pictures() {
    let f = folder();
    let path = |name: &str| f.path().join(name);
    let exr = |name: &str, size: [u32; 2], channels: usize| {
        let mut image = Image::new(Window::of_size(size[0], size[1]));
        let samples = vec![0.5; size[0] as usize * size[1] as usize];
        for k in 0..channels {
            let name = ["R", "G", "B"].get(k).map_or_else(|| format!("extra.{k}"), ToString::to_string);
            image.channels.push(Channel { name, samples: Samples::F32(samples.clone()) });
        }
        let file = std::fs::File::create(path(name)).expect("a file");
        openexr_core::write(file, &image).expect("it is written");
    };
    let pfm = |name: &str, width: usize| {
        let mut bytes = format!("PF\n{width} 1\n-1\n").into_bytes();
        bytes.resize(bytes.len() + 12 * width, 0);
        std::fs::write(path(name), bytes).expect("a file");
    };
    let texture = |name: &str, file: &str| {
        let mut text = String::new();
        let _ = write!(
            text,
            "Camera \"perspective\"\nFilm \"rgb\" \"integer xresolution\" 2 \"integer yresolution\" 2\nWorldBegin\nLightSource \"infinite\"\n\
             Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\"\n\
             Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n"
        );
        std::fs::write(path(name), text).expect("a scene");
    };
    // 12 bytes a pixel, of which the files have none.
    std::fs::write(path("large.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 20000 +X 20000\n")
        .expect("a file");
    texture("hdr.pbrt", "large.hdr");
    exr("wide.exr", [65_536, 1], 3);
    exr("high.exr", [1, 65_536], 3);
    exr("wider.exr", [65_537, 1], 3);
    pfm("wide.pfm", 65_536);
    pfm("wider.pfm", 65_537);
    exr("channels.exr", [2, 2], 1024);
    exr("more.exr", [2, 2], 1025);
    texture("exr.pbrt", "wider.exr");
    texture("pfm.pbrt", "wider.pfm");
    texture("within.pbrt", "wide.exr");
    refused(
        f.path(),
        &[
            ("info wider.exr", 1, "wider.exr"),
            ("compare wider.exr wider.exr", 1, "wider.exr"),
            ("compare wider.pfm wider.pfm", 1, "wider.pfm"),
            ("render exr.pbrt -o a.png", 1, "wider.exr"),
            ("render pfm.pbrt -o a.png", 1, "wider.pfm"),
            (
                "compare large.hdr large.hdr",
                1,
                "large.hdr: 20000x20000 pixels take 4800000000 bytes in memory",
            ),
            ("render hdr.pbrt -o a.png", 1, "large.hdr: 20000x20000 pixels take 4800000000 bytes in memory"),
            ("info more.exr", 1, "1025 channels, the limit is 1024"),
            ("merge more.exr -o a.png", 1, "1025 channels, the limit is 1024"),
        ],
    );
    // What is written can be looked at and compared.
    for (image, size) in [("wide.exr", "65536"), ("high.exr", "65536"), ("channels.exr", "extra.1023")] {
        let said = ok(f.path(), &format!("info {image}")).stdout;
        assert!(said.contains(size), "{said}");
    }
    for image in ["wide.exr", "high.exr", "wide.pfm"] {
        ok(f.path(), &format!("compare {image} {image}"));
    }
    ok(f.path(), "render within.pbrt --spp 1 -o a.png --progress none");
}

#[test]
fn models() {
    let f = folder();
    let header = |vectors: u64, nr: [u64; 2]| {
        format!(
            "svm_type c_svc\nkernel_type rbf\ngamma 0.5\nnr_class 2\ntotal_sv {vectors}\nrho 0\nlabel 1 -1\nnr_sv {} {}\nSV\n",
            nr[0], nr[1]
        )
    };
    let write = |name: &str, text: String| std::fs::write(f.path().join(name), text).expect("a file");
    write("vectors.model", header(4_000_001, [2_000_000, 2_000_001]));
    write("features.model", header(2, [1, 1]) + "1 1000001:1\n-1 1:1\n");
    write("values.model", header(1000, [500, 500]) + &"1 1000000:1\n".repeat(1000));
    let render = |model: &str| format!("tradeoff {model} --data {model} -o out");
    for (model, wanted) in [
        ("vectors.model", "4000001 is beyond the limit of 4000000 support vectors"),
        ("features.model", "feature 1000001 is beyond the limit of features, 1000000"),
        ("values.model", "the model needs more than the limit of 134217728 values"),
    ] {
        refused(f.path(), &[(&render(model), 1, wanted)]);
    }
}
