//! Our engines, by sample and by trajectory.

use std::{hint::black_box, path::Path, time::Instant};

use hydro_model::{Engine, EngineKind, Scratch, checkpoint::Checkpoint};

use crate::{
    bandwidth::sum,
    error::Result,
    files,
    implementation::{Block, Implementation},
};

/// A checkpoint that walks over recorded samples, one at a time.
pub(crate) struct OneSample {
    state: State,
    samples: Vec<Vec<f64>>,
    evicted: Vec<f32>,
    next: usize,
}

/// State that a simulation keeps between samples.
struct State {
    engine: Box<dyn Engine>,
    memory: Vec<f64>,
    force: Vec<f64>,
    now: Vec<f64>,
    next: Vec<f64>,
    scratch: Scratch,
}

impl State {
    fn new(engine: Box<dyn Engine>) -> Self {
        let outputs = engine.outputs();
        Self {
            memory: vec![0.0; engine.memory_len()],
            force: vec![0.0; outputs],
            now: vec![0.0; outputs],
            next: vec![0.0; outputs],
            scratch: Scratch::default(),
            engine,
        }
    }

    /// No force after a past in which every sample was `x`.
    fn restart(&mut self, x: &[f64]) {
        self.force.fill(0.0);
        self.engine
            .start(x, &self.force, &mut self.memory, &mut self.scratch);
    }

    /// One more sample; the force after it.
    fn step(&mut self, x: &[f64]) {
        self.engine.observe(x, &mut self.memory, &mut self.scratch);
        self.engine.sample(
            &self.memory,
            &self.force,
            &mut self.now,
            &mut self.next,
            &mut self.scratch,
        );
        std::mem::swap(&mut self.force, &mut self.next);
    }
}

fn load(checkpoint: &Path, engine: &str) -> Result<Box<dyn Engine>> {
    let kind: EngineKind = engine.parse()?;
    Ok(Checkpoint::load(checkpoint)?.engine(kind, None)?)
}

impl OneSample {
    pub(crate) fn new(
        checkpoint: &Path,
        inputs: &Path,
        engine: &str,
        evict: usize,
    ) -> Result<Self> {
        let samples = files::rows(files::named(&files::tensors(inputs)?, "x")?)?;
        let mut state = State::new(load(checkpoint, engine)?);
        state.restart(samples.first().ok_or("no samples")?);
        Ok(Self {
            state,
            samples,
            evicted: vec![1.0; evict],
            next: 0,
        })
    }
}

impl Implementation for OneSample {
    /// The forces after every sample, from zero.
    fn check(&mut self) -> Result<Vec<f64>> {
        self.state.restart(&self.samples[0]);
        let mut forces = Vec::new();
        for x in &self.samples {
            self.state.step(x);
            forces.extend_from_slice(&self.state.force);
        }
        self.state.restart(&self.samples[0]);
        Ok(forces)
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let mut seconds = 0.0;
        let mut begin = Instant::now();
        for _ in 0..count {
            if !self.evicted.is_empty() {
                black_box(sum(&self.evicted));
                begin = Instant::now();
            }
            self.state.step(black_box(&self.samples[self.next]));
            black_box(&self.state.force);
            self.next = (self.next + 1) % self.samples.len();
            if !self.evicted.is_empty() {
                seconds += begin.elapsed().as_secs_f64();
            }
        }
        if self.evicted.is_empty() {
            seconds = begin.elapsed().as_secs_f64();
        }
        Ok(Block::timed(seconds))
    }
}

/// A checkpoint that evaluates whole trajectories at once: the recorded samples, `batch` times.
pub(crate) struct WholeTrajectories {
    engine: Box<dyn Engine>,
    x: Vec<f64>,
    start: Vec<f64>,
    scratch: Scratch,
}

impl WholeTrajectories {
    pub(crate) fn new(
        checkpoint: &Path,
        inputs: &Path,
        engine: &str,
        batch: usize,
    ) -> Result<Self> {
        let engine = load(checkpoint, engine)?;
        let samples = files::rows(files::named(&files::tensors(inputs)?, "x")?)?;
        Ok(Self {
            x: samples.concat().repeat(batch),
            start: vec![0.0; batch * engine.outputs()],
            scratch: Scratch::default(),
            engine,
        })
    }

    fn evaluate(&mut self) -> Result<Vec<f64>> {
        Ok(self
            .engine
            .trajectories(&self.x, &self.start, &mut self.scratch)?)
    }
}

impl Implementation for WholeTrajectories {
    /// The last force of the first trajectory.
    fn check(&mut self) -> Result<Vec<f64>> {
        let (forces, outputs) = (self.evaluate()?, self.engine.outputs());
        let length = forces.len() / (self.start.len() / outputs);
        Ok(forces[length - outputs..length].to_vec())
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let begin = Instant::now();
        for _ in 0..count {
            black_box(self.evaluate()?);
        }
        Ok(Block::timed(begin.elapsed().as_secs_f64()))
    }
}
