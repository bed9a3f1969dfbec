//! `sparing compare`.

use anyhow::{Context, bail};
use clap::Args;
use sparing_image::metrics::{Comparison, Exposure, compare, error_map};
use sparing_image::picture::{Picture, Pixels};
use sparing_image::png::write_png;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `sparing compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArguments {
    /// Picture to judge: .exr, .pfm, .hdr or .png.
    image: PathBuf,
    /// What it should be.
    reference: PathBuf,
    /// Exposure in stops for perceptual errors; default: the reference's 95th percentile of luminance becomes 0.9.
    #[arg(long, value_name = "EV", allow_negative_numbers = true)]
    exposure: Option<f32>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write a picture of the errors.
    #[arg(long, value_name = "FILE.png")]
    error_map: Option<PathBuf>,
}

pub(super) fn run(a: &CompareArguments) -> anyhow::Result<ExitCode> {
    let (image, size) = read(&a.image)?;
    let (reference, reference_size) = read(&a.reference)?;
    if size != reference_size {
        bail!(
            "{} is {}x{} but {} is {}x{}",
            a.image.display(),
            size[0],
            size[1],
            a.reference.display(),
            reference_size[0],
            reference_size[1]
        );
    }
    let exposure = a.exposure.map_or(Exposure::Auto, Exposure::Stops);
    let c = compare(&image, &reference, size[0], size[1], exposure);
    if a.json {
        println!("{}", serde_json::to_string_pretty(&json(&c))?);
    } else {
        print(&c);
    }
    if let Some(path) = &a.error_map {
        let map = error_map(&image, &reference, size[0], size[1], exposure);
        write_png(path, size[0], size[1], &map, 0.0).context("cannot write the error map")?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Linear pixels and size of a picture.
fn read(path: &Path) -> anyhow::Result<(Vec<[f32; 3]>, [u32; 2])> {
    let p = Picture::read(path)?;
    let pixels = match p.pixels {
        Pixels::Rgb32F(data) => data,
        Pixels::Rgba8 { data, .. } => data
            .iter()
            .map(|[r, g, b, _]| [r, g, b].map(|v| sparing_render::texture::srgb_to_linear(f32::from(*v) / 255.0)))
            .collect(),
    };
    Ok((pixels, [p.width, p.height]))
}
