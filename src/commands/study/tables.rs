//! Tables: as text, as CSV.

use super::plan::Knob;
use super::record::Metric;
use super::results::{Row, Study, SummaryRow};
use sparing_adaptive::study::{Mean, Ratio};
use std::fmt::Write as _;

/// A ratio as people read it: `<` where the policy is better already, `>` where the error was never reached.
pub(super) fn ratio(r: Option<Ratio>) -> String {
    match r {
        None => "-".to_owned(),
        Some(Ratio::Exactly(v)) => format!("{v:.2}"),
        Some(Ratio::AtMost(v)) => format!("<{v:.2}"),
        Some(Ratio::Unreached(v)) => format!(">{v:.2}"),
    }
}

/// A mean as people read it.
pub(super) fn mean(m: &Mean) -> String {
    let sign = if m.unreached > 0 {
        ">"
    } else if m.at_most > 0 {
        "<"
    } else {
        ""
    };
    if m.scenes == 0 { "-".to_owned() } else { format!("{sign}{:.2}", m.value) }
}

/// A share with its sign.
pub(super) fn percent(v: Option<f64>) -> String {
    v.map_or("-".to_owned(), |v| format!("{:+.2} %", v * 100.0))
}

/// A share of what the oracle saves.
pub(super) fn share(v: Option<f64>) -> String {
    v.map_or("-".to_owned(), |v| format!("{:.0} %", v * 100.0))
}

/// The result for people.
pub(super) fn text(study: &Study) -> String {
    let mut out = String::new();
    let heading = |out: &mut String| {
        let _ = write!(out, "{:<14}", "policy");
        for m in Metric::ALL {
            let _ = write!(out, "{:>15}", m.short());
        }
        let _ = writeln!(out, "{:>12}{:>12}{:>9}", "bias", "dark bias", "oracle");
    };
    for (level, oracle) in study.levels.iter().zip(&study.oracle) {
        let _ = writeln!(
            out,
            "Ratios of {}, and in brackets of samples, at the error of uniform {level} spp, to uniform's: {}",
            study.time_name(),
            study.mean_of()
        );
        heading(&mut out);
        for r in study.summary.iter().filter(|r| r.level == *level) {
            let cells = r.time.iter().zip(&r.spp).map(|(t, s)| [mean(t), mean(s)]);
            line(&mut out, r.policy.name(), cells, r.worst_bias, r.oracle_share);
        }
        if let Some(oracle) = oracle {
            let _ = writeln!(out, "oracle's samples: {oracle:.2}");
        }
        for a in study.against.iter().filter(|a| a.level == *level) {
            let cell = |v: &Option<[f64; 2]>, i: usize| v.map_or("-".to_owned(), |v| format!("{:.2}", v[i]));
            for (i, what) in ["mean", "worst"].into_iter().enumerate() {
                let cells = a
                    .time
                    .iter()
                    .zip(&a.spp)
                    .map(|(t, s)| format!("{:>15}", format!("{} ({})", cell(t, i), cell(s, i))));
                let name = format!("svm/thr. {what}");
                let _ = writeln!(out, "{name:<14}{}", cells.collect::<String>());
            }
        }
        for scene in &study.scenes {
            let _ = writeln!(out, "\n{} at uniform {level} spp", scene.runs.name);
            for r in scene.rows.iter().filter(|r| r.level == *level) {
                let cells = r.time.iter().zip(&r.spp).map(|(t, s)| [ratio(*t), ratio(*s)]);
                line(&mut out, r.policy.name(), cells, r.bias, r.oracle_share);
            }
        }
        out.push('\n');
    }
    for (scene, record) in tolerances(study) {
        let Knob::Tolerance(t) = record.knob else { continue };
        let _ = writeln!(
            out,
            "{scene}, {} --tolerance {t}: {:.1} spp, mean CIEDE2000 predicted {:.3}, achieved {:.3} ({:+.0} %)",
            record.policy.name(),
            record.average_spp,
            record.predicted_de,
            record.mean_de,
            (record.mean_de / record.predicted_de - 1.0) * 100.0
        );
    }
    out.push_str(
        "> some error was never reached: a lower bound. < better already at the least samples. bias: signed, at as many samples \
         per pixel as the level; of all scenes the farthest from 0. oracle: share of the best allocation's saving.",
    );
    out
}

