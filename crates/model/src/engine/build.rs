//! Choice of the engine for a model.

use pulp::Arch;

use super::{
    candle_engine::CandleEngine, cnode_engine::CnodeEngine, instructions::instructions,
    interface::Engine, kind::EngineKind, lstm_engine::LstmEngine, mlp_engine::MlpEngine,
    ode_engine::OdeEngine, packed_perceptron::Precision, relaxation_engine::RelaxationEngine,
};
use crate::{
    architectures::Network, error::ModelError, force_model::ForceModel, kernel::has_int16,
};

impl ForceModel {
    /// An evaluator of single samples.
    pub fn engine(&self, kind: EngineKind) -> Result<Box<dyn Engine>, ModelError> {
        let arch = instructions()?;
        Ok(match kind {
            EngineKind::Fused => fused(self, Precision::Single, arch)?,
            EngineKind::FusedF16 => fused(self, Precision::Half, arch)?,
            EngineKind::FusedI16 => fused(self, Precision::Int16, arch)?,
            EngineKind::Candle => Box::new(CandleEngine(self.clone())),
        })
    }
}

impl EngineKind {
    /// Note for a user of this engine on a processor that lacks its instructions.
    pub fn note(self) -> Option<&'static str> {
        let arch = instructions().unwrap_or(Arch::Scalar);
        (self == Self::FusedI16 && !has_int16(arch)).then_some(
            "engine `fused-i16`: this processor has no AVX2, for which its products are written; plain loops give the same \
             numbers, and `fused` may be faster",
        )
    }
}

/// The fused engine of a model, in the instructions of `arch`.
pub(super) fn fused(
    model: &ForceModel,
    precision: Precision,
    arch: Arch,
) -> candle_core::Result<Box<dyn Engine>> {
    Ok(match &model.network {
        Network::AttentionOde(_) | Network::MlpOde(_) => {
            Box::new(OdeEngine::new(model, precision, arch)?)
        }
        Network::Mlp(mlp) => Box::new(MlpEngine::new(model, mlp, precision, arch)?),
        Network::RelaxationOde(ode) => {
            Box::new(RelaxationEngine::new(model, ode, precision, arch)?)
        }
        Network::Cnode(cnode) => Box::new(CnodeEngine::new(model, cnode, precision, arch)?),
        Network::Lstm(lstm) => Box::new(LstmEngine::new(model, lstm, precision, arch)?),
    })
}
