//! Range of the training data, which the checkpoint keeps as its envelope.

use hydro_model::envelope::Envelope;

use super::config::Labels;
use crate::dataset::Split;

/// Least and greatest features and forces of a split, as a network is shown them.
pub(super) fn training_range(train: &Split, labels: Labels) -> Envelope {
    let (least, most) = range(train.inputs(), (0..train.len()).map(|at| train.x(at)));
    let forces = (0..train.len()).map(|at| match labels {
        Labels::Perturbed => train.wrench(at),
        Labels::Clean => train.clean(at),
    });
    let (least_force, most_force) = range(train.outputs(), forces);
    Envelope {
        least,
        most,
        least_force,
        most_force,
    }
}

/// Least and greatest of each column of rows.
fn range<'a>(
    columns: usize,
    trajectories: impl Iterator<Item = &'a [f32]>,
) -> (Vec<f64>, Vec<f64>) {
    let mut least = vec![f64::INFINITY; columns];
    let mut most = vec![f64::NEG_INFINITY; columns];
    for row in trajectories.flat_map(|rows| rows.chunks_exact(columns)) {
        for ((value, least), most) in row.iter().zip(&mut least).zip(&mut most) {
            *least = least.min(f64::from(*value));
            *most = most.max(f64::from(*value));
        }
    }
    (least, most)
}
