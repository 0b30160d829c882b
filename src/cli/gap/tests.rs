//! Going on, changed inputs, a stop, damage and strangers' files, with stages that only count.
#![allow(clippy::unwrap_used)]

use std::{
    cell::RefCell,
    fs,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use clap::Parser as _;
use hydro_effects::Id;
use hydro_gap::{
    Watch,
    records::{Added, Found, Named, Verified},
    verdict::{FittedEffect, FittedParameter, Gap, Outcome},
};

use super::{
    candidate::Candidate,
    flags::Flags,
    inputs::Inputs,
    pipeline::{self, Reached, Stage, Stages},
    results_folder::{Folder, provenance},
    session, terminal,
};

fn found() -> Found {
    Found {
        schema: "hydro-gap-find/1".into(),
        fit_trials: vec!["a".into()],
        held_out_trials: vec!["b".into()],
        medium: Default::default(),
        channels: vec![],
        segment: 2.0,
        // Not exact in decimal: it must survive the file to the last bit.
        excess: 0.1 + 0.2,
        p_value: 1e-3,
        by_sensor: [].into(),
        places: vec![],
        regime: vec![],
        heat_maps: vec![],
        remarks: vec![],
    }
}

fn added_mass() -> FittedEffect {
    FittedEffect {
        effect: Id::AddedMass,
        target: "hull\u{1b}[2J".into(),
        probability: 0.98,
        surrogate: false,
        explained: None,
        parameters: vec![FittedParameter {
            name: "surge".into(),
            value: 3.0,
            unit: "kg".into(),
            ci95: [2.5, 3.5],
            by_trial: Default::default(),
        }],
    }
}

fn named() -> Named {
    Named {
        schema: "hydro-gap-name/1".into(),
        outcome: Outcome::Named,
        stand_ins: vec![],
        chosen: vec![added_mass()],
        effects: vec![added_mass()],
        confusion_set: vec![],
        next_experiment: None,
        ranking: vec![],
        nuisances: vec![],
        explained: None,
        calibration: Default::default(),
        remarks: vec![],
    }
}

fn candidate() -> Candidate {
    Candidate {
        added: Added {
            schema: "hydro-gap-add/1".into(),
            effects: vec![added_mass()],
            sensors: [].into(),
            bootstrap: vec![],
            cross_fit: vec![],
            own: None,
            recalibrated: vec![],
            commands_before: 0.0,
            numbers: vec![],
            model: Some("patched.xml".into()),
            diff: String::new(),
            remarks: vec![],
        },
        xml: Some("<mujoco/>".into()),
        residual: vec![],
    }
}

fn verified(accepted: bool) -> Verified {
    Verified {
        schema: "hydro-gap-verify/1".into(),
        gap: Gap {
            metric: "nrmse".into(),
            before: Some(0.5),
            after: Some(0.1),
            reduction: Some(0.8),
            ci95: Some([0.7, 0.9]),
            n_holdout_trials: 1,
            per_sensor: [].into(),
        },
        horizons: vec![],
        overlays: vec![],
        accepted,
        refused_because: (!accepted).then(|| "`depth` gets worse".into()),
        contradicted: false,
        recalibrated: None,
        cross_fitted: false,
        remarks: vec![],
    }
}

/// A model, three trials, and stages that write down that they ran.
struct Fake {
    root: tempfile::TempDir,
    ran: RefCell<Vec<&'static str>>,
    stop: AtomicBool,
    stops_in: Option<&'static str>,
    accepted: bool,
    named: fn() -> Named,
    candidate: fn() -> Candidate,
}

impl Fake {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("nominal.xml"), "<mujoco/>").unwrap();
        fs::create_dir(root.path().join("trials")).unwrap();
        for name in ["a", "b", "c"] {
            fs::write(root.path().join(format!("trials/{name}.csv")), "time\n").unwrap();
        }
        Self {
            root,
            ran: RefCell::default(),
            stop: AtomicBool::new(false),
            stops_in: None,
            accepted: true,
            named,
            candidate,
        }
    }

    fn out(&self) -> std::path::PathBuf {
        self.root.path().join("out")
    }

    fn flags(&self, more: &[&str]) -> Flags {
        #[derive(clap::Parser)]
        struct Command {
            #[command(flatten)]
            flags: Flags,
        }
        let path = |name: &str| self.root.path().join(name).display().to_string();
        let given = [
            "gap".to_owned(),
            "--model".to_owned(),
            path("nominal.xml"),
            "--trials".to_owned(),
            path("trials"),
            "--out".to_owned(),
            path("out"),
        ];
        let all = given
            .into_iter()
            .chain(more.iter().map(|s| (*s).to_owned()));
        Command::try_parse_from(all).unwrap().flags
    }

    fn run(&self, until: Stage, more: &[&str]) -> anyhow::Result<Reached> {
        self.ran.take();
        let step = |name: &'static str| {
            self.ran.borrow_mut().push(name);
            if self.stops_in == Some(name) {
                self.stop.store(true, Ordering::Relaxed);
                anyhow::bail!("the library stopped");
            }
            Ok(())
        };
        let stages = Stages {
            find: Box::new(|_| step("find").map(|()| found())),
            name: Box::new(|_, _| step("name").map(|()| (self.named)())),
            add: Box::new(|_, _, _| step("add").map(|()| Some((self.candidate)()))),
            verify: Box::new(|input, _| {
                if let Some(candidate) = input.candidate {
                    assert_eq!(fs::read_to_string(candidate).unwrap(), "<mujoco/>");
                }
                assert_eq!(input.candidate.is_some(), (self.candidate)().xml.is_some());
                step("verify").map(|()| Some(verified(self.accepted)))
            }),
        };
        let watch = Watch {
            stop: &self.stop,
            tell: &|_, _, _| {},
        };
        let flags = self.flags(more);
        let mut folder = session::open(&flags)?;
        let note =
            |inputs: &mut Inputs| inputs.note_held_out(&hydro_gap::trial::list(&flags.trials)?);
        pipeline::run(&mut folder, &stages, until, &watch, note)
    }

    fn ran(&self) -> Vec<&'static str> {
        self.ran.borrow().clone()
    }

    fn fault(&self, more: &[&str]) -> String {
        format!("{:#}", self.run(Stage::Verify, more).unwrap_err())
    }

    fn held_out(&self) -> String {
        let known = provenance::<Inputs>(&self.out()).unwrap().unwrap();
        known.inputs.held_out_trials().remove(0)
    }
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_stage_that_is_there_does_not_run_again() {
    let fake = Fake::new();
    assert!(matches!(
        fake.run(Stage::Name, &[]).unwrap(),
        Reached::Named(_)
    ));
    assert_eq!(fake.ran(), ["find", "name"]);
    let Reached::Verdict(first) = fake.run(Stage::Verify, &[]).unwrap() else {
        panic!("no verdict");
    };
    assert_eq!(fake.ran(), ["add", "verify"]);
    assert_eq!(
        names(&fake.out()),
        [
            "add.json",
            "candidate.xml",
            "find.json",
            "name.json",
            "patched.xml",
            "report.html",
            "run.json",
            "timing.json",
            "verdict.json",
            "verify.json"
        ]
    );
    let page = fs::read(fake.out().join("report.html")).unwrap();
    let Reached::Verdict(second) = fake.run(Stage::Verify, &[]).unwrap() else {
        panic!("no verdict");
    };
    assert_eq!(fake.ran(), [""; 0]);
    assert!(
        first == second,
        "what was read back differs from what was computed"
    );
    assert_eq!(page, fs::read(fake.out().join("report.html")).unwrap());
}

