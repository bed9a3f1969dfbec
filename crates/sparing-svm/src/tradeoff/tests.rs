use super::*;
use crate::prune::testing::machine;

fn options() -> TradeoffOptions {
    TradeoffOptions {
        methods: ["drop", "greedy", "kmeans-fit"].map(|m| m.parse().unwrap()).to_vec(),
        sizes: vec![8, 24, 1000],
        seed: 5,
        certified: true,
    }
}

#[test]
fn a_model_alone_gives_agreement_but_no_accuracy() {
    let model = machine(120, 3, 2.0, 10.0, 3);
    let mut calls = Vec::new();
    let t = tradeoff(&model, None, &options(), &mut |p| {
        calls.push(p.next.to_owned());
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!((t.source, t.fit_rows, t.measured_rows), (Source::Samples, SAMPLES[0], SAMPLES[1]));
    assert_eq!(calls.len(), 8);
    assert_eq!(t.points.len(), 7, "sizes above the model's are left out: {:?}", t.skipped);
    let certified = t.points.last().unwrap();
    assert_eq!((certified.method.as_str(), certified.flips, certified.agreement), ("certified", 0, 1.0));
    assert!(t.full.quality.is_none() && t.full.flips == 0);
    assert!(t.points.iter().any(|p| p.pareto) || t.full.pareto);
    let csv = t.to_csv();
    assert_eq!(csv.lines().count(), 9);
    assert!(csv.lines().all(|l| l.split(',').count() == 11), "{csv}");
    let json: serde_json::Value = serde_json::from_str(&t.to_json().unwrap()).unwrap();
    assert_eq!(json["source"], "samples");
    assert!(json["full"].get("accuracy").is_none() && json["full"].get("rendered_error").is_none());
    let picked = t.pick_loss(3.0).unwrap();
    assert!(picked.agreement >= 0.97 && picked.model.is_some());
    assert!(t.pick_size(8).unwrap().vectors <= 8);
    assert!(t.pick_size(2).is_none() && t.pick_loss(-5.0).is_none());
}

#[test]
fn labelled_data_gives_accuracy_of_rows_not_fitted() {
    let model = machine(120, 3, 2.0, 10.0, 4);
    let rows = samples::queries(&model, 2000, 9);
    let labels: Vec<f64> =
        rows.chunks(3).map(|x| if model.decision_value(x) > 0.1 { 1.0 } else { -1.0 }).collect();
    let data = Labelled { rows: &rows, labels: &labels };
    let t = tradeoff(&model, Some(data), &options(), &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!((t.source, t.fit_rows, t.measured_rows), (Source::Data, 1000, 1000));
    let quality = t.full.quality.unwrap();
    assert!(quality.accuracy > 0.8 && quality.auc.unwrap() > 0.99);
    let mut with_column = t.clone();
    with_column.points[0].rendered_error = Some(1.5);
    assert!(with_column.to_csv().lines().all(|l| l.split(',').count() == 12));
    let json: serde_json::Value = serde_json::from_str(&t.to_json().unwrap()).unwrap();
    assert!(json["points"][0]["accuracy"].is_number());
}

#[test]
fn bad_data_says_where() {
    let model = machine(30, 2, 2.0, 10.0, 4);
    let run = |rows: &[f64], labels: &[f64]| {
        tradeoff(&model, Some(Labelled { rows, labels }), &options(), &mut |_| ControlFlow::Continue(()))
            .unwrap_err()
            .to_string()
    };
    assert!(run(&[0.0; 6], &[1.0, -1.0, 3.0]).contains("row 3"), "{}", run(&[0.0; 6], &[1.0, -1.0, 3.0]));
    assert!(run(&[0.0, 0.0, f64::NAN, 0.0], &[1.0, -1.0]).contains("row 2"));
    assert!(run(&[0.0; 5], &[1.0, -1.0]).contains("2 rows"));
    assert!(run(&[0.0; 2], &[1.0]).contains("row"));
    let stop = tradeoff(&model, None, &options(), &mut |_| ControlFlow::Break(()));
    assert_eq!(stop.unwrap_err(), PruneError::Stopped);
}
