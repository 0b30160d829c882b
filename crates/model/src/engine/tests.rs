//! Every engine against Candle, in every instruction set of this machine.

use candle_core::{Device, Tensor};
use candle_nn::VarBuilder;
use pulp::Arch;

use super::{
    Engine, EngineKind, Scratch, build, candle_engine::CandleEngine, packed_perceptron::Precision,
};
use crate::{
    AttentionOdeConfig, CnodeConfig, Control, Encoder, Encoding, ForceModel, LstmConfig, MlpConfig,
    MlpOdeConfig, ModelConfig, ModelError, Normaliser, Parameters, RelaxationOdeConfig, Solver,
    Tokens,
    architectures::cnode::STATE_LIMIT,
    features::FeatureLayout,
    kernel::{instruction_sets, rounded},
};

fn layout() -> FeatureLayout {
    FeatureLayout::floating_base(&["a".into(), "b".into()]).expect("valid")
}

/// Realistic scales, so that SI and standardised units differ.
fn normaliser(inputs: usize) -> Normaliser {
    Normaliser {
        input_mean: (0..inputs).map(|i| 0.1 * i as f64).collect(),
        input_std: (0..inputs).map(|i| 0.5 + 0.1 * i as f64).collect(),
        output_mean: vec![10.0, -5.0, 400.0, 0.0, 1.0, 2.0],
        output_std: vec![50.0, 40.0, 200.0, 10.0, 8.0, 6.0],
    }
}

