//! Split of the trials into those to fit and those held out, by name, before any is opened.

use rand::{SeedableRng as _, seq::SliceRandom as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Trials to fit and trials to verify on. No trial is in both.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Split {
    /// Names of the trials to fit, sorted.
    pub fit: Vec<String>,
    /// Names of the trials that only the verification may open, sorted.
    pub held_out: Vec<String>,
}

/// Holds out the share `holdout` (0 to 1) of the trials: of two or more at least one and never all, of a single one none.
/// It depends on the names and the seed only, not on the order of the names.
pub fn split(names: &[String], holdout: f64, seed: u64) -> Split {
    let names = shuffled(names, seed);
    if names.len() < 2 {
        return Split {
            fit: names,
            held_out: Vec::new(),
        };
    }
    let wanted = (names.len() as f64 * holdout).round() as usize;
    let held_out = wanted.clamp(1, names.len() - 1);
    parted(&names, |place| place < held_out)
}

/// Splits for a cross-fit: every trial is held out in exactly one of them. There are `k`, but at least two and at most as
/// many as trials; none for fewer than two trials.
pub fn folds(names: &[String], k: usize, seed: u64) -> Vec<Split> {
    let names = shuffled(names, seed);
    if names.len() < 2 {
        return Vec::new();
    }
    let k = k.clamp(2, names.len());
    (0..k)
        .map(|fold| parted(&names, |place| place % k == fold))
        .collect()
}

/// The names without repetition, in an order given by them and the seed.
fn shuffled(names: &[String], seed: u64) -> Vec<String> {
    let mut names = names.to_vec();
    names.sort();
    names.dedup();
    names.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    names
}

fn parted(names: &[String], is_held_out: impl Fn(usize) -> bool) -> Split {
    let mut split = Split::default();
    for (place, name) in names.iter().enumerate() {
        let side = if is_held_out(place) {
            &mut split.held_out
        } else {
            &mut split.fit
        };
        side.push(name.clone());
    }
    split.fit.sort();
    split.held_out.sort();
    split
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn names() -> impl Strategy<Value = Vec<String>> {
        proptest::collection::btree_set("[a-z0-9_]{1,6}", 0..40)
            .prop_map(|names| names.into_iter().collect())
    }

    fn is_partition(split: &Split, names: &[String]) -> bool {
        let mut all = [split.fit.clone(), split.held_out.clone()].concat();
        all.sort();
        all == names
    }

    proptest! {
        #[test]
        fn a_split_is_disjoint_covering_and_blind_to_the_order_of_the_files(
            names in names(), holdout in 0.0..1.0, seed: u64
        ) {
            let one = split(&names, holdout, seed);
            prop_assert!(is_partition(&one, &names));
            let backwards: Vec<String> = names.iter().rev().cloned().collect();
            prop_assert_eq!(&one, &split(&backwards, holdout, seed));
            if names.len() >= 2 {
                prop_assert!(!one.held_out.is_empty() && !one.fit.is_empty());
                let wanted = names.len() as f64 * holdout;
                let limit = (names.len() - 1) as f64;
                prop_assert!((one.held_out.len() as f64 - wanted.clamp(1.0, limit.max(1.0))).abs() <= 0.5);
            } else {
                prop_assert!(one.held_out.is_empty());
            }
        }

        #[test]
        fn folds_hold_every_trial_out_once(names in names(), k in 0_usize..50, seed: u64) {
            let folds = folds(&names, k, seed);
            let mut held_out: Vec<String> = Vec::new();
            for fold in &folds {
                prop_assert!(is_partition(fold, &names));
                prop_assert!(!fold.fit.is_empty() && !fold.held_out.is_empty());
                held_out.extend(fold.held_out.clone());
            }
            held_out.sort();
            if names.len() >= 2 {
                prop_assert_eq!(&held_out, &names);
                prop_assert_eq!(folds.len(), k.clamp(2, names.len()));
                let sizes: BTreeSet<usize> = folds.iter().map(|fold| fold.held_out.len()).collect();
                prop_assert!(sizes.last().unwrap() - sizes.first().unwrap() <= 1);
            } else {
                prop_assert!(folds.is_empty());
            }
        }
    }

    #[test]
    fn the_seed_decides_and_odd_shares_do_no_harm() {
        let names: Vec<String> = (0..20).map(|k| format!("run{k}")).collect();
        let splits: BTreeSet<Vec<String>> = (0..10)
            .map(|seed| split(&names, 0.25, seed).held_out)
            .collect();
        assert!(splits.len() > 5);
        assert_eq!(split(&names, 0.25, 3).held_out.len(), 5);
        for odd in [f64::NAN, -1.0, 0.0] {
            assert_eq!(split(&names, odd, 0).held_out.len(), 1);
        }
        assert_eq!(split(&names, 7.0, 0).fit.len(), 1);
        let twice = [names.clone(), names.clone()].concat();
        assert_eq!(split(&twice, 0.25, 3), split(&names, 0.25, 3));
    }
}
