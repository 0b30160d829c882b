//! Line plots as SVG text, in the one style of every page.

use plotters::{coord::Shift, prelude::*};

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008), truth first in black.
const PALETTE: [RGBColor; 8] = [
    RGBColor(20, 20, 20),
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(140, 140, 140),
];

/// A named line.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points; those that are not finite are left out.
    pub points: Vec<(f64, f64)>,
}

/// Caption, axes and size of a plot.
#[derive(Clone, Debug)]
pub struct Axes<'a> {
    /// Caption above the plot.
    pub title: &'a str,
    /// Quantity and unit of the abscissa.
    pub x: &'a str,
    /// Quantity and unit of the ordinate.
    pub y: &'a str,
    /// Width and height [px].
    pub size: (u32, u32),
    /// Same scale on both axes (a path seen from above).
    pub equal: bool,
}

/// The colour of the line `index`, as in the plots, for legends in HTML.
pub fn colour(index: usize) -> String {
    let RGBColor(r, g, b) = PALETTE[index % PALETTE.len()];
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// One of several plots in a picture.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// Caption, axes and size; all panels of a picture have the size of the first.
    pub axes: Axes<'a>,
    /// The lines; names are those of the first panel.
    pub series: Vec<Series>,
}

/// Height of a line of a picture's legend [px].
const LEGEND_LINE: u32 = 18;
/// Margin below the last line [px].
const LEGEND_MARGIN: u32 = 12;

/// Draws panels, `columns` in each row, and one legend below: a self-contained `<svg>` on white, or nothing where there is
/// nothing to draw.
pub fn panels(all: &[Panel<'_>], columns: usize) -> String {
    let Some(first) = all.first() else {
        return String::new();
    };
    let columns = columns.clamp(1, all.len());
    let rows = all.len().div_ceil(columns);
    let (width, height) = (
        first.axes.size.0 * columns as u32,
        first.axes.size.1 * rows as u32,
    );
    let (places, legend_height) = legend_places(&first.series, width);
    let mut svg = String::new();
    let size = (width, height + legend_height);
    let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
    let paint = || {
        area.fill(&WHITE)?;
        let (plots, below) = area.split_vertically(height);
        for (area, panel) in plots.split_evenly((rows, columns)).iter().zip(all) {
            draw(area, &panel.axes, &panel.series)?;
        }
        legend(&below, &first.series, &places)?;
        area.present()
    };
    let drawn = paint();
    drop(area);
    if drawn.is_err() { String::new() } else { svg }
}

/// Where each name's stroke begins [px], in as many lines as a picture of that width needs, and their height.
fn legend_places(series: &[Series], width: u32) -> (Vec<(i32, i32)>, u32) {
    let margin = 12;
    let (mut x, mut line) = (margin, 0);
    let places = series.iter().map(|named| {
        // Sans-serif letters of 12 px are about 6.5 px wide; a stroke and two gaps beside them.
        let taken = 40 + (6.5 * named.name.chars().count() as f64) as i32;
        if x > margin && x + taken > width as i32 {
            (x, line) = (margin, line + 1);
        }
        let place = (x, 12 + (line * LEGEND_LINE) as i32);
        x += taken;
        place
    });
    let places = places.collect();
    (places, (line + 1) * LEGEND_LINE + LEGEND_MARGIN)
}

/// Names beside strokes of their colours.
fn legend<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    series: &[Series],
    places: &[(i32, i32)],
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>> {
    for (index, (line, (x, y))) in series.iter().zip(places).enumerate() {
        let colour = PALETTE[index % PALETTE.len()];
        area.draw(&PathElement::new(
            [(*x, *y), (x + 18, *y)],
            colour.stroke_width(3),
        ))?;
        let style = ("sans-serif", 12).into_font().color(&RGBColor(40, 40, 40));
        area.draw(&Text::new(line.name.clone(), (x + 23, y - 6), style))?;
    }
    Ok(())
}

/// Draws lines; the text is a self-contained `<svg>`. Empty where there is nothing to draw.
pub fn lines(axes: &Axes<'_>, series: &[Series]) -> String {
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, axes.size).into_drawing_area();
    // The backend writes to a string, which cannot fail; a degenerate range is widened before.
    let drawn = draw(&area, axes, series).and_then(|()| area.present());
    drop(area);
    if drawn.is_err() { String::new() } else { svg }
}