/// Renders that were asked for a tolerance, with their scene.
pub(super) fn tolerances(study: &Study) -> impl Iterator<Item = (&str, &super::record::Record)> {
    study
        .scenes
        .iter()
        .flat_map(|s| s.runs.records.iter().filter(|r| !r.on_curve()).map(|r| (s.runs.name.as_str(), r)))
}

fn line(
    out: &mut String,
    name: &str,
    cells: impl Iterator<Item = [String; 2]>,
    bias: [Option<f64>; 2],
    oracle: Option<f64>,
) {
    let _ = write!(out, "{name:<14}");
    for [time, spp] in cells {
        let _ = write!(out, "{:>15}", format!("{time} ({spp})"));
    }
    let _ = writeln!(out, "{:>12}{:>12}{:>9}", percent(bias[0]), percent(bias[1]), share(oracle));
}

/// One row a render.
pub(super) fn renders_csv(study: &Study) -> String {
    let mut out = "scene,width,height,policy,knob,on_curve,wall_seconds,cpu_seconds,decide_share,average_spp,rel_mse,mean_ciede2000,p95_ciede2000,\
                   p99_ciede2000,mean_flip,bias,bias_dark,predicted_mean_ciede2000,predicted_rel_mse\n"
        .to_owned();
    for s in &study.scenes {
        let [w, h] = s.runs.size;
        for r in &s.runs.records {
            let cpu = r.cpu_seconds.map_or(String::new(), |t| t.to_string());
            let dark = r.bias_dark.map_or(String::new(), |b| b.to_string());
            let _ = writeln!(
                out,
                "{},{w},{h},{},{},{},{},{cpu},{},{},{},{},{},{},{},{},{dark},{},{}",
                s.runs.name,
                r.policy.name(),
                r.knob.label(),
                r.on_curve(),
                r.wall_seconds,
                r.decide_share,
                r.average_spp,
                r.rel_mse,
                r.mean_de,
                r.p95_de,
                r.p99_de,
                r.flip,
                r.bias,
                r.predicted_de,
                r.predicted_rel_mse
            );
        }
    }
    out
}

/// One row for each scene, level, policy and metric, and for the means (scene `all`).
pub(super) fn summary_csv(study: &Study) -> String {
    let mut out =
        "scene,level,policy,metric,time_ratio,time_state,spp_ratio,spp_state,unreached_scenes\n".to_owned();
    let number = |v: f64| if v.is_finite() { v.to_string() } else { String::new() };
    for SummaryRow { level, policy, time, spp, .. } in &study.summary {
        for (i, m) in Metric::ALL.into_iter().enumerate() {
            let state = |m: &Mean| {
                if m.unreached > 0 {
                    "lower-bound"
                } else if m.at_most > 0 {
                    "upper-bound"
                } else {
                    "exact"
                }
            };
            let _ = writeln!(
                out,
                "all,{level},{},{},{},{},{},{},{}",
                policy.name(),
                m.short(),
                number(time[i].value),
                state(&time[i]),
                number(spp[i].value),
                state(&spp[i]),
                time[i].unreached
            );
        }
    }
    for s in &study.scenes {
        for Row { level, policy, time, spp, .. } in &s.rows {
            for (i, m) in Metric::ALL.into_iter().enumerate() {
                let cell = |r: Option<Ratio>| match r {
                    None => ",".to_owned(),
                    Some(Ratio::Exactly(v)) => format!("{v},exact"),
                    Some(Ratio::AtMost(v)) => format!("{v},at-most"),
                    Some(Ratio::Unreached(v)) => format!("{v},unreached"),
                };
                let unreached = u8::from(matches!(time[i], Some(Ratio::Unreached(_))));
                let _ = writeln!(
                    out,
                    "{},{level},{},{},{},{},{unreached}",
                    s.runs.name,
                    policy.name(),
                    m.short(),
                    cell(time[i]),
                    cell(spp[i])
                );
            }
        }
    }
    out
}
