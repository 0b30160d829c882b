//! `card.json` of a checkpoint whose weights are sound; one that loads is stepped.

use hydro_model::{EngineKind, Scratch, checkpoint::Checkpoint};

use super::{folder, refused, weights::PARTS};

/// Reads a card beside the weights whose digest it names.
pub fn read(bytes: &[u8]) -> bool {
    let names = |digest: &str| bytes.windows(64).any(|text| text == digest.as_bytes());
    let part = PARTS.iter().find(|part| names(&part.digest()));
    let weights = part.unwrap_or(&PARTS[0]).weights;
    folder::put("card/card.json", bytes);
    folder::put("card/weights.safetensors", weights);
    match Checkpoint::load(&folder::path().join("card")) {
        Ok(checkpoint) => step(&checkpoint),
        Err(error) => refused(&error),
    }
}

/// Starts a simulation of an accepted checkpoint and goes on for three samples.
pub(super) fn step(checkpoint: &Checkpoint) -> bool {
    let engine = match checkpoint.engine(EngineKind::Fused, None) {
        Ok(engine) => engine,
        Err(error) => return refused(&error),
    };
    let mut scratch = Scratch::default();
    let mut memory = vec![0.0; engine.memory_len()];
    let (mut now, mut next) = (vec![0.0; engine.outputs()], vec![0.0; engine.outputs()]);
    let mut force = vec![0.0; engine.outputs()];
    for (at, value) in [0.0, 0.1, 1e3].into_iter().enumerate() {
        let x = vec![value; engine.inputs()];
        if at == 0 {
            engine.estimate(&x, &mut force, &mut scratch);
            engine.start(&x, &force, &mut memory, &mut scratch);
        } else {
            engine.observe(&x, &mut memory, &mut scratch);
        }
        engine.sample(&memory, &force, &mut now, &mut next, &mut scratch);
        force.copy_from_slice(&next);
    }
    true
}
