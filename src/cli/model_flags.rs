//! Options that choose a model: its kind, and sizes in place of the preset's.

use anyhow::bail;
use clap::ValueEnum;
use hydro_model::{
    AttentionOdeConfig, CnodeConfig, Control, Encoding, LstmConfig, MlpConfig, MlpOdeConfig,
    ModelConfig, RelaxationOdeConfig, Solver, Tokens, kinematics::Kinematics,
};

/// Kind and sizes of the model.
#[derive(Debug, clap::Args)]
pub(super) struct ModelFlags {
    /// Kind of model.
    #[arg(long, value_enum, default_value_t = Kind::AttentionOde)]
    model: Kind,
    /// Hidden widths of the field, such as 512,512,512; for an LSTM, widths of its layers.
    #[arg(long, value_delimiter = ',')]
    hidden: Option<Vec<usize>>,
    /// Past samples in the attention's window, or in a Relaxation-ODE's differences.
    #[arg(long)]
    window: Option<usize>,
    /// Modes of a Relaxation-ODE. The force is their sum; each has its own memory length. Legs towed in each other's wakes
    /// need several.
    #[arg(long)]
    modes: Option<usize>,
    /// Numbers of a Relaxation-ODE's memory, each relaxing at its own learned rate; the force reads them. For water that remembers.
    #[arg(long)]
    memory: Option<usize>,
    /// What the attention attends to: past samples, or, as the paper says it, the numbers of the condition vector (the present
    /// sample's; with --window those of past samples too).
    #[arg(long, value_enum)]
    tokens: Option<TokenFlag>,
    /// Step an Attention-ODE by the sample at the end of the step, not by the one at its start, which delays the force by a
    /// sample.
    #[arg(long)]
    end_of_step: bool,
    /// Attention heads.
    #[arg(long)]
    heads: Option<usize>,
    /// Length of a sample's embedding; for an MLP-ODE, width of the hidden layer before h.
    #[arg(long)]
    embedding: Option<usize>,
    /// Length of the latent h; for a CNODE, of its state beside the force. The paper has 6.
    #[arg(long)]
    latent: Option<usize>,
    /// Encoding of a sample; the paper has raw. A Relaxation-ODE has links by default if the data set holds the robot's
    /// kinematics, else hydrodynamic.
    #[arg(long, value_enum)]
    encoding: Option<Encoded>,
    /// Path of a CNODE through the samples: hermite, from past samples alone, or the paper's natural spline, which needs
    /// the whole trajectory; a simulation replaces it by hermite.
    #[arg(long)]
    control: Option<Control>,
    /// Give the field h without the force, so that the force is a running sum (the paper's other equation).
    #[arg(long)]
    without_force: bool,
    /// Leave out the linear part of the field, as in the paper.
    #[arg(long)]
    without_skip: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// The paper's: attention over the past, an ODE for the force.
    AttentionOde,
    /// The paper's plain ODE: a perceptron of the present sample instead of the attention.
    MlpOde,
    /// Ours: the force, or each of its modes, relaxes at a learned rate to a target of closed forms and a network.
    RelaxationOde,
    /// The paper's controlled ODE, a baseline: the force follows the changes of the motion.
    Cnode,
    /// The paper's recurrent baseline: layers of long short-term memory.
    Lstm,
    /// The memoryless baseline: a perceptron of the present sample.
    Mlp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TokenFlag {
    /// The samples of the window.
    Samples,
    /// The encoded numbers of the window.
    Features,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Encoded {
    /// Raw, except that the attitude is the world's up direction in the base frame.
    Up,
    /// The features as recorded, quaternion included.
    Raw,
    /// Up, followed by the closed forms of buoyancy, drag and constant added mass.
    Hydrodynamic,
    /// Hydrodynamic, with the closed forms of every link; the data set's manifest must hold the robot's kinematics.
    Links,
}

impl Encoded {
    fn encoding(self, kinematics: Option<&Kinematics>) -> anyhow::Result<Encoding> {
        Ok(match self {
            Self::Up => Encoding::Up,
            Self::Raw => Encoding::Raw,
            Self::Hydrodynamic => Encoding::Hydrodynamic,
            Self::Links => match kinematics {
                Some(kinematics) => Encoding::Links(kinematics.clone()),
                None => bail!(
                    "--encoding links: the data set's manifest.json holds no `kinematics`; expected one as \
                     scripts/gen_task2.py writes"
                ),
            },
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Preset {
    /// The paper's sizes; hours on two cores.
    Full,
    /// The sizes of the released checkpoint: smaller, 10 to 15 minutes on one core.
    Release,
    /// A few minutes on two cores.
    Demo,
}

impl Kind {
    fn hidden(self, preset: Preset) -> Vec<usize> {
        use Preset::{Demo, Full, Release};
        match (self, preset) {
            (Self::AttentionOde | Self::MlpOde | Self::Mlp, Full) => vec![512; 3],
            (Self::AttentionOde | Self::MlpOde | Self::Mlp, Release) => vec![256; 3],
            (Self::AttentionOde | Self::MlpOde | Self::Mlp, Demo) => vec![256; 2],
            (Self::RelaxationOde, Full | Release) => vec![256; 2],
            (Self::RelaxationOde, Demo) => vec![128; 2],
            (Self::Cnode, Full) => vec![256, 512, 512],
            (Self::Cnode, Release) => vec![128, 256, 256],
            (Self::Cnode, Demo) => vec![64, 128],
            (Self::Lstm, Full) => vec![256; 2],
            (Self::Lstm, Release) => vec![128; 2],
            (Self::Lstm, Demo) => vec![64],
        }
    }

    fn name(self) -> String {
        self.to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

impl ModelFlags {
    /// The solver by default. A CNODE's path is curved between samples, which Euler's method does not follow.
    pub(super) fn usual_solver(&self) -> Solver {
        match self.model {
            Kind::Cnode => Solver::Rk4,
            _ => Solver::Euler,
        }
    }

    /// The preset's sizes with the flags on top.
    ///
    /// # Errors
    /// A flag that this kind does not use; encoding `links` without kinematics in the data set.
    pub(super) fn config(
        &self,
        preset: Preset,
        kinematics: Option<&Kinematics>,
    ) -> anyhow::Result<ModelConfig> {
        self.refuse_idle_flags()?;
        let hidden = self
            .hidden
            .clone()
            .unwrap_or_else(|| self.model.hidden(preset));
        let encoding = |usual: Encoding| match self.encoding {
            Some(encoded) => encoded.encoding(kinematics),
            None => Ok(usual),
        };
        Ok(match self.model {
            Kind::AttentionOde => {
                let sizes = AttentionOdeConfig::default();
                let (tokens, window) = match self.tokens {
                    Some(TokenFlag::Features) => (Tokens::Features, 1),
                    Some(TokenFlag::Samples) | None => (Tokens::Samples, sizes.window),
                };
                ModelConfig::AttentionOde(AttentionOdeConfig {
                    tokens,
                    end_of_step: self.end_of_step,
                    window: self.window.unwrap_or(window),
                    heads: self.heads.unwrap_or(sizes.heads),
                    embedding: self.embedding.unwrap_or(sizes.embedding),
                    latent: self.latent.unwrap_or(sizes.latent),
                    encoding: encoding(sizes.encoding)?,
                    field_sees_force: !self.without_force,
                    skip: !self.without_skip,
                    hidden,
                })
            }
            Kind::MlpOde => {
                let sizes = MlpOdeConfig::default();
                ModelConfig::MlpOde(MlpOdeConfig {
                    latent_hidden: self
                        .embedding
                        .map_or(sizes.latent_hidden, |width| vec![width]),
                    latent: self.latent.unwrap_or(sizes.latent),
                    encoding: encoding(sizes.encoding)?,
                    field_sees_force: !self.without_force,
                    skip: !self.without_skip,
                    hidden,
                })
            }
            Kind::RelaxationOde => {
                let sizes = RelaxationOdeConfig::with_kinematics(kinematics);
                ModelConfig::RelaxationOde(RelaxationOdeConfig {
                    window: self.window.unwrap_or(sizes.window),
                    encoding: encoding(sizes.encoding)?,
                    skip: !self.without_skip,
                    modes: self.modes.unwrap_or(sizes.modes),
                    memory: self.memory.unwrap_or(sizes.memory),
                    hidden,
                })
            }
            Kind::Cnode => {
                let sizes = CnodeConfig::default();
                ModelConfig::Cnode(CnodeConfig {
                    hidden_state: self.latent.unwrap_or(sizes.hidden_state),
                    encoding: encoding(sizes.encoding)?,
                    control: self.control.unwrap_or(sizes.control),
                    hidden,
                })
            }
            Kind::Lstm => ModelConfig::Lstm(LstmConfig {
                encoding: encoding(LstmConfig::default().encoding)?,
                skip: !self.without_skip,
                hidden,
            }),
            Kind::Mlp => ModelConfig::Mlp(MlpConfig {
                encoding: encoding(MlpConfig::default().encoding)?,
                skip: !self.without_skip,
                hidden,
            }),
        })
    }

    fn refuse_idle_flags(&self) -> anyhow::Result<()> {
        use Kind::{AttentionOde, Cnode, Lstm, Mlp, MlpOde, RelaxationOde};
        let flags: [(&str, bool, &[Kind]); 11] = [
            (
                "--window",
                self.window.is_some(),
                &[AttentionOde, RelaxationOde],
            ),
            ("--modes", self.modes.is_some(), &[RelaxationOde]),
            ("--memory", self.memory.is_some(), &[RelaxationOde]),
            ("--tokens", self.tokens.is_some(), &[AttentionOde]),
            ("--end-of-step", self.end_of_step, &[AttentionOde]),
            ("--heads", self.heads.is_some(), &[AttentionOde]),
            (
                "--embedding",
                self.embedding.is_some(),
                &[AttentionOde, MlpOde],
            ),
            (
                "--latent",
                self.latent.is_some(),
                &[AttentionOde, MlpOde, Cnode],
            ),
            ("--control", self.control.is_some(), &[Cnode]),
            (
                "--without-force",
                self.without_force,
                &[AttentionOde, MlpOde],
            ),
            (
                "--without-skip",
                self.without_skip,
                &[AttentionOde, MlpOde, RelaxationOde, Lstm, Mlp],
            ),
        ];
        for (flag, given, kinds) in flags {
            if given && !kinds.contains(&self.model) {
                let names: Vec<String> = kinds.iter().map(|kind| kind.name()).collect();
                bail!(
                    "{flag} is not used by the model {}; it is for {}",
                    self.model.name(),
                    names.join(", ")
                );
            }
        }
        Ok(())
    }
}
