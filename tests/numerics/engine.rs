//! The released checkpoints on recorded motion: every engine against Candle.

use std::path::Path;

use hydro_model::{EngineKind, Scratch, Solver, checkpoint::Checkpoint};
use hydro_training::rollouts::Rollouts;

/// Forces [T, f] of each recorded run, in one engine, carried from the estimate at its start.
fn forces(checkpoint: &Checkpoint, kind: EngineKind, solver: Solver) -> Vec<Vec<f64>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let recorded = Rollouts::load(&root.join("tests/data/rollouts")).unwrap();
    let engine = checkpoint.engine(kind, Some(solver)).unwrap();
    let mut scratch = Scratch::default();
    recorded
        .runs
        .iter()
        .map(|run| {
            let x: Vec<f64> = run.x.rows().flatten().copied().collect();
            let mut start = vec![0.0; engine.outputs()];
            engine.estimate(&x[..engine.inputs()], &mut start, &mut scratch);
            engine.trajectories(&x, &start, &mut scratch).unwrap()
        })
        .collect()
}

/// Root mean square and largest difference over all runs [standard deviations of the output], worst component.
fn errors(checkpoint: &Checkpoint, a: &[Vec<f64>], b: &[Vec<f64>]) -> (f64, f64) {
    let std = &checkpoint.card.normaliser.output_std;
    let mut worst = (0.0f64, 0.0f64);
    for (component, std) in std.iter().enumerate() {
        let differences: Vec<f64> = a
            .iter()
            .flatten()
            .zip(b.iter().flatten())
            .skip(component)
            .step_by(checkpoint.card.outputs.len())
            .map(|(a, b)| (a - b).abs() / std)
            .collect();
        assert!(differences.len() > 200, "{} rows", differences.len());
        let square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
        worst.0 = worst.0.max(square.sqrt());
        worst.1 = differences.into_iter().fold(worst.1, f64::max);
    }
    worst
}

#[test]
fn every_engine_follows_candle_along_recorded_motion() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, solvers) in [
        ("b1-task2", &Solver::ALL[..]),
        ("b1-relaxation", &[Solver::Euler]),
    ] {
        let checkpoint = Checkpoint::load(&root.join("models").join(name)).unwrap();
        for solver in solvers {
            follows_candle(&checkpoint, *solver);
        }
    }
}

fn follows_candle(checkpoint: &Checkpoint, solver: Solver) {
    let name = checkpoint.card.model.kind();
    let candle = forces(checkpoint, EngineKind::Candle, solver);
    let found = |kind| errors(checkpoint, &forces(checkpoint, kind, solver), &candle);
    let (rms, most) = found(EngineKind::Fused);
    // The lengths of adaptive steps differ by rounding too, within the solver's tolerance.
    let bound = match solver {
        Solver::DormandPrince => 2e-4,
        Solver::Euler | Solver::Rk4 => 2e-5,
    };
    assert!(most < bound, "{name} {solver}: {rms} rms, {most} at most");
    // Halves and int16: under 0.5 % of a standard deviation at every sample, and far from exact.
    for kind in [EngineKind::FusedF16, EngineKind::FusedI16] {
        let (rms, most) = found(kind);
        println!("{name} {solver} {kind}: {rms:.1e} rms, {most:.1e} at most");
        assert!(
            most < 5e-3 && rms > 1e-6,
            "{name} {solver} {kind}: {rms} rms, {most} at most"
        );
    }
}
