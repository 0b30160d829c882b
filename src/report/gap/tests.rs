//! The page of every outcome, from one made-up record.
#![allow(clippy::unwrap_used)]

use hydro_effects::Id;
use hydro_gap::{
    records::{
        Added, Channel, Found, HeatMap, Horizon, Hypothesis, Named, Overlay, Record, Refitted,
        Verified,
    },
    verdict::{
        Bias, Calibration, FittedEffect, FittedParameter, Gap, Outcome, Patch, Place, Regime,
        SCHEMA, SensorGap, SensorPatch, Verdict,
    },
};

use super::{headline, page};

fn effect(
    effect: Id,
    target: &str,
    probability: f64,
    parameters: &[(&str, f64, &str)],
) -> FittedEffect {
    FittedEffect {
        effect,
        target: target.to_owned(),
        probability,
        surrogate: false,
        explained: None,
        parameters: parameters
            .iter()
            .map(|(name, value, unit)| FittedParameter {
                name: (*name).to_owned(),
                value: *value,
                unit: (*unit).to_owned(),
                ci95: [value - 0.1 * value.abs(), value + 0.15 * value.abs()],
                by_trial: Default::default(),
            })
            .collect(),
    }
}

fn calibration() -> Calibration {
    let row = |truth: &str, part: f64| (truth.to_owned(), part);
    Calibration {
        alarm_level: 0.03,
        alarm: 0.01,
        confusion: [
            ("added_mass".to_owned(), [row("added_mass", 0.95)].into()),
            ("payload".to_owned(), [row("added_mass", 0.05)].into()),
        ]
        .into(),
    }
}

