//! The training loop.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use candle_core::{Device, Tensor, backprop::GradStore};
use hydro_model::{
    Adjoint, Encoder, ForceModel, Network, Outputs, Parameters, Solver,
    architectures::check_count,
    checkpoint::{Card, Checkpoint, DatasetNote, SCHEMA},
};

use super::{
    adamw::{AdamW, StepSettings},
    batch::{Batcher, signed_quaternion},
    config::TrainConfig,
    device::TrainDevice,
    log::{self, LogRecord},
    normaliser::training_normaliser,
    observer::{Observer, TrainProgress},
    range::training_range,
    schedule::learning_rate,
    state::{self, Position},
    windows::{Window, cut_windows, steps_per_epoch},
};
use crate::{
    TrainError,
    dataset::{Dataset, Manifest, Split},
    metrics::{InitialForce, evaluate_model},
};

/// Name of the state inside a run's folder.
const STATE: &str = "state.safetensors";

/// Name of the log inside a run's folder.
const LOG: &str = "log.jsonl";

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainOutcome {
    /// All epochs were run.
    Finished,
    /// The validation error had stopped falling.
    StoppedEarly,
    /// The flag was set; the state on disk lets the run go on.
    Cancelled,
}

/// A training run.
///
/// ```no_run
/// use std::{path::Path, sync::atomic::AtomicBool};
///
/// use hydro_training::{TrainConfig, Trainer, dataset::Dataset};
///
/// let dataset = Dataset::open(Path::new("data/task2"))?;
/// let mut trainer = Trainer::new(TrainConfig::default(), &dataset)?;
/// let run = Path::new("out/run");
/// trainer.resume(run)?;
/// trainer.run(run, &AtomicBool::new(false), &mut ())?;
/// trainer.checkpoint("b1-task2", "hydro train")?.save(Path::new("out/model"))?;
/// # Ok::<(), hydro_training::TrainError>(())
/// ```
#[derive(Debug)]
pub struct Trainer {
    config: TrainConfig,
    manifest: Manifest,
    dataset_sha256: String,
    train: Split,
    validation: Split,
    device: (TrainDevice, Device),
    /// Device of the steps before the last resumption.
    resumed_from: Option<TrainDevice>,
    model: ForceModel,
    parameters: Parameters,
    best: BTreeMap<String, Tensor>,
    optimiser: AdamW,
    position: Position,
}

impl Trainer {
    /// Reads the splits `train` and `val`, takes the normaliser from `train` and draws the weights. Trains on the
    /// processor.
    pub fn new(config: TrainConfig, dataset: &Dataset) -> Result<Self, TrainError> {
        Self::on(TrainDevice::Cpu, config, dataset)
    }

    /// [`Trainer::new`], on a device: weights, solver, gradient and validation; the optimiser is on the processor.
    ///
    /// # Errors
    /// Also a device that this build or this machine does not have.
    pub fn on(
        device: TrainDevice,
        config: TrainConfig,
        dataset: &Dataset,
    ) -> Result<Self, TrainError> {
        config.check()?;
        if config.adjoint == Adjoint::Continuous && device != TrainDevice::Cpu {
            return Err(TrainError::Config {
                field: "adjoint",
                found: config.adjoint.to_string(),
                expected: format!("discrete on {device}; the other is for the processor alone"),
            });
        }
        if device != TrainDevice::Cpu && !config.model.trains_on_any_device() {
            return Err(TrainError::Config {
                field: "device",
                found: device.to_string(),
                expected: format!("cpu, the only one of the model {}", config.model.kind()),
            });
        }
        if device != TrainDevice::Cpu
            && config.model.steps_a_field()
            && config.solver == Solver::DormandPrince
        {
            return Err(TrainError::Config {
                field: "solver",
                found: config.solver.to_string(),
                expected: format!("euler or rk4 on {device}; it is for the processor alone"),
            });
        }
        let device = (device, device.open()?);
        let dataset = &dataset.clone().with_outputs(config.outputs)?;
        let train = dataset.split("train", config.trajectories)?;
        let validation = dataset.split("val", None)?;
        if train.is_empty() {
            return Err(TrainError::Split {
                split: "train",
                reason: format!(
                    "of {} is empty: it needs a trajectory at least, make a larger data set",
                    dataset.folder().display()
                ),
            });
        }
        let manifest = dataset.manifest().clone();
        config.model.check_features(&manifest.features)?;
        let encoder = Encoder::new(config.model.encoding(), &manifest.features);
        check_count(&config.model, encoder.len(), manifest.outputs.len())?;
        let normaliser = training_normaliser(&train, &encoder, config.labels);
        let (inputs, outputs) = (encoder.len(), manifest.outputs.len());
        let (network, parameters) = Parameters::draw_on(&device.1, config.seed, |vb| {
            Network::new(&config.model, inputs, outputs, vb)
        })?;
        let model = ForceModel {
            encoder,
            normaliser,
            network,
            solver: config.solver,
            config: config.model.clone(),
        };
        Ok(Self {
            config,
            manifest,
            dataset_sha256: dataset.sha256().to_owned(),
            train,
            validation,
            device,
            resumed_from: None,
            model,
            parameters,
            best: BTreeMap::new(),
            optimiser: AdamW::default(),
            position: Position::default(),
        })
    }

