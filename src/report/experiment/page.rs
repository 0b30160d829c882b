//! The page: what was done, the tables, then the pictures.

use std::fmt::Write as _;

use hydro_training::{
    comparison::BOUND,
    experiment::{Experiment, ExperimentResults, Reference, Row},
};

use super::tables::{Column, digits, figures_of, markdown};

/// Renders the tables.
pub fn tables(results: &ExperimentResults) -> String {
    let mut text = format!("# {}\n\n", title(results.experiment));
    provenance(&mut text, results);
    match results.experiment {
        Experiment::Task1 => towing(&mut text, results),
        Experiment::Task2 => swimming(&mut text, results),
    }
    orderings(&mut text, results);
    text
}

/// Shows pictures, by the names of their files in `figures/` beside the page.
pub fn pictures<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut text = "## Pictures\n\n".to_owned();
    for name in names {
        let alt = name.trim_end_matches(".svg").replace('-', " ");
        let _ = writeln!(text, "![{alt}](figures/{name})\n");
    }
    text
}

fn title(experiment: Experiment) -> &'static str {
    match experiment {
        Experiment::Task1 => "Task 1: the towed robot",
        Experiment::Task2 => "Task 2: the swimming robot",
    }
}

fn provenance(text: &mut String, results: &ExperimentResults) {
    let seeds = |row: &Row| row.seeds.len();
    let (least, most) = (
        results.rows.iter().map(seeds).min().unwrap_or(0),
        results.rows.iter().map(seeds).max().unwrap_or(0),
    );
    let _ = writeln!(text, "`{}`\n", results.command);
    let missing = if least < most {
        format!("; rows with fewer than {most} seeds are not finished")
    } else {
        String::new()
    };
    let _ = writeln!(
        text,
        "Mean \u{b1} standard deviation over {most} seeds{missing}. Least in bold. Errors are against the clean wrench. MAE, \
         RMSE: over all axes and samples by definition, N and N m together. nRMSE: root mean square over axes of RMSE / \
         standard deviation of the clean wrench.\n"
    );
    for (name, sha256) in &results.data {
        let _ = write!(text, "Data {name}: manifest sha256 `{sha256}`");
        if let Some(budget) = results.budgets.get(name) {
            let trajectories = budget
                .trajectories
                .map_or_else(|| "all".to_owned(), |count| count.to_string());
            let _ = write!(
                text,
                "; everybody has {} passes over {trajectories} training trajectories, {} windows of {} samples a step",
                budget.epochs, budget.batch, budget.horizon
            );
        }
        let _ = writeln!(
            text,
            ". Largest learning rate: {}.",
            learning_rates(results, name)
        );
    }
    text.push_str(
        "MLP-ODE and Attention-ODE predict the force one sample ahead of what they are told, but for those that the sample at the \
         end of a step drives; the others give the force at the newest sample. A model that sees the whole trajectory is in no contest; in closed loop, and where times are taken, it \
         has the causal path.\n\n",
    );
}

/// Every rate with the rows that have it.
fn learning_rates(results: &ExperimentResults, data: &str) -> String {
    let mut rates: Vec<(f64, Vec<&str>)> = Vec::new();
    for row in rows(results, data) {
        match rates
            .iter_mut()
            .find(|known| known.0.total_cmp(&row.learning_rate).is_eq())
        {
            Some(known) => known.1.push(&row.label),
            None => rates.push((row.learning_rate, vec![&row.label])),
        }
    }
    let rates: Vec<String> = rates
        .iter()
        .map(|(rate, labels)| format!("{rate} of {}", labels.join("; ")))
        .collect();
    rates.join(", ")
}

fn rows<'a>(
    results: &'a ExperimentResults,
    data: &'a str,
) -> impl Iterator<Item = &'a Row> + Clone {
    results.rows.iter().filter(move |row| row.data == data)
}

/// The rows of a data set, then those that nothing was trained for.
fn rows_and_yardsticks<'a>(
    results: &'a ExperimentResults,
    data: &'a str,
) -> impl Iterator<Item = &'a Row> + Clone {
    let beside = results.yardsticks.iter();
    rows(results, data).chain(beside.filter(move |row| row.data == data))
}

/// What the last rows of a table are.
const YARDSTICKS: &str = "\nThe last rows are not trained: what is known without learning, which a model must beat, and what the \
                          paper prints for its own data (some of its RMSE are below the MAE, which cannot be).\n\n";