/// A vehicle of `sensors` sensors in `trials` trials that lacks added mass.
pub(super) fn record(sensors: usize, trials: usize) -> Record {
    let name = |index: usize| match index {
        0 => "imu_gyro".to_owned(),
        1 => "dvl_velocity_in_the_frame_of_the_hull".to_owned(),
        2 => "attitude".to_owned(),
        n => format!("joint_{n}_position"),
    };
    let trial = |index: usize| format!("trial_{index:02}_amplitude_ladder.npz");
    let wave = |seed: usize, i: usize| ((seed * 37 + i * 11) as f64 * 0.13).sin();
    let heat_maps = (0..trials)
        .map(|t| {
            let windows = 16 + 3 * (t % 4);
            HeatMap {
                trial: trial(t),
                edges: (0..=windows).map(|i| i as f64).collect(),
                sensors: (0..sensors)
                    .map(|s| {
                        let value = |i: usize| {
                            let size = (3.0 - 0.4 * s as f64).max(0.0) * (1.0 + wave(s + t, i));
                            (s != 5 || !i.is_multiple_of(7)).then_some(10f64.powf(size * 0.6))
                        };
                        (name(s), (0..windows).map(value).collect())
                    })
                    .collect(),
            }
        })
        .collect();
    let chosen = vec![effect(
        Id::AddedMass,
        "hull",
        0.993,
        &[
            ("surge", 12.3, "kg"),
            ("sway", 31.0, "kg"),
            ("yaw_inertia", -0.012, "kg m^2"),
            ("factor", 1.02, "1"),
        ],
    )];
    let mut effects = chosen.clone();
    effects.push(effect(Id::Payload, "hull", 0.02, &[("mass", 1.2, "kg")]));
    effects.push(effect(
        Id::ActuatorLag,
        "thruster_starboard_vertical",
        0.006,
        &[("time", 0.05, "s")],
    ));
    let places = vec![
        Place {
            trial: trial(0),
            sensor: name(0),
            t_start: 3.0,
            t_end: 5.0,
            share: 0.34,
            p_value: 0.0005,
        },
        Place {
            trial: trial(1),
            sensor: name(1),
            t_start: 7.0,
            t_end: 8.0,
            share: 0.12,
            p_value: 0.01,
        },
    ];
    let regime = vec![
        Regime {
            rule: "speed > 0.3 and acceleration > 0.5".into(),
            share: 0.71,
            samples: 0.18,
        },
        Regime {
            rule: "command reversal".into(),
            share: 0.44,
            samples: 0.21,
        },
    ];
    let by_sensor = (0..sensors)
        .map(|s| (name(s), 0.5f64.powi(s as i32 + 1)))
        .collect();
    let gap = Gap {
        metric: "nrmse".into(),
        before: Some(0.421),
        after: Some(0.0763),
        reduction: Some(0.819),
        ci95: Some([0.74, 0.88]),
        n_holdout_trials: trials.min(4),
        per_sensor: (0..sensors)
            .map(|s| {
                let before = 0.5 / (s + 1) as f64;
                (
                    name(s),
                    SensorGap {
                        before,
                        after: before * 0.2,
                        reduction: 0.8,
                        ci95: [0.7, 0.85],
                    },
                )
            })
            .collect(),
    };
    let samples = 1000;
    let time: Vec<f64> = (0..samples).map(|i| i as f64 * 0.02).collect();
    let overlays = (0..trials.min(4))
        .flat_map(|t| {
            let time = time.clone();
            (0..sensors).flat_map(move |s| {
                let time = time.clone();
                (0..if s < 2 { 3 } else { 1 }).map(move |component| {
                    let truth = |i: usize| {
                        (time[i] * (1.0 + 0.3 * component as f64) + s as f64).sin() * 0.4
                    };
                    let noisy = |i: usize| truth(i) + 0.02 * (i as f64 * 12.9898).sin();
                    Overlay {
                        trial: trial(t),
                        sensor: name(s),
                        component,
                        unit: if s == 0 { "rad/s".into() } else { "m/s".into() },
                        time: time.clone(),
                        measured: (0..samples)
                            .map(|i| (!(300..340).contains(&i)).then(|| noisy(i)))
                            .collect(),
                        before: (0..samples)
                            .map(|i| {
                                (i % 100 != 99).then(|| truth(i) * (1.0 + 0.006 * (i % 100) as f64))
                            })
                            .collect(),
                        after: (0..samples)
                            .map(|i| {
                                (i % 100 != 99)
                                    .then(|| truth(i) * (1.0 + 0.0006 * (i % 100) as f64))
                            })
                            .collect(),
                    }
                })
            })
        })
        .collect();
    let sensor_patch: std::collections::BTreeMap<_, _> = [
        (
            "depth".to_owned(),
            SensorPatch {
                bias: Bias::Scalar(0.02),
                ..SensorPatch::none(1)
            },
        ),
        (
            "imu_gyro".to_owned(),
            SensorPatch {
                bias: Bias::Vector(vec![0.01, -0.02, 0.0]),
                scale: 1.03,
                delay: 0.04,
            },
        ),
    ]
    .into();
    Record {
        model: "mjcf/vehicle.xml".into(),
        command: "hydro gap run --model mjcf/vehicle.xml --trials data/trials --out out".into(),
        found: Found {
            schema: "hydro-gap-find/1".into(),
            fit_trials: (4..trials.max(5)).map(trial).collect(),
            held_out_trials: (0..trials.min(4)).map(trial).collect(),
            medium: Default::default(),
            channels: (0..sensors)
                .map(|s| Channel {
                    sensor: name(s),
                    component: 0,
                    unit: "m/s".into(),
                    noise: 0.012,
                    declared_noise: (s % 2 == 0).then_some(0.01),
                })
                .collect(),
            segment: 2.0,
            excess: 14.2,
            p_value: 0.0004,
            by_sensor,
            places: places.clone(),
            regime: regime.clone(),
            heat_maps,
            remarks: vec!["`depth` has no noise in the MJCF: 0.012 m was estimated from still samples.".into()],
        },
        named: Named {
            schema: "hydro-gap-name/1".into(),
            outcome: Outcome::Named,
            stand_ins: vec![],
            chosen: chosen.clone(),
            effects: effects.clone(),
            confusion_set: vec![],
            next_experiment: None,
            ranking: (0..12)
                .map(|i| Hypothesis {
                    effects: match i {
                        0 => vec![(Id::AddedMass, "hull".into())],
                        1 => vec![(Id::AddedMass, "hull".into()), (Id::ActuatorLag, "thruster_1".into())],
                        2 => vec![],
                        _ => vec![(Id::ALL[i], "hull".into())],
                    },
                    log_evidence: 412.0 - 20.0 * i as f64,
                    probability: if i == 0 { 0.97 } else { 0.03 / 2f64.powi(i as i32) },
                    unexplained: 0.02 * i as f64,
                    refitted: i < 4,
                })
                .collect(),
            nuisances: vec![("mass of hull".into(), 1.012, 0.021), ("gain of thruster_1".into(), 0.98, 0.01)],
            explained: Some(0.979),
            calibration: calibration(),
            remarks: vec![],
        },
        added: Some(Added {
            schema: "hydro-gap-add/1".into(),
            effects: chosen.clone(),
            sensors: sensor_patch.clone(),
            cross_fit: vec![],
            own: None,
            recalibrated: vec![],
            commands_before: 0.0,
            bootstrap: vec![(Id::AddedMass, "hull".into(), {
                let mut again = chosen[0].parameters.clone();
                again[0].ci95 = [9.0, 16.0];
                again
            })],
            numbers: vec![Refitted {
                what: "hull.mass".into(),
                from: 25.0,
                to: 24.6,
                unit: "kg".into(),
                deviation: 0.11,
            }],
            model: Some("patched.xml".into()),
            diff: "--- vehicle.xml\n+++ patched.xml\n@@ -3,4 +3,9 @@\n <mujoco>\n-  <option timestep=\"0.002\"/>\n\
                   +  <option timestep=\"0.002\" integrator=\"implicitfast\"/>\n+  <extension><plugin \
                   plugin=\"hydro.wrench\"><instance name=\"hydro\"><config key=\"effects\" value='{\"schema\": \
                   \"hydro-effects/1\", \"effects\": []}'/></instance></plugin></extension>\n </mujoco>\n"
                .into(),
            remarks: vec![],
        }),
        verified: Some(Verified {
            schema: "hydro-gap-verify/1".into(),
            gap: gap.clone(),
            horizons: [(0.5, 0.2), (1.0, 0.33), (2.0, 0.42)]
                .into_iter()
                .map(|(seconds, before)| Horizon { seconds, before, after: before * 0.19, ci95: [0.7, 0.88] })
                .collect(),
            overlays,
            accepted: true,
            refused_because: None,
            contradicted: false,
            recalibrated: None,
            cross_fitted: false,
            remarks: vec![],
        }),
        verdict: Verdict {
            schema: SCHEMA.into(),
            verdict: Outcome::Named,
            named: vec![Id::AddedMass],
            medium: Default::default(),
            effects,
            explained: Some(0.979),
            unexplained: Some(0.021),
            calibration: calibration(),
            confusion_set: vec![],
            next_experiment: None,
            places,
            regime,
            gap,
            verified: true,
            contradicted: false,
            doubts: Vec::new(),
            refused_because: None,
            patch: Some(Patch { model: "patched.xml".into(), sensors: sensor_patch, stand_ins: vec![] }),
        },
        seconds: [("find", 11.2), ("name", 21.0), ("add", 8.0), ("verify", 3.4)]
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
    }
}