#[test]
fn an_earlier_stage_that_runs_again_takes_the_later_ones_along() {
    let fake = Fake::new();
    fake.run(Stage::Verify, &[]).unwrap();
    fs::remove_file(fake.out().join("name.json")).unwrap();
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["name", "add", "verify"]);
    fs::remove_file(fake.out().join("candidate.xml")).unwrap();
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["add", "verify"]);
}

/// Nothing that the catalogue explains.
fn unknown() -> Named {
    let mut named = named();
    named.outcome = Outcome::Unknown;
    named.effects = named.chosen.split_off(0);
    named.effects[0].surrogate = true;
    named
}

fn with_residual() -> Candidate {
    let mut made = candidate();
    made.added.effects = vec![];
    made.residual = vec![
        ("residual/weights.safetensors", b"numbers".to_vec()),
        ("residual/card.json", b"{}".to_vec()),
    ];
    made
}

fn not_offered() -> Candidate {
    let mut made = candidate();
    (made.added.effects, made.added.model, made.xml) = (vec![], None, None);
    made.added.remarks = vec!["a learned residual needs a free joint; not offered".into()];
    made
}

/// A drag of which the data tell one axis is shown by that axis.
#[test]
fn values_of_which_the_data_tell_nothing_are_counted() {
    let shown = |intervals: &[[f64; 2]]| {
        let mut effect = added_mass();
        let of = |(at, ci95): (usize, &[f64; 2])| FittedParameter {
            name: format!("axis_{at}"),
            value: (ci95[0] + ci95[1]) / 2.0,
            ci95: *ci95,
            ..effect.parameters[0].clone()
        };
        effect.parameters = intervals.iter().enumerate().map(of).collect();
        let Reached::Verdict(mut record) = Fake::new().run(Stage::Verify, &[]).unwrap() else {
            panic!("no verdict");
        };
        record.named.chosen = vec![effect];
        let text = terminal::ten_lines(&record, Path::new("out"));
        let line = text.lines().find(|line| line.contains("values"));
        line.map_or(String::new(), |line| line.trim().to_owned())
    };
    let text = shown(&[[0.0, 18.0], [9.0, 19.0], [-1.0, 1.0], [-4.0, -2.0]]);
    assert_eq!(
        text,
        "values  axis_1 14 kg (9 to 19), axis_3 −3 kg (−4 to −2); of 2 more the interval holds 0"
    );
    let text = shown(&[[-1.0, 1.0], [0.0, 2.0]]);
    assert_eq!(
        text,
        "values  axis_1 1 kg (0 to 2); of 1 more the interval holds 0"
    );
}

