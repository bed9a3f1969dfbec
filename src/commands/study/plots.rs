//! Log-log plots: error over time in each scene, and in all scenes together.

use super::plan::{Plan, PolicyName};
use super::record::Metric;
use super::results::Study;
use crate::plot::{Anchor, BLACK, COLOURS, Canvas, Colour, FAINT, GREY, WHITE, marker};
use sparing_image::atomic::OutputError;

/// Size of one plot, and where its axes are.
const SIZE: [f64; 2] = [440.0, 340.0];
const LEFT: f64 = 70.0;
const RIGHT: f64 = 424.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 286.0;

/// The drawings as SVG, to be shown in the page.
pub(super) struct Plots {
    pub(super) summary: String,
    /// For each scene, in the order of [`Metric::ALL`].
    pub(super) scenes: Vec<Vec<String>>,
}

/// One line of a plot.
struct Series {
    policy: PolicyName,
    points: Vec<[f64; 2]>,
    /// Whether the points are renders, to be marked.
    marked: bool,
}

struct Chart<'a> {
    title: String,
    axes: [&'a str; 2],
    series: Vec<Series>,
    /// Where dashed lines cross.
    cross: Vec<[f64; 2]>,
}

pub(super) fn write(plan: &Plan, study: &Study) -> Result<Plots, OutputError> {
    let summary = summary(study);
    crate::plot::write(&summary, &plan.folder.join("summary.svg"), &plan.folder.join("summary.png"))?;
    let mut plots = Plots { summary: summary.to_svg(), scenes: Vec::new() };
    for scene in &study.scenes {
        let mut of_scene = Vec::new();
        for metric in Metric::ALL {
            let runs = &scene.runs;
            let series = study.policies.iter().map(|&policy| Series {
                policy,
                points: runs.of(policy).map(|r| [r.seconds(runs.clock), metric.of(r)]).collect(),
                marked: true,
            });
            let uniform = runs.time_curve(PolicyName::Uniform, metric);
            let cross = study.levels.iter().filter_map(|n| {
                let seconds = runs.uniform_seconds(f64::from(*n));
                Some([seconds, uniform.error_at(seconds)?])
            });
            let chart = Chart {
                title: format!("{}: {}", runs.name, metric.title()),
                axes: [&format!("{} (s)", study.time_name()), metric.title()],
                series: series.collect(),
                cross: cross.collect(),
            };
            let mut canvas = Canvas::new(SIZE);
            chart.draw(&mut canvas, 0.0);
            let name = format!("{}-{}", runs.name, metric.short());
            let file = |e: &str| plan.folder.join("plots").join(format!("{name}.{e}"));
            crate::plot::write(&canvas, &file("svg"), &file("png"))?;
            of_scene.push(canvas.to_svg());
        }
        plots.scenes.push(of_scene);
    }
    Ok(plots)
}

/// Steps of the relative time in the summary, a factor of two.
const STEPS: i32 = 4;

/// All scenes in one: time and error over those of uniform sampling at the first level, geometric means. A time at which
/// some scene was not measured is left out.
fn summary(study: &Study) -> Canvas {
    let panels = [Metric::RelMse, Metric::P99];
    let mut canvas = Canvas::new([SIZE[0] * panels.len() as f64, SIZE[1]]);
    let Some(level) = study.levels.first().map(|n| f64::from(*n)) else { return canvas };
    for (i, metric) in panels.into_iter().enumerate() {
        let series = study.policies.iter().map(|&policy| {
            let at = |t: f64| -> Option<[f64; 2]> {
                let mut sum = 0.0;
                for scene in &study.scenes {
                    let runs = &scene.runs;
                    let seconds = runs.uniform_seconds(level);
                    let base = runs.time_curve(PolicyName::Uniform, metric).error_at(seconds)?;
                    let error = runs.time_curve(policy, metric).error_at(seconds * t)?;
                    sum += (error / base).ln();
                }
                Some([t, (sum / study.scenes.len() as f64).exp()])
            };
            let times = (-6 * STEPS..=8 * STEPS).map(|k| (f64::from(k) / f64::from(STEPS)).exp2());
            Series { policy, points: times.filter_map(at).collect(), marked: false }
        });
        let x = format!("{} / uniform's at {level} spp", study.time_name());
        let chart = Chart {
            title: format!("{}, {}", metric.title(), study.mean_of()),
            axes: [&x, "error / uniform's"],
            series: series.collect(),
            cross: vec![[1.0, 1.0]],
        };
        chart.draw(&mut canvas, i as f64 * SIZE[0]);
    }
    canvas
}

/// A logarithmic axis: from value to place.
struct Axis {
    values: [f64; 2],
    places: [f64; 2],
}

impl Axis {
    /// Around these values, with some room.
    fn new(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let usable = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let room = (0.06 * (high - low)).max(0.1);
        Self { values: [low - room, high + room], places }
    }

    fn place(&self, value: f64) -> f64 {
        let t = (value.log10() - self.values[0]) / (self.values[1] - self.values[0]);
        self.places[0] + t * (self.places[1] - self.places[0])
    }

    /// Values with a tick, and whether they have a number.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = self.values[1] - self.values[0];
        let digits = if decades < 1.6 { &[1, 2, 5][..] } else { &[1][..] };
        let all = (self.values[0].floor() as i32..=self.values[1].ceil() as i32)
            .flat_map(|d| (1..10).map(move |m| (d, m)));
        all.map(|(d, m)| (f64::from(m) * 10.0_f64.powi(d), digits.contains(&m)))
            .filter(|(v, _)| (self.values[0]..=self.values[1]).contains(&v.log10()))
            .collect()
    }
}