fn nothing_held_out() -> Gap {
    Gap {
        metric: "nrmse".into(),
        before: None,
        after: None,
        reduction: None,
        ci95: None,
        n_holdout_trials: 0,
        per_sensor: [].into(),
    }
}

/// One record an outcome, by name.
fn outcomes() -> Vec<(&'static str, Record)> {
    let base = || record(3, 5);
    let named = base();
    let mut pair = base();
    pair.verdict.named.push(Id::QuadraticDrag);
    pair.verdict.effects.insert(
        1,
        effect(
            Id::QuadraticDrag,
            "hull",
            0.97,
            &[("surge", 40.0, "N s^2/m^2")],
        ),
    );
    pair.verdict.confusion_set = vec![Id::Current, Id::ConstantForce];
    pair.named.chosen = pair.verdict.effects[..2].to_vec();
    let mut single = base();
    single.verified = None;
    single.verdict.verified = false;
    single.verdict.gap = nothing_held_out();
    (single.verdict.named, single.verdict.patch) = (vec![], None);
    single.verdict.refused_because = Some("there is one trial only".into());
    let mut refused = base();
    refused.verdict.verified = false;
    (refused.verdict.named, refused.verdict.patch) = (vec![], None);
    refused.verdict.refused_because = Some("`depth` gets worse by 4 % (95 %: 2.5 to 6 %)".into());
    let mut contradicted = refused.clone();
    contradicted.verdict.verdict = Outcome::Unknown;
    contradicted.verdict.contradicted = true;
    (
        contradicted.verdict.gap.reduction,
        contradicted.verdict.gap.ci95,
    ) = (Some(-0.4), Some([-0.7, -0.1]));
    (contradicted.verdict.effects.iter_mut()).for_each(|effect| effect.surrogate = true);
    let mut confusable = base();
    confusable.verdict.verdict = Outcome::Confusable;
    confusable.verdict.named = vec![];
    confusable.verdict.confusion_set = vec![Id::AddedMass, Id::Payload];
    confusable.verdict.effects[1].probability = 0.48;
    confusable.verdict.next_experiment =
        Some("static tilt: hold the vehicle at 20 degrees of roll for 10 s".into());
    confusable.verdict.gap = nothing_held_out();
    (confusable.verdict.verified, confusable.verdict.patch) = (false, None);
    (confusable.added, confusable.verified) = (None, None);
    let mut no_gap = confusable.clone();
    no_gap.verdict.verdict = Outcome::NoGap;
    (no_gap.verdict.confusion_set, no_gap.verdict.next_experiment) = (vec![], None);
    (no_gap.verdict.effects, no_gap.named.chosen) = (vec![], vec![]);
    (no_gap.verdict.places, no_gap.verdict.regime) = (vec![], vec![]);
    let mut unknown = no_gap.clone();
    unknown.verdict.verdict = Outcome::Unknown;
    unknown.verdict.effects = vec![effect(
        Id::LinearDrag,
        "hull",
        0.6,
        &[("surge", 4.0, "N s/m")],
    )];
    unknown.verdict.effects[0].surrogate = true;
    let mut residual = unknown.clone();
    residual.verdict.verified = true;
    residual.verdict.gap = named.verdict.gap.clone();
    residual.verdict.patch = named.verdict.patch.clone();
    let mut tried = residual.clone();
    (tried.verdict.verified, tried.verdict.patch) = (false, None);
    tried.verdict.refused_because = Some("`depth` gets worse by 4 %.".into());
    let mut not_offered = unknown.clone();
    not_offered.verdict.refused_because =
        Some("a learned residual needs a free joint; not offered".into());
    vec![
        ("named", named),
        ("pair", pair),
        ("single", single),
        ("refused", refused),
        ("confusable", confusable),
        ("no_gap", no_gap),
        ("unknown", unknown),
        ("residual", residual),
        ("tried", tried),
        ("not offered", not_offered),
        ("contradicted", contradicted),
    ]
}