#[test]
fn an_effect_in_two_places_says_whose_the_values_are() {
    let Reached::Verdict(mut record) = Fake::new().run(Stage::Verify, &[]).unwrap() else {
        panic!("no verdict");
    };
    let mut fore = record.named.chosen[0].clone();
    (fore.target, fore.explained) = ("fore".to_owned(), Some(0.4));
    fore.parameters.truncate(1);
    let aft = FittedEffect {
        target: "aft".to_owned(),
        ..fore.clone()
    };
    let mut other = record.named.chosen[0].clone();
    (other.effect, other.explained) = (Id::Current, Some(0.3));
    record.named.chosen = vec![fore.clone(), aft.clone()];
    record.verdict.effects = vec![fore.clone(), aft, other];
    (record.verdict.explained, record.verdict.unexplained) = (Some(0.9), Some(0.1));
    let text = terminal::ten_lines(&record, Path::new("out"));
    let line = |what: &str| {
        let mut lines = text.lines();
        let line = lines.find(|line| line.trim_start().starts_with(what));
        line.unwrap_or_default().to_owned()
    };
    let name = hydro_plugin::report::gap::effect_name(fore.effect);
    for target in ["fore", "aft"] {
        assert!(
            line("values").contains(&format!("{name} on `{target}`: ")),
            "{text}"
        );
    }
    // The part of both is told once.
    assert!(
        line("explained").contains(&format!("40 % alone by {name} in 2 places")),
        "{text}"
    );
    assert_eq!(line("explained").matches("alone by").count(), 2, "{text}");
}

