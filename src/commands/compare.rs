//! `sparing compare`.

use super::Usage;
use crate::session::console;
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use sparing_image::atomic::check_writable;
use sparing_image::metrics::{
    Comparison, ErrorKind, Exposure, Summary, block_means, compare, error_map, signed_difference,
};
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
    /// What the error map shows.
    #[arg(long, value_enum, default_value_t)]
    error_kind: MapKind,
    /// Write a picture of the signed relative difference of luminance: red is too bright, blue too dark, white right.
    #[arg(long, value_name = "FILE.png")]
    signed_difference: Option<PathBuf>,
    /// The difference that is pure red or blue; 0.1 is 10 % of the reference.
    #[arg(long, value_name = "PART", default_value_t = 0.1, requires = "signed_difference")]
    difference_range: f32,
    /// Signed differences of means over blocks of this many pixels a side, one pixel each: less noise.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "signed_difference",
        value_parser = clap::value_parser!(u32).range(1..=65536))]
    blocks: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum MapKind {
    /// FLIP, 0 to 1.
    #[default]
    Flip,
    /// CIEDE2000, 0 to 20.
    Ciede2000,
    /// Relative error, 0 to 1.
    Relative,
}

impl From<MapKind> for ErrorKind {
    fn from(kind: MapKind) -> Self {
        match kind {
            MapKind::Flip => Self::Flip,
            MapKind::Ciede2000 => Self::Ciede2000,
            MapKind::Relative => Self::Relative,
        }
    }
}

pub(super) fn run(a: &CompareArguments) -> anyhow::Result<ExitCode> {
    if a.exposure.is_some_and(|ev| !ev.is_finite()) {
        return Err(Usage::error("the exposure must be a finite number"));
    }
    if !(a.difference_range.is_finite() && a.difference_range > 0.0) {
        return Err(Usage::error("the range of differences must be a positive number"));
    }
    for path in [&a.error_map, &a.signed_difference].into_iter().flatten() {
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Usage::error(format!("{}: error maps are written as .png", path.display())));
        }
        check_writable(path)?;
    }
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
    let exposure = a.exposure.map_or(Exposure::Auto, Exposure::Ev);
    let c = compare(&image, &reference, size[0], size[1], exposure)?;
    if a.json {
        console::print(serde_json::to_string_pretty(&json(&c))?)?;
    } else {
        console::print(text(&c))?;
    }
    if let Some(path) = &a.error_map {
        let map = error_map(&image, &reference, size[0], size[1], exposure, a.error_kind.into())?;
        write_png(path, size[0], size[1], &map, 0.0).context("cannot write the error map")?;
    }
    if let Some(path) = &a.signed_difference {
        let range = a.difference_range;
        let exposure = Exposure::Scale(exposure.scale(&reference));
        let means = |pixels: &[[f32; 3]]| block_means(pixels, size[0], size[1], a.blocks);
        let ((image, _), (reference, size)) = (means(&image), means(&reference));
        let map = signed_difference(&image, &reference, size[0], size[1], exposure, range)?;
        write_png(path, size[0], size[1], &map, 0.0).context("cannot write the signed difference")?;
        if !a.json {
            console::print(format!(
                "{}: red {:+.1} % and more, blue {:+.1} % and less",
                path.display(),
                range * 100.0,
                range * -100.0
            ))?;
        }
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
            .map(|[r, g, b, _]| {
                [r, g, b].map(|v| sparing_render::texture::srgb_to_linear(f32::from(*v) / 255.0))
            })
            .collect(),
    };
    Ok((pixels, [p.width, p.height]))
}

fn json(c: &Comparison) -> serde_json::Value {
    let summary =
        |s: &Summary| serde_json::json!({ "mean": s.mean, "p95": s.p95, "p99": s.p99, "max": s.max });
    serde_json::json!({
        "rel_mse": c.rel_mse,
        "mse": c.mse,
        "psnr": c.psnr,
        "ciede2000": summary(&c.ciede2000),
        "flip": summary(&c.flip),
        "signed_bias": c.signed_bias,
        "signed_bias_dark": c.signed_bias_dark,
        "exposure_scale": c.scale,
        "compared_pixels": c.compared,
        "non_finite_image": c.non_finite_image,
        "non_finite_reference": c.non_finite_reference,
    })
}

fn text(c: &Comparison) -> String {
    let summary =
        |s: &Summary| format!("mean {:.4}  p95 {:.4}  p99 {:.4}  max {:.4}", s.mean, s.p95, s.p99, s.max);
    let bias = [c.signed_bias, c.signed_bias_dark].map(|b| format!("{:+.3} %", b * 100.0));
    let mut lines = vec![
        format!("relMSE      {:.6e}", c.rel_mse),
        format!("MSE         {:.6e}", c.mse),
        format!("PSNR        {:.2} dB", c.psnr),
        format!("CIEDE2000   {}", summary(&c.ciede2000)),
        format!("FLIP        {}", summary(&c.flip)),
        format!("bias        {}, darkest lit quarter {}", bias[0], bias[1]),
        format!("(both pictures times {:.4})", c.scale),
    ];
    if c.non_finite_image + c.non_finite_reference > 0 {
        let [image, reference] = [c.non_finite_image, c.non_finite_reference];
        lines.push(format!("not finite  {image} pixels of the picture, {reference} of the reference"));
    }
    lines.join("\n")
}