    /// Goes back to where a run in `folder` stopped; false where there is none. Refuses a state made with
    /// other settings or data; a state made on another device is gone on with, and ends within rounding of what
    /// either device alone would have given.
    pub fn resume(&mut self, folder: &Path) -> Result<bool, TrainError> {
        let path = folder.join(STATE);
        // What stands there and is no file is refused where it is read.
        if path.symlink_metadata().is_err() {
            return Ok(false);
        }
        let state = state::load(
            &path,
            (&self.config, &self.dataset_sha256),
            &self.parameters,
        )?;
        self.parameters.restore(&state.weights)?;
        self.best = state.best;
        self.optimiser = state.optimiser;
        self.position = state.position;
        self.resumed_from = Some(state.device);
        Ok(true)
    }

    /// Refuses a finished checkpoint that these settings and data would not give.
    pub fn check_card(&self, card: &Card) -> Result<(), TrainError> {
        let data = card
            .dataset
            .as_ref()
            .map_or("", |note| note.sha256.as_str());
        let pairs = [
            (
                "model",
                format!("{:?}", self.config.model),
                format!("{:?}", card.model),
            ),
            (
                "solver",
                self.config.solver.to_string(),
                card.solver.to_string(),
            ),
            (
                "kind of outputs",
                Outputs::of(&self.manifest.outputs).to_string(),
                Outputs::of(&card.outputs).to_string(),
            ),
            ("data set", self.dataset_sha256.clone(), data.to_owned()),
        ];
        for (what, expected, found) in pairs {
            if expected != found {
                return Err(TrainError::OtherCheckpoint {
                    what,
                    found,
                    expected,
                });
            }
        }
        Ok(())
    }

    /// Device of the steps before the last [`Trainer::resume`]; `None` without one.
    pub fn resumed_from(&self) -> Option<TrainDevice> {
        self.resumed_from
    }

    /// False where the validation split is empty: the weights are then those of the last epoch.
    pub fn validates(&self) -> bool {
        !self.validation.is_empty()
    }

    /// Number of weights.
    pub fn parameter_count(&self) -> usize {
        self.parameters.count()
    }

    /// Steps of a whole run.
    pub fn steps(&self) -> usize {
        self.config.epochs * steps_per_epoch(&self.config, &self.train)
    }

    /// The log so far.
    pub fn log(&self) -> &[LogRecord] {
        &self.position.log
    }

