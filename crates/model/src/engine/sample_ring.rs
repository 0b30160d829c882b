//! The last samples as a ring in a simulation's memory: `[slot of the newest sample, z of slot 0 [n], .., z of slot W-1 [n]]`.

/// Length of a ring of `window` samples of `inputs` numbers.
pub(super) fn memory_len(window: usize, inputs: usize) -> usize {
    1 + window * inputs
}

/// Fills every slot with the sample that `write` writes.
pub(super) fn fill(memory: &mut [f64], inputs: usize, write: impl FnOnce(&mut [f64])) {
    memory[0] = 0.0;
    let (first, rest) = memory[1..].split_at_mut(inputs);
    write(first);
    for slot in rest.chunks_exact_mut(inputs) {
        slot.copy_from_slice(first);
    }
}

/// Adds the sample that `write` writes, in place of the oldest one.
pub(super) fn push(memory: &mut [f64], inputs: usize, write: impl FnOnce(&mut [f64])) {
    let slots = (memory.len() - 1) / inputs;
    let slot = (newest(memory, slots) + 1) % slots;
    memory[0] = slot as f64;
    write(&mut memory[1 + slot * inputs..][..inputs]);
}

/// Index of the newest slot; always a valid one, whatever number the memory holds.
pub(super) fn newest(memory: &[f64], slots: usize) -> usize {
    memory[0] as usize % slots
}
