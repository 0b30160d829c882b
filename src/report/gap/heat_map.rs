//! Heat maps of the excess: one map for each trial, one row for each sensor, one column for each window of time.

use std::{collections::BTreeMap, fmt::Write as _};

use hydro_gap::{
    records::{Found, HeatMap},
    verdict::Place,
};

use super::{
    numbers::{number, p_value, percent},
    sentence,
    svg::{self, Anchor, Scale},
};
use crate::report::html::escape;

/// Number of colours.
const LEVELS: usize = 8;
/// Width of a map [px]; a phone shows it at about this size.
const WIDTH: f64 = 400.0;
/// Height of a row [px].
const ROW: f64 = 16.0;
/// Approximate width of a letter of a sensor's name [px].
const LETTER: f64 = 6.2;
/// Most letters of a sensor's name.
const NAME: usize = 18;
/// Up to this many sensors all are drawn; of more, only those with an excess.
const ALL_SENSORS: usize = 8;
/// Trials that are shown at once; the others unfold.
const OPEN_TRIALS: usize = 12;

/// Upper bounds of the colours but the last: from noise alone (1) to the greatest value in equal ratios.
#[derive(Clone, Debug)]
struct Colours {
    bounds: [f64; LEVELS - 1],
}

impl Colours {
    fn from_maps(maps: &[HeatMap]) -> Self {
        let (_, greatest) = svg::range(
            maps.iter()
                .flat_map(|map| map.sensors.values().flatten().flatten().copied()),
        );
        // The first colour is what noise alone may well give; at least a factor of ten is spread.
        let lowest: f64 = 1.5;
        let greatest = if greatest.is_finite() { greatest } else { 0.0 };
        let highest = (greatest / lowest).max(10.0);
        let mut bounds = [0.0; LEVELS - 1];
        for (index, bound) in bounds.iter_mut().enumerate() {
            *bound = lowest * highest.powf(index as f64 / (LEVELS - 1) as f64);
        }
        Self { bounds }
    }

    fn level(&self, value: f64) -> usize {
        self.bounds.iter().filter(|bound| value > **bound).count()
    }
}

/// The section.
pub(super) fn section(html: &mut String, found: &Found, places: &[Place]) {
    if found.heat_maps.is_empty() {
        html.push_str("<p>There is no window to show.</p>");
        return;
    }
    let colours = Colours::from_maps(&found.heat_maps);
    if places.is_empty() && !is_coloured(found, &colours) {
        let count = found.heat_maps.len();
        let _ = write!(
            html,
            "<p class=\"note\">Looked at: every sensor in the windows of {count} trials. No window has more than noise \
             may give, so there is no map.</p>"
        );
        return;
    }
    html.push_str(
        "<p class=\"note\">Squared difference over the variance of the noise, averaged over a window: 1 is \
         noise alone. Framed: windows that chance does not explain. Empty: no samples.</p>",
    );
    legend(html, &colours);
    let (order, quiet) = rows(found, &colours, places);
    let (first, others) = found
        .heat_maps
        .split_at(found.heat_maps.len().min(OPEN_TRIALS));
    maps(html, first, &order, &colours, places);
    if !others.is_empty() {
        let _ = write!(
            html,
            "<details><summary>{} more trials</summary>",
            others.len()
        );
        maps(html, others, &order, &colours, places);
        html.push_str("</details>");
    }
    if !quiet.is_empty() {
        let _ = write!(
            html,
            "<p class=\"note\">Nothing beyond noise in any window, not drawn: {}.</p>",
            escape(&quiet.join(", "))
        );
    }
}

/// True where some window exceeds what noise alone may give.
fn is_coloured(found: &Found, colours: &Colours) -> bool {
    let mut values =
        (found.heat_maps.iter()).flat_map(|map| map.sensors.values().flatten().flatten());
    values.any(|value| colours.level(*value) > 0)
}

