//! The last samples as a ring in a simulation's memory: `[slot of the newest sample, z of slot 0 [n], .., z of slot W-1 [n]]`.

/// How many numbers a past of `window` samples of `inputs` numbers takes.
pub(super) fn memory_len(window: usize, inputs: usize) -> usize {
    1 + window * inputs
}

/// Every slot holds what `write` puts there.
pub(super) fn fill(memory: &mut [f64], inputs: usize, write: impl FnOnce(&mut [f64])) {
    memory[0] = 0.0;
    let (first, rest) = memory[1..].split_at_mut(inputs);
    write(first);
    for slot in rest.chunks_exact_mut(inputs) {
        slot.copy_from_slice(first);
    }
}

/// The slot after the newest takes what `write` puts there and is the newest.
pub(super) fn push(memory: &mut [f64], inputs: usize, write: impl FnOnce(&mut [f64])) {
    let slots = (memory.len() - 1) / inputs;
    let slot = (newest(memory, slots) + 1) % slots;
    memory[0] = slot as f64;
    write(&mut memory[1 + slot * inputs..][..inputs]);
}

/// The newest slot; any number in the memory gives one of the slots.
pub(super) fn newest(memory: &[f64], slots: usize) -> usize {
    memory[0] as usize % slots
}