/// The page is written so that an XML parser reads it too: every tag is closed, every name escaped.
fn well_formed(html: &str) {
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..Default::default()
    };
    let tree = roxmltree::Document::parse_with_options(html, options);
    let tree = tree.unwrap_or_else(|error| panic!("{error}"));
    let names = ["script", "img", "link", "iframe", "b1", "object"];
    for node in tree.descendants().filter(roxmltree::Node::is_element) {
        assert!(
            !names.contains(&node.tag_name().name()),
            "{:?}",
            node.tag_name()
        );
        for attribute in node.attributes() {
            assert!(!attribute.name().starts_with("on"), "{attribute:?}");
            assert!(
                !["src", "href"].contains(&attribute.name()),
                "{attribute:?}"
            );
        }
    }
}

#[test]
fn every_outcome_has_its_own_honest_sentence() {
    let said: Vec<String> = outcomes()
        .iter()
        .map(|(name, record)| {
            format!(
                "{name}: {}",
                headline(&record.verdict, &record.named.chosen)
            )
        })
        .collect();
    let expected = [
        "named: The nominal model lacks added mass on `hull` (probability 0.99); adding it, with the numbers of the \
         nominal refitted, cuts the error on 4 held-out trials by 82 % (95 %: 74 to 88 %). It explains 98 % of the excess over \
         noise; 2.1 % is left.",
        "pair: The nominal model lacks added mass on `hull` (probability 0.99) and quadratic drag on `hull` \
         (0.97); adding them, with the numbers of the nominal refitted, cuts the error on 4 held-out trials by 82 % (95 %: 74 to 88 %). They explain 98 % of the excess over noise; 2.1 % is left. A further part is a \
         water current or a constant force: the data cannot tell.",
        "single: The nominal model lacks added mass on `hull` (probability 0.99); no trial could be held out, so \
         no reduction of the error is claimed and nothing was added. It explains 98 % of the excess over noise; 2.1 % is left.",
        "refused: The fit asks for added mass on `hull` (probability 0.99), but the held-out trials refuse it: \
         `depth` gets worse by 4 % (95 %: 2.5 to 6 %); nothing was added.",
        "confusable: The nominal model lacks added mass or a payload on `hull`, but the data cannot tell which; \
         nothing was added.",
        "no_gap: No gap: simulation and measurement agree within sensor noise and the uncertainty of the nominal \
         model.",
        "unknown: Something is missing that no effect of the catalogue explains with plausible values; the nearest, linear drag on \
         `hull`, would only stand in for it; nothing was added.",
        "residual: Something is missing that no effect of the catalogue explains with plausible values; the nearest, linear drag on \
         `hull`, would only stand in for it. A learned residual was added, which is no name: it cuts the error on \
         4 held-out trials by 82 % (95 %: 74 to 88 %).",
        "tried: Something is missing that no effect of the catalogue explains with plausible values; the nearest, linear drag on \
         `hull`, would only stand in for it. A learned residual was tried, but the held-out trials refuse it: \
         `depth` gets worse by 4 %; nothing was added.",
        "not offered: Something is missing that no effect of the catalogue explains with plausible values; the nearest, linear drag on \
         `hull`, would only stand in for it; nothing was added.",
        "contradicted: Simulation and measurement disagree, and nothing can be named: what fits best, added mass on `hull` \
         (probability 0.99), raises the error on 4 held-out trials by 40 % (95 %: \u{2212}70 to \u{2212}10 %); nothing was added.",
    ];
    assert_eq!(said, expected);
}

