//! From the features of a sample to the numbers a network sees.

use serde::{Deserialize, Serialize};

use crate::features::FeatureLayout;

/// How the attitude reaches the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// The features as they are, quaternion and all: the paper's.
    Raw,
    /// The quaternion's four numbers give way to the world's up direction in the base frame: the water's
    /// wrench in the base frame depends on neither the heading nor the quaternion's sign, and hydrostatics
    /// are then nearly linear.
    #[default]
    Up,
}

/// An encoding of one feature layout: n raw features in, [`Encoder::len`] numbers out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoder {
    inputs: usize,
    /// Where the quaternion stands, when it is to be replaced.
    quaternion: Option<usize>,
}

impl Encoder {
    /// For a layout; [`Encoding::Up`] changes nothing where there is no quaternion.
    pub fn new(encoding: Encoding, layout: &FeatureLayout) -> Self {
        Self {
            inputs: layout.len(),
            quaternion: match encoding {
                Encoding::Raw => None,
                Encoding::Up => layout.quaternion(),
            },
        }
    }

    /// n, the raw features of a sample.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// How many numbers an encoded sample holds.
    #[expect(clippy::len_without_is_empty, reason = "a layout is never empty")]
    pub fn len(&self) -> usize {
        self.inputs - usize::from(self.quaternion.is_some())
    }

    /// Where the raw feature at `raw` stands in an encoded sample; `None` for a part of a quaternion that is
    /// replaced.
    pub fn index_of(&self, raw: usize) -> Option<usize> {
        match self.quaternion {
            Some(at) if (at..at + 4).contains(&raw) => None,
            Some(at) if raw >= at + 4 => Some(raw - 1),
            _ => Some(raw),
        }
    }

    /// Calls `put(index, value)` for each number of the encoded sample `x` (SI, length n).
    #[inline]
    pub fn encode(&self, x: &[f64], mut put: impl FnMut(usize, f64)) {
        let Some(at) = self.quaternion else {
            for (index, value) in x.iter().enumerate() {
                put(index, *value);
            }
            return;
        };
        for (index, value) in x[..at].iter().enumerate() {
            put(index, *value);
        }
        for (index, value) in up_in_base([x[at], x[at + 1], x[at + 2], x[at + 3]])
            .into_iter()
            .enumerate()
        {
            put(at + index, value);
        }
        for (index, value) in x[at + 4..].iter().enumerate() {
            put(at + 3 + index, *value);
        }
    }
}

/// The world's z axis in the base frame: the last row of `world_from_base`. A zero quaternion is the identity.
fn up_in_base([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let square = w * w + x * x + y * y + z * z;
    if square < f64::MIN_POSITIVE {
        return [0.0, 0.0, 1.0];
    }
    let scale = 2.0 / square;
    [
        scale * (x * z - w * y),
        scale * (y * z + w * x),
        1.0 - scale * (x * x + y * y),
    ]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::frames::base_from_world;

    fn encoded(encoding: Encoding, x: &[f64]) -> Vec<f64> {
        let layout = FeatureLayout::floating_base(&["a".into()]).expect("valid");
        let encoder = Encoder::new(encoding, &layout);
        let mut out = vec![f64::NAN; encoder.len()];
        encoder.encode(x, |index, value| out[index] = value);
        out
    }

    #[test]
    fn raw_is_the_identity_and_up_keeps_its_neighbours() {
        let x: Vec<f64> = (0..13).map(f64::from).collect();
        assert_eq!(encoded(Encoding::Raw, &x), x);
        let up = encoded(Encoding::Up, &x);
        assert_eq!(up.len(), 12);
        assert_eq!((&up[..2], &up[5..]), (&x[..2], &x[6..]));
        let layout = FeatureLayout::floating_base(&["a".into()]).expect("valid");
        let encoder = Encoder::new(Encoding::Up, &layout);
        for (raw, value) in x.iter().enumerate() {
            let kept = !(2..6).contains(&raw);
            assert_eq!(
                encoder.index_of(raw).map(|at| up[at]),
                kept.then_some(*value)
            );
        }
    }

    #[test]
    fn a_zero_quaternion_is_upright() {
        assert_eq!(encoded(Encoding::Up, &[0.0; 13])[2..5], [0.0, 0.0, 1.0]);
    }

    proptest! {
        #[test]
        fn up_is_the_world_axis_in_the_base_frame_whatever_the_sign(q in prop::array::uniform4(-1.0f64..1.0)) {
            prop_assume!(q.iter().map(|c| c * c).sum::<f64>() > 1e-3);
            let expected = base_from_world(q, [0.0, 0.0, 1.0]);
            for quaternion in [q, q.map(|c| -c)] {
                for (got, want) in up_in_base(quaternion).iter().zip(expected) {
                    prop_assert!((got - want).abs() < 1e-12);
                }
            }
        }
    }
}
