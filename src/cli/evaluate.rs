//! `hydro evaluate`: errors of a checkpoint on a data set, in open loop.

use std::{convert::Infallible, path::PathBuf};

use anyhow::{Context as _, bail};
use hydro_model::{EngineKind, Outputs, Solver, checkpoint::Checkpoint, document::Difference};
use hydro_training::{
    InitialForce,
    comparison::{Predict, open_loop, precomputed},
    dataset::Dataset,
    metrics::{AttentionUse, attention_use, predict_by_engine},
};

use super::{
    other_water::other_water,
    output::{print_json, print_note_of},
    sample_period::check_sample_period,
    table::table,
    yardsticks::without_learning,
};

/// Flags of `hydro evaluate`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Checkpoint to evaluate.
    #[arg(long, default_value = "models/b1-task2")]
    checkpoint: PathBuf,
    /// Data set.
    #[arg(long)]
    data: PathBuf,
    /// train, val or test.
    #[arg(long, default_value = "test")]
    split: String,
    /// Force at the first sample: clean (the true one), recorded (perturbed), estimate (the model's own) or zero.
    #[arg(long, default_value_t = InitialForce::Clean)]
    start: InitialForce,
    /// Solver other than the card's: euler, rk4 or dopri5.
    #[arg(long)]
    solver: Option<Solver>,
    /// fused, fused-f16, fused-i16 or candle.
    #[arg(long, default_value_t = EngineKind::Fused)]
    engine: EngineKind,
    /// Of an Attention-ODE: how far its weights are from uniform, and its error with other weights in their place; by the
    /// checkpoint's own solver and from the true first force, whatever `--start`, `--solver` and `--engine` say.
    #[arg(long)]
    attention: bool,
    /// Print one JSON value and nothing else.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let checkpoint = Checkpoint::load(&args.checkpoint)?;
    let outputs = Outputs::of(&checkpoint.card.outputs);
    let data = Dataset::open(&args.data)?.with_outputs(outputs)?;
    let manifest = data.manifest();
    let card = &checkpoint.card;
    let (features, expected) = (manifest.features.features(), card.features.features());
    let features = Difference::find("feature", features, expected);
    let outputs = || Difference::find("output", &manifest.outputs, &card.outputs);
    if let Some(difference) = features.or_else(outputs) {
        bail!(
            "{}: {difference} as in {}: the data are of another robot",
            args.data.display(),
            args.checkpoint.display()
        );
    }
    check_sample_period(
        (&args.checkpoint, checkpoint.card.sample_period),
        (&args.data, manifest.sample_period),
    )?;
    let other_water = other_water(
        (&args.checkpoint, checkpoint.card.water.as_ref()),
        (&args.data, manifest.water.as_ref()),
    );
    if let Some(warning) = &other_water {
        eprintln!("{warning}");
    }
    let split = data.split(&args.split, None)?;
    if split.is_empty() {
        bail!(
            "{}: the {} split is empty; there is nothing to evaluate",
            args.data.display(),
            args.split
        );
    }
    let place = || args.checkpoint.display().to_string();
    let attention = if args.attention {
        let found = attention_use(&checkpoint, &split).with_context(place)?;
        Some(found.with_context(|| {
            format!(
                "--attention: {} is of the kind {}, which has none; expected attention-ode",
                args.checkpoint.display(),
                checkpoint.card.model.kind()
            )
        })?)
    } else {
        None
    };
    let engine = (checkpoint.engine(args.engine, args.solver)).with_context(place)?;
    print_note_of(args.engine);
    let name = checkpoint.card.model.kind().to_owned();
    let forces = predict_by_engine(engine.as_ref(), &split, args.start).with_context(place)?;
    let rounding = match args.engine {
        EngineKind::FusedF16 | EngineKind::FusedI16 => {
            let single = (checkpoint.engine(EngineKind::Fused, args.solver)).with_context(place)?;
            let single =
                predict_by_engine(single.as_ref(), &split, args.start).with_context(place)?;
            let std = &checkpoint.card.normaliser.output_std;
            Some(distance(&forces, &single, std))
        }
        EngineKind::Fused | EngineKind::Candle => None,
    };
    let mut rows: Vec<(String, Box<Predict<'_, Infallible>>)> = vec![(name, precomputed(forces))];
    rows.extend(without_learning(&split));
    let Ok(result) = open_loop(&rows, &split, &manifest.outputs, 0, &|_| ());
    let row = &result.rows[0];
    let of_axes = row.errors.mae.iter().chain(&row.errors.rmse);
    if let Some(error) = of_axes
        .chain([&row.errors.pooled])
        .find(|error| !error.is_finite())
    {
        bail!(
            "{}: an error is {error}: the predicted force leaves the range of numbers; the checkpoint is of no use on {}",
            args.checkpoint.display(),
            args.data.display()
        );
    }
    if args.json {
        let rounding_of = |kind| {
            let (rms, largest) = rounding.filter(|_| args.engine == kind)?;
            Some(serde_json::json!({"rms": rms, "largest": largest}))
        };
        return print_json(&serde_json::json!({
            "checkpoint": args.checkpoint.display().to_string(), "data": args.data.display().to_string(), "split": args.split, "start": args.start,
            "trajectories": result.trajectories, "outputs": result.outputs, "errors": row.errors,
            "yardsticks": &result.rows[1..], "other_water": other_water,
            "halves": rounding_of(EngineKind::FusedF16), "int16": rounding_of(EngineKind::FusedI16), "attention": attention,
        }));
    }
    say!(
        "{} on the {} split of {}: {} trajectories",
        row.name,
        args.split,
        args.data.display(),
        result.trajectories
    );
    let axes: Vec<Vec<String>> = (0..result.outputs.len())
        .map(|axis| {
            vec![
                result.outputs[axis].clone(),
                format!("{:.3}", row.errors.mae[axis]),
                format!("{:.3}", row.errors.rmse[axis]),
                format!("{:.4}", row.errors.nrmse[axis]),
                format!("{:.4}", row.errors.nrmse_hydrodynamic[axis]),
            ]
        })
        .chain([vec![
            "pooled".to_owned(),
            String::new(),
            String::new(),
            format!("{:.4}", row.errors.pooled),
            format!("{:.4}", row.errors.pooled_hydrodynamic),
        ]])
        .collect();
    let head = [
        "",
        "MAE [N, N m]",
        "RMSE [N, N m]",
        "nRMSE",
        "nRMSE, no buoyancy",
    ];
    say!("{}", table(&head, &axes));
    say!("Beside it, on the same samples:");
    let beside: Vec<Vec<String>> = result
        .rows
        .iter()
        .map(|row| {
            let errors = &row.errors;
            let pooled =
                [errors.pooled, errors.pooled_hydrodynamic].map(|value| format!("{value:.4}"));
            std::iter::once(row.name.clone()).chain(pooled).collect()
        })
        .collect();
    say!("{}", table(&["", "nRMSE", "nRMSE, no buoyancy"], &beside));
    if let Some(attention) = &attention {
        say_attention(attention)?;
    }
    if let Some((rms, largest)) = rounding {
        say!(
            "{} instead of single precision: {rms:.1e} rms, {largest:.1e} at most, in standard deviations of the output, worst \
             axis",
            match args.engine {
                EngineKind::FusedI16 => "int16",
                _ => "halves",
            }
        );
    }
    Ok(())
}

