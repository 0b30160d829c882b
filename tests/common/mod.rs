//! Checkpoints and scenes for the tests.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

pub mod tiny;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use hydro_model::{
    AttentionOdeConfig, CnodeConfig, Encoder, LstmConfig, MlpConfig, MlpOdeConfig, ModelConfig,
    Network, Normaliser, Parameters, RelaxationOdeConfig, Solver,
    checkpoint::{Card, Checkpoint, SCHEMA},
    features::{Feature, FeatureLayout},
    water::BodyAddedMass,
};

pub const WRENCH: [&str; 6] = [
    "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z",
];

/// Force and torque of [`constant`].
pub const CONSTANT: [f64; 6] = [3.0, -2.0, 4.0, 0.0, 0.0, 0.0];

/// Mean and spread of a test checkpoint's predictions.
pub struct Recipe {
    pub features: FeatureLayout,
    pub outputs: Vec<&'static str>,
    pub model: ModelConfig,
    pub mean: Vec<f64>,
    pub deviation: Vec<f64>,
    /// What the card leaves to the inertia.
    pub added_mass: Vec<BodyAddedMass>,
}

/// An Attention-ODE of a window of four samples.
pub fn attention() -> ModelConfig {
    ModelConfig::AttentionOde(AttentionOdeConfig {
        window: 4,
        heads: 2,
        embedding: 8,
        latent: 8,
        hidden: vec![16, 16],
        ..AttentionOdeConfig::default()
    })
}

/// For a floating base with these joints: newtons that depend on the motion.
pub fn lively(joints: &[&str]) -> Recipe {
    let joints: Vec<String> = joints.iter().map(|name| (*name).to_owned()).collect();
    Recipe {
        features: FeatureLayout::floating_base(&joints).unwrap(),
        outputs: WRENCH.to_vec(),
        model: attention(),
        mean: vec![2.0, 1.0, 3.0, 0.1, -0.1, 0.05],
        deviation: vec![4.0, 4.0, 4.0, 0.2, 0.2, 0.2],
        added_mass: Vec::new(),
    }
}

/// For a floating base without joints: the same force always, up to 1e-12.
pub fn constant() -> Recipe {
    Recipe {
        mean: CONSTANT.to_vec(),
        deviation: vec![1e-13; 6],
        ..lively(&[])
    }
}

/// Torque on the fin of [`constant_with_fin`].
pub const FIN_TORQUE: f64 = 0.7;

/// As [`constant`], with a constant torque on the joint `fin`, which is no feature.
pub fn constant_with_fin() -> Recipe {
    let mut recipe = constant();
    recipe.outputs.push("joint_torque.fin");
    recipe.mean.push(FIN_TORQUE);
    recipe.deviation.push(1e-13);
    recipe
}

