//! Exit statuses of `hydro`.

use hydro_training::TrainError;

/// Any failure but those named below. A command line that cannot be parsed is 2, by clap.
const FAILURE: u8 = 1;
/// A training whose loss is no longer a number.
const DIVERGED: u8 = 3;

/// Exit status for an error.
pub(crate) fn exit_status(error: &anyhow::Error) -> u8 {
    match error.downcast_ref() {
        Some(TrainError::Diverged { .. }) => DIVERGED,
        _ => FAILURE,
    }
}

#[cfg(test)]
mod tests {
    use anyhow::Context as _;

    use super::*;

    #[test]
    fn divergence_has_a_status_of_its_own_under_any_context() {
        let diverged = || TrainError::Diverged {
            epoch: 0,
            step: 1,
            loss: f64::NAN,
            learning_rate: 1.0,
        };
        let bare = anyhow::Error::from(diverged());
        let told = Err::<(), _>(diverged())
            .context("2/lstm/seed-0")
            .expect_err("an error");
        assert_eq!([exit_status(&bare), exit_status(&told)], [3, 3]);
        assert_eq!(exit_status(&anyhow::anyhow!("another")), 1);
    }
}