#[test]
fn a_learned_residual_is_added_without_a_name_or_not_at_all() {
    let mut fake = Fake::new();
    (fake.named, fake.candidate) = (unknown, with_residual);
    let Reached::Verdict(record) = fake.run(Stage::Verify, &[]).unwrap() else {
        panic!("no verdict");
    };
    let verdict = &record.verdict;
    assert_eq!(verdict.verdict, Outcome::Unknown);
    assert!(verdict.named.is_empty() && verdict.verified && verdict.patch.is_some());
    let text = terminal::ten_lines(&record, &fake.out());
    assert!(
        text.contains("A learned residual was added") && text.contains("patched.xml"),
        "{text}"
    );
    assert_eq!(
        names(&fake.out().join("residual")),
        ["card.json", "weights.safetensors"]
    );
    // Without its weights the candidate is of no use.
    fs::remove_file(fake.out().join("residual/weights.safetensors")).unwrap();
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["add", "verify"]);
    // Held-out trials refuse it: the candidate stays, nothing is added.
    fs::remove_file(fake.out().join("verify.json")).unwrap();
    fake.accepted = false;
    let Reached::Verdict(record) = fake.run(Stage::Verify, &[]).unwrap() else {
        panic!("no verdict");
    };
    assert!(!fake.out().join("patched.xml").exists() && record.verdict.patch.is_none());
    let text = terminal::ten_lines(&record, &fake.out());
    assert!(
        text.contains("learned residual was tried") && text.contains("gets worse"),
        "{text}"
    );
    // Asked to leave it out, or where it cannot be offered, nothing of it stays.
    let text = fake.fault(&["--no-residual"]);
    assert!(
        text.contains("--no-residual is given, it was not given"),
        "{text}"
    );
    fake.candidate = not_offered;
    let Reached::Verdict(record) = fake
        .run(Stage::Verify, &["--overwrite", "--no-residual"])
        .unwrap()
    else {
        panic!("no verdict");
    };
    let left = names(&fake.out());
    assert!(!left.contains(&"residual".to_owned()) && !left.contains(&"candidate.xml".to_owned()));
    let text = terminal::ten_lines(&record, &fake.out());
    assert!(text.contains("needs a free joint; not offered"), "{text}");
    assert!(!record.verdict.verified && record.verdict.named.is_empty());
}

#[test]
fn a_stop_keeps_what_was_finished() {
    let mut fake = Fake::new();
    fake.stops_in = Some("add");
    let text = fake.fault(&[]);
    assert!(text.contains("interrupted in `add`"), "{text}");
    assert_eq!(
        names(&fake.out()),
        ["find.json", "name.json", "run.json", "timing.json"]
    );
    // Asked before anything: nothing runs.
    let text = fake.fault(&[]);
    assert!(
        text.contains("interrupted in `add`") && fake.ran().is_empty(),
        "{text}"
    );
    fake.stops_in = None;
    fake.stop.store(false, Ordering::Relaxed);
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["add", "verify"]);
}

#[test]
fn other_inputs_are_named_and_refused_until_told_to_start_anew() {
    let fake = Fake::new();
    fake.run(Stage::Verify, &[]).unwrap();
    let text = fake.fault(&["--seed", "7", "--holdout", "0.5", "--medium", "air"]);
    for word in [
        "--medium differs",
        "--seed is 7, it was 0",
        "--holdout is 0.5, it was 0.25",
        "--overwrite",
    ] {
        assert!(text.contains(word), "{text}");
    }
    fs::write(
        fake.root.path().join("nominal.xml"),
        "<mujoco model=\"b\"/>",
    )
    .unwrap();
    fs::write(fake.root.path().join("trials/d.csv"), "time\n").unwrap();
    let text = fake.fault(&[]);
    assert!(
        text.contains("nominal.xml has changed") && text.contains("trial `d` is new"),
        "{text}"
    );
    assert!(fake.out().join("patched.xml").exists() && fake.ran().is_empty());
    fake.run(Stage::Find, &["--overwrite"]).unwrap();
    assert_eq!(names(&fake.out()), ["find.json", "run.json", "timing.json"]);
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["name", "add", "verify"]);
}

#[test]
fn an_included_file_belongs_to_the_model() {
    let fake = Fake::new();
    let model = "<mujoco><include file=\"part.xml\"/></mujoco>";
    fs::write(fake.root.path().join("nominal.xml"), model).unwrap();
    fs::write(fake.root.path().join("part.xml"), "<mujoco/>").unwrap();
    fake.run(Stage::Find, &[]).unwrap();
    fs::write(fake.root.path().join("part.xml"), "<mujoco model=\"b\"/>").unwrap();
    let text = fake.fault(&[]);
    assert!(text.contains("nominal.xml has changed"), "{text}");
}

