//! A step of the fused engine takes no memory from the allocator.

use std::path::Path;

use allocation_counter::measure;
use hydro_model::{
    EngineKind, Scratch, Solver, checkpoint::Checkpoint, envelope::Limits, features::Feature,
};

/// Allocations during a fresh start and 50 samples.
fn allocations(checkpoint: &Checkpoint, kind: EngineKind, solver: Solver) -> u64 {
    let engine = checkpoint.engine(kind, Some(solver)).unwrap();
    let (mut memory, mut scratch) = (vec![0.0; engine.memory_len()], Scratch::default());
    let mut x = vec![0.1; engine.inputs()];
    let (mut carried, mut now, mut next) = ([0.0; 6], [0.0; 6], [0.0; 6]);
    engine.start(&x, &carried, &mut memory, &mut scratch);
    engine.observe(&x, &mut memory, &mut scratch);
    engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
    let counted = measure(|| {
        engine.start(&x, &carried, &mut memory, &mut scratch);
        for step in 0..50 {
            x[3] = 0.01 * f64::from(step);
            engine.observe(&x, &mut memory, &mut scratch);
            carried = next;
            engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
        }
    });
    counted.count_total
}

#[test]
fn samples_are_taken_and_evaluated_without_allocation() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let released = Checkpoint::load(&root.join("models/b1-task2")).unwrap();
    let others = crate::common::zoo(&["fin"]);
    let checkpoints = others
        .iter()
        .map(crate::common::Recipe::checkpoint)
        .chain([released]);
    for checkpoint in checkpoints {
        let name = checkpoint.card.model.kind();
        let model = &checkpoint.card.model;
        let fits = |solver: &Solver| model.check_solver(*solver).is_ok();
        for solver in Solver::ALL.into_iter().filter(fits) {
            for kind in [
                EngineKind::Fused,
                EngineKind::FusedF16,
                EngineKind::FusedI16,
            ] {
                assert_eq!(allocations(&checkpoint, kind, solver), 0, "{name} {kind}");
            }
            // What is counted is there to be counted.
            assert!(allocations(&checkpoint, EngineKind::Candle, solver) > 50);
        }
    }
}

/// The plugin's work on every sample and force.
#[test]
fn nor_is_there_any_in_what_holds_a_network_to_its_range() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/b1-task2");
    let card = Checkpoint::load(&folder).unwrap().card;
    let limits = Limits::new(card.envelope.unwrap(), &card.features, &card.outputs);
    let (mut x, mut drag, mut force) = (vec![9.0; card.features.len()], [0.0; 6], [1e6; 6]);
    let speed = card.features.index_of(&Feature::LinearVelocity(0)).unwrap();
    let counted = measure(|| {
        limits.drag(&x, &mut drag);
        limits.hold(&mut x);
        limits.hold_force(&mut force);
    });
    assert!(drag[0] < 0.0 && x[speed] < 9.0 && force[0] < 1e6);
    assert_eq!(counted.count_total, 0);
}