fn configs() -> Vec<ModelConfig> {
    let ode = AttentionOdeConfig {
        window: 5,
        embedding: 16,
        latent: 10,
        hidden: vec![33, 200],
        ..AttentionOdeConfig::default()
    };
    let plain = AttentionOdeConfig {
        skip: false,
        encoding: Encoding::Raw,
        ..ode.clone()
    };
    let sum = AttentionOdeConfig {
        field_sees_force: false,
        window: 1,
        ..ode.clone()
    };
    let features = AttentionOdeConfig {
        tokens: Tokens::Features,
        window: 1,
        ..plain.clone()
    };
    let features_of_a_window = AttentionOdeConfig {
        window: 3,
        end_of_step: true,
        encoding: Encoding::Up,
        ..features.clone()
    };
    let end = AttentionOdeConfig {
        end_of_step: true,
        ..ode.clone()
    };
    vec![
        ModelConfig::AttentionOde(ode),
        ModelConfig::AttentionOde(plain),
        ModelConfig::AttentionOde(sum),
        ModelConfig::AttentionOde(features),
        ModelConfig::AttentionOde(features_of_a_window),
        ModelConfig::AttentionOde(end),
        ModelConfig::MlpOde(MlpOdeConfig {
            latent_hidden: vec![21],
            latent: 10,
            hidden: vec![33, 200],
            ..MlpOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            window: 3,
            hidden: vec![33, 200],
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![33, 200],
            modes: 3,
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![33, 200],
            modes: 2,
            memory: 11,
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::Cnode(CnodeConfig {
            hidden: vec![33, 200],
            // The path that a simulation has; the other needs the whole trajectory.
            control: Control::Hermite,
            ..CnodeConfig::default()
        }),
        ModelConfig::Lstm(LstmConfig {
            hidden: vec![33, 50],
            ..LstmConfig::default()
        }),
        ModelConfig::Lstm(LstmConfig {
            hidden: vec![33, 50],
            skip: false,
            ..LstmConfig::default()
        }),
        ModelConfig::Mlp(MlpConfig {
            hidden: vec![33, 200],
            ..MlpConfig::default()
        }),
    ]
}

/// Those that step a model.
fn solvers(config: &ModelConfig) -> impl Iterator<Item = Solver> {
    let fits = move |solver: &Solver| config.check_solver(*solver).is_ok();
    Solver::ALL.into_iter().filter(fits)
}

/// Greatest distance of the fused engine from Candle [standard deviations]: with adaptive steps, whose lengths differ by rounding
/// too, within the solver's tolerance.
fn solver_bound(solver: Solver) -> f64 {
    match solver {
        Solver::Euler | Solver::Rk4 => 2e-5,
        Solver::DormandPrince => 2e-4,
    }
}

fn model(config: &ModelConfig, solver: Solver) -> ForceModel {
    drawn(config, solver).0
}

fn drawn(config: &ModelConfig, solver: Solver) -> (ForceModel, Parameters) {
    let inputs = Encoder::new(config.encoding(), &layout()).len();
    let build = |vb: VarBuilder| {
        ForceModel::new(config, &layout(), normaliser(inputs), solver, vb)
            .map_err(|error| candle_core::Error::Msg(error.to_string()))
    };
    Parameters::draw(5, build).expect("built")
}

fn fused(model: &ForceModel, precision: Precision, arch: Arch) -> Box<dyn Engine> {
    build::fused(model, precision, arch).expect("an engine")
}

/// T samples of n features, smooth, without a generator.
fn motion(samples: usize, n: usize) -> Vec<f64> {
    (0..samples * n)
        .map(|i| (0.1 * (i / n) as f64 + (i % n) as f64).sin())
        .collect()
}

/// Largest difference in standard deviations of the output.
fn difference(a: &[f64], b: &[f64], std: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .zip(std.iter().cycle())
        .map(|((a, b), std)| (a - b).abs() / std)
        .fold(0.0, f64::max)
}

/// Steps from `start` [f] along x [T, n]: the forces, one at a time.
fn stepped(engine: &dyn Engine, x: &[f64], start: &[f64]) -> Vec<f64> {
    let mut memory = vec![0.0; engine.memory_len()];
    let (mut now, mut next) = (vec![0.0; start.len()], vec![0.0; start.len()]);
    let mut carried = start.to_vec();
    let mut scratch = Scratch::default();
    let mut forces = Vec::new();
    for (k, x) in x.chunks_exact(engine.inputs()).enumerate() {
        if k == 0 {
            engine.start(x, start, &mut memory, &mut scratch);
        } else {
            engine.observe(x, &mut memory, &mut scratch);
        }
        engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
        forces.extend_from_slice(&now);
        carried.copy_from_slice(&next);
    }
    forces
}

const PRECISIONS: [Precision; 3] = [Precision::Single, Precision::Half, Precision::Int16];

const START: [f64; 6] = [20.0, 0.0, 300.0, 1.0, -2.0, 3.0];

#[test]
fn engines_agree_with_candle_and_with_whole_trajectories_in_every_instruction_set() {
    for config in configs() {
        for solver in solvers(&config) {
            let model = model(&config, solver);
            let (n, samples) = (model.inputs(), 30);
            let x = motion(samples, n);
            let single: Vec<f32> = x.iter().map(|v| *v as f32).collect();
            let whole = model
                .predict(
                    &Tensor::from_vec(single, (1, samples, n), &Device::Cpu).expect("shape fits"),
                    &Tensor::new(&[START.map(|v| v as f32)], &Device::Cpu).expect("shape fits"),
                )
                .and_then(|t| Ok(t.flatten_all()?.to_vec1::<f32>()?))
                .expect("predicted");
            let whole: Vec<f64> = whole.into_iter().map(f64::from).collect();
            let reference = stepped(&CandleEngine(model.clone()), &x, &START);
            let std = &model.normaliser.output_std;
            let bound = solver_bound(solver);
            assert!(difference(&reference, &whole, std) < bound, "{config:?}");
            for arch in instruction_sets() {
                let found = stepped(&*fused(&model, Precision::Single, arch), &x, &START);
                let error = difference(&found, &reference, std);
                assert!(error < bound, "{config:?} {solver} {arch:?}: {error}");
            }
        }
    }
}

/// Every model with every solver that steps it by more than one stage.
fn with_stages() -> Vec<(ModelConfig, Solver)> {
    let mut all = Vec::new();
    for config in configs() {
        let staged = solvers(&config).filter(|solver| *solver != Solver::Euler);
        all.extend(staged.map(|solver| (config.clone(), solver)));
    }
    all
}

/// Longer than what the engines take as one product.
#[test]
fn a_long_trajectory_is_the_same_in_blocks() {
    for config in configs() {
        let model = model(&config, Solver::Euler);
        let x = motion(600, model.inputs());
        let engine = fused(&model, Precision::Single, Arch::new());
        let whole = engine
            .trajectories(&x, &START, &mut Scratch::default())
            .expect("a whole trajectory");
        assert_eq!(whole, stepped(&*engine, &x, &START), "{config:?}");
    }
}

/// Says nothing where the machine has a single vector unit.
#[test]
fn the_vector_units_give_the_same_numbers() {
    for (config, solver) in with_stages() {
        let model = model(&config, solver);
        let x = motion(20, model.inputs());
        for precision in PRECISIONS {
            // The portable path rounds products before it adds them.
            let found: Vec<Vec<f64>> = instruction_sets()[1..]
                .iter()
                .map(|arch| stepped(&*fused(&model, precision, *arch), &x, &START))
                .collect();
            for pair in found.windows(2) {
                assert_eq!(pair[0], pair[1], "{config:?} {solver} {precision:?}");
            }
        }
    }
}

/// The half-precision engine agrees with the single-precision one on rounded weights.
#[test]
fn halves_are_the_rounded_weights_and_nothing_else() {
    for config in configs() {
        let (model, parameters) = drawn(&config, Solver::Euler);
        let x = motion(20, model.inputs());
        let halves = |arch| stepped(&*fused(&model, Precision::Half, arch), &x, &START);
        let before: Vec<Vec<f64>> = instruction_sets().into_iter().map(halves).collect();
        let full = stepped(&*fused(&model, Precision::Single, Arch::new()), &x, &START);
        let std = &model.normaliser.output_std;
        let error = difference(&before[0], &full, std);
        assert!(error > 1e-6 && error < 5e-3, "{config:?}: {error}");

        for (name, var) in parameters.iter() {
            let parts = ["field", "layer", "memory"];
            let halved = parts.iter().any(|part| name.starts_with(part));
            if !halved || !name.ends_with("weight") || name.contains("skip") {
                continue;
            }
            let values = var.flatten_all().and_then(|t| t.to_vec1::<f32>());
            let values: Vec<f32> = values
                .expect("numbers")
                .into_iter()
                .map(|value| rounded(value).expect("in range").to_f32())
                .collect();
            let tensor = Tensor::from_vec(values, var.shape(), &Device::Cpu).expect("shape fits");
            var.set(&tensor).expect("set");
        }
        // The model holds the variables themselves, so it is rounded now.
        let reference = stepped(&CandleEngine(model.clone()), &x, &START);
        for (arch, before) in instruction_sets().into_iter().zip(before) {
            let after = stepped(&*fused(&model, Precision::Single, arch), &x, &START);
            assert_eq!(before, after, "{config:?} {arch:?}");
            assert!(difference(&before, &reference, std) < 2e-5, "{config:?}");
        }
    }
}

#[test]
fn trajectories_together_are_those_one_by_one() {
    for config in configs() {
        for solver in solvers(&config) {
            let model = model(&config, solver);
            let (n, samples) = (model.inputs(), 7);
            for (rows, arch) in [1, 3, 19]
                .into_iter()
                .flat_map(|rows| instruction_sets().into_iter().map(move |arch| (rows, arch)))
            {
                let x = motion(rows * samples, n);
                let start: Vec<f64> = (0..rows * 6).map(|i| START[i % 6] + i as f64).collect();
                for precision in PRECISIONS {
                    let engine = fused(&model, precision, arch);
                    let together = engine
                        .trajectories(&x, &start, &mut Scratch::default())
                        .expect("whole trajectories");
                    let one_by_one: Vec<f64> = x
                        .chunks_exact(samples * n)
                        .zip(start.chunks_exact(6))
                        .flat_map(|(x, start)| stepped(&*engine, x, start))
                        .collect();
                    assert_eq!(
                        together, one_by_one,
                        "{config:?} {rows} rows {precision:?} {arch:?}"
                    );
                }
                let candle = CandleEngine(model.clone());
                let together = candle
                    .trajectories(&x, &start, &mut Scratch::default())
                    .expect("whole trajectories");
                assert_eq!(together.len(), rows * samples * 6);
                let first = stepped(&candle, &x[..n], &start[..6]);
                assert_eq!(together[..6], first[..]);
            }
            for engine in EngineKind::ALL.map(|kind| model.engine(kind).expect("an engine")) {
                let run = |x: &[f64], start: &[f64]| {
                    engine.trajectories(x, start, &mut Scratch::default())
                };
                assert!(run(&[], &[]).expect("none").is_empty());
                for (x, start) in [(n + 1, 6), (n, 5), (n, 0), (3 * n, 12)] {
                    let error = run(&vec![0.0; x], &vec![0.0; start]).expect_err("ragged");
                    assert!(error.to_string().contains("expected ["), "{error}");
                }
            }
        }
    }
}

/// A memory that starts with any sample and takes W more is the memory of these alone.
#[test]
fn the_memory_forgets_what_left_the_window() {
    let model = model(&configs()[0], Solver::Euler);
    let (n, window) = (model.inputs(), model.window());
    let x = motion(3 * window, n);
    for kind in EngineKind::ALL {
        let engine = model.engine(kind).expect("an engine");
        let force = |begin: usize| {
            let mut memory = vec![0.0; engine.memory_len()];
            let mut scratch = Scratch::default();
            engine.start(&x[begin * n..][..n], &START, &mut memory, &mut scratch);
            for sample in x.chunks_exact(n).skip(window) {
                engine.observe(sample, &mut memory, &mut scratch);
            }
            let (mut now, mut next) = ([0.0; 6], [0.0; 6]);
            engine.sample(
                &memory,
                &START,
                &mut now,
                &mut next,
                &mut Scratch::default(),
            );
            next
        };
        let (one, other) = (force(0), force(1));
        // The ring stands elsewhere, and sums run by slot: equal up to rounding.
        assert!(
            difference(&one, &other, &model.normaliser.output_std) < 1e-6,
            "{kind}"
        );
    }
}

/// Nothing in a CNODE's equation brings its state back: thrown to and fro for long, it would be no number.
#[test]
fn a_controlled_state_stays_a_number() {
    let config = configs()
        .into_iter()
        .find(|config| matches!(config, ModelConfig::Cnode(_)))
        .expect("a CNODE");
    for solver in Solver::FIXED {
        let model = model(&config, solver);
        for kind in EngineKind::ALL {
            let engine = model.engine(kind).expect("an engine");
            let mut memory = vec![0.0; engine.memory_len()];
            let mut scratch = Scratch::default();
            let sample =
                |step: usize| vec![if step.is_multiple_of(3) { 1e6 } else { -1e6 }; model.inputs()];
            engine.start(&sample(0), &START, &mut memory, &mut scratch);
            let mut limited = false;
            for step in 1..600 {
                engine.observe(&sample(step), &mut memory, &mut scratch);
                limited |= memory.iter().any(|value| value.abs() >= STATE_LIMIT);
            }
            let (mut now, mut next) = ([0.0; 6], [0.0; 6]);
            engine.sample(&memory, &START, &mut now, &mut next, &mut scratch);
            assert!(
                limited && now.iter().all(|value| value.is_finite()),
                "{solver} {kind}: {now:?}"
            );
        }
    }
}

/// A state that a user overwrote: no panic, and no number stays none.
#[test]
fn a_broken_memory_is_not_hidden() {
    for config in configs() {
        let model = model(&config, Solver::Rk4);
        let (n, mut scratch) = (model.inputs(), Scratch::default());
        let x = motion(1, n);
        for kind in EngineKind::ALL {
            let engine = model.engine(kind).expect("an engine");
            let force = |memory: &[f64]| {
                let (mut now, mut next) = ([0.0; 6], [0.0; 6]);
                engine.sample(memory, &START, &mut now, &mut next, &mut Scratch::default());
                next
            };
            let mut memory = vec![0.0; engine.memory_len()];
            engine.start(&x, &START, &mut memory, &mut scratch);
            let sound = force(&memory);
            assert!(sound.iter().all(|value| value.is_finite()));
            // Everything but the first number, which says where, is broken.
            memory[1..].fill(f64::NAN);
            engine.observe(&x, &mut memory, &mut scratch);
            let whole = model.window() == 1 && !matches!(config, ModelConfig::Lstm(_));
            if !whole {
                let found = force(&memory);
                assert!(
                    found.iter().any(|value| value.is_nan()),
                    "{config:?} {kind}: {found:?}"
                );
            }
            memory[0] = 1e300;
            engine.observe(&x, &mut memory, &mut scratch);
        }
    }
}

/// Where the plugin holds a force back, that is what the next one is relaxed from, and every engine leaves the same share of it.
#[test]
fn a_relaxation_goes_on_from_the_force_that_it_is_given() {
    for (modes, memory) in [(1, 0), (3, 0), (1, 7)] {
        let config = ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![33, 200],
            modes,
            memory,
            ..RelaxationOdeConfig::default()
        });
        let model = model(&config, Solver::Euler);
        let (n, mut scratch) = (model.inputs(), Scratch::default());
        let x = motion(3, n);
        let mut shares = Vec::new();
        for kind in EngineKind::ALL {
            let engine = model.engine(kind).expect("an engine");
            let mut memory = vec![0.0; engine.memory_len()];
            let mut own = Vec::new();
            let force = |memory: &[f64], given: [f64; 6]| {
                let (mut now, mut next) = ([0.0; 6], [0.0; 6]);
                engine.sample(memory, &given, &mut now, &mut next, &mut Scratch::default());
                assert_eq!(now, next);
                now
            };
            engine.start(&x[..n], &START, &mut memory, &mut scratch);
            let first = force(&memory, START);
            let std = &model.normaliser.output_std;
            assert!(difference(&first, &START, std) < 1e-6, "{kind}: {first:?}");
            for x in x[n..].chunks_exact(n) {
                engine.observe(x, &mut memory, &mut scratch);
                let (low, high) = (
                    force(&memory, START),
                    force(&memory, START.map(|f| f + 10.0)),
                );
                for (low, high) in low.iter().zip(&high) {
                    let left = (high - low) / 10.0;
                    assert!(
                        (0.01..0.99).contains(&left),
                        "{modes} modes, {kind}: {left}"
                    );
                    own.push(left);
                }
            }
            shares.push(own);
        }
        let [first, others @ ..] = &shares[..] else {
            panic!("no engine")
        };
        assert!(!others.is_empty());
        for other in others {
            for (one, other) in first.iter().zip(other) {
                // Halves and int16 round the weights of the rates.
                assert!((one - other).abs() < 1e-5, "{modes} modes: {one} {other}");
            }
        }
    }
}

