//! A step of the fused engine takes no memory from the allocator.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::path::Path;

use allocation_counter::measure;
use hydro_plugin::{
    checkpoint::Checkpoint,
    model::{Engine, EngineKind, Scratch, Solver},
    plugin::{Registry, Settings, search::SearchPath},
};

/// What the allocator is asked for while a fresh start and 50 samples are evaluated.
fn allocations(checkpoint: &Checkpoint, kind: EngineKind, solver: Solver) -> u64 {
    counted(&*checkpoint.engine(kind, Some(solver)).unwrap())
}

fn counted(engine: &dyn Engine) -> u64 {
    let (mut memory, mut scratch) = (vec![0.0; engine.memory_len()], Scratch::default());
    let mut x = vec![0.1; engine.inputs()];
    let (mut carried, mut now, mut next) = ([0.0; 6], [0.0; 6], [0.0; 6]);
    engine.start(&x, &carried, &mut memory, &mut scratch);
    engine.observe(&x, &mut memory, &mut scratch);
    engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
    let info = measure(|| {
        engine.start(&x, &carried, &mut memory, &mut scratch);
        for step in 0..50 {
            x[3] = 0.01 * f64::from(step);
            engine.observe(&x, &mut memory, &mut scratch);
            carried = next;
            engine.sample(&memory, &carried, &mut now, &mut next, &mut scratch);
        }
    });
    info.count_total
}

#[test]
fn samples_are_taken_and_evaluated_without_allocation() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let released = Checkpoint::load(&root.join("models/b1-task2")).unwrap();
    let others = common::zoo(&["fin"]);
    let checkpoints = others
        .iter()
        .map(common::Recipe::checkpoint)
        .chain([released]);
    for checkpoint in checkpoints {
        let name = checkpoint.card.model.kind();
        let model = &checkpoint.card.model;
        let fits = |solver: &Solver| model.check_solver(*solver).is_ok();
        for solver in Solver::ALL.into_iter().filter(fits) {
            for kind in [EngineKind::Fused, EngineKind::FusedF16] {
                assert_eq!(allocations(&checkpoint, kind, solver), 0, "{name} {kind}");
            }
            // What is counted is there to be counted.
            assert!(allocations(&checkpoint, EngineKind::Candle, solver) > 50);
        }
    }
}

/// As the plugin has it: held within the range of its training.
#[test]
fn nor_is_there_any_in_what_holds_a_network_to_its_range() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/b1-task2");
    let registry = Registry::default();
    let loaded = registry.checkpoint(&folder).unwrap();
    assert!(loaded.checkpoint.card.envelope.is_some());
    let text = |name| (name == "checkpoint").then(|| folder.display().to_string());
    let settings = Settings::parse(text, &SearchPath::default()).unwrap();
    let engine = registry.engine(&loaded, &settings).unwrap();
    let bare = loaded.checkpoint.engine(settings.engine, None).unwrap();
    assert!(engine.memory_len() > bare.memory_len());
    assert_eq!(counted(&*engine), 0);
}
