//! Calibration by simulation: trials drawn from the leading answers, and what the search says of them.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{likelihood::explanation::Explanation, output::verdict::Calibration};

/// The test for any gap, and the table of confusions between the leading sets.
pub(crate) fn calibrate(explanation: &Explanation<'_>) -> Calibration {
    let settings = &explanation.problem.settings;
    let options = &settings.options.name;
    let nothing = explanation.nothing();
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    // Single effects suffice to see how large their odds become by chance.
    let nulls = explanation.simulated(nothing, 1, options.null_draws, &mut rng);
    let (odds, own_odds) = explanation.odds();
    let as_large = nulls.iter().filter(|(_, of)| *of >= odds).count();
    let leaders: Vec<usize> = (0..explanation.sets.len())
        .filter(|set| explanation.sets[*set].probability > options.error)
        .take(options.leaders)
        .collect();
    let mut confusion: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
    for set in leaders {
        let truth = name(explanation, &explanation.sets[set].set);
        let largest = explanation.sets[set].set.len() + 1;
        let drawn = explanation.simulated(set, largest, options.leader_draws, &mut rng);
        for (said, _) in &drawn {
            let row = confusion.entry(name(explanation, said)).or_default();
            *row.entry(truth.clone()).or_insert(0.0) += 1.0 / drawn.len() as f64;
        }
    }
    Calibration {
        alarm_level: options.alarm,
        // Simulated trials have no values of their own. Of effects that have, the odds themselves tell: without a gap their
        // mean is below one, so that they exceed k in one of k sets of trials at most (Markov).
        alarm: ((as_large + 1) as f64 / (nulls.len() + 1) as f64).min(own_odds.recip()),
        confusion,
    }
}

/// Effects of a set, by name.
fn name(explanation: &Explanation<'_>, set: &[usize]) -> String {
    let mut ids = explanation.effects(set);
    ids.sort_unstable();
    ids.dedup();
    let names: Vec<String> = ids.iter().map(ToString::to_string).collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join("+")
    }
}
