//! The plot: time of a query against accuracy (or agreement).

use crate::plot::{Anchor, BLACK, COLOURS, Canvas, DOWN, FAINT, GREY, marker, thousands};
use sparing_svm::tradeoff::{Point, Source, Tradeoff};

/// Size of the drawing; the legend has the right part for itself.
const SIZE: [f64; 2] = [760.0, 460.0];
const LEFT: f64 = 64.0;
const RIGHT: f64 = 560.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 404.0;
/// Percentage points below the best that the axis shows at most; what is worse stands at its foot.
const SHOWN: f64 = 4.0;

/// Draws the plot.
pub(super) fn draw(t: &Tradeoff) -> Canvas {
    let all: Vec<&Point> = std::iter::once(&t.full).chain(&t.points).collect();
    let axes = Axes::new(&all);
    let mut canvas = Canvas::new(SIZE);
    axes.draw(&mut canvas, t);
    let mut methods: Vec<&str> = Vec::new();
    for point in &t.points {
        if !methods.contains(&point.method.as_str()) {
            methods.push(&point.method);
        }
    }
    let mut row = TOP + 10.0;
    let mut entry = |canvas: &mut Canvas, text: String| {
        canvas.text([RIGHT + 46.0, row + 4.0], 12.0, Anchor::Start, false, text);
        row += 20.0;
        [RIGHT + 28.0, row - 20.0]
    };
    for (i, method) in methods.iter().enumerate().filter(|(_, m)| **m != "certified") {
        let colour = COLOURS[i % COLOURS.len()];
        let of_method: Vec<&Point> = t.points.iter().filter(|p| p.method == *method).collect();
        let places: Vec<[f64; 2]> = of_method.iter().map(|p| axes.place(p)).collect();
        // Only between points that are both shown: lines along the foot would say nothing.
        for (pair, ends) in places.windows(2).zip(of_method.windows(2)) {
            if !ends.iter().any(|p| axes.below(p)) {
                canvas.line(pair.to_vec(), 1.3, None, colour);
            }
        }
        for (place, point) in places.iter().zip(&of_method) {
            marker(&mut canvas, *place, if axes.below(point) { DOWN } else { i }, colour);
        }
        let at = entry(&mut canvas, (*method).to_owned());
        canvas.line(vec![[at[0] - 14.0, at[1]], [at[0] + 12.0, at[1]]], 1.3, None, colour);
        marker(&mut canvas, at, i, colour);
    }
    front(&mut canvas, &axes, &all);
    if let Some(certified) = t.points.iter().find(|p| p.method == "certified") {
        star(&mut canvas, axes.place(certified), 4);
        let at = entry(&mut canvas, "certified cascade".to_owned());
        star(&mut canvas, at, 4);
    }
    star(&mut canvas, axes.place(&t.full), 5);
    let at = entry(&mut canvas, format!("full: {} vectors", thousands(t.full.vectors)));
    star(&mut canvas, at, 5);
    let at = entry(&mut canvas, "Pareto front".to_owned());
    canvas.line(vec![[at[0] - 14.0, at[1]], [at[0] + 12.0, at[1]]], 1.2, Some([5.0, 3.0]), BLACK);
    if all.iter().any(|p| axes.below(p)) {
        let at = entry(&mut canvas, "below the axis".to_owned());
        marker(&mut canvas, at, DOWN, GREY);
    }
    entry(&mut canvas, "(numbers: vectors)".to_owned());
    numbers(&mut canvas, &axes, &all);
    canvas
}

struct Axes {
    /// Logarithm of nanoseconds.
    x: [f64; 2],
    /// Per cent.
    y: [f64; 2],
    step: f64,
}

impl Axes {
    fn new(all: &[&Point]) -> Self {
        let times = all.iter().map(|p| p.ns_per_query.max(0.1).log10());
        let (lo, hi) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        let scores = || all.iter().map(|p| p.score() * 100.0);
        let best = scores().fold(0.0, f64::max);
        // The axis begins a little below the worst machine that comes near the best one.
        let near = scores().filter(|s| best - s <= SHOWN);
        let worst = near.fold(best, f64::min);
        let step =
            [0.1, 0.2, 0.5, 1.0, 2.0, 5.0].into_iter().find(|s| (best - worst) / s <= 8.0).unwrap_or(10.0);
        let low = ((worst / step - 0.2).floor() * step).max(0.0);
        let high = (best / step + 0.3).ceil() * step;
        Self { x: [lo - 0.1, hi + 0.12], y: [low, high], step }
    }

    fn x(&self, ns: f64) -> f64 {
        let t = (ns.max(0.1).log10() - self.x[0]) / (self.x[1] - self.x[0]);
        LEFT + t * (RIGHT - LEFT)
    }