/// Sensors that are drawn, the largest share of the excess first, and, where they are many, those left out.
fn rows<'f>(found: &'f Found, colours: &Colours, places: &[Place]) -> (Vec<&'f str>, Vec<&'f str>) {
    let mut names: Vec<&str> = found
        .heat_maps
        .iter()
        .flat_map(|map| map.sensors.keys().map(String::as_str))
        .collect();
    names.sort_unstable();
    names.dedup();
    let share = |name: &str| found.by_sensor.get(name).copied().unwrap_or(0.0);
    names.sort_by(|a, b| share(b).total_cmp(&share(a)).then_with(|| a.cmp(b)));
    if names.len() <= ALL_SENSORS {
        return (names, Vec::new());
    }
    let loud = |name: &str| {
        let mut maps = found.heat_maps.iter();
        let coloured = maps.any(|map| {
            let mut values = map.sensors.get(name).into_iter().flatten().flatten();
            values.any(|value| colours.level(*value) > 0)
        });
        coloured || places.iter().any(|place| place.sensor == name)
    };
    let (mut drawn, mut quiet): (Vec<&str>, Vec<&str>) =
        names.into_iter().partition(|name| loud(name));
    if drawn.is_empty() {
        drawn = quiet.drain(..ALL_SENSORS).collect();
    }
    (drawn, quiet)
}

fn legend(html: &mut String, colours: &Colours) {
    html.push_str("<div class=\"scale\">");
    svg::open(html, 430.0, 32.0, "colour scale");
    let width = 50.0;
    for level in 0..LEVELS {
        svg::rectangle(
            html,
            &format!("h{level}"),
            (10.0 + width * level as f64, 2.0),
            (width, 12.0),
        );
    }
    for (index, bound) in colours.bounds.iter().enumerate() {
        svg::text(
            html,
            (10.0 + width * (index + 1) as f64, 27.0),
            Anchor::Middle,
            "",
            &short(*bound),
        );
    }
    svg::text(html, (10.0, 27.0), Anchor::Start, "", "noise");
    svg::text(html, (420.0, 27.0), Anchor::End, "", "more");
    html.push_str("</svg></div>");
}

/// Two digits are enough for a colour.
fn short(value: f64) -> String {
    if (10.0..1e4).contains(&value) {
        format!("{value:.0}")
    } else if value < 10.0 {
        format!("{value:.1}")
    } else {
        number(value)
    }
}

fn maps(html: &mut String, maps: &[HeatMap], order: &[&str], colours: &Colours, places: &[Place]) {
    html.push_str("<div class=\"grid maps\">");
    // One scale of time for all, so that trials compare.
    let longest = maps.iter().map(duration).fold(0.0, f64::max);
    for map in maps {
        let _ = write!(
            html,
            "<figure><figcaption>{}</figcaption>",
            escape(&map.trial)
        );
        one(html, map, order, colours, places, longest);
        html.push_str("</figure>");
    }
    html.push_str("</div>");
}

fn duration(map: &HeatMap) -> f64 {
    let (low, high) = svg::range(map.edges.iter().copied());
    (high - low).max(0.0)
}

fn one(
    html: &mut String,
    map: &HeatMap,
    order: &[&str],
    colours: &Colours,
    places: &[Place],
    longest: f64,
) {
    let letters = order.iter().map(|name| name.chars().count()).max();
    let left = 8.0 + LETTER * letters.unwrap_or(0).min(NAME) as f64;
    let right = WIDTH - 14.0;
    let start = map.edges.first().copied().unwrap_or(0.0);
    let time = Scale::new((start, start + longest), (left, right));
    let height = ROW * order.len() as f64;
    svg::open(
        html,
        WIDTH,
        height + 22.0,
        &format!("excess by sensor and time in {}", map.trial),
    );
    // Cells of one colour are one path: a page of many trials stays small.
    let mut cells: BTreeMap<usize, String> = BTreeMap::new();
    for (row, sensor) in order.iter().enumerate() {
        let y = ROW * row as f64;
        svg::name(html, (left - 5.0, y + 12.0), Anchor::End, NAME, sensor);
        let Some(values) = map.sensors.get(*sensor) else {
            continue;
        };
        for (window, value) in map.edges.windows(2).zip(values) {
            let Some(value) = value.filter(|value| !value.is_nan()) else {
                continue;
            };
            let (from, to) = (time.at(window[0]), time.at(window[1]));
            let _ = write!(
                cells.entry(colours.level(value)).or_default(),
                "M{} {}h{}v{}h-{}z",
                svg::coordinate(from),
                svg::coordinate(y + 0.5),
                svg::coordinate(to - from),
                svg::coordinate(ROW - 1.0),
                svg::coordinate(to - from)
            );
        }
    }
    for (level, path) in cells {
        let _ = write!(html, "<path class=\"h{level}\" d=\"{path}\"/>");
    }
    for place in places.iter().filter(|place| place.trial == map.trial) {
        let Some(row) = order.iter().position(|sensor| *sensor == place.sensor) else {
            continue;
        };
        let (from, to) = (time.at(place.t_start), time.at(place.t_end));
        let _ = write!(
            html,
            "<g><title>{}</title>",
            escape(&format!(
                "{}, p {}",
                sentence::place(place).replace('`', ""),
                p_value(place.p_value)
            ))
        );
        svg::rectangle(
            html,
            "place",
            (from, ROW * row as f64 + 1.0),
            (to - from, ROW - 2.0),
        );
        html.push_str("</g>");
    }
    svg::time_axis(html, &time, left, right, height + 2.0);
    html.push_str("</svg>");
}