#[test]
fn the_estimate_is_a_fixed_point_and_the_same_in_every_engine() {
    for config in configs() {
        let model = model(&config, Solver::Euler);
        let x = motion(1, model.inputs());
        let mut scratch = Scratch::default();
        let mut settle = |kind| {
            let mut force = vec![0.0; model.outputs()];
            model
                .engine(kind)
                .expect("an engine")
                .estimate(&x, &mut force, &mut scratch);
            force
        };
        let (fused, candle) = (settle(EngineKind::Fused), settle(EngineKind::Candle));
        let std = &model.normaliser.output_std;
        // A running sum does not settle; its rounding grows over the 200 steps.
        assert!(
            difference(&fused, &candle, std) < 1e-3,
            "{fused:?} {candle:?}"
        );
        let settles = match &config {
            ModelConfig::AttentionOde(config) => config.field_sees_force && config.skip,
            ModelConfig::MlpOde(config) => config.field_sees_force && config.skip,
            _ => false,
        };
        if settles {
            let (mut now, mut next) = (fused.clone(), fused.clone());
            let engine = model.engine(EngineKind::Fused).expect("an engine");
            let mut memory = vec![0.0; engine.memory_len()];
            engine.start(&x, &fused, &mut memory, &mut scratch);
            engine.sample(&memory, &fused, &mut now, &mut next, &mut scratch);
            assert!(difference(&next, &fused, std) < 1e-4, "{next:?} {fused:?}");
        }
    }
}

