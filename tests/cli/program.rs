//! The program as a user meets it: every refusal through the real binary, nothing half-written.
#![cfg(feature = "cli")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

use crate::{
    common::tiny::{FEATURES, T, dataset, sha256},
    run::{hydro, refused},
};
use hydro_model::checkpoint::Checkpoint;
use safetensors::{SafeTensors, tensor::TensorView};

fn refusal(arguments: &[&str]) -> String {
    refused(&hydro(arguments))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A safetensors file of f32 with one tensor changed: its shape and its bytes.
fn with_tensor(
    file: &Path,
    changed: &str,
    change: impl FnOnce(&mut Vec<usize>, &mut Vec<u8>),
) -> Vec<u8> {
    let whole = fs::read(file).unwrap();
    let tensors = SafeTensors::deserialize(&whole).unwrap();
    let view = tensors.tensor(changed).unwrap();
    let (mut shape, mut data) = (view.shape().to_vec(), view.data().to_vec());
    change(&mut shape, &mut data);
    let view = TensorView::new(view.dtype(), shape, &data).unwrap();
    let others = tensors.iter().filter(|(name, _)| *name != changed);
    safetensors::serialize(others.chain([(changed, view)]), None).unwrap()
}

/// Puts a NaN in the place of the number at `index`.
fn put_nan(data: &mut [u8], index: usize) {
    data[4 * index..4 * (index + 1)].copy_from_slice(&f32::NAN.to_le_bytes());
}

fn train<'a>(data: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let sizes = [
        "--hidden",
        "16,16",
        "--latent",
        "8",
        "--embedding",
        "8",
        "--batch",
        "8",
        "--horizon",
        "20",
    ];
    let places = ["train", "--data", data, "--out", out];
    places
        .into_iter()
        .chain(sizes)
        .chain(more.iter().copied())
        .collect()
}

struct Place {
    _folder: tempfile::TempDir,
    data: PathBuf,
    out: PathBuf,
}

fn place() -> Place {
    let folder = tempfile::tempdir().unwrap();
    let place = Place {
        data: folder.path().join("data"),
        out: folder.path().join("model"),
        _folder: folder,
    };
    dataset(&place.data);
    place
}

#[test]
fn a_small_model_is_trained_evaluated_and_described() {
    let Place { data, out, .. } = &place();
    let trained = hydro(&train(text(data), text(out), &["--epochs", "30", "--json"]));
    assert!(
        trained.status.success(),
        "{}",
        String::from_utf8_lossy(&trained.stderr)
    );
    let result: serde_json::Value = serde_json::from_slice(&trained.stdout).unwrap();
    let pooled = result["test"]["pooled"].as_f64().unwrap();
    assert!(
        pooled < 0.5,
        "a force that follows its inputs should be learned: {pooled}"
    );

    let evaluated = hydro(&[
        "evaluate",
        "--checkpoint",
        text(out),
        "--data",
        text(data),
        "--json",
    ]);
    let again: serde_json::Value = serde_json::from_slice(&evaluated.stdout).unwrap();
    let through_engine = again["errors"]["pooled"].as_f64().unwrap();
    // Same model, other code (engine a sample at a time against Candle a trajectory at a time); the first
    // sample is given and counted by one of the two only.
    assert!(
        (through_engine - pooled).abs() < 0.05 * pooled,
        "{through_engine} {pooled}"
    );

    let described = String::from_utf8(hydro(&["inspect", text(out)]).stdout).unwrap();
    assert!(
        described.contains("attention-ode") && described.contains("position.thigh"),
        "{described}"
    );
    for part in ["MAE", "first force: clean", "linear_velocity.x"] {
        assert!(described.contains(part), "{part}: {described}");
    }
    let widest = described.lines().map(|line| line.chars().count()).max();
    assert!(widest.unwrap() < 500, "{described}");
    let card = Checkpoint::load(out).unwrap().card;
    assert!(
        card.command.starts_with("hydro train --data"),
        "{}",
        card.command
    );
    assert_eq!(card.outputs, ["force.x", "force.y"]);
}

