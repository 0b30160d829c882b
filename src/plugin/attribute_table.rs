//! Attributes of the plugins as a user reads of them. MuJoCo's registration, `hydro attributes` and docs/reference-attributes.md
//! are made from these tables.

use std::ffi::CStr;

/// An attribute of a plugin: a `key` of its `<config>`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attribute {
    /// Its key.
    pub name: &'static CStr,
    /// Unit; empty where it is no number.
    pub unit: &'static str,
    /// What it is, in Markdown.
    pub meaning: &'static str,
    /// What holds where it is missing or empty, in Markdown.
    pub default: &'static str,
}

/// Attributes of `hydro.wrench`.
pub const WRENCH: [Attribute; 16] = [
    Attribute {
        name: c"checkpoint",
        unit: "",
        meaning: "folder with `card.json` and `weights.safetensors`",
        default: "this or `effects`",
    },
    Attribute {
        name: c"effects",
        unit: "",
        meaning: "named effects: JSON `hydro-effects/1` where the value starts with `{`, else a file's path",
        default: "this or `checkpoint`",
    },
    Attribute {
        name: c"density",
        unit: "kg/m^3",
        meaning: "density of the water, a feature of the model; >= 0",
        default: "1000",
    },
    Attribute {
        name: c"waterline",
        unit: "m",
        meaning: "world z of the still surface: all that the fluid does fades with the submerged part of the hull's \
                  volume",
        default: "fully submerged",
    },
    Attribute {
        name: c"current",
        unit: "m/s",
        meaning: "velocity of the water in the world, x y z; or JSON `hydro-current/1` or a file's path: a profile in \
                  depth or a grid in place, depth and time, a random part, a part that a program sets",
        default: "0 0 0",
    },
    Attribute {
        name: c"waves",
        unit: "",
        meaning: "linear waves about `waterline`: JSON `hydro-waves/1`, or a file's path",
        default: "none",
    },
    Attribute {
        name: c"potential_flow",
        unit: "",
        meaning: "diffraction and radiation of the carrying body, by a boundary element program: JSON \
                  `hydro-potential-flow/1`, or a file's path",
        default: "none",
    },
    Attribute {
        name: c"hull",
        unit: "",
        meaning: "names of the geoms that displace water",
        default: "those of the body and below with `fluidshape=\"ellipsoid\"`, else those in group 3, else all",
    },
    Attribute {
        name: c"volume",
        unit: "m^3",
        meaning: "what the carrying body displaces",
        default: "its hull's volume",
    },
    Attribute {
        name: c"centre_of_buoyancy",
        unit: "m",
        meaning: "where its buoyancy acts, body frame x y z",
        default: "centre of the submerged part",
    },
    Attribute {
        name: c"joints",
        unit: "",
        meaning: "names of the card's joints in this model, in the card's order",
        default: "the card's",
    },
    Attribute {
        name: c"solver",
        unit: "",
        meaning: "`euler` or `rk4`, one step a sample, of a checkpoint whose equation is stepped (Attention-ODE, MLP-ODE, \
                  CNODE); or `dopri5`, as many as its tolerance asks for (1e-4 of the force, 1e-5 of a standard deviation; \
                  7 evaluations of the field a sample at least, 391 at most), of all but a CNODE",
        default: "the card's",
    },
    Attribute {
        name: c"engine",
        unit: "",
        meaning: "`fused`; `fused-f16`, with the field's weights rounded to IEEE halves (half the memory to read; with the \
                  released checkpoint 0.02 % of a standard deviation rms and 0.16 % at most on test trajectories, and \
                  `hydro evaluate --engine fused-f16` says it of another); `fused-i16`, with weights and activations in whole \
                  numbers of 13 and 12 bits, for `vpmaddwd` (AVX2; elsewhere plain loops, the same products bit for bit; with the released \
                  checkpoints 0.03 % of a standard deviation rms and 0.18 % at most on recorded motion); or `candle`, the \
                  reference",
        default: "`fused`",
    },
    Attribute {
        name: c"initial_force",
        unit: "N, N m",
        meaning: "the force at the first sample, one number an output of the card; or `estimate`, what the checkpoint \
                  predicts for a window filled with that sample (a CNODE, which settles nowhere: what it learned of first \
                  samples). It is held within the forces of the training as any of the network's is. LSTM and memoryless \
                  checkpoints take no initial force and ignore it",
        default: "`estimate`",
    },
    Attribute {
        name: c"wrench_scale",
        unit: "",
        meaning: "six factors > 0 on the checkpoint's wrench, force x y z, then torque x y z, in the body's frame; effects \
                  are not scaled, nor is `initial_force`. Needs `checkpoint`",
        default: "1 1 1 1 1 1",
    },
    Attribute {
        name: c"outputs",
        unit: "",
        meaning: "which of the checkpoint's outputs act: `wrench`, on the body that carries it, or `generalised`, the torques \
                  on the joints too, which the card must have. Needs `checkpoint`",
        default: "all of the card's",
    },
];

/// Attributes of `hydro.load_cell`.
pub const LOAD_CELL: [Attribute; 3] = [
    Attribute {
        name: c"site",
        unit: "",
        meaning: "a site on the body below the cell",
        default: "required",
    },
    Attribute {
        name: c"quantity",
        unit: "N or N m",
        meaning: "`force` or `torque`, three numbers",
        default: "`force`",
    },
    Attribute {
        name: c"include",
        unit: "",
        meaning: "`plugin`: what `hydro.wrench` and effects apply on the site's body and below, the reaction of added mass \
                  with it; `all`: MuJoCo's own fluid and gravity compensation too",
        default: "`plugin`",
    },
];