#[test]
fn a_held_out_file_may_be_away_until_verify() {
    let fake = Fake::new();
    fake.run(Stage::Find, &[]).unwrap();
    let path = fake
        .root
        .path()
        .join(format!("trials/{}.csv", fake.held_out()));
    fs::remove_file(&path).unwrap();
    fake.run(Stage::Add, &[]).unwrap();
    assert_eq!(fake.ran(), ["name", "add"]);
    fs::write(&path, "time\n0\n").unwrap();
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["verify"]);
    // From then on it counts.
    fs::write(&path, "time\n0\n1\n").unwrap();
    let text = fake.fault(&[]);
    assert!(text.contains("the file of held-out trial"), "{text}");
}

#[test]
fn a_trial_that_changes_is_named() {
    let fake = Fake::new();
    fake.run(Stage::Find, &[]).unwrap();
    let held_out = fake.held_out();
    let name = ["a", "b", "c"]
        .into_iter()
        .find(|name| *name != held_out)
        .unwrap();
    fs::write(
        fake.root.path().join(format!("trials/{name}.csv")),
        "time\n0\n",
    )
    .unwrap();
    let text = fake.fault(&[]);
    assert!(
        text.contains(&format!("the file of trial `{name}` has changed")),
        "{text}"
    );
}

#[test]
fn files_of_other_people_are_never_overwritten() {
    for name in ["patched.xml", "report.html", "verdict.json"] {
        // In a folder that this program never saw.
        let fake = Fake::new();
        fs::create_dir(fake.out()).unwrap();
        fs::write(fake.out().join(name), "mine").unwrap();
        for more in [&[][..], &["--overwrite"]] {
            let text = fake.fault(more);
            assert!(text.contains(name) && fake.ran().is_empty(), "{text}");
        }
        // Changed after this program wrote it.
        let fake = Fake::new();
        fake.run(Stage::Verify, &[]).unwrap();
        fs::write(fake.out().join(name), "mine").unwrap();
        for more in [&[][..], &["--overwrite"], &["--seed", "3", "--overwrite"]] {
            let text = fake.fault(more);
            assert!(
                text.contains(name) && text.contains("not overwritten"),
                "{text}"
            );
            assert_eq!(fs::read(fake.out().join(name)).unwrap(), b"mine");
            assert!(fake.out().join("find.json").exists() && fake.ran().is_empty());
        }
    }
}

#[test]
fn a_damaged_file_is_named_and_what_to_do() {
    let fake = Fake::new();
    fake.run(Stage::Verify, &[]).unwrap();
    for text in ["{\"schema\": \"hydro-gap-name/1\"", "{}", "\u{0}"] {
        fs::write(fake.out().join("name.json"), text).unwrap();
        let text = fake.fault(&[]);
        assert!(
            text.contains("name.json is damaged; delete it and the stage `name` runs again"),
            "{text}"
        );
    }
    let mut other = named();
    other.schema = "hydro-gap-name/9".into();
    fs::write(
        fake.out().join("name.json"),
        serde_json::to_string(&other).unwrap(),
    )
    .unwrap();
    let text = fake.fault(&[]);
    assert!(
        text.contains("hydro-gap-name/9") && text.contains("hydro-gap-name/1"),
        "{text}"
    );
    fs::remove_file(fake.out().join("name.json")).unwrap();
    fake.run(Stage::Verify, &[]).unwrap();
    assert_eq!(fake.ran(), ["name", "add", "verify"]);
    // A flipped bit that leaves good JSON behind.
    let path = fake.out().join("find.json");
    let whole = fs::read_to_string(&path).unwrap();
    let digit = whole.find("\"excess\": ").unwrap() + "\"excess\": ".len();
    let mut flipped = whole.clone().into_bytes();
    flipped[digit] ^= 1;
    fs::write(&path, flipped).unwrap();
    let text = fake.fault(&[]);
    assert!(text.contains("find.json is damaged; delete it"), "{text}");
    assert!(text.contains("not what was written"), "{text}");
    fs::write(&path, whole).unwrap();
    fs::write(fake.out().join("run.json"), "{").unwrap();
    let text = fake.fault(&[]);
    assert!(text.contains("run.json is damaged; delete it"), "{text}");
}

