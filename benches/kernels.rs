//! Criterion: what the kernels cost through the doors that users take.
//!
//! `cargo bench --bench kernels`: one row through a field of several widths (the product of one row), whole
//! trajectories and their gradient (the product of many rows, the attention, the adjoint).
#![allow(missing_docs, clippy::unwrap_used)]

use candle_core::{Device, Tensor};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use hydro_model::{
    AttentionOdeConfig, Encoding, EngineKind, ForceModel, MlpConfig, ModelConfig, Normaliser,
    Parameters, Scratch, Solver, features::FeatureLayout,
};

const INPUTS: usize = 12;
const OUTPUTS: usize = 6;

fn model(config: &ModelConfig, solver: Solver) -> (ForceModel, Parameters) {
    let features = (0..INPUTS).map(|i| format!("position.j{i}").parse().unwrap());
    let layout = FeatureLayout::new(features.collect()).unwrap();
    Parameters::draw(0, |vb| {
        let normaliser = Normaliser::identity(INPUTS, OUTPUTS);
        ForceModel::new(config, &layout, normaliser, solver, vb)
            .map_err(|error| candle_core::Error::Msg(error.to_string()))
    })
    .unwrap()
}

fn field(width: usize) -> ModelConfig {
    ModelConfig::Mlp(MlpConfig {
        hidden: vec![width; 3],
        encoding: Encoding::Raw,
        skip: false,
    })
}

/// One row through every engine.
fn one_row(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one row");
    for width in [64, 256, 512, 1024] {
        let (model, parameters) = model(&field(width), Solver::Euler);
        group.throughput(Throughput::Bytes(4 * parameters.count() as u64));
        for kind in EngineKind::ALL {
            let engine = model.engine(kind).unwrap();
            let mut scratch = Scratch::default();
            let (x, mut force) = ([0.1; INPUTS], [0.0; OUTPUTS]);
            group.bench_function(BenchmarkId::new(kind.to_string(), width), |bench| {
                bench.iter(|| engine.estimate(&x, &mut force, &mut scratch));
            });
        }
    }
    group.finish();
}

/// 32 trajectories of 100 steps, forward and back.
fn trajectories(criterion: &mut Criterion) {
    const BATCH: usize = 32;
    const STEPS: usize = 100;
    let mut group = criterion.benchmark_group("trajectories");
    group.sample_size(10);
    for solver in Solver::ALL {
        let ode = AttentionOdeConfig {
            latent: OUTPUTS,
            hidden: vec![256; 3],
            encoding: Encoding::Raw,
            skip: false,
            ..AttentionOdeConfig::default()
        };
        let window = ode.window;
        let (model, _) = model(&ModelConfig::AttentionOde(ode), solver);
        let z = Tensor::rand(-1f32, 1.0, (BATCH, window + STEPS, INPUTS), &Device::Cpu).unwrap();
        let start = Tensor::zeros((BATCH, OUTPUTS), candle_core::DType::F32, &Device::Cpu).unwrap();
        let forward = || {
            let network = &model.network;
            network.forward(&z, &start, solver).unwrap()
        };
        group.throughput(Throughput::Elements((BATCH * STEPS) as u64));
        group.bench_function(BenchmarkId::new("forward", solver), |bench| {
            bench.iter(forward);
        });
        group.bench_function(BenchmarkId::new("forward and back", solver), |bench| {
            bench.iter(|| {
                forward()
                    .sqr()
                    .unwrap()
                    .mean_all()
                    .unwrap()
                    .backward()
                    .unwrap()
            });
        });
    }
    group.finish();
}

criterion_group!(kernels, one_row, trajectories);
criterion_main!(kernels);
