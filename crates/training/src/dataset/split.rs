//! Trajectories in memory.

use std::path::Path;

use hydro_model::document::hexadecimal;
use safetensors::{Dtype, SafeTensors};
use sha2::{Digest as _, Sha256};

use super::{
    error::DatasetError,
    manifest::{Manifest, ShardEntry},
};

/// Trajectories of equal length, one after the other; all SI.
#[derive(Clone, Debug)]
pub struct Split {
    samples: usize,
    inputs: usize,
    outputs: usize,
    /// [M, T, n]
    x: Vec<f32>,
    /// [M, T, f], perturbed.
    wrench: Vec<f32>,
    /// [M, T, f]
    clean: Vec<f32>,
    /// [M, T, f]
    hydrostatic: Vec<f32>,
    /// [T]
    time: Vec<f32>,
    /// [M, T]
    condition: Vec<i32>,
}

impl Split {
    pub(super) fn empty(manifest: &Manifest) -> Self {
        Self {
            samples: manifest.samples,
            inputs: manifest.features.len(),
            outputs: manifest.outputs.len(),
            x: Vec::new(),
            wrench: Vec::new(),
            clean: Vec::new(),
            hydrostatic: Vec::new(),
            time: Vec::new(),
            condition: Vec::new(),
        }
    }

    /// M, trajectories.
    pub fn len(&self) -> usize {
        self.condition.len() / self.samples
    }

    /// True without a trajectory.
    pub fn is_empty(&self) -> bool {
        self.condition.is_empty()
    }

    /// T, samples a trajectory.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// n, features a sample.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// f, force components.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Features of a trajectory, [T, n].
    pub fn x(&self, trajectory: usize) -> &[f32] {
        let size = self.samples * self.inputs;
        &self.x[trajectory * size..][..size]
    }

    /// Perturbed wrench of a trajectory, [T, f].
    pub fn wrench(&self, trajectory: usize) -> &[f32] {
        self.rows(&self.wrench, trajectory)
    }

    /// Clean wrench of a trajectory, [T, f].
    pub fn clean(&self, trajectory: usize) -> &[f32] {
        self.rows(&self.clean, trajectory)
    }

    /// Buoyancy part of the clean wrench, [T, f].
    pub fn hydrostatic(&self, trajectory: usize) -> &[f32] {
        self.rows(&self.hydrostatic, trajectory)
    }

    /// Sample times [s], [T]; none where there is no trajectory.
    pub fn time(&self) -> &[f32] {
        &self.time
    }

    /// Condition of every sample of a trajectory, [T].
    pub fn condition(&self, trajectory: usize) -> &[i32] {
        &self.condition[trajectory * self.samples..][..self.samples]
    }

    /// Hands every sample's features [n] to `edit`, trajectory after trajectory, to be changed in place.
    pub fn edit_samples(&mut self, mut edit: impl FnMut(&mut [f32])) {
        self.x.chunks_exact_mut(self.inputs).for_each(&mut edit);
    }

    fn rows<'a>(&self, values: &'a [f32], trajectory: usize) -> &'a [f32] {
        let size = self.samples * self.outputs;
        &values[trajectory * size..][..size]
    }

    pub(super) fn append(&mut self, other: Self) {
        self.x.extend(other.x);
        self.wrench.extend(other.wrench);
        self.clean.extend(other.clean);
        self.hydrostatic.extend(other.hydrostatic);
        self.condition.extend(other.condition);
        self.time = other.time;
    }

    /// Keeps the first so many trajectories; all where there are fewer.
    pub(super) fn truncate(&mut self, trajectories: usize) {
        let rows = trajectories.min(self.len()) * self.samples;
        self.x.truncate(rows * self.inputs);
        for values in [&mut self.wrench, &mut self.clean, &mut self.hydrostatic] {
            values.truncate(rows * self.outputs);
        }
        self.condition.truncate(rows);
    }

    /// Reads and checks one shard. The last `joints` outputs of the manifest are torques of joints.
    pub(super) fn read(
        folder: &Path,
        entry: &ShardEntry,
        manifest: &Manifest,
        joints: usize,
    ) -> Result<Self, DatasetError> {
        let path = folder.join(&entry.file);
        // Twice what its numbers take, and its header: a safetensors file holds nothing else.
        let most = manifest.bytes(entry).unwrap_or(0).saturating_mul(2) + hydro_files::TEXT;
        let bytes = hydro_files::read(&path, most).map_err(|source| DatasetError::Io {
            path: path.clone(),
            source,
        })?;
        let found = hexadecimal(&Sha256::digest(&bytes));
        if found != entry.sha256 {
            return Err(DatasetError::Damaged {
                path,
                found,
                expected: entry.sha256.clone(),
            });
        }
        let tensors = SafeTensors::deserialize(&bytes).map_err(|error| DatasetError::Format {
            path: path.clone(),
            reason: hydro_files::short(error),
        })?;
        let shard = Shard {
            path: &path,
            tensors,
        };
        let (m, t) = (entry.trajectories, manifest.samples);
        let features: Vec<String> = manifest
            .features
            .features()
            .iter()
            .map(ToString::to_string)
            .collect();
        let (n, f) = (features.len(), manifest.outputs.len());
        let forces = Forces {
            shard: &shard,
            shape: [m, t],
            outputs: &manifest.outputs,
            joints,
        };
        Ok(Self {
            samples: t,
            inputs: n,
            outputs: f,
            x: shard.rows("x", [m, t, n], &features)?,
            wrench: forces.rows("wrench", "generalised")?,
            clean: forces.rows("wrench_clean", "generalised")?,
            hydrostatic: forces.rows_or_zero("hydrostatic", "generalised_hydrostatic")?,
            time: shard.rows("time", [1, t, 1], &["time".to_owned()])?,
            condition: shard
                .words("condition", Dtype::I32, &[m, t])?
                .map(i32::from_le_bytes)
                .collect(),
        })
    }
}