/// The patched model holds the likeliest of an undecided part, alone or beside what is named.
#[test]
fn what_stands_for_an_undecided_part_is_said() {
    let patch = |record: &Record| {
        let mut patch = record.verdict.patch.clone().unwrap();
        patch.stand_ins = vec![Id::Current];
        Some(patch)
    };
    let mut all = outcomes();
    let (_, mut pair) = all.swap_remove(1);
    let (_, named) = &all[0];
    pair.verdict.patch = patch(named);
    let said = headline(&pair.verdict, &pair.named.chosen);
    assert!(
        said.ends_with("the data cannot tell; the patched model holds a water current for it."),
        "{said}"
    );
    let (_, mut open) = outcomes().swap_remove(4);
    (open.verdict.patch, open.verdict.gap) = (patch(named), named.verdict.gap.clone());
    let said = headline(&open.verdict, &[]);
    assert!(
        said.ends_with("adding a water current, the likeliest, cuts the error on 4 held-out trials by 82 % (95 %: 74 to 88 %)."),
        "{said}"
    );
    (open.verdict.patch, open.verdict.refused_because) = (None, Some("it got worse".into()));
    let said = headline(&open.verdict, &[]);
    assert!(said.ends_with("nothing was added: it got worse."), "{said}");
}

#[test]
fn a_target_is_said_once_only_where_it_is_that_of_all() {
    let (_, mut record) = outcomes().swap_remove(4);
    let said = |record: &Record| headline(&record.verdict, &[]);
    // Of one of the set nothing but its name is known.
    record.verdict.confusion_set.push(Id::SensorScale);
    assert!(
        said(&record).contains("added mass on `hull`, a payload on `hull` or a sensor scale, but"),
        "{}",
        said(&record)
    );
    record.verdict.confusion_set = vec![Id::AddedMass];
    let mut other = record.verdict.effects[0].clone();
    other.target = "fin".into();
    record.verdict.effects.push(other);
    assert!(
        said(&record).contains("added mass, but the data cannot tell on which of `hull` and `fin`"),
        "{}",
        said(&record)
    );
}