    /// Trains on to the end, or until `cancel` is set. After every epoch, and when cancelled, `folder` holds
    /// the state to go on from and the log.
    pub fn run(
        &mut self,
        folder: &Path,
        cancel: &AtomicBool,
        observer: &mut dyn Observer,
    ) -> Result<TrainOutcome, TrainError> {
        fs::create_dir_all(folder).map_err(|source| TrainError::Io {
            path: folder.to_owned(),
            source,
        })?;
        let per_epoch = steps_per_epoch(&self.config, &self.train);
        let steps = self.steps();
        let samples = self.config.horizon.min(self.train.samples());
        let (began, done_before) = (Instant::now(), self.position.step);
        let mut rate = learning_rate(&self.config, self.position.step.saturating_sub(1), steps);
        while !self.position.finished && self.position.epoch < self.config.epochs {
            let windows = cut_windows(&self.config, &self.train, self.position.epoch);
            for chunk in windows
                .chunks(self.config.batch)
                .take(per_epoch)
                .skip(self.position.step_in_epoch)
            {
                if cancel.load(Ordering::Relaxed) {
                    self.save(folder)?;
                    return Ok(TrainOutcome::Cancelled);
                }
                rate = learning_rate(&self.config, self.position.step, steps);
                let loss = self.step(chunk, samples, rate)?;
                self.position.step += 1;
                self.position.step_in_epoch += 1;
                self.position.loss_sum += loss;
                let pace =
                    began.elapsed().as_secs_f64() / (self.position.step - done_before) as f64;
                observer.step(&TrainProgress {
                    epoch: self.position.epoch,
                    epochs: self.config.epochs,
                    step: self.position.step,
                    steps,
                    loss: self.position.loss_sum / self.position.step_in_epoch as f64,
                    learning_rate: rate,
                    best: self.position.best,
                    remaining_secs: pace * (steps - self.position.step) as f64,
                });
            }
            self.close_epoch(rate, observer)?;
            self.save(folder)?;
        }
        Ok(if self.position.epoch < self.config.epochs {
            TrainOutcome::StoppedEarly
        } else {
            TrainOutcome::Finished
        })
    }

    /// One step of the optimiser; the loss before it.
    fn step(&mut self, windows: &[Window], samples: usize, rate: f64) -> Result<f64, TrainError> {
        let batcher = Batcher {
            split: &self.train,
            encoder: &self.model.encoder,
            normaliser: &self.model.normaliser,
            quaternion: signed_quaternion(self.config.model.encoding(), &self.manifest.features),
            past: self.model.window() - 1,
            labels: self.config.labels,
        };
        let batch = batcher.batch(windows, samples)?.to_device(&self.device.1)?;
        let loss = |adjoint| {
            let network = &self.model.network;
            let forces =
                network.forward_with(&batch.z, &batch.start, self.config.solver, adjoint)?;
            (forces - &batch.target)?.sqr()?.mean_all()
        };
        let adjoint = self.config.adjoint;
        let exact = (adjoint == Adjoint::Continuous && self.position.step_in_epoch == 0)
            .then(|| loss(Adjoint::Discrete)?.backward())
            .transpose()?;
        let loss = loss(adjoint)?;
        let value = f64::from(loss.to_scalar::<f32>()?);
        let step = StepSettings {
            learning_rate: rate,
            weight_decay: self.config.weight_decay,
            clip_norm: self.config.clip_norm,
        };
        let diverged = |loss: f64| TrainError::Diverged {
            epoch: self.position.epoch,
            step: self.position.step,
            loss,
            learning_rate: rate,
        };
        if !value.is_finite() {
            return Err(diverged(value));
        }
        // An estimate of the first force has weights of its own: the trajectory's gradient stays what it was, but for the
        // clip, which looks at all of them.
        let network = &self.model.network;
        let whole = match network.estimate_loss(&batch.z, &batch.start)? {
            Some(estimate) => (loss + estimate)?,
            None => loss,
        };
        let gradients = whole.backward()?;
        if let Some(exact) = exact {
            let error = distance(&self.parameters, &gradients, &exact)?;
            self.position.adjoint_error = Some(error);
        }
        let norm = self.optimiser.step(&self.parameters, &gradients, step)?;
        if norm.is_finite() {
            Ok(value)
        } else {
            Err(diverged(norm))
        }
    }

