//! A step of the fused engine takes no memory from the allocator.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::Path;

use allocation_counter::measure;
use hydro_plugin::{
    checkpoint::Checkpoint,
    model::{EngineKind, Scratch, Solver},
};

#[test]
fn samples_are_taken_and_evaluated_without_allocation() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let checkpoint = Checkpoint::load(&root.join("models/b1-task2")).unwrap();
    let count = |kind: EngineKind, solver: Solver| {
        let engine = checkpoint.engine(kind, Some(solver)).unwrap();
        let (mut memory, mut scratch) = (vec![0.0; engine.memory_len()], Scratch::default());
        let mut x = vec![0.1; engine.inputs()];
        let (mut carried, mut now, mut next) = ([0.0; 6], [0.0; 6], [0.0; 6]);
        engine.start(&x, &mut memory);
        engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
        let counted = measure(|| {
            engine.start(&x, &mut memory);
            for step in 0..50 {
                x[3] = 0.01 * f64::from(step);
                engine.observe(&x, &mut memory);
                carried = next;
                engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
            }
        });
        counted.count_total
    };
    for solver in Solver::ALL {
        assert_eq!(count(EngineKind::Fused, solver), 0);
        assert_eq!(count(EngineKind::FusedF16, solver), 0);
        // What is counted is there to be counted.
        assert!(count(EngineKind::Candle, solver) > 50);
    }
}