fn number(value: f64) -> String {
    if value >= 0.9999 {
        format!("{value:.0}")
    } else {
        format!("{value:.*}", (-value.log10() - 1e-9).ceil() as usize)
    }
}

impl Chart<'_> {
    /// Draws it with its left edge at `x0`.
    fn draw(&self, canvas: &mut Canvas, x0: f64) {
        let [left, right] = [x0 + LEFT, x0 + RIGHT];
        let points = || self.series.iter().flat_map(|s| &s.points);
        let x = Axis::new(points().map(|p| p[0]), [left, right]);
        let y = Axis::new(points().map(|p| p[1]), [BOTTOM, TOP]);
        for (value, labelled) in x.ticks() {
            let at = x.place(value);
            if labelled {
                canvas.line(vec![[at, TOP], [at, BOTTOM]], 0.8, None, FAINT);
                canvas.text([at, BOTTOM + 18.0], 12.0, Anchor::Middle, false, number(value));
            }
            canvas.line(
                vec![[at, BOTTOM], [at, BOTTOM + if labelled { 5.0 } else { 3.0 }]],
                0.9,
                None,
                BLACK,
            );
        }
        for (value, labelled) in y.ticks() {
            let at = y.place(value);
            if labelled {
                canvas.line(vec![[left, at], [right, at]], 0.8, None, FAINT);
                canvas.text([left - 8.0, at + 4.0], 12.0, Anchor::End, false, number(value));
            }
            canvas.line(vec![[left - if labelled { 5.0 } else { 3.0 }, at], [left, at]], 0.9, None, BLACK);
        }
        for [cx, cy] in &self.cross {
            let (px, py) = (x.place(*cx), y.place(*cy));
            canvas.line(vec![[left, py], [right, py]], 0.9, Some([4.0, 3.0]), GREY);
            canvas.line(vec![[px, TOP], [px, BOTTOM]], 0.9, Some([4.0, 3.0]), GREY);
        }
        canvas.line(vec![[left, TOP], [left, BOTTOM], [right, BOTTOM]], 1.0, None, BLACK);
        for series in &self.series {
            self.draw_series(canvas, series, &x, &y);
        }
        self.legend(canvas, right);
        canvas.text([0.5 * (left + right), TOP - 14.0], 13.0, Anchor::Middle, false, self.title.clone());
        canvas.text([0.5 * (left + right), BOTTOM + 40.0], 12.5, Anchor::Middle, false, self.axes[0]);
        canvas.text([x0 + 18.0, 0.5 * (TOP + BOTTOM)], 12.5, Anchor::Middle, true, self.axes[1]);
    }

    fn draw_series(&self, canvas: &mut Canvas, series: &Series, x: &Axis, y: &Axis) {
        let shown = series.points.iter().filter(|p| p.iter().all(|v| *v > 0.0 && v.is_finite()));
        let mut places: Vec<[f64; 2]> = shown.map(|p| [x.place(p[0]), y.place(p[1])]).collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (kind, colour) = look(series.policy);
        if places.len() > 1 {
            canvas.line(places.clone(), 1.6, None, colour);
        }
        if series.marked {
            places.iter().for_each(|p| marker(canvas, *p, kind, colour));
        }
    }

    /// In the upper right corner: curves go from the upper left to the lower right.
    fn legend(&self, canvas: &mut Canvas, right: f64) {
        let left = right - 112.0;
        let bottom = TOP + 3.0 + 17.0 * self.series.len() as f64;
        let corners = [[left - 5.0, TOP + 2.0], [right, TOP + 2.0], [right, bottom], [left - 5.0, bottom]];
        canvas.area(corners.to_vec(), WHITE, WHITE);
        for (i, series) in self.series.iter().enumerate() {
            let at = TOP + 12.0 + 17.0 * i as f64;
            let (kind, colour) = look(series.policy);
            canvas.line(vec![[left, at], [left + 24.0, at]], 1.6, None, colour);
            if series.marked {
                marker(canvas, [left + 12.0, at], kind, colour);
            }
            canvas.text([left + 31.0, at + 4.0], 12.0, Anchor::Start, false, series.policy.name());
        }
    }
}

/// A policy looks the same in all plots.
fn look(policy: PolicyName) -> (usize, Colour) {
    let kind = match policy {
        PolicyName::Threshold => 0,
        PolicyName::HalfBuffer => 1,
        PolicyName::Svm => 2,
        PolicyName::Planned => 4,
        PolicyName::Shapes => 5,
        PolicyName::Uniform => return (3, [70, 70, 70]),
    };
    (kind, COLOURS[kind])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_they_need() {
        let all = [1e-5, 0.002, 0.05, 0.1, 0.5, 1.0, 20.0, 1000.0].map(number);
        assert_eq!(all, ["0.00001", "0.002", "0.05", "0.1", "0.5", "1", "20", "1000"]);
    }

    #[test]
    fn axes_stand_for_any_values() {
        for values in [&[][..], &[1.0], &[0.0, f64::NAN], &[1e-9, 1e9]] {
            let axis = Axis::new(values.iter().copied(), [0.0, 100.0]);
            assert!(axis.values[0] < axis.values[1] && !axis.ticks().is_empty());
        }
        let axis = Axis::new([1.0, 100.0].into_iter(), [0.0, 100.0]);
        assert!((axis.place(10.0) - 50.0).abs() < 1e-9);
    }
}