/// Total variations by head, and errors with other weights.
fn say_attention(attention: &AttentionUse) -> anyhow::Result<()> {
    let of_head = |head: usize| {
        let slopes = attention.from_slopes.as_ref().map(|apart| apart[head]);
        let numbers = [
            Some(attention.from_uniform[head]),
            slopes,
            Some(attention.from_mean[head]),
        ];
        let words = numbers
            .map(|apart| apart.map_or_else(|| "-".to_owned(), |apart| format!("{apart:.3}")));
        std::iter::once((head + 1).to_string())
            .chain(words)
            .collect()
    };
    let heads: Vec<Vec<String>> = (0..attention.mean.len()).map(of_head).collect();
    say!(
        "Total variation of the attention's weights, mean over samples: from uniform, from the fixed slopes' alone, from their \
         own mean"
    );
    say!("{}", table(&["head", "uniform", "slopes", "mean"], &heads));
    let rows: Vec<Vec<String>> = attention
        .ablations
        .iter()
        .map(|row| {
            let errors = [row.nrmse, row.nrmse_hydrodynamic].map(|error| format!("{error:.4}"));
            std::iter::once(row.weights.to_owned())
                .chain(errors)
                .collect()
        })
        .collect();
    say!("From the true first force, with these weights:");
    say!(
        "{}",
        table(&["weights", "nRMSE", "nRMSE, no buoyancy"], &rows)
    );
    Ok(())
}

/// Root mean square of the worst axis, and the largest, of a - b [standard deviations of the output].
fn distance(a: &[Vec<f64>], b: &[Vec<f64>], std: &[f64]) -> (f64, f64) {
    let (mut squares, mut largest, mut count) = (vec![0.0; std.len()], 0.0f64, 0.0f64);
    for (a, b) in a.iter().zip(b) {
        for (a, b) in a.chunks_exact(std.len()).zip(b.chunks_exact(std.len())) {
            count += 1.0;
            for (((a, b), std), square) in a.iter().zip(b).zip(std).zip(&mut squares) {
                let apart = (a - b).abs() / std;
                *square += apart * apart;
                largest = largest.max(apart);
            }
        }
    }
    let worst = squares.into_iter().fold(0.0, f64::max);
    ((worst / count.max(1.0)).sqrt(), largest)
}