/// The forces of a shard: components of the wrench, then torques of joints from a tensor of all degrees of freedom.
struct Forces<'a> {
    shard: &'a Shard<'a>,
    /// M, T.
    shape: [usize; 2],
    outputs: &'a [String],
    joints: usize,
}

impl Forces<'_> {
    /// Rows [M, T, f] of a tensor of wrenches and one of generalised forces.
    fn rows(&self, wrench: &str, generalised: &str) -> Result<Vec<f32>, DatasetError> {
        let ([m, t], base) = (self.shape, self.outputs.len() - self.joints);
        let wrench = self
            .shard
            .rows(wrench, [m, t, base], &self.outputs[..base])?;
        if self.joints == 0 {
            return Ok(wrench);
        }
        let all = self.outputs.len();
        let whole = self.shard.rows(generalised, [m, t, all], self.outputs)?;
        let rows = wrench.chunks_exact(base).zip(whole.chunks_exact(all));
        Ok(rows
            .flat_map(|(wrench, whole)| wrench.iter().chain(&whole[base..]).copied())
            .collect())
    }

    /// The same, with zeros for a tensor that is not there.
    fn rows_or_zero(&self, wrench: &str, generalised: &str) -> Result<Vec<f32>, DatasetError> {
        let names = self.shard.tensors.names();
        let is_there = |name: &str| names.contains(&name);
        if is_there(wrench) && (self.joints == 0 || is_there(generalised)) {
            return self.rows(wrench, generalised);
        }
        // As many as the wrench has: its size is known to be there.
        let mut rows = self.rows("wrench", "generalised")?;
        rows.fill(0.0);
        Ok(rows)
    }
}

/// One file, opened.
struct Shard<'a> {
    path: &'a Path,
    tensors: SafeTensors<'a>,
}

impl Shard<'_> {
    /// The four-byte words of a tensor of the expected type and shape.
    fn words(
        &self,
        name: &str,
        dtype: Dtype,
        shape: &[usize],
    ) -> Result<impl Iterator<Item = [u8; 4]>, DatasetError> {
        let refuse = |found: String| DatasetError::Tensor {
            path: self.path.to_owned(),
            name: name.to_owned(),
            found,
            expected: format!("{dtype:?} {shape:?}"),
        };
        let view = self.tensors.tensor(name).map_err(|_| {
            let mut names: Vec<&str> = self.tensors.names();
            names.sort_unstable();
            refuse(format!("missing (there are: {})", names.join(", ")))
        })?;
        if view.dtype() != dtype || view.shape() != shape {
            return Err(refuse(format!("{:?} {:?}", view.dtype(), view.shape())));
        }
        let (words, _) = view.data().as_chunks::<4>();
        Ok(words.iter().copied())
    }

    /// Finite numbers of shape [M, T, columns]; a lone trajectory of one column is a vector [T].
    fn rows(
        &self,
        name: &str,
        shape: [usize; 3],
        columns: &[String],
    ) -> Result<Vec<f32>, DatasetError> {
        let [_, samples, width] = shape;
        let shape = if name == "time" {
            &shape[1..2]
        } else {
            &shape[..]
        };
        let values: Vec<f32> = self
            .words(name, Dtype::F32, shape)?
            .map(f32::from_le_bytes)
            .collect();
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(index) => Err(DatasetError::NonFinite {
                path: self.path.to_owned(),
                tensor: name.to_owned(),
                trajectory: index / (samples * width),
                row: index / width % samples,
                column: columns[index % width].clone(),
                value: values[index],
            }),
        }
    }
}