fn towing(text: &mut String, results: &ExperimentResults) {
    let names = [
        ("1.1", "1.1, one condition"),
        ("1.2", "1.2, changing conditions"),
        ("1.3", "1.3, changing conditions with noise"),
    ];
    for (data, name) in names {
        let _ = writeln!(text, "## {name}\n");
        *text += &figures_of(
            rows_and_yardsticks(results, data),
            &[
                Column::new("MAE [N]", "mae"),
                Column::new("RMSE [N]", "rmse"),
                Column::new("nRMSE", "nrmse"),
                Column::new("RMSE against the perturbed force [N]", "rmse_perturbed"),
                Column::new("nRMSE, estimated start", "nrmse_estimate"),
                Column::new("start from zero", "nrmse_zero"),
                Column::new("error of the work", "work_error"),
            ],
        );
        *text += YARDSTICKS;
    }
    cost(text, results, "1.2");
}

fn swimming(text: &mut String, results: &ExperimentResults) {
    let rows = || rows(results, "2");
    let beyond: Vec<&str> = names(rows(), "beyond.");
    *text += "## Open loop, from the true first force\n\n";
    *text += &figures_of(
        rows_and_yardsticks(results, "2"),
        &[
            Column::new("MAE", "mae"),
            Column::new("RMSE", "rmse"),
            Column::new("MAE force [N]", "mae_force"),
            Column::new("MAE torque [N m]", "mae_torque"),
            Column::new("nRMSE", "nrmse"),
            Column::new("without buoyancy", "nrmse_hydrodynamic"),
            Column::new("error of the drag's work", "work_error"),
            Column::new("of its power", "power_error"),
            Column::unranked("gives energy", "gives"),
            Column::unranked("fluctuation", "fluctuation"),
        ],
    );
    let truth = rows().find_map(|row| row.values.get("gives_truth"));
    *text += YARDSTICKS;
    *text += "Work: of the wrench without buoyancy on the base; root mean square over trajectories of its error, over that of the \
              true work; power: RMSE over standard deviation. ";
    if let Some(truth) = truth {
        let _ = write!(
            text,
            "gives energy: share of the samples in which that wrench drives the base, in the truth {:.3}, for the legs push; ",
            truth.mean
        );
    }
    *text += "fluctuation: power above the truth's bandwidth (99 % of its power), over the truth's there.\n\n";

    *text += "## The force at the start\n\n";
    *text += &figures_of(
        rows(),
        &[
            Column::new("nRMSE, true start", "nrmse"),
            Column::new("estimated", "nrmse_estimate"),
            Column::new("zero", "nrmse_zero"),
            Column::new("error of the estimate", "first_force"),
        ],
    );
    *text += "\nThe error of the estimate is that of the first force, in standard deviations.\n\n";

    *text += "## Closed loop: the plugin drives MuJoCo\n\n";
    let references: Vec<Row> = results.references.iter().map(Reference::row).collect();
    *text += &figures_of(
        rows().chain(&references),
        &[
            Column::new("1 s [m]", "position.1"),
            Column::new("2 s [m]", "position.2"),
            Column::new("4 s [m]", "position.4"),
            Column::new("2 s [deg]", "attitude.2"),
            Column::new("diverged", "diverged"),
            Column::unranked("greatest speed", "peak.speed"),
            Column::unranked("rate", "peak.rate"),
            Column::unranked("force", "peak.force"),
            Column::unranked("torque", "peak.torque"),
        ],
    );
    if let Some(runs) = rows().find_map(|row| row.values.get("runs")) {
        let _ = write!(
            text,
            "\nMedian distance and angle from the truth over {:.0} runs; how many diverged; greatest values of ten minutes over the \
             truth's (a run that blew up has none). Beyond the velocities of its training the plugin holds a network to the \
             nearest that it knows and brakes what is left (open loop, below as above, it is asked as it is). ",
            runs.mean
        );
        let within = |key: &str| -> String {
            let each = rows().filter_map(|row| {
                let bounded = row.values.get(key)?;
                let count = (bounded.mean * bounded.count as f64).round();
                Some(format!("{} {count:.0} of {}", row.label, bounded.count))
            });
            each.collect::<Vec<_>>().join("; ")
        };
        let bounded = within("bounded");
        let _ = writeln!(
            text,
            "Seeds whose greatest values stayed within {BOUND} times the truth's: {bounded}."
        );
        let bounded = within("bounded_as_oracle");
        if !bounded.is_empty() {
            let _ = writeln!(
                text,
                "\nLegs that the water does not brake move faster than the truth's, so even the oracle's peaks are greater. Within \
                 {BOUND} times the oracle's: {bounded}."
            );
        }
        if !references.is_empty() {
            *text += "\nThe last rows are not trained, or on the base's velocity alone (drag): they show what a wrench on the base \
                      can be worth. The oracle is the true wrench; what it misses are the water's torques on the joints.\n";
        }
    }

    if !beyond.is_empty() {
        *text += "\n## Outside the training range\n\n";
        let mut columns = vec![Column::new("inside", "nrmse")];
        let heads: Vec<String> = beyond
            .iter()
            .map(|key| key.trim_start_matches("beyond.").to_owned())
            .collect();
        columns.extend(
            heads
                .iter()
                .zip(&beyond)
                .map(|(head, key)| Column::new(head, key)),
        );
        columns.push(Column::new("10 % noise", "noise.0.1"));
        *text += &figures_of(rows(), &columns);
        *text += "\nnRMSE, each by the standard deviations of its own data. Noise: of a tenth of each feature's standard deviation, the density excepted.\n\n";
    }
    cost(text, results, "2");
}

