//! The force that a plugin should apply, computed beside it: samples every period, the network once a
//! sample, the line between two samples.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

use hydro_model::{Engine, EngineKind, Scratch, checkpoint::Checkpoint};

pub struct Reference {
    engine: Box<dyn Engine>,
    period: f64,
    scratch: Scratch,
    memory: Vec<f64>,
    taken: f64,
    now: Vec<f64>,
    next: Vec<f64>,
}

impl Reference {
    /// From the first sample of a run, at `time`.
    pub fn new(checkpoint: &Checkpoint, kind: EngineKind, time: f64, x: &[f64]) -> Self {
        let engine = checkpoint.engine(kind, None).unwrap();
        let (mut scratch, forces) = (Scratch::default(), vec![0.0; engine.outputs()]);
        let mut start = forces.clone();
        engine.estimate(x, &mut start, &mut scratch);
        let mut memory = vec![0.0; engine.memory_len()];
        engine.start(x, &start, &mut memory, &mut scratch);
        let mut reference = Self {
            memory,
            period: checkpoint.card.sample_period,
            engine,
            scratch,
            taken: time,
            now: forces.clone(),
            next: forces,
        };
        reference.evaluate(&start);
        reference
    }

    fn evaluate(&mut self, carried: &[f64]) {
        let (now, next) = (&mut self.now, &mut self.next);
        self.engine
            .sample(&self.memory, carried, now, next, &mut self.scratch);
    }

    /// The next sample, one period after the last.
    pub fn sample(&mut self, time: f64, x: &[f64]) {
        self.engine.observe(x, &mut self.memory, &mut self.scratch);
        self.taken = time;
        let carried = self.next.clone();
        self.evaluate(&carried);
    }

    /// The force at `time`, up to a period after the last sample.
    pub fn force(&self, time: f64) -> Vec<f64> {
        let fraction = (time - self.taken) / self.period;
        let between = |(now, next): (&f64, &f64)| now + fraction * (next - now);
        self.now.iter().zip(&self.next).map(between).collect()
    }
}
