//! Warnings about a checkpoint, each with the value found and the one expected.

use hydro_model::{Encoder, checkpoint::Card, envelope::Excess};

use crate::plugin::attributes::FRESH_WATER;

/// Deviations from the mean within which a density counts as trained.
const TRAINED: f64 = 4.0;

/// A warning for the user. The memory in the state sees to it that a fault or a start is told once:
/// each notice comes with a change of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// The step does not divide the sample period: features are interpolated.
    StepDoesNotDivide,
    /// A velocity is out of the network's range, for the first time since the start's own sample.
    OutOfRange(Excess),
    /// A state or a prediction that is no number: zero wrench until a reset.
    NotFinite,
    /// The engine's own fluid acts as well.
    FluidCountedTwice,
    /// The water is unlike any that the model was trained in.
    DensityOutsideTraining {
        /// The attribute [kg/m^3].
        found: f64,
        /// Training range, mean and four standard deviations to each side [kg/m^3].
        trained: (f64, f64),
    },
    /// The model was trained on a path that needs the future.
    ControlReplaced,
    /// The model has no density among its features.
    DensityUnused {
        /// The attribute [kg/m^3].
        found: f64,
    },
}

impl Notice {
    /// Text of the warning, at `time` [s], with steps of `timestep` [s] and samples of `sample_period` [s].
    pub fn text(self, time: f64, timestep: f64, sample_period: f64) -> String {
        match self {
            Self::StepDoesNotDivide => format!(
                "the step of {timestep} s does not divide the checkpoint's sample period of {sample_period} s; \
                 samples are interpolated"
            ),
            Self::OutOfRange(Excess {
                velocity,
                found,
                range: (least, most),
                others,
            }) => {
                let unit = velocity.unit();
                let others = match others {
                    0 => String::new(),
                    more => format!(" (and {more} more)"),
                };
                format!(
                    "`{velocity}` is {found:.3} {unit} at t = {time} s, outside the training range {least:.3} to \
                     {most:.3}{others}: the force is a guess"
                )
            }
            Self::NotFinite => format!(
                "the state or the predicted force is not a number at t = {time} s; the wrench is zero until the \
                 simulation is reset"
            ),
            Self::FluidCountedTwice => {
                "option density or viscosity is above 0, which switches MuJoCo's own fluid \
                 on for every body, so the water counts twice; set both to 0"
                    .to_owned()
            }
            Self::DensityOutsideTraining {
                found,
                trained: (least, most),
            } => format!(
                "attribute `density` is {found} kg/m^3; the checkpoint was trained from {least:.1} to {most:.1} \
                 kg/m^3, and what it predicts elsewhere is a guess"
            ),
            Self::ControlReplaced => {
                "the checkpoint's CNODE was trained on the natural spline of whole trajectories; a simulation has the \
                 past alone and takes the hermite path, so the errors in its card are not those here"
                    .to_owned()
            }
            Self::DensityUnused { found } => format!(
                "attribute `density` is {found} kg/m^3; the checkpoint has no feature `density`, so that \
                 changes nothing"
            ),
        }
    }
}

/// The notice for a density attribute [kg/m^3] that is outside the training data, or that no feature takes.
pub(super) fn density_notice(card: &Card, found: f64) -> Option<Notice> {
    let Some(at) = card.features.density() else {
        let other = (found - FRESH_WATER).abs() > 0.0;
        return other.then_some(Notice::DensityUnused { found });
    };
    let at = Encoder::new(card.model.encoding(), &card.features).index_of(at)?;
    let (mean, std) = (
        card.normaliser.input_mean[at],
        card.normaliser.input_std[at],
    );
    let trained = (mean - TRAINED * std, mean + TRAINED * std);
    let outside = !(trained.0..=trained.1).contains(&found);
    outside.then_some(Notice::DensityOutsideTraining { found, trained })
}