/// Share of the excess by sensor, as bars; not shown where no window stands out, because they would be shares of noise.
pub(super) fn shares(html: &mut String, found: &Found, places: &[Place]) {
    let mut shares: Vec<(&str, f64)> = (found.by_sensor.iter())
        .map(|(name, share)| (name.as_str(), *share))
        .collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(b.0)));
    if shares.is_empty() || places.is_empty() {
        return;
    }
    html.push_str("<h3>By sensor</h3>");
    let (first, others) = shares.split_at(shares.len().min(ALL_SENSORS));
    bars(html, first);
    if !others.is_empty() {
        let _ = write!(html, "<details><summary>{} more</summary>", others.len());
        bars(html, others);
        html.push_str("</details>");
    }
}

fn bars(html: &mut String, shares: &[(&str, f64)]) {
    html.push_str(
        "<div class=\"wide\"><table><tr><th class=\"t\">sensor</th><th></th><th>of the excess</th></tr>",
    );
    for (name, share) in shares {
        let _ = write!(
            html,
            "<tr><td class=\"t\">{}</td><td class=\"bar\">",
            escape(name)
        );
        svg::share_bar(html, "fb", *share);
        let _ = write!(html, "</td><td class=\"n\">{}</td></tr>", percent(*share));
    }
    html.push_str("</table></div>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_sensors_those_with_something_to_see_are_drawn() {
        let found = |sensors: usize, loud: &[usize]| {
            let row = |at: usize| {
                let value = if loud.contains(&at) { 9.0 } else { 1.0 };
                (format!("s{at:02}"), vec![Some(value)])
            };
            let map = HeatMap {
                trial: "t".into(),
                edges: vec![0.0, 1.0],
                sensors: (0..sensors).map(row).collect(),
            };
            Found {
                heat_maps: vec![map],
                ..super::super::tests::record(2, 5).found
            }
        };
        let split = |found: &Found| {
            let colours = Colours::from_maps(&found.heat_maps);
            let (drawn, quiet) = rows(found, &colours, &[]);
            (drawn.join(" "), quiet.len())
        };
        assert_eq!(split(&found(20, &[3, 17])), ("s03 s17".to_owned(), 18));
        assert_eq!(split(&found(ALL_SENSORS, &[3])).1, 0);
        // Nothing anywhere: some are drawn all the same, to show that it was looked at.
        assert_eq!(split(&found(20, &[])).1, 20 - ALL_SENSORS);
    }

    #[test]
    fn colours_rise_with_the_value_whatever_the_values() {
        for values in [
            vec![],
            vec![None, Some(1.0)],
            vec![Some(1.0), Some(1e9)],
            vec![Some(f64::INFINITY), Some(f64::NAN)],
        ] {
            let map = HeatMap {
                trial: "t".into(),
                edges: vec![0.0, 1.0, 2.0],
                sensors: [("s".to_owned(), values)].into(),
            };
            let colours = Colours::from_maps(&[map]);
            assert!(colours.bounds.windows(2).all(|pair| pair[0] < pair[1]));
            assert_eq!(colours.level(1.0), 0);
            assert_eq!(colours.level(f64::INFINITY), LEVELS - 1);
        }
    }
}