#[test]
fn an_out_that_cannot_be_a_folder_is_said() {
    let fake = Fake::new();
    fs::write(fake.out(), "a file").unwrap();
    let text = fake.fault(&[]);
    assert!(text.contains("out") && fake.ran().is_empty(), "{text}");
}

#[test]
fn a_number_that_is_not_finite_is_found_when_it_is_kept() {
    let fake = Fake::new();
    fake.run(Stage::Find, &[]).unwrap();
    let mut folder = Folder::go_on(
        &fake.out(),
        provenance::<Inputs>(&fake.out()).unwrap().unwrap(),
    )
    .unwrap();
    let mut bad = found();
    bad.excess = f64::NAN;
    let text = format!("{:#}", folder.keep(&bad).unwrap_err());
    assert!(
        text.contains("`find`") && text.contains("not finite"),
        "{text}"
    );
}

#[test]
fn what_held_out_trials_refuse_leaves_no_patched_model() {
    let mut fake = Fake::new();
    fake.run(Stage::Verify, &[]).unwrap();
    assert!(fake.out().join("patched.xml").exists());
    fs::remove_file(fake.out().join("verify.json")).unwrap();
    fake.accepted = false;
    let Reached::Verdict(record) = fake.run(Stage::Verify, &[]).unwrap() else {
        panic!("no verdict");
    };
    assert!(!fake.out().join("patched.xml").exists() && !record.verdict.verified);
}

#[test]
fn the_terminal_has_ten_lines_at_most_and_is_not_steered_by_names() {
    for accepted in [true, false] {
        let mut fake = Fake::new();
        fake.accepted = accepted;
        let Reached::Verdict(mut record) = fake.run(Stage::Verify, &[]).unwrap() else {
            panic!("no verdict");
        };
        record.verdict.next_experiment = Some("a\nb".into());
        record.verdict.doubts = vec!["`m\u{1b}` is far".into(), "so is `n`".into()];
        let text = terminal::ten_lines(&record, &fake.out());
        assert!(text.contains("doubtful  `m ` is far; so is `n`"), "{text}");
        assert!(
            text.lines().count() <= 10 && !text.contains('\u{1b}'),
            "{text}"
        );
        assert!(
            text.contains("added mass") && text.contains("report.html"),
            "{text}"
        );
        assert_eq!(text.contains("patched.xml"), accepted, "{text}");
    }
}

/// Effects of the user's own beside the model are inputs: a change of them starts anew, and the report knows them.
#[test]
fn the_users_own_effects_are_inputs() {
    let fake = Fake::new();
    fake.run(Stage::Find, &[]).unwrap();
    let folder = fake.root.path().join("effects.d");
    fs::create_dir(&folder).unwrap();
    let text = "summary = \"s\"\ntarget = \"body\"\nworld_force = {x = \"-k * x\"}\n[parameters.k]\nunit = \"N/m\"\n\
                lower = 0\nupper = 9\nprior_sd = 1";
    fs::write(folder.join("spring.toml"), text).unwrap();
    let fault = fake.fault(&[]);
    assert!(
        fault.contains("effects of your own are user.spring, they were none"),
        "{fault}"
    );
    fake.run(Stage::Find, &["--overwrite"]).unwrap();
    fake.run(Stage::Find, &[]).unwrap();
    assert!(fake.ran().is_empty());
    fs::write(folder.join("spring.toml"), text.replace('9', "8")).unwrap();
    let fault = fake.fault(&[]);
    assert!(
        fault.contains("the definition of user.spring has changed"),
        "{fault}"
    );
    fs::write(folder.join("spring.toml"), text.replace("N/m", "N")).unwrap();
    let fault = fake.fault(&[]);
    assert!(
        fault.contains("spring.toml") && fault.contains("expected [N]"),
        "{fault}"
    );
}