fn draw<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    axes: &Axes<'_>,
    series: &[Series],
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>> {
    let finite = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
    let all: Vec<(f64, f64)> = series
        .iter()
        .flat_map(|line| line.points.iter().copied().filter(finite))
        .collect();
    let (mut xs, mut ys) = (
        range(all.iter().map(|p| p.0), 0.0),
        range(all.iter().map(|p| p.1), 0.05),
    );
    let margins = (70.0, 60.0);
    if axes.equal {
        let plot = (
            f64::from(axes.size.0) - margins.0,
            f64::from(axes.size.1) - margins.1,
        );
        let scale = ((xs.1 - xs.0) / plot.0).max((ys.1 - ys.0) / plot.1) * 1.05;
        (xs, ys) = (centred(xs, scale * plot.0), centred(ys, scale * plot.1));
    }
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .caption(axes.title, ("sans-serif", 15))
        .x_label_area_size(36)
        .y_label_area_size(54)
        .build_cartesian_2d(xs.0..xs.1, ys.0..ys.1)?;
    chart
        .configure_mesh()
        .x_desc(axes.x)
        .y_desc(axes.y)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(228, 228, 228))
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .label_style(("sans-serif", 12).into_font().color(&RGBColor(60, 60, 60)))
        .axis_style(RGBColor(120, 120, 120))
        .draw()?;
    for (index, line) in series.iter().enumerate() {
        let style = PALETTE[index % PALETTE.len()].stroke_width(if index == 0 { 2 } else { 1 });
        chart.draw_series(LineSeries::new(
            line.points.iter().copied().filter(finite),
            style,
        ))?;
    }
    Ok(())
}

/// Least and greatest value, widened by a part of their distance and never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (0.0, 1.0);
    }
    let pad = ((high - low) * margin).max(if high > low {
        0.0
    } else {
        high.abs().max(1.0) * 0.05
    });
    (low - pad, high + pad)
}

fn centred(range: (f64, f64), width: f64) -> (f64, f64) {
    let middle = (range.0 + range.1) / 2.0;
    (middle - width / 2.0, middle + width / 2.0)
}

/// Short numbers: no trailing zeros, no `-0`.
fn tick(value: &f64) -> String {
    let text = if value.abs() >= 100.0 {
        format!("{value:.0}")
    } else {
        format!("{value:.2}")
    };
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => text.as_str(),
    };
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> Axes<'static> {
        Axes {
            title: "force x",
            x: "time [s]",
            y: "[N]",
            size: (400, 200),
            equal: false,
        }
    }

    #[test]
    fn a_line_becomes_svg_and_bad_points_are_left_out() {
        let series = |points| {
            [Series {
                name: "truth".into(),
                points,
            }]
        };
        let svg = lines(
            &axes(),
            &series(vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)]),
        );
        assert!(
            svg.starts_with("<svg") && svg.contains("polyline") && !svg.contains("NaN"),
            "{svg}"
        );
        // Nothing, one point and a constant are ranges of no width.
        for points in [vec![], vec![(1.0, 1.0)], vec![(0.0, 2.0), (1.0, 2.0)]] {
            assert!(lines(&axes(), &series(points)).starts_with("<svg"));
        }
    }

    #[test]
    fn panels_share_a_picture_and_its_legend() {
        let panel = |name: &str| Panel {
            axes: axes(),
            series: vec![Series {
                name: name.into(),
                points: vec![(0.0, 1.0), (1.0, 2.0)],
            }],
        };
        let svg = panels(&[panel("truth"), panel("x"), panel("y")], 2);
        assert!(svg.contains("width=\"800\" height=\"430\""), "{svg}");
        assert!(
            svg.contains(">\ntruth\n<") && !svg.contains(">\nx\n<"),
            "{svg}"
        );
        assert_eq!(panels(&[], 2), "");
    }

    #[test]
    fn a_long_legend_takes_more_lines_and_stays_inside() {
        let names = [
            "a",
            "a name of thirty letters and so",
            "another one of thirty letters.",
        ];
        let series: Vec<Series> = names
            .iter()
            .map(|name| Series {
                name: (*name).to_owned(),
                points: Vec::new(),
            })
            .collect();
        assert_eq!(legend_places(&series, 800).1, 30);
        let (places, height) = legend_places(&series, 400);
        assert_eq!(height, 48);
        assert_eq!((places[1].1, places[2]), (12, (12, 30)));
        // One that is wider than the picture has a line of its own all the same.
        assert_eq!(legend_places(&series, 100).1, 66);
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!(
            [0.5, -0.001, 120.0, 3.0].map(|v| tick(&v)),
            ["0.5", "0", "120", "3"]
        );
    }
}