    /// Validates where there is a split for it, remembers the best weights, writes the epoch's line.
    fn close_epoch(&mut self, rate: f64, observer: &mut dyn Observer) -> Result<(), TrainError> {
        let validation = self
            .validates()
            .then(|| {
                evaluate_model(
                    &self.model,
                    &self.manifest.outputs,
                    &self.validation,
                    InitialForce::Recorded,
                )
            })
            .transpose()?;
        let errors = validation.as_ref().map(|of| &of.errors);
        let place = &mut self.position;
        if let Some(errors) = errors {
            if place
                .best
                .is_none_or(|best| best.is_nan() || errors.pooled < best)
            {
                place.best = Some(errors.pooled);
                place.since_best = 0;
                self.best = self.parameters.snapshot()?;
            } else {
                place.since_best += 1;
            }
        }
        let record = LogRecord {
            epoch: place.epoch,
            step: place.step,
            loss: place.loss_sum / place.step_in_epoch.max(1) as f64,
            learning_rate: rate,
            validation: errors.map(|of| of.pooled),
            validation_hydrodynamic: errors.map(|of| of.pooled_hydrodynamic),
            best: place.best,
            adjoint_error: place.adjoint_error.take(),
        };
        place.log.push(record.clone());
        place.epoch += 1;
        place.step_in_epoch = 0;
        place.loss_sum = 0.0;
        place.finished =
            place.since_best >= self.config.patience || place.epoch >= self.config.epochs;
        observer.epoch(&record, validation.as_ref());
        Ok(())
    }

    fn save(&self, folder: &Path) -> Result<(), TrainError> {
        let run = (&self.config, self.dataset_sha256.as_str());
        let weights = (&self.parameters, &self.best);
        state::save(
            &folder.join(STATE),
            run,
            self.device.0,
            &self.position,
            weights,
            &self.optimiser,
        )?;
        log::write(&folder.join(LOG), &self.position.log)
    }

    /// The best weights so far (the present ones before the first epoch has ended and without a validation split), with a card.
    pub fn checkpoint(&self, name: &str, command: &str) -> Result<Checkpoint, TrainError> {
        let manifest = &self.manifest;
        let card = Card {
            schema: SCHEMA.to_owned(),
            name: name.to_owned(),
            model: self.config.model.clone(),
            features: manifest.features.clone(),
            feature_units: manifest.feature_units.clone(),
            outputs: manifest.outputs.clone(),
            output_units: manifest.output_units.clone(),
            frames: manifest.frames.clone(),
            joints: manifest.features.joints(),
            sample_period: manifest.sample_period,
            residual: false,
            water: manifest.water.clone(),
            added_mass: manifest.added_mass.clone(),
            envelope: Some(training_range(&self.train, self.config.labels)),
            solver: self.config.solver,
            normaliser: self.model.normaliser.clone(),
            dataset: Some(DatasetNote {
                name: manifest.name.clone(),
                sha256: self.dataset_sha256.clone(),
                trajectories: self.train.len(),
            }),
            metrics: serde_json::Value::Null,
            command: command.to_owned(),
            hydro: env!("CARGO_PKG_VERSION").to_owned(),
            weights_sha256: String::new(),
            card_sha256: String::new(),
        };
        let weights = if self.best.is_empty() {
            self.parameters.snapshot()?
        } else {
            self.best.clone()
        };
        Ok(Checkpoint::new(card, weights)?)
    }
}

/// |g - exact| / |exact| over all weights.
fn distance(
    parameters: &Parameters,
    gradients: &GradStore,
    exact: &GradStore,
) -> Result<f64, TrainError> {
    let (mut off, mut whole) = (0.0, 0.0);
    for (_, var) in parameters.iter() {
        if let (Some(g), Some(exact)) = (gradients.get(var), exact.get(var)) {
            let square = |t: Tensor| t.sqr()?.sum_all()?.to_scalar::<f32>();
            off += f64::from(square((g - exact)?)?);
            whole += f64::from(square(exact.clone())?);
        }
    }
    Ok((off / whole.max(f64::MIN_POSITIVE)).sqrt())
}

#[cfg(test)]
#[path = "tests/run.rs"]
mod tests;
