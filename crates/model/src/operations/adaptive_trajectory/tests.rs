use candle_core::{DType, Device, Var};

use super::*;
use crate::{
    operations::{activation_cache::Mark, tensor_trajectory::period, trajectory::Trajectory},
    perceptron::Perceptron,
    solver::Solver,
    testing::{numbers, ramp, weighted},
};

const FORCE: usize = 2;
const LATENT: usize = 3;
/// Two chunks, the second one not full.
const ROWS: usize = 18;
const STEPS: usize = 5;

fn config() -> PerceptronConfig {
    PerceptronConfig {
        inputs: FORCE + LATENT,
        outputs: FORCE,
        hidden: vec![7, 5],
        skip: true,
        relaxing: false,
    }
}

/// F_0, h, and weights of a field that pulls the force back within a fraction of a period: steps are many, and of
/// many lengths.
fn arguments() -> [Var; 3] {
    let mut flat = numbers(&(ramp(&[config().count()], 0.77) * 0.8).expect("scaled"));
    let linear = flat.len() - FORCE * config().inputs;
    for axis in 0..FORCE {
        flat[linear + axis * (config().inputs + 1)] -= 6.0;
    }
    let flat = Tensor::new(flat, &Device::Cpu).expect("a vector");
    let latent = (ramp(&[ROWS, STEPS, LATENT], 0.53) * 4.0).expect("scaled");
    [ramp(&[ROWS, FORCE], 0.9), latent, flat]
        .map(|tensor| Var::from_tensor(&tensor).expect("a variable"))
}

fn forces(start: &Tensor, latent: &Tensor, flat: &Tensor) -> Tensor {
    let operation = AdaptiveTrajectory::new(config());
    operation.apply(start, latent, flat).expect("runs")
}

fn gradients(loss: &Tensor, vars: &[Var; 3]) -> [Vec<f64>; 3] {
    let found = loss.backward().expect("derives");
    vars.each_ref()
        .map(|var| numbers(found.get(var).expect("a gradient")))
}

#[test]
fn the_adjoint_agrees_with_candle_on_an_unrolled_graph() {
    let vars = arguments();
    let [start, latent, flat] = &vars;
    let ours = forces(start, latent, flat);
    let field = Perceptron::from_flat(&config(), flat).expect("a field");
    let mut unrolled = vec![start.as_tensor().clone()];
    for step in 0..STEPS {
        let h = latent.narrow(1, step, 1).and_then(|h| h.squeeze(1));
        unrolled.push(period(&field, &unrolled[step], &h.expect("one step")).expect("runs"));
    }
    let theirs = Tensor::stack(&unrolled, 1).expect("stacked");
    let close = |what: &str, ours: &[f64], theirs: &[f64]| {
        let scale = theirs.iter().fold(1e-3f64, |most, v| most.max(v.abs()));
        assert_eq!(ours.len(), theirs.len());
        for (a, b) in ours.iter().zip(theirs) {
            assert!((a - b).abs() < 1e-10 * scale, "{what}: {a} against {b}");
        }
    };
    close("forces", &numbers(&ours), &numbers(&theirs));
    let (ours, theirs) = (
        gradients(&weighted(&ours), &vars),
        gradients(&weighted(&theirs), &vars),
    );
    for (what, (ours, theirs)) in ["F_0", "h", "weights"].iter().zip(ours.iter().zip(&theirs)) {
        close(what, ours, theirs);
    }
}

/// The steps that were taken, of the first chunk, with other numbers; a loss that weighs every force otherwise.
fn replay(taken: &Taken<f64>, [start, latent, flat]: &[Vec<f64>; 3], weights: &[f64]) -> f64 {
    let config = config();
    let field = PerceptronRows::new(&config, flat, false);
    let mut now = start.clone();
    let (mut work, mut out) = (Work::default(), Vec::new());
    let weigh = |now: &[f64], sample: usize| -> f64 {
        now.iter()
            .enumerate()
            .map(|(i, force)| {
                let at = (i / FORCE * (STEPS + 1) + sample) * FORCE + i % FORCE;
                weights[at] * force * force
            })
            .sum()
    };
    let mut loss = weigh(&now, 0);
    for sample in 0..STEPS {
        for (row, length) in &taken.steps[taken.range(sample, sample + 1)] {
            let h = &latent[(row * STEPS + sample) * LATENT..][..LATENT];
            let before = now[row * FORCE..][..FORCE].to_vec();
            let mut slopes = vec![0.0; WEIGHED * FORCE];
            for (stage, a) in A.iter().enumerate().take(WEIGHED) {
                let mut input = vec![0.0; FORCE];
                lean(&mut input, &before, (a, *length), &slopes, FORCE);
                input.extend_from_slice(h);
                field.evaluate(&input, &mut out, &mut work, ());
                slopes[stage * FORCE..][..FORCE].copy_from_slice(&out);
            }
            let after = &mut now[row * FORCE..][..FORCE];
            lean(after, &before, (&B, *length), &slopes, FORCE);
        }
        loss += weigh(&now, sample + 1);
    }
    loss
}