/// One of every kind of model, for the joints given.
pub fn zoo(joints: &[&str]) -> Vec<Recipe> {
    let hidden = || vec![16, 16];
    let kinds = [
        attention(),
        ModelConfig::MlpOde(MlpOdeConfig {
            latent: 8,
            hidden: hidden(),
            ..MlpOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: hidden(),
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: hidden(),
            modes: 3,
            memory: 6,
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::Cnode(CnodeConfig {
            hidden: hidden(),
            ..CnodeConfig::default()
        }),
        ModelConfig::Lstm(LstmConfig {
            hidden: hidden(),
            ..LstmConfig::default()
        }),
    ];
    let recipe = |model| Recipe {
        model,
        ..lively(joints)
    };
    let mut all: Vec<Recipe> = kinds.into_iter().map(recipe).collect();
    all.push(memoryless(joints));
    all
}

/// Memoryless, for the joints given.
pub fn memoryless(joints: &[&str]) -> Recipe {
    let config = MlpConfig {
        hidden: vec![16, 16],
        ..MlpConfig::default()
    };
    Recipe {
        model: ModelConfig::Mlp(config),
        ..lively(joints)
    }
}

/// The towing task's: two joints and two velocities in, two forces out.
pub fn towing() -> Recipe {
    Recipe {
        features: FeatureLayout::new(vec![
            Feature::JointPosition("thigh".into()),
            Feature::JointPosition("calf".into()),
            Feature::LinearVelocity(0),
            Feature::LinearVelocity(1),
        ])
        .unwrap(),
        outputs: vec!["force.x", "force.y"],
        model: attention(),
        mean: vec![-3.0, 1.0],
        deviation: vec![2.0, 2.0],
        added_mass: Vec::new(),
    }
}

impl Recipe {
    pub fn checkpoint(&self) -> Checkpoint {
        let encoder = Encoder::new(self.model.encoding(), &self.features);
        let (inputs, outputs) = (encoder.len(), self.outputs.len());
        let network =
            |vb: candle_nn::VarBuilder<'_>| Network::new(&self.model, inputs, outputs, vb);
        let (_, drawn) = Parameters::draw(7, network).unwrap();
        let mut weights = drawn.snapshot().unwrap();
        // The last layer is drawn small; a force that hardly moves would test nothing.
        if let Some(last) = weights.get_mut("field.2.weight") {
            *last = last.affine(20.0, 0.0).unwrap();
        }
        let mut normaliser = Normaliser::identity(inputs, outputs);
        normaliser.output_mean.clone_from(&self.mean);
        normaliser.output_std.clone_from(&self.deviation);
        // The density is around 1000, and what it multiplies has its size.
        if let Some(at) = self
            .features
            .density()
            .and_then(|raw| encoder.index_of(raw))
        {
            normaliser.input_mean[at] = 1000.0;
            normaliser.input_std[at] = 20.0;
            normaliser.input_std[at + 1..].fill(1000.0);
        }
        let units = |name: &str| {
            if name.starts_with("force") {
                "N"
            } else {
                "N m"
            }
            .to_owned()
        };
        let card = Card {
            schema: SCHEMA.to_owned(),
            name: "test".to_owned(),
            feature_units: self
                .features
                .features()
                .iter()
                .map(|f| f.unit().to_owned())
                .collect(),
            joints: self.features.joints(),
            features: self.features.clone(),
            output_units: self.outputs.iter().map(|name| units(name)).collect(),
            outputs: self.outputs.iter().map(|name| (*name).to_owned()).collect(),
            frames: BTreeMap::from([("wrench".to_owned(), "base".to_owned())]),
            sample_period: 0.01,
            residual: false,
            water: None,
            added_mass: self.added_mass.clone(),
            envelope: None,
            solver: Solver::Euler,
            normaliser,
            dataset: None,
            metrics: serde_json::Value::Null,
            command: "a test".to_owned(),
            hydro: env!("CARGO_PKG_VERSION").to_owned(),
            weights_sha256: String::new(),
            card_sha256: String::new(),
            model: self.model.clone(),
        };
        Checkpoint::new(card, weights).unwrap()
    }

    /// Saves it below `root`, under a name, and says where.
    pub fn save(&self, root: &Path, name: &str) -> PathBuf {
        let folder = root.join(name);
        self.checkpoint().save(&folder).unwrap();
        folder
    }
}

/// Ways in which a scene asks for the force.
pub enum Asks {
    /// An engine plugin.
    Plugin,
    /// Custom texts and so many numbers of user data, for MuJoCo 2.2.2.
    Custom { userdata: usize },
}

/// An ellipsoid with a tail fin on a hinge and a motor; `attributes` are those of `hydro.wrench`.
pub fn fish(asks: &Asks, attributes: &[(&str, &str)], integrator: &str) -> String {
    let each = |line: fn(&str, &str) -> String| -> String {
        attributes
            .iter()
            .map(|(key, value)| line(key, value))
            .collect()
    };
    let (head, carried, sensor) = match asks {
        Asks::Plugin => {
            let config = each(|key, value| format!("<config key=\"{key}\" value=\"{value}\"/>"));
            (
                format!(
                    "<extension><plugin plugin=\"hydro.wrench\"><instance name=\"water\">{config}</instance>\
                     </plugin></extension>"
                ),
                "<plugin plugin=\"hydro.wrench\" instance=\"water\"/>",
                "<sensor><plugin name=\"water\" plugin=\"hydro.wrench\" instance=\"water\"/></sensor>",
            )
        }
        Asks::Custom { userdata } => {
            let texts = each(|key, value| format!("<text name=\"hydro.{key}\" data=\"{value}\"/>"));
            (
                format!("<size nuserdata=\"{userdata}\"/><custom>{texts}</custom>"),
                "",
                "",
            )
        }
    };
    format!(
        r#"<mujoco>
  <option timestep="0.002" gravity="0 0 0" integrator="{integrator}"/>
  {head}
  <worldbody>
    <body name="hull"><freejoint/>{carried}
      <geom type="ellipsoid" size="0.3 0.1 0.12" mass="12"/>
      <body name="fin" pos="-0.3 0 0">
        <joint name="fin" axis="0 0 1" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="fin" joint="fin"/></actuator>
  {sensor}
</mujoco>"#
    )
}