/// Keys of values that begin so, in their order.
fn names<'a>(rows: impl Iterator<Item = &'a Row>, begin: &str) -> Vec<&'a str> {
    let mut found: Vec<&str> = rows
        .flat_map(|row| row.values.keys())
        .map(String::as_str)
        .filter(|key| key.starts_with(begin))
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

fn cost(text: &mut String, results: &ExperimentResults, data: &str) {
    *text += "## What it costs\n\n";
    let head = [
        "",
        "parameters",
        "400 steps, one by one [ms]",
        "400 recorded [ms]",
        "64 x 400 recorded [ms]",
        "training [s]",
        "its peak memory [MiB]",
    ]
    .map(str::to_owned);
    let printed = results.yardsticks.iter();
    let printed = printed.filter(|row| row.data == data && row.parameters.is_some());
    let cells: Vec<Vec<String>> = rows(results, data)
        .chain(printed)
        .map(|row| {
            let timed = |pick: fn(
                &hydro_training::experiment::Cost,
            ) -> hydro_training::experiment::Timed| {
                row.cost.as_ref().map(pick).map_or_else(
                    || "\u{2013}".to_owned(),
                    |timed| {
                        let digits = digits(timed.median);
                        format!(
                            "{:.digits$} ({:.digits$} to {:.digits$})",
                            timed.median, timed.quartiles[0], timed.quartiles[1]
                        )
                    },
                )
            };
            let figure = |key: &str| {
                row.values.get(key).map_or_else(
                    || "\u{2013}".to_owned(),
                    |value| format!("{:.0}", value.mean),
                )
            };
            vec![
                row.label.clone(),
                row.parameters
                    .map_or_else(|| "\u{2013}".to_owned(), |count| count.to_string()),
                timed(|cost| cost.stepped),
                timed(|cost| cost.one),
                timed(|cost| cost.many),
                figure("train_seconds"),
                figure("peak_memory"),
            ]
        })
        .collect();
    *text += &markdown(&head, &cells);
    let machine = rows(results, data)
        .find_map(|row| row.cost.as_ref())
        .map_or_else(String::new, |cost| format!(", {}", cost.machine));
    let _ = writeln!(
        text,
        "\nTimes: our engine on one thread, median and quartiles, everybody in turn{machine}. One by one as in a simulation; recorded, \
         the Relaxation-ODE and the memoryless take many samples as one product, MLP-ODE and Attention-ODE many trajectories, LSTM and \
         CNODE neither. Training: wall clock, other jobs may have \
         run beside it.\n"
    );
}

fn orderings(text: &mut String, results: &ExperimentResults) {
    if results.orderings.is_empty() {
        return;
    }
    *text += "## Who is ahead of whom, and how sure that is\n\n";
    let head = [
        "claim",
        "data",
        "ratio of nRMSE",
        "95 % interval",
        "probability",
    ]
    .map(str::to_owned);
    let cells: Vec<Vec<String>> = results
        .orderings
        .iter()
        .map(|ordering| {
            vec![
                format!("{} ahead of {}", ordering.better, ordering.worse),
                ordering.data.clone(),
                format!("{:.3}", ordering.ratio),
                format!("{:.3} to {:.3}", ordering.ci95[0], ordering.ci95[1]),
                format!("{:.1} %", 100.0 * ordering.probability),
            ]
        })
        .collect();
    *text += &markdown(&head, &cells);
    *text += "\nBelow 1 the claim holds; its probability is one-sided. Student's interval of the logarithm, from the spread over seeds \
              (Welch) and over test trajectories (bootstrap); each claim by itself, so that of twenty such probabilities of 95 % one may \
              be luck.\n\n";
}