/// Finite differences at the step lengths that were taken, which the gradient holds fixed too.
#[test]
fn the_gradient_agrees_with_finite_differences() {
    const FEW: usize = 5;
    let few = arguments().map(|var| {
        let part = if var.rank() > 1 {
            var.narrow(0, 0, FEW).expect("some rows")
        } else {
            var.as_tensor().clone()
        };
        Var::from_tensor(&part.force_contiguous().expect("rows")).expect("a variable")
    });
    let values = few.each_ref().map(|var| numbers(var));
    let operation = AdaptiveTrajectory::new(config());
    let shapes = few.each_ref().map(|var| var.shape());
    let found = operation.forward(values.each_ref().map(Vec::as_slice), shapes);
    let found = found.expect("runs");
    let taken = operation.taken.get().expect("gone forward");
    let taken = &taken.downcast_ref::<Vec<Taken<f64>>>().expect("in f64")[0];
    assert!(taken.steps.len() > 2 * FEW * STEPS, "{}", taken.steps.len());

    let forces = forces(&few[0], &few[1], &few[2]);
    assert_eq!(numbers(&forces), found);
    let weights = numbers(&ramp(forces.dims(), 0.31));
    let gradient = gradients(&weighted(&forces), &few);
    for (which, gradient) in gradient.iter().enumerate() {
        for index in (0..gradient.len()).step_by(7) {
            let at = |shift: f64| {
                let mut moved = values.clone();
                moved[which][index] += shift;
                replay(taken, &moved, &weights)
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            let error = (slope - gradient[index]).abs();
            assert!(
                error < 1e-7 * slope.abs().max(1.0),
                "{which}, {index}: {slope} against {}",
                gradient[index]
            );
        }
    }
}

/// Classical Runge-Kutta with 200 steps a period, every h held over as many.
#[test]
fn forces_are_those_of_many_small_steps_to_the_tolerance() {
    const TIMES: usize = 200;
    let [start, latent, flat] = arguments();
    let ours = numbers(&forces(&start, &latent, &flat));
    // f / TIMES: the last layer, its bias and the linear part.
    let mut slow = numbers(&flat);
    let last = slow.len() - FORCE * (5 + 1 + config().inputs);
    for weight in &mut slow[last..] {
        *weight /= TIMES as f64;
    }
    let operation = Trajectory {
        field: config(),
        tableau: Solver::Rk4.tableau().expect("of one step"),
        field_sees_force: true,
        adjoint: crate::Adjoint::Discrete,
        cache: None,
        mark: Mark::default(),
    };
    let held = latent
        .reshape((ROWS, STEPS, 1, LATENT))
        .and_then(|h| h.broadcast_as((ROWS, STEPS, TIMES, LATENT)))
        .and_then(|h| h.reshape((ROWS, STEPS * TIMES, LATENT)));
    let slow = Tensor::new(slow, &Device::Cpu).expect("a vector");
    let fine = operation.apply(&start, &held.expect("repeated"), &slow);
    let fine = numbers(&fine.expect("runs"));
    let mut worst = 0.0f64;
    for (row, ours) in ours.chunks_exact((STEPS + 1) * FORCE).enumerate() {
        for (i, ours) in ours.iter().enumerate() {
            let (sample, axis) = (i / FORCE, i % FORCE);
            let exact = fine[(row * (STEPS * TIMES + 1) + sample * TIMES) * FORCE + axis];
            worst = worst.max((ours - exact).abs() / exact.abs().max(1.0));
        }
    }
    assert!(worst < 2e-4 && worst > 1e-9, "{worst}");
}

/// Alone, among others, in single precision, and by whatever threads.
#[test]
fn a_trajectory_does_not_see_its_neighbours() {
    let single = arguments().map(|var| {
        let tensor = var.to_dtype(DType::F32).expect("rounded");
        Var::from_tensor(&tensor).expect("a variable")
    });
    let [start, latent, flat] = &single;
    let bits = |tensor: &Tensor| {
        tensor
            .flatten_all()
            .and_then(|t| t.to_vec1::<f32>())
            .expect("numbers")
    };
    let whole = bits(&forces(start, latent, flat));
    let row = (STEPS + 1) * FORCE;
    for index in 0..ROWS {
        let own = |tensor: &Tensor| tensor.narrow(0, index, 1).expect("a row");
        let alone = bits(&forces(&own(start), &own(latent), flat));
        assert_eq!(alone, whole[index * row..][..row]);
    }
    let run = || {
        let forces = forces(start, latent, flat);
        let weights = ramp(forces.dims(), 0.31).to_dtype(DType::F32);
        let loss = (forces.sqr().expect("squares") * weights.expect("rounded"))
            .and_then(|t| t.sum_all()?.backward())
            .expect("derives");
        let found = single.each_ref();
        found.map(|var| bits(loss.get(var).expect("a gradient")))
    };
    let [one, many] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(run)
    });
    assert_eq!(one, many);

    let double = numbers(&{
        let [start, latent, flat] = arguments();
        forces(&start, &latent, &flat)
    });
    for (single, double) in whole.iter().zip(double) {
        let error = (f64::from(*single) - double).abs();
        assert!(error < 2e-4 * double.abs().max(1.0), "{single} {double}");
    }
}