/// The features of one sample, all `value` but for a unit quaternion: an attitude is one whatever the rest does.
fn sample_of(value: f64, n: usize) -> Vec<f64> {
    let mut x = vec![value; n];
    x[4..8].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
    x
}

/// Greatest distance of an engine from Candle [standard deviations].
fn precision_bound(precision: Precision) -> f64 {
    match precision {
        Precision::Single => 2e-5,
        Precision::Half | Precision::Int16 => 5e-3,
    }
}

#[test]
fn extreme_and_denormal_inputs_agree_with_candle() {
    for (config, solver) in with_stages() {
        let model = model(&config, solver);
        let n = model.inputs();
        let std = &model.normaliser.output_std;
        let reference = |x: &[f64], carried: &[f64]| {
            stepped(&CandleEngine(model.clone()), &[x, x].concat(), carried)
        };
        for arch in instruction_sets() {
            for precision in PRECISIONS {
                let engine = fused(&model, precision, arch);
                for value in [0.0, 1e30, -1e300, f64::MAX, f64::INFINITY] {
                    let x = sample_of(value, n);
                    for carried in [0.0, 1e9] {
                        let forces = stepped(&*engine, &[&x[..], &x].concat(), &[carried; 6]);
                        assert!(
                            forces.iter().all(|v| v.is_finite()),
                            "{arch:?} {precision:?} {value}: {forces:?}"
                        );
                        for ((found, want), std) in forces
                            .iter()
                            .zip(reference(&x, &[carried; 6]))
                            .zip(std.iter().cycle())
                        {
                            let bound = precision_bound(precision).max(solver_bound(solver));
                            let bound = bound * (std + want.abs());
                            assert!(
                                (found - want).abs() < bound,
                                "{arch:?} {precision:?} {value} {carried}: {found} {want}"
                            );
                        }
                    }
                    let mut settled = vec![0.0; 6];
                    engine.estimate(&x, &mut settled, &mut Scratch::default());
                    assert!(
                        settled.iter().all(|v| v.is_finite()),
                        "{value}: {settled:?}"
                    );
                }
                // Denormal in f32, before and after standardising, and in f64.
                for value in [f64::from(f32::MIN_POSITIVE) / 8.0, -1e-40, 5e-324] {
                    let (x, carried) = (sample_of(value, n), [10.0 + value; 6]);
                    let error = difference(
                        &stepped(&*engine, &[&x[..], &x].concat(), &carried),
                        &reference(&x, &carried),
                        std,
                    );
                    let bound = precision_bound(precision).max(solver_bound(solver));
                    assert!(error < bound, "{arch:?} {precision:?} {value}: {error}");
                }
            }
        }
    }
}

