//! Options of the stages of `hydro gap`.

use std::path::PathBuf;

use hydro_effects::Medium;

/// Options of every stage. With the same options the stages in --out are reused.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Flags {
    /// Nominal MJCF.
    #[arg(long)]
    pub(super) model: PathBuf,
    /// Folder of trials: npz of mujoco.sysid, or csv.
    #[arg(long)]
    pub(super) trials: PathBuf,
    /// Folder of results. Stages found there, of the same inputs, are not computed again (`add` repeats the fits of `name`).
    #[arg(long)]
    pub(super) out: PathBuf,
    /// Uncertainty of the nominal's numbers (nominal.toml); 3 % if left out.
    #[arg(long)]
    pub(super) uncertainty: Option<PathBuf>,
    /// Folder of effects of your own, NAME.toml each; the folder effects.d beside the model if left out and there.
    #[arg(long)]
    pub(super) effects: Option<PathBuf>,
    /// The medium that the robot moves in: effects of thicker ones are left out. What the model tells of if left out: water where
    /// its fluid is that dense or something floats in it.
    #[arg(long, value_enum)]
    pub(super) medium: Option<MediumFlag>,
    /// Part of the trials that nothing before `verify` opens, above 0 and below 1.
    #[arg(long, default_value_t = 0.25, value_parser = part)]
    pub(super) holdout: f64,
    /// Seed of every draw.
    #[arg(long, default_value_t = 0)]
    pub(super) seed: u64,
    /// Threads; all cores if left out. Results do not depend on it.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Where no effect explains the difference, do not offer a learned residual.
    #[arg(long)]
    pub(super) no_residual: bool,
    /// Start anew though --out holds stages of other inputs.
    #[arg(long)]
    pub(super) overwrite: bool,
    /// Print one JSON value at the end and nothing else on standard output.
    #[arg(long)]
    pub(super) json: bool,
}

/// A medium by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum MediumFlag {
    None,
    Air,
    Water,
}

impl From<MediumFlag> for Medium {
    fn from(flag: MediumFlag) -> Self {
        match flag {
            MediumFlag::None => Self::None,
            MediumFlag::Air => Self::Air,
            MediumFlag::Water => Self::Water,
        }
    }
}

fn part(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if value > 0.0 && value < 1.0 {
        Ok(value)
    } else {
        Err("expected a part above 0 and below 1, such as 0.25".to_owned())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::part;

    #[test]
    fn a_part_is_between_none_and_all() {
        assert!((part("0.25").unwrap() - 0.25).abs() < 1e-12);
        for bad in ["0", "1", "-0.1", "nan", "25%"] {
            assert!(part(bad).unwrap_err().contains("expected"), "{bad}");
        }
    }
}
