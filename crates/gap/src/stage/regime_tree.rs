//! When the nominal fails: a shallow regression tree of the excess over readable features of the motion.

use crate::{
    likelihood::innovations::Innovation, options::LocateOptions, output::verdict::Regime,
    problem::problem::Problem,
};

/// Features by segment that a person would name, in SI units.
struct Features {
    names: Vec<String>,
    /// [segments][features]
    rows: Vec<Vec<f64>>,
    /// Excess of each: squared innovation less its expectation.
    excess: Vec<f64>,
}

/// Rules, the largest share first.
pub(crate) fn rules(problem: &Problem<'_>, innovations: &[Vec<Innovation>]) -> Vec<Regime> {
    let options = &problem.settings.options.locate;
    let features = features(problem, innovations);
    let all: Vec<usize> = (0..features.rows.len()).collect();
    let total: f64 = features.excess.iter().sum();
    if total <= 0.0 || all.is_empty() {
        return Vec::new();
    }
    let mut leaves = Vec::new();
    split(
        &features,
        all,
        Vec::new(),
        options.tree_depth,
        options,
        &mut leaves,
    );
    let rows = features.rows.len() as f64;
    let mut rules: Vec<Regime> = leaves
        .into_iter()
        .filter(|(conditions, _)| !conditions.is_empty())
        .map(|(conditions, members)| Regime {
            rule: conditions.join(" and "),
            share: (members.iter().map(|row| features.excess[*row]).sum::<f64>() / total)
                .clamp(0.0, 1.0),
            samples: members.len() as f64 / rows,
        })
        .filter(|regime| regime.share > options.tree_lift * regime.samples)
        .collect();
    rules.sort_by(|a, b| b.share.total_cmp(&a.share));
    rules
}

/// Splits where the squared difference of the mean excess, weighted by the sizes, is largest.
fn split(
    features: &Features,
    members: Vec<usize>,
    conditions: Vec<String>,
    depth: usize,
    options: &LocateOptions,
    leaves: &mut Vec<(Vec<String>, Vec<usize>)>,
) {
    let least = (options.tree_leaf * features.rows.len() as f64).max(options.tree_leaf_samples);
    let mut best: Option<(f64, usize, f64)> = None;
    if depth > 0 {
        for feature in 0..features.names.len() {
            let mut values: Vec<f64> = members
                .iter()
                .map(|row| features.rows[*row][feature])
                .collect();
            values.sort_by(f64::total_cmp);
            for quantile in 1..=options.tree_quantiles {
                let threshold =
                    values[quantile * (values.len() - 1) / (options.tree_quantiles + 1)];
                let (mut above, mut below) = ((0.0, 0.0), (0.0, 0.0));
                for row in &members {
                    let side = if features.rows[*row][feature] > threshold {
                        &mut above
                    } else {
                        &mut below
                    };
                    side.0 += features.excess[*row];
                    side.1 += 1.0;
                }
                if above.1 < least || below.1 < least {
                    continue;
                }
                let difference: f64 = above.0 / above.1 - below.0 / below.1;
                let gain = difference * difference * above.1 * below.1 / (above.1 + below.1);
                if best.is_none_or(|(before, ..)| gain > before) {
                    best = Some((gain, feature, threshold));
                }
            }
        }
    }
    let Some((_, feature, threshold)) = best else {
        leaves.push((conditions, members));
        return;
    };
    let (above, below): (Vec<usize>, Vec<usize>) = members
        .into_iter()
        .partition(|row| features.rows[*row][feature] > threshold);
    for (side, sign) in [(above, ">"), (below, "<=")] {
        let mut conditions = conditions.clone();
        conditions.push(format!("{} {sign} {threshold:.2}", features.names[feature]));
        split(features, side, conditions, depth - 1, options, leaves);
    }
}

fn features(problem: &Problem<'_>, innovations: &[Vec<Innovation>]) -> Features {
    let model = problem.plant.description();
    let free = model.nq == model.nv + 1;
    let mut names: Vec<String> = Vec::new();
    if free {
        let base = ["speed", "angle of attack", "yaw rate", "height"];
        names.extend(base.map(str::to_owned));
    }
    for joint in &model.joints {
        names.push(format!("|{} velocity|", joint.name));
        names.push(format!("{} position", joint.name));
    }
    names.extend(["command", "command rate"].map(str::to_owned));
    let ahead = problem.settings.options.locate.command_rate_time;
    let mut found = Features {
        names,
        rows: Vec::new(),
        excess: Vec::new(),
    };
    for (at, innovations) in innovations.iter().enumerate() {
        let trial = &problem.trials[at];
        let motion = &problem.motions[at];
        let mut control = vec![0.0; trial.control.width()];
        let mut later = control.clone();
        for innovation in innovations {
            let row = innovation.rows.start;
            let (qpos, qvel) = motion.state(row);
            let mut values = Vec::with_capacity(found.names.len());
            if free {
                let in_base = hydro_frames::base_from_world(
                    [qpos[3], qpos[4], qpos[5], qpos[6]],
                    [qvel[0], qvel[1], qvel[2]],
                );
                let speed = in_base.iter().map(|v| v * v).sum::<f64>().sqrt();
                let across = in_base[1].hypot(in_base[2]);
                values.extend([
                    speed,
                    across.atan2(in_base[0].abs()),
                    qvel[5].abs(),
                    qpos[2],
                ]);
            }
            for joint in &model.joints {
                values.extend([qvel[joint.dof].abs(), qpos[joint.qpos]]);
            }
            let time = motion.times[row];
            trial.control.interpolate(time, &mut control);
            trial.control.interpolate(time + ahead, &mut later);
            let norm = control.iter().map(|u| u * u).sum::<f64>().sqrt();
            let rate = control
                .iter()
                .zip(&later)
                .map(|(a, b)| ((b - a) / ahead).powi(2))
                .sum::<f64>()
                .sqrt();
            values.extend([norm, rate]);
            found.rows.push(values);
            let excess = |(squares, count): &(f64, usize)| squares - *count as f64;
            found
                .excess
                .push(innovation.sources.iter().map(excess).sum());
        }
    }
    found
}