#[test]
fn where_it_sits_may_be_open_where_that_it_is_missing_is_not() {
    let mut record = record(3, 5);
    let chosen = record.named.chosen[..1].to_vec();
    let mut here = chosen[0].clone();
    here.probability = 0.6;
    let mut there = here.clone();
    (there.target, there.probability) = ("calf".into(), 0.398);
    let mut nowhere = here.clone();
    (nowhere.target, nowhere.probability) = ("thigh".into(), 0.002);
    record.verdict.effects = vec![here.clone(), there, nowhere];
    let said = headline(&record.verdict, &[here.clone()]);
    assert!(
        said.contains("or `calf` (probability above 0.99)"),
        "{said}"
    );
    assert!(!said.contains("thigh"), "{said}");
    // Sets with it on both bodies: not here or there, but here, and perhaps there too.
    let mut sure = here.clone();
    sure.probability = 0.99;
    let mut too = sure.clone();
    (too.target, too.probability) = ("calf".into(), 0.3);
    record.verdict.effects = vec![sure.clone(), too];
    let said = headline(&record.verdict, &[sure]);
    assert!(!said.contains("or `calf`"), "{said}");
    // Another effect there does not hide that this one may be there.
    let mut there = here.clone();
    (there.target, there.probability) = ("calf".into(), 0.398);
    let other = effect(Id::Payload, "calf", 1.0, &[]);
    record.verdict.effects = vec![other.clone(), here.clone(), there];
    let said = headline(&record.verdict, &[here, other]);
    assert!(said.contains("or `calf`"), "{said}");
    // One hypothesis on two thrusters has an entry each: its probability must not count twice.
    let lag = |target: &str, p: f64| effect(Id::ActuatorLag, target, p, &[]);
    let one = lag("thruster_1", 0.6);
    record.verdict.effects = vec![one.clone(), lag("thruster_2", 0.3), lag("thruster_3", 0.3)];
    let said = headline(&record.verdict, &[one]);
    assert!(
        said.contains("on `thruster_1` (probability 0.60)"),
        "{said}"
    );
}

#[test]
fn every_outcome_is_a_well_formed_page_and_survives_its_files() {
    for (name, record) in outcomes() {
        let html = page(&record);
        well_formed(&html);
        let text = serde_json::to_string(&record).unwrap();
        // Not `assert_eq`: a difference would print thousands of numbers.
        assert!(
            serde_json::from_str::<Record>(&text).unwrap() == record,
            "{name}"
        );
        for outside in ["http://", "https://"] {
            let inside = html.replace("http://www.w3.org/2000/svg", "");
            assert!(!inside.contains(outside), "{name}");
        }
        // For eyes: HYDRO_PAGES=/tmp/pages cargo test report::gap
        if let Some(folder) = std::env::var_os("HYDRO_PAGES") {
            std::fs::write(
                std::path::Path::new(&folder).join(format!("{name}.html")),
                html,
            )
            .unwrap();
        }
    }
}

#[test]
fn numbers_of_the_nominal_stand_beside_the_diff() {
    let html = page(&record(3, 5));
    let table = html
        .split("Numbers of the nominal that were refitted")
        .nth(1)
        .expect("there is a table");
    for part in ["<code>hull.mass</code>", ">25<", ">24.6<", ">0.11<", ">kg<"] {
        assert!(table.contains(part), "{part}");
    }
    let mut old = serde_json::to_value(&record(3, 5).added).expect("it is written");
    old.as_object_mut().expect("a record").remove("numbers");
    let old: Added = serde_json::from_value(old).expect("an old file is read");
    assert!(old.numbers.is_empty());
}

#[test]
fn a_large_record_stays_a_small_page() {
    let record = record(14, 10);
    let html = page(&record);
    well_formed(&html);
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    if let Some(folder) = std::env::var_os("HYDRO_PAGES") {
        std::fs::write(std::path::Path::new(&folder).join("large.html"), html).unwrap();
    }
}

#[test]
fn names_of_people_are_text_and_never_tags() {
    let evil = "<script>alert(\"1\")</script>&`'\u{0}";
    let text = serde_json::to_string(&record(3, 5)).unwrap();
    let mut tree: serde_json::Value = serde_json::from_str(&text).unwrap();
    // Every text of the record but ids and outcomes.
    fn poison(value: &mut serde_json::Value, key: &str, evil: &str) {
        match value {
            serde_json::Value::String(text) => {
                let id = Id::ALL.iter().any(|id| id.as_str() == text);
                if !id && !["verdict", "outcome", "medium"].contains(&key) {
                    *text = format!("{evil}{text}");
                }
            }
            serde_json::Value::Array(items) => {
                items.iter_mut().for_each(|item| poison(item, key, evil))
            }
            serde_json::Value::Object(map) => {
                for (key, item) in map.iter_mut() {
                    poison(item, key, evil);
                }
                if ["sensors", "per_sensor", "by_sensor", "seconds"].contains(&key) {
                    let old = std::mem::take(map);
                    map.extend(
                        old.into_iter()
                            .map(|(name, item)| (format!("{evil}{name}"), item)),
                    );
                }
            }
            _ => {}
        }
    }
    poison(&mut tree, "", evil);
    let record: Record = serde_json::from_value(tree).unwrap();
    let html = page(&record);
    well_formed(&html);
    assert!(!html.contains("<script"));
    assert!(html.contains("&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&amp;"));
}