/// Layers whose weights and activations are denormal: halves have none, singles do as Candle does.
#[test]
fn denormal_weights_agree_with_candle() {
    let config = &configs()[0];
    let (model, parameters) = drawn(config, Solver::Euler);
    for (name, var) in parameters.iter() {
        if name.starts_with("field.0") {
            let small = var.as_tensor().affine(1e-39, 0.0).expect("scaled");
            var.set(&small).expect("set");
        }
    }
    let x = motion(6, model.inputs());
    let reference = stepped(&CandleEngine(model.clone()), &x, &START);
    for arch in instruction_sets() {
        for precision in PRECISIONS {
            let found = stepped(&*fused(&model, precision, arch), &x, &START);
            let error = difference(&found, &reference, &model.normaliser.output_std);
            assert!(error < 2e-3, "{arch:?} {precision:?}: {error}");
        }
    }
}

#[test]
fn a_weight_beyond_halves_is_refused_by_its_value() {
    let (model, parameters) = drawn(&configs()[0], Solver::Euler);
    for (name, var) in parameters.iter() {
        if name == "field.1.weight" {
            let large = var.as_tensor().affine(0.0, -7e4).expect("filled");
            var.set(&large).expect("set");
        }
    }
    let error = model
        .engine(EngineKind::FusedF16)
        .expect_err("beyond a half")
        .to_string();
    assert!(
        error.contains(
            "layer 1 of the field: a weight is -70000, halves reach to 65504; the engine `fused` holds it"
        ),
        "{error}"
    );
    model.engine(EngineKind::Fused).expect("an f32 engine");
}

