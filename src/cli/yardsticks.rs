//! Rows without learning of an open-loop table.

use std::convert::Infallible;

use hydro_training::{comparison::Predict, dataset::Split, metrics::Yardstick};

/// Name and prediction of each yardstick that a split allows.
pub(super) fn without_learning(split: &Split) -> Vec<(String, Box<Predict<'static, Infallible>>)> {
    Yardstick::of_split(split)
        .into_iter()
        .map(|yardstick| {
            let predict: Box<Predict<'static, Infallible>> =
                Box::new(move |split, trajectory| Ok(yardstick.predict(split, trajectory)));
            (yardstick.label().to_owned(), predict)
        })
        .collect()
}