#[test]
fn numbers_that_are_none_leave_a_page() {
    let mut record = record(3, 5);
    record.verdict.gap.reduction = Some(f64::NAN);
    record.verdict.gap.ci95 = Some([f64::NEG_INFINITY, f64::INFINITY]);
    record.verdict.effects[0].parameters[0].value = f64::NAN;
    record.verdict.effects[0].probability = f64::NAN;
    record.found.heat_maps[0].edges = vec![];
    record.found.heat_maps[1].edges = vec![0.0, f64::INFINITY, f64::NAN];
    if let Some(verified) = &mut record.verified {
        verified.horizons[0].before = f64::INFINITY;
        verified.overlays[0].time = vec![];
        verified.overlays[1].before = vec![Some(1e300), Some(-1e300)];
    }
    if let Some(added) = &mut record.added {
        added.effects[0].parameters[1].ci95 = [f64::NAN, f64::NAN];
    }
    let html = page(&record);
    well_formed(&html);
    for word in ["NaN", ">inf", " inf", "\"inf", "-inf"] {
        let at = html.find(word).unwrap_or(html.len());
        assert_eq!(
            at,
            html.len(),
            "{:?}",
            html[at.saturating_sub(80)..].get(..120)
        );
    }
}

#[test]
fn what_refitting_alone_does_is_said_where_it_is_known() {
    let outcomes = outcomes();
    let (_, record) = outcomes.iter().find(|(name, _)| *name == "named").unwrap();
    let mut record = record.clone();
    assert!(!page(&record).contains("refitted alone"));
    let before = record.verdict.gap.before.unwrap();
    record.verified.as_mut().unwrap().recalibrated = Some(0.4 * before);
    assert!(
        page(&record).contains("refitted alone, without an addition, they cut the error by 60 %")
    );
}

#[test]
fn shares_of_noise_are_not_shown() {
    let loud = page(&record(12, 5));
    assert!(loud.contains("of the excess</th>") && loud.contains("class=\"place\""));
    assert!(
        loud.contains("<summary>4 more</summary>"),
        "eight sensors of twelve are open"
    );
    let mut quiet = record(12, 5);
    for map in &mut quiet.found.heat_maps {
        for value in map.sensors.values_mut().flatten().flatten() {
            *value = 1.0;
        }
    }
    (quiet.verdict.places, quiet.verdict.regime) = (Vec::new(), Vec::new());
    quiet.found.p_value = 0.01;
    let html = page(&quiet);
    well_formed(&html);
    for absent in ["of the excess</th>", "class=\"place\"", "class=\"h1\""] {
        assert!(!html.contains(absent), "{absent}");
    }
    assert!(html.contains("adds up to more than chance"));
    quiet.found.p_value = 0.6;
    assert!(!page(&quiet).contains("adds up to more than chance"));
}

#[test]
fn what_is_of_first_order_says_so_and_confusions_stand_below() {
    let mut tried = record(3, 2);
    tried.named.ranking.truncate(6);
    let html = page(&tried);
    let sets = html.split("Sets that were tried").nth(1).unwrap();
    let sets = sets.split("<h2>").next().unwrap();
    // Two of the six.
    assert_eq!(sets.matches(">first order</span>").count(), 2);
    let confusions = sets.split("tell them apart?").nth(1).unwrap();
    for part in [
        "where added_mass is true",
        "95\u{a0}%",
        "payload",
        "look as much like a gap",
    ] {
        assert!(
            confusions.replace("95 %", "95\u{a0}%").contains(part),
            "{part}: {confusions}"
        );
    }
}

#[test]
fn what_the_effects_explain_and_what_is_left_stands_in_the_sentence() {
    let mut record = record(3, 2);
    record.verdict.effects[0].explained = Some(0.979);
    let said = headline(&record.verdict, &record.named.chosen);
    assert!(
        said.contains("It explains 98 % of the excess over noise; 2.1 % is left."),
        "{said}"
    );
    record.verdict.explained = None;
    assert!(!headline(&record.verdict, &record.named.chosen).contains("explains"));
}