#[test]
fn an_interrupted_run_goes_on_to_the_same_weights() {
    let whole = place();
    let flags = ["--epochs", "200", "--patience", "200"];
    assert!(
        hydro(&train(text(&whole.data), text(&whole.out), &flags))
            .status
            .success()
    );

    for signal in ["INT", "KILL"] {
        let cut = interrupted_and_resumed(signal, &flags);
        let weights = |folder: &Path| fs::read(folder.join("weights.safetensors")).unwrap();
        assert!(
            weights(&whole.out) == weights(&cut.out),
            "after SIG{signal} the weights differ from those of an unbroken run"
        );
    }
}

/// Trains, sends a signal as soon as there is something to resume from, and resumes.
fn interrupted_and_resumed(signal: &str, flags: &[&str]) -> Place {
    let cut = place();
    let mut child = Command::new(env!("CARGO_BIN_EXE_hydro"))
        .args(train(text(&cut.data), text(&cut.out), flags))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // Wait until there is something to interrupt; a very fast machine may finish first, and then
    // the resume below has nothing to do, which must hold too.
    let state = cut
        .out
        .with_file_name("model.run")
        .join("state.safetensors");
    for _ in 0..400 {
        if state.exists() {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(state.exists(), "no state after four seconds");
    Command::new("kill")
        .args([&format!("-{signal}"), &child.id().to_string()])
        .status()
        .unwrap();
    let interrupted = !child.wait().unwrap().success();
    assert_eq!(
        cut.out.exists(),
        !interrupted,
        "a checkpoint stands exactly where training finished, SIG{signal}"
    );

    let resumed: Vec<&str> = flags.iter().copied().chain(["--resume"]).collect();
    let output = hydro(&train(text(&cut.data), text(&cut.out), &resumed));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    cut
}

#[test]
fn what_is_there_is_not_overwritten_unasked() {
    let Place { data, out, .. } = &place();
    assert!(
        hydro(&train(text(data), text(out), &["--epochs", "1"]))
            .status
            .success()
    );
    let before = fs::read(out.join("weights.safetensors")).unwrap();
    let message = refusal(&train(text(data), text(out), &["--epochs", "1"]));
    assert!(
        message.contains("--resume") && message.contains("--overwrite"),
        "{message}"
    );
    assert_eq!(before, fs::read(out.join("weights.safetensors")).unwrap());
}

#[test]
fn a_data_set_that_is_not_whole_is_refused_by_name() {
    let Place { data, out, .. } = &place();
    let shard = data.join("train-00000-of-00001.safetensors");
    let whole = fs::read(&shard).unwrap();
    let attempt = |change: &dyn Fn()| {
        change();
        let message = refusal(&train(text(data), text(out), &["--epochs", "1"]));
        fs::write(&shard, &whole).unwrap();
        assert!(!out.exists(), "half a checkpoint was left");
        message
    };
    let missing = attempt(&|| fs::remove_file(&shard).unwrap());
    assert!(
        missing.contains("train-00000-of-00001.safetensors"),
        "{missing}"
    );
    let cut = attempt(&|| fs::write(&shard, &whole[..whole.len() / 2]).unwrap());
    assert!(cut.contains("sha256"), "{cut}");
    let flipped = attempt(&|| {
        let mut bytes = whole.clone();
        let at = bytes.len() - 100;
        bytes[at] ^= 1;
        fs::write(&shard, bytes).unwrap();
    });
    assert!(flipped.contains("sha256"), "{flipped}");

    let manifest = fs::read_to_string(data.join("manifest.json")).unwrap();
    fs::write(
        data.join("manifest.json"),
        manifest.replace("hydro-dataset/1", "hydro-dataset/7"),
    )
    .unwrap();
    let schema = refusal(&train(text(data), text(out), &["--epochs", "1"]));
    assert!(schema.contains("hydro-dataset/7"), "{schema}");
}

#[test]
fn a_full_disk_leaves_no_half_written_checkpoint() {
    let Place { data, out, .. } = &place();
    // No file may grow beyond a block, as on a disk that has no more; the signal of it is ignored, so
    // that the program sees the error of the write.
    let arguments = train(text(data), text(out), &["--epochs", "1"]).join(" ");
    let command = format!(
        "trap '' XFSZ; ulimit -f 1; exec {} {arguments}",
        env!("CARGO_BIN_EXE_hydro")
    );
    let output = Command::new("bash")
        .args(["-c", &command])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{message}");
    assert!(message.contains("File too large"), "{message}");
    assert!(!message.contains("panicked"), "{message}");
    assert!(!out.exists());
    let left: Vec<PathBuf> = fs::read_dir(out.with_file_name("model.run"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    assert!(left.is_empty(), "partial files were left: {left:?}");
}

#[test]
fn a_checkpoint_that_is_not_whole_is_refused_by_name() {
    let Place { data, out, .. } = &place();
    let missing = refusal(&["evaluate", "--checkpoint", text(out), "--data", text(data)]);
    assert!(missing.contains("no checkpoint at"), "{missing}");
    assert!(
        hydro(&train(text(data), text(out), &["--epochs", "1"]))
            .status
            .success()
    );
    let weights = out.join("weights.safetensors");
    let whole = fs::read(&weights).unwrap();
    for change in [whole[..whole.len() - 7].to_vec(), {
        let mut flipped = whole.clone();
        let at = flipped.len() - 9;
        flipped[at] ^= 0x40;
        flipped
    }] {
        fs::write(&weights, change).unwrap();
        let message = refusal(&["inspect", text(out)]);
        assert!(
            message.contains("damaged") && message.contains("sha256"),
            "{message}"
        );
    }
    fs::write(&weights, &whole).unwrap();
    let card = fs::read_to_string(out.join("card.json")).unwrap();
    fs::write(
        out.join("card.json"),
        card.replace("hydro-checkpoint/1", "hydro-checkpoint/2"),
    )
    .unwrap();
    assert!(refusal(&["inspect", text(out)]).contains("hydro-checkpoint/2"));
}

#[test]
fn weights_of_the_right_digest_that_do_not_fit_are_refused_by_name() {
    let Place { data, out, .. } = &place();
    assert!(
        hydro(&train(text(data), text(out), &["--epochs", "1"]))
            .status
            .success()
    );
    let (weights, card) = (out.join("weights.safetensors"), out.join("card.json"));
    // A card that was changed on purpose has no digest of its own.
    let described = fs::read_to_string(&card).unwrap();
    let mut described: serde_json::Value = serde_json::from_str(&described).unwrap();
    assert!(
        described
            .as_object_mut()
            .unwrap()
            .remove("card_sha256")
            .is_some()
    );
    let described = described.to_string();
    let whole = sha256(&fs::read(&weights).unwrap());
    assert!(described.contains(&whole), "{described}");
    let nan = with_tensor(&weights, "field.0.bias", |_, data| put_nan(data, 3));
    let misshapen = with_tensor(&weights, "field.0.bias", |shape, _| shape.push(1));
    for (changed, expected) in [
        (nan, "tensor `field.0.bias` holds NaN at position 3"),
        (
            misshapen,
            "tensor `field.0.bias` is F32 [16, 1], expected F32 [16]",
        ),
    ] {
        fs::write(&weights, &changed).unwrap();
        fs::write(&card, described.replace(&whole, &sha256(&changed))).unwrap();
        let message = refusal(&["inspect", text(out)]);
        assert!(
            message.contains("weights.safetensors") && message.contains(expected),
            "{message}"
        );
    }
}

#[test]
fn a_row_that_is_not_a_number_is_found() {
    let Place { data, out, .. } = &place();
    let file = "train-00000-of-00001.safetensors";
    let (shard, manifest) = (data.join(file), data.join("manifest.json"));
    let described = fs::read_to_string(&manifest).unwrap();
    let whole = sha256(&fs::read(&shard).unwrap());
    let (trajectory, row, feature) = (5, 17, 1);
    let changed = with_tensor(&shard, "x", |_, data| {
        put_nan(data, (trajectory * T + row) * FEATURES.len() + feature);
    });
    fs::write(&shard, &changed).unwrap();
    fs::write(&manifest, described.replace(&whole, &sha256(&changed))).unwrap();
    let message = refusal(&train(text(data), text(out), &["--epochs", "1"]));
    let expected = "`x` of trajectory 5, row 17, linear_velocity.x is NaN";
    assert!(
        message.contains(file) && message.contains(expected),
        "{message}"
    );
    assert!(!out.exists(), "half a checkpoint was left");
}

#[test]
fn flags_out_of_range_are_named() {
    let Place { data, out, .. } = &place();
    let cases = [
        (["--learning-rate", "0"], "learning_rate is 0"),
        (["--heads", "3"], "not divisible by 3 heads"),
        (["--trajectories", "0"], "trajectories is 0"),
        (
            ["--modes", "2"],
            "--modes is not used by the model attention-ode; it is for relaxation-ode",
        ),
        (
            ["--memory", "64"],
            "--memory is not used by the model attention-ode; it is for relaxation-ode",
        ),
    ];
    for (flags, expected) in cases {
        let message = refusal(&train(text(data), text(out), &flags));
        assert!(message.contains(expected), "{message}");
        assert!(!out.exists());
    }
    let nowhere = refusal(&["inspect", "/no/such/folder"]);
    assert!(nowhere.contains("card.json"), "{nowhere}");
}

#[test]
fn devices_that_are_none_or_not_built_in_are_refused() {
    let Place { data, out, .. } = &place();
    let message = refusal(&train(text(data), text(out), &["--device", "gpu"]));
    let expected = "unknown device `gpu`: there are cpu, cuda and cuda:N";
    assert!(message.contains(expected), "{message}");
    // A card of this number is nowhere, whatever the build.
    let message = refusal(&train(text(data), text(out), &["--device", "cuda:999"]));
    let expected = if cfg!(feature = "cuda") {
        "cuda:999 cannot be used"
    } else {
        "cuda:999: this build has no CUDA; `cargo build --release --features cuda --target-dir target/cuda` makes one that does"
    };
    assert!(message.contains(expected), "{message}");
    assert!(!out.exists());
}

#[test]
fn the_doctor_finds_this_build_sound() {
    let output = hydro(&["doctor", "--json"]);
    assert!(output.status.success());
    let findings: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(findings["plugin"]["Ok"].is_string(), "{findings}");
}

/// An unstable nominal makes MuJoCo warn at every step.
#[cfg(all(feature = "mujoco", mujoco_plugins))]
#[test]
fn warnings_of_mujoco_are_told_once_with_their_count() {
    let folder = tempfile::tempdir().unwrap();
    let nominal = folder.path().join("nominal.xml");
    let trials = folder.path().join("trials");
    fs::create_dir(&trials).unwrap();
    fs::write(
        &nominal,
        "<mujoco><option timestep='0.01' integrator='Euler'/><worldbody><body><joint name='j' type='slide' stiffness='1e9'/>\
         <geom size='.1' mass='1'/></body></worldbody><actuator><motor name='m' joint='j'/></actuator>\
         <sensor><jointpos name='p' joint='j' noise='0.01'/></sensor></mujoco>",
    )
    .unwrap();
    for trial in 0..2 {
        let rows = (0..100).map(|row| {
            let time = 0.01 * f64::from(row);
            format!("{time},{},{}\n", time.sin(), 0.1 * (3.0 * time).cos())
        });
        let table: String = std::iter::once("time,m,p\n".to_owned())
            .chain(rows)
            .collect();
        fs::write(trials.join(format!("{trial}.csv")), table).unwrap();
    }
    let out = folder.path().join("out");
    let output = hydro(&[
        "gap",
        "find",
        "--model",
        text(&nominal),
        "--trials",
        text(&trials),
        "--out",
        text(&out),
    ]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!message.contains("WARNING: Nan"), "{message}");
    let told: Vec<&str> = message
        .lines()
        .filter(|line| line.contains("MuJoCo warned"))
        .collect();
    assert_eq!(told.len(), 1, "{message}");
    assert!(
        told[0].contains("QACC") || told[0].contains("QPOS"),
        "{message}"
    );
}

/// scripts/learning_rates.py tells a divergence from other failures by this status.
#[test]
fn a_training_that_diverges_exits_with_three() {
    let Place { data, out, .. } = &place();
    let hopeless = [
        "--model",
        "mlp-ode",
        "--learning-rate",
        "1",
        "--epochs",
        "200",
    ];
    let diverged = hydro(
        &["train", "--data", text(data), "--out", text(out)]
            .into_iter()
            .chain(hopeless)
            .chain(["--hidden", "64,64,64", "--patience", "200"])
            .collect::<Vec<_>>(),
    );
    let message = refused(&diverged);
    assert_eq!(diverged.status.code(), Some(3), "{message}");
    assert!(message.contains("lower the learning rate"), "{message}");
    let other = hydro(&train("no/such/folder", text(out), &[]));
    assert_eq!(other.status.code(), Some(1));
    assert_eq!(hydro(&["train", "--no-such-flag"]).status.code(), Some(2));
    let help = String::from_utf8(hydro(&["train", "--help"]).stdout).unwrap();
    assert!(help.contains("Exit status"), "{help}");
}

#[test]
fn the_users_own_effects_are_listed_and_their_faults_named() {
    let example = "examples/tether/effects.d";
    let output = hydro(&["gap", "effects", "--effects", example]);
    let listed = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && listed.contains("added_mass"));
    assert!(listed.contains("user.tether (on a body; written to: plugin)"));
    assert!(listed.contains("parameters: drag [N s^2/m^3], length [m], stiffness [N/m]"));
    let output = hydro(&["gap", "effects", "--json", "--effects", example]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let effects = json["effects"].as_array().unwrap();
    let tether = effects.last().unwrap();
    assert_eq!(tether["id"], "user.tether");
    assert_eq!(tether["parameters"][1]["null"], 2.0);

    let folder = tempfile::tempdir().unwrap();
    let good = fs::read_to_string(format!("{example}/tether.toml")).unwrap();
    let file = folder.path().join("tether.toml");
    let given = ["gap", "effects", "--effects", text(folder.path())];
    fs::write(&file, good.replace("\"-pull * x", "\"-pul * x")).unwrap();
    let said = refusal(&given);
    assert!(
        said.contains("tether.toml") && said.contains("did you mean `pull`?"),
        "{said}"
    );
    fs::write(&file, "summary = ").unwrap();
    assert!(refusal(&given).contains("line 1, column"));
    fs::remove_file(&file).unwrap();
    assert!(refusal(&given).contains("no file NAME.toml"));
}

/// Derivatives of an article, in and out: the file loads in the plugin (`tests/plugin/whole_matrix.rs`).
#[test]
fn effects_come_from_a_table_of_derivatives() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("vehicle.toml");
    fs::write(
        &file,
        "X_udot = -6.36\nY_vdot = -7.12\nN_rdot = -0.222\nY_rdot = 0.3\nX_u = -13.7\n",
    )
    .unwrap();
    let command = ["effects", "from-fossen", text(&file), "--target", "rov"];
    let output = hydro(&command);
    assert!(output.status.success());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let effects = json["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 2);
    let added = &effects[0];
    assert_eq!(
        (&added["effect"], &added["target"]),
        (&"added_mass".into(), &"rov".into())
    );
    let matrix = &added["parameters"]["matrix"];
    assert_eq!(
        (&matrix[0][0], &matrix[1][5]),
        (&6.36.into(), &(-0.3).into())
    );
    assert_eq!(matrix[1][5], matrix[5][1]);
    assert_eq!(effects[1]["parameters"]["matrix"][0][0], 13.7);

    fs::write(&file, "X_udot = 6.36\n").unwrap();
    let said = refusal(&command);
    assert!(
        said.contains("vehicle.toml") && said.contains("has the eigenvalue -6.36"),
        "{said}"
    );
    assert!(refusal(&command[..3]).contains("--target"));
    fs::remove_file(&file).unwrap();
    assert!(refusal(&command).contains("No such file"));
}

/// First values of a ball of 0.5 m: the volume, half the displaced mass, half rho C_D times the disc.
#[cfg(mujoco_plugins)]
#[test]
fn effects_come_from_the_shape_of_a_body() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("ball.xml");
    let ball = r#"<mujoco><worldbody><body name="ball"><freejoint/><geom size="0.25" mass="60"/></body></worldbody></mujoco>"#;
    fs::write(&model, ball).unwrap();
    let command = ["effects", "from-shape", text(&model), "--body", "ball"];
    let output = hydro(&command);
    assert!(output.status.success());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let value = |at: usize, name: &str| json["effects"][at]["parameters"][name].as_f64().unwrap();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.25_f64.powi(3);
    assert!((value(0, "volume") / volume - 1.0).abs() < 1e-12);
    assert!((value(1, "sway") / (500.0 * volume) - 1.0).abs() < 0.01);
    assert!((value(2, "heave") / (500.0 * 0.25 * 0.25 * std::f64::consts::PI) - 1.0).abs() < 0.01);

    let said = refusal(&[&command[..3], &["--body", "keel"]].concat());
    assert!(
        said.contains("no body `keel`; it has: world, ball"),
        "{said}"
    );
    let said = refusal(&[&command[..], &["--drag-coefficient", "0"]].concat());
    assert!(said.contains("expected a number above 0"), "{said}");
    fs::write(&model, "<mujoco").unwrap();
    assert!(refusal(&command).contains("ball.xml"));
}

#[cfg(mujoco_plugins)]
#[test]
fn gap_refuses_a_medium_that_the_model_contradicts() {
    let folder = tempfile::tempdir().unwrap();
    let nominal = folder.path().join("nominal.xml");
    let model = r#"<mujoco><option density="1000"/><worldbody><body><freejoint/><geom size="0.1"/>
        <site name="s"/></body></worldbody><sensor><gyro name="g" site="s"/></sensor></mujoco>"#;
    fs::write(&nominal, model).unwrap();
    let trials = folder.path().join("trials");
    fs::create_dir(&trials).unwrap();
    for trial in ["a", "b"] {
        let rows = (0..20).map(|row| format!("{},0,0,0\n", 0.01 * f64::from(row)));
        let head = "time,g[0],g[1],g[2]\n".to_owned();
        let table: String = std::iter::once(head).chain(rows).collect();
        fs::write(trials.join(format!("{trial}.csv")), table).unwrap();
    }
    let run = |medium: &str| {
        let out = folder.path().join(medium);
        let (model, trials, out) = (text(&nominal), text(&trials), text(&out));
        let output = hydro(&[
            "gap", "find", "--model", model, "--trials", trials, "--out", out, "--medium", medium,
        ]);
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let message = run("air");
    assert!(
        message.contains("--medium is air, but the fluid of") && message.contains("is water"),
        "{message}"
    );
    assert!(!run("water").contains("--medium"));
    assert!(run("oil").contains("[possible values: none, air, water]"));
}