    fn y(&self, percent: f64) -> f64 {
        BOTTOM - (percent.max(self.y[0]) - self.y[0]) / (self.y[1] - self.y[0]) * (BOTTOM - TOP)
    }

    fn below(&self, p: &Point) -> bool {
        p.score() * 100.0 < self.y[0]
    }

    /// Where a point stands; at the foot of the axis if it is worse.
    fn place(&self, p: &Point) -> [f64; 2] {
        let y = self.y(p.score() * 100.0);
        [self.x(p.ns_per_query), if self.below(p) { y - 6.0 } else { y }]
    }

    fn draw(&self, canvas: &mut Canvas, t: &Tradeoff) {
        let count = ((self.y[1] - self.y[0]) / self.step).round() as usize;
        for i in 0..=count {
            let value = self.y[0] + i as f64 * self.step;
            let y = self.y(value);
            canvas.line(vec![[LEFT, y], [RIGHT, y]], 0.8, None, FAINT);
            let digits = usize::from(self.step < 1.0);
            canvas.text([LEFT - 7.0, y + 4.2], 12.0, Anchor::End, false, format!("{value:.digits$}"));
        }
        for decade in self.x[0].floor() as i32..=self.x[1].ceil() as i32 {
            for m in 1..10 {
                let ns = 10.0_f64.powi(decade) * f64::from(m);
                let x = self.x(ns);
                if !(LEFT..=RIGHT).contains(&x) {
                    continue;
                }
                let narrow = self.x[1] - self.x[0] < 2.2;
                let labelled = m == 1 || (narrow && (m == 2 || m == 5));
                if m == 1 {
                    canvas.line(vec![[x, TOP], [x, BOTTOM]], 0.8, None, FAINT);
                }
                canvas.line(
                    vec![[x, BOTTOM], [x, BOTTOM + if labelled { 6.0 } else { 3.5 }]],
                    0.9,
                    None,
                    BLACK,
                );
                if labelled {
                    canvas.text([x, BOTTOM + 20.0], 12.0, Anchor::Middle, false, time(ns));
                }
            }
        }
        canvas.line(vec![[LEFT, TOP], [LEFT, BOTTOM], [RIGHT, BOTTOM]], 1.0, None, BLACK);
        let middle = [0.5 * (LEFT + RIGHT), BOTTOM + 44.0];
        canvas.text(middle, 13.0, Anchor::Middle, false, "time per query (ns, one thread, log scale)");
        let title = match t.source {
            Source::Data => "accuracy on held-out rows (%)",
            Source::Samples => "agreement with the full machine (%), sampled queries",
        };
        canvas.text([18.0, 0.5 * (TOP + BOTTOM)], 13.0, Anchor::Middle, true, title);
    }
}

/// The front as steps: a score is had from its point's time on.
fn front(canvas: &mut Canvas, axes: &Axes, all: &[&Point]) {
    let mut best: Vec<&&Point> = all.iter().filter(|p| p.pareto && !axes.below(p)).collect();
    best.sort_by(|a, b| a.ns_per_query.total_cmp(&b.ns_per_query));
    let mut steps: Vec<[f64; 2]> = Vec::new();
    for point in best {
        let [x, y] = axes.place(point);
        if let Some(last) = steps.last().copied() {
            steps.push([x, last[1]]);
        }
        steps.push([x, y]);
    }
    if let (Some(first), Some(last)) = (steps.first().copied(), steps.last().copied()) {
        steps.insert(0, [first[0], BOTTOM]);
        steps.push([RIGHT, last[1]]);
        canvas.line(steps, 1.2, Some([5.0, 3.0]), BLACK);
    }
}

/// Numbers of vectors above the points of the front, where there is room.
fn numbers(canvas: &mut Canvas, axes: &Axes, all: &[&Point]) {
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for point in
        all.iter().filter(|p| p.pareto && p.method != "full" && p.method != "certified" && !axes.below(p))
    {
        let [x, y] = axes.place(point);
        if taken.iter().all(|t| (t[0] - x).abs() > 26.0 || (t[1] - y).abs() > 13.0) {
            taken.push([x, y]);
            canvas.text([x, y - 8.0], 10.0, Anchor::Middle, false, point.vectors.to_string());
        }
    }
}

/// A black star with so many points.
fn star(canvas: &mut Canvas, [x, y]: [f64; 2], points: usize) {
    let outline = (0..2 * points).map(|i| {
        let a = i as f64 / points as f64 * std::f64::consts::PI;
        let r = if i % 2 == 0 { 7.5 } else { 3.2 };
        [x + r * a.sin(), y - r * a.cos()]
    });
    canvas.area(outline.collect(), BLACK, [255, 255, 255]);
}

fn time(ns: f64) -> String {
    if ns >= 1.0 { thousands(ns.round() as usize) } else { format!("{ns:.1}") }
}
