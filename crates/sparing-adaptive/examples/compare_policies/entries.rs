//! What is compared.

use crate::errors::Errors;
use crate::rule::{Pool, Rule, Step, Unit};
use sparing_adaptive::goal::Goal;
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{Band, Barrier, Decisions, Planned, Policy, Svm, Threshold};

/// Makes a policy for a goal.
type Make = Box<dyn Fn(Goal) -> Box<dyn Policy>>;

/// A policy and what was found of it.
pub struct Entry {
    pub name: String,
    pub make: Make,
    /// Whether averages of samples are its knob, and not thresholds.
    pub averages: bool,
    /// Most samples of a pixel, if not those of the comparison.
    pub cap: Option<u32>,
    /// Logarithms of relative spp, a row a scene.
    pub logs: Vec<[f64; 4]>,
    /// At about 32 samples on average, one a scene.
    pub biases: Vec<f64>,
    /// Errors at each knob, of the scene at hand.
    pub curve: Vec<Errors>,
}

impl Entry {
    fn new(name: &str, make: Make) -> Self {
        Self {
            name: name.to_owned(),
            make,
            averages: false,
            cap: None,
            logs: Vec::new(),
            biases: Vec::new(),
            curve: Vec::new(),
        }
    }

    fn rule(name: &str, set: impl Fn(&mut Rule) + 'static) -> Self {
        let make = move |goal| {
            let mut rule = Rule::new(goal);
            set(&mut rule);
            Box::new(rule) as Box<dyn Policy>
        };
        Self::new(name, Box::new(make))
    }

    fn capped(cap: u32) -> Self {
        let name = format!("threshold, at most {cap}");
        Self { cap: Some(cap), ..Self::new(&name, Box::new(|g| Box::new(Threshold::new(g)))) }
    }

    /// The same for averages of samples in place of thresholds.
    pub fn by_average(self) -> Self {
        Self { name: format!("{}, by average", self.name), averages: true, ..self }
    }
}

/// What is always compared: the pooled rule, which others are compared with, and the plan alone.
pub fn base() -> Vec<Entry> {
    vec![
        Entry::new("threshold", Box::new(|g| Box::new(Threshold::new(g)))),
        Entry::new("planned", Box::new(|goal| Box::new(Planned { goal }))),
    ]
}

/// What was tried of rules, by the name of the group.
pub fn tries(group: &str, max_spp: u32) -> Result<Vec<Entry>, String> {
    let pool = |name: &str, pool: Pool| Entry::rule(name, move |r| r.pool = pool);
    let unit = |name: &str, unit: Unit| Entry::rule(name, move |r| r.unit = unit);
    let step = |name: &str, step: Step| Entry::rule(name, move |r| r.step = step);
    Ok(match group {
        "pooling" => vec![
            pool("3x3", Pool::Square(1)),
            pool("5x5", Pool::Square(2)),
            pool("7x7", Pool::Square(3)),
            pool("largest of 3x3", Pool::Largest),
            pool("3x3, same shapes", Pool::SameShapes(1)),
            pool("3x3, alike surfaces", Pool::Alike(1)),
            pool("5x5, alike surfaces", Pool::Alike(2)),
        ],
        "units" => vec![
            unit("larger of luminance and CIEDE2000", Unit::Both),
            unit("luminance", Unit::Luminance),
            unit("CIEDE2000", Unit::Perceived),
            unit("XYZ", Unit::Xyz),
        ],
        "layers" => vec![
            step("times 3/2 and 4/3", Step::Half),
            step("times 2", Step::Double),
            step("times 4", Step::Quadruple),
        ],
        "cures" => {
            let own = |name: &str, own: f32, pool: Pool| {
                Entry::rule(name, move |r| (r.plan, r.own, r.pool) = (false, own, pool))
            };
            vec![
                own("larger of own and 3x3", 1.0, Pool::Square(1)),
                own("own as one of 3x3", 0.0, Pool::Square(1)),
                own("own as one of 5x5", 0.0, Pool::Square(2)),
                own("own as one of 7x7", 0.0, Pool::Square(3)),
                own("largest of 3x3", 0.0, Pool::Largest),
                Entry::rule("plan and spreading", |_| ()),
                Entry::rule("the same, own counts 1", |r| r.own = 1.0),
                Entry::rule("the same, own counts 2", |r| r.own = 2.0),
            ]
        }
        "powers" => [1.0, 0.9, 0.8, 0.7]
            .map(|power| Entry::rule(&format!("spread / n^{power}"), move |r| r.power = power))
            .into(),
        "budget" => {
            let caps = (0..4).map(|k| max_spp >> k);
            caps.map(Entry::capped).chain([base().swap_remove(0).by_average()]).collect()
        }
        _ => {
            return Err(format!(
                "'{group}' is not a group: use cures, pooling, units, layers, powers or budget"
            ));
        }
    })
}

/// The machine of a file, in a band that may follow the name: `MODEL@STOP,GO_ON`. Several joined by `+`: one a layer.
pub fn machine(name: &str) -> Result<Entry, Box<dyn std::error::Error>> {
    let (paths, band) = name.split_once('@').unwrap_or((name, ""));
    let machines = paths.split('+').map(Machine::read).collect::<Result<Vec<_>, _>>()?;
    let band = match band.split_once(',') {
        Some((stop, go_on)) => Band { stop: stop.parse()?, go_on: go_on.parse()? },
        None => Band::default(),
    };
    let make = move |goal| {
        let svm = |m: &Machine| {
            let mut svm = Svm::new(goal, m.clone());
            svm.band = band;
            svm
        };
        Box::new(LayerMachines(machines.iter().map(svm).collect())) as Box<dyn Policy>
    };
    Ok(Entry::new(name, Box::new(make)))
}

/// One machine a doubling of the minimum, the last for all later ones.
struct LayerMachines(Vec<Svm>);

impl Policy for LayerMachines {
    fn name(&self) -> &'static str {
        "svm"
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let mut all: Vec<Decisions> = self.0.iter_mut().map(|svm| svm.decide(barrier)).collect();
        let last = all.len() - 1;
        let layer = |count: u32| (count / barrier.bounds.min_spp.max(1)).max(1).ilog2() as usize;
        let pixels = barrier.view().pixels.iter().enumerate();
        let targets = pixels.map(|(i, p)| all[layer(p.count).min(last)].targets[i]).collect();
        Decisions { targets, ..all.swap_remove(last) }
    }
}