#[test]
fn a_solver_that_cannot_step_a_model_is_refused() {
    let cnode = ModelConfig::Cnode(CnodeConfig::default());
    let error = cnode
        .check_solver(Solver::DormandPrince)
        .expect_err("a path with fixed nodes");
    assert_eq!(
        error.to_string(),
        "model configuration: solver is dopri5, expected euler or rk4: a CNODE's path has its slopes at the times of \
         fixed steps"
    );
    let inputs = Encoder::new(cnode.encoding(), &layout()).len();
    let built = Parameters::draw(5, |vb| {
        let model = ForceModel::new(
            &cnode,
            &layout(),
            normaliser(inputs),
            Solver::DormandPrince,
            vb,
        );
        assert!(matches!(model, Err(ModelError::Config { .. })));
        Ok(())
    });
    built.expect("asked");
    for config in configs() {
        for solver in Solver::FIXED {
            config.check_solver(solver).expect("of every model");
        }
    }
}

#[test]
fn sizes_that_do_not_go_together_are_refused() {
    let config = ModelConfig::AttentionOde(AttentionOdeConfig {
        embedding: 10,
        ..AttentionOdeConfig::default()
    });
    let error = config.check().expect_err("10 is not divisible by 4");
    assert_eq!(
        error.to_string(),
        "model configuration: embedding 10 is not divisible by 4 heads"
    );
    let model = model(&configs()[0], Solver::Euler);
    let x = Tensor::zeros((1, 3, 7), candle_core::DType::F32, &Device::Cpu).expect("zeros");
    let start = Tensor::zeros((1, 6), candle_core::DType::F32, &Device::Cpu).expect("zeros");
    let error = model.predict(&x, &start).expect_err("7 features");
    assert_eq!(
        error.to_string(),
        "x has shape [1, 3, 7], expected [batch, samples, 15]"
    );
}

#[test]
fn names_are_read_back_and_others_refused() {
    for kind in EngineKind::ALL {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    assert_eq!(
        "onnx".parse::<EngineKind>().expect_err("none").to_string(),
        "unknown engine `onnx`: there are fused, fused-f16, fused-i16 and candle"
    );
}
