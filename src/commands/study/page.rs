//! One HTML page with everything inside it.

use super::pictures::Pictures;
use super::plan::Knob;
use super::plots::Plots;
use super::record::Metric;
use super::results::{SceneResult, Study};
use super::tables::{mean, percent, ratio, share, tolerances};
use sparing_adaptive::study::Ratio;
use std::fmt::Write as _;

const STYLE: &str = include_str!("page.css");
const NOTES: &str = include_str!("notes.html");

/// The page.
pub(super) fn page(study: &Study, plots: &Plots, pictures: &[Pictures]) -> String {
    let mut out = String::new();
    let names: Vec<String> = study.scenes.iter().map(|s| escape(&s.runs.name)).collect();
    let levels: Vec<String> = study.levels.iter().map(u32::to_string).collect();
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>Sampling policies compared</title>\n<style>\n{STYLE}</style>\
         </head>\n<body><main>\n<h1>Sampling policies compared</h1>\n<p class=\"lead\">Ratios of {} (small: of samples) to uniform sampling at equal error: {}. \
         Levels: uniform {} spp. References of {} spp, at most {} spp a pixel, {} threads, {}, Sparing {}.</p>\n",
        study.time_name(),
        names.join(", "),
        levels.join(" and "),
        study.reference_spp,
        study.max_spp,
        study.threads,
        match study.seeds {
            1 => format!("seed {}", study.seed),
            n => format!("means of {n} seeds from {} on", study.seed),
        },
        escape(study.version)
    );
    let _ = writeln!(out, "<figure class=\"wide\">{}</figure>", plots.summary);
    for (level, oracle) in study.levels.iter().zip(&study.oracle) {
        let _ = writeln!(out, "<h2>All scenes, at the error of uniform {level} spp</h2>");
        table_head(&mut out, "largest bias", "in dark parts");
        for r in study.summary.iter().filter(|r| r.level == *level) {
            let cells = r.time.iter().zip(&r.spp).map(|(t, s)| (t.value, t.unreached > 0, mean(t), mean(s)));
            row(&mut out, r.policy.name(), cells, r.worst_bias, r.oracle_share);
        }
        table_end(&mut out, *oracle);
    }
    tolerance_table(&mut out, study);
    for ((scene, plots), pictures) in study.scenes.iter().zip(&plots.scenes).zip(pictures) {
        scene_part(&mut out, study, scene, plots, pictures);
    }
    let _ = writeln!(out, "{NOTES}</main></body></html>");
    out
}

fn scene_part(out: &mut String, study: &Study, scene: &SceneResult, plots: &[String], pictures: &Pictures) {
    let [w, h] = scene.runs.size;
    let reference = &scene.runs.reference;
    let _ = writeln!(
        out,
        "<section><h2>{}</h2>\n<p>{w}x{h} pixels, radiance times {:.4}. The reference's own relMSE is below {:.2e}.</p>",
        escape(&scene.runs.name),
        reference.exposure,
        reference.rel_mse
    );
    picture(
        out,
        &pictures.counts,
        "Where the samples went: black is the least, light yellow the most, in powers of two.",
    );
    picture(out, &pictures.crops, "The part where uniform sampling is worst.");
    for (level, oracle) in study.levels.iter().zip(&scene.oracle) {
        let _ = writeln!(out, "<h3>At the error of uniform {level} spp</h3>");
        table_head(out, "bias", "in dark parts");
        for r in scene.rows.iter().filter(|r| r.level == *level) {
            let value = |t: &Option<Ratio>| t.map_or(f64::NAN, Ratio::value);
            let unreached = |t: &Option<Ratio>| matches!(t, Some(Ratio::Unreached(_)));
            let cells =
                r.time.iter().zip(&r.spp).map(|(t, s)| (value(t), unreached(t), ratio(*t), ratio(*s)));
            row(out, r.policy.name(), cells, r.bias, r.oracle_share);
        }
        table_end(out, *oracle);
    }
    let _ = writeln!(out, "<div class=\"plots\">{}</div></section>", plots.join("\n"));
}

fn table_head(out: &mut String, bias: &str, dark: &str) {
    out.push_str("<div class=\"scroll\"><table><thead><tr><th>policy</th>");
    for m in Metric::ALL {
        let _ = write!(out, "<th>{}</th>", m.title());
    }
    let _ = writeln!(out, "<th>{bias}</th><th>{dark}</th><th>of the oracle</th></tr></thead><tbody>");
}

fn row(
    out: &mut String,
    name: &str,
    cells: impl Iterator<Item = (f64, bool, String, String)>,
    bias: [Option<f64>; 2],
    oracle: Option<f64>,
) {
    let _ = write!(out, "<tr><th>{}</th>", escape(name));
    for (value, unreached, time, spp) in cells {
        let _ = write!(
            out,
            "<td style=\"background:{}\">{} <small>{}</small></td>",
            shade(value, unreached),
            escape(&time),
            escape(&spp)
        );
    }
    let _ = writeln!(
        out,
        "<td>{}</td><td>{}</td><td>{}</td></tr>",
        percent(bias[0]),
        percent(bias[1]),
        share(oracle)
    );
}

/// Blue where it gains, orange where it loses, both by the logarithm up to a factor of four; grey where unreached.
fn shade(ratio: f64, unreached: bool) -> String {
    if unreached {
        return "#e6e6e6".to_owned();
    }
    if !ratio.is_finite() || ratio <= 0.0 {
        return "none".to_owned();
    }
    let t = (ratio.log2() / 2.0).clamp(-1.0, 1.0);
    let target = if t < 0.0 { [122.0, 184.0, 222.0] } else { [240.0, 165.0, 110.0] };
    let [r, g, b] = target.map(|c: f64| (255.0 + (c - 255.0) * t.abs()).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn table_end(out: &mut String, oracle: Option<f64>) {
    out.push_str("</tbody></table></div>");
    if let Some(oracle) = oracle {
        let _ = writeln!(
            out,
            "<p class=\"note\">The best allocation would need {oracle:.2} of the samples for the same relMSE.</p>"
        );
    }
}

fn tolerance_table(out: &mut String, study: &Study) {
    if tolerances(study).next().is_none() {
        return;
    }
    out.push_str(
        "<h2>Is the tolerance true?</h2>\n<div class=\"scroll\"><table><thead><tr><th>scene</th><th>asked for</th><th>samples per \
         pixel</th><th>predicted mean CIEDE2000</th><th>achieved</th><th>achieved / predicted</th></tr></thead><tbody>",
    );
    for (scene, r) in tolerances(study) {
        let Knob::Tolerance(t) = r.knob else { continue };
        let _ = writeln!(
            out,
            "<tr><th>{}</th><td>{} {t}</td><td>{:.1}</td><td>{:.3}</td><td>{:.3}</td><td>{:.2}</td></tr>",
            escape(scene),
            r.policy.name(),
            r.average_spp,
            r.predicted_de,
            r.mean_de,
            r.mean_de / r.predicted_de
        );
    }
    out.push_str("</tbody></table></div>\n");
}

fn picture(out: &mut String, png: &[u8], caption: &str) {
    let data = base64(png);
    let _ = writeln!(
        out,
        "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>"
    );
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_rfc() {
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn shades_tell_gain_from_loss() {
        assert_eq!(shade(1.0, false), "#ffffff");
        assert_eq!(shade(0.1, false), shade(0.25, false));
        assert_ne!(shade(0.5, false), shade(2.0, false));
        assert_eq!((shade(f64::NAN, false), shade(3.0, true)), ("none".to_owned(), "#e6e6e6".to_owned()));
    }
}
