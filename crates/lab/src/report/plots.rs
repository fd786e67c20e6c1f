//! Errors over samples and over time on double logarithmic paper, as SVG that is sharp at any size.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::COLORS;
use crate::comparison::{Comparison, Convergence};

/// What lies on the horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    Seconds,
    Samples,
}

impl Axis {
    fn of(self, point: &Convergence) -> f64 {
        match self {
            Self::Seconds => point.seconds,
            Self::Samples => f64::from(point.spp),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Samples => "samples per pixel",
        }
    }
}

const SIZE: (u32, u32) = (620, 400);

/// relMSE of every method, with the interval of its mean over runs as a band.
pub(crate) fn convergence(comparison: &Comparison, axis: Axis) -> Result<String, String> {
    let mut svg = String::new();
    draw(comparison, axis, &mut svg).map_err(|e| e.to_string())?;
    // Black is whatever the page writes with; the page decides on the size.
    Ok(svg.replace("#000000", "currentColor").replacen("<svg width=\"620\" height=\"400\"", "<svg", 1))
}

fn draw(comparison: &Comparison, axis: Axis, svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let points = || comparison.methods.iter().flat_map(|m| &m.convergence);
    let xs = range(points().map(|p| axis.of(p)), 1.15);
    let ys = range(points().map(|p| p.relmse.value), 1.6);
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .margin_right(90)
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d((xs[0]..xs[1]).log_scale(), (ys[0]..ys[1]).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(axis.name())
        .y_desc("relMSE")
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .bold_line_style(BLACK.mix(0.18))
        .light_line_style(BLACK.mix(0.06))
        .axis_style(BLACK.mix(0.5))
        .x_label_formatter(&|x| number(*x))
        .y_label_formatter(&|y| number(*y))
        .draw()?;
    for (i, method) in comparison.methods.iter().enumerate() {
        let [r, g, b] = COLORS[i % COLORS.len()];
        let color = RGBColor(r, g, b);
        let curve: Vec<_> = method.convergence.iter().map(|p| (axis.of(p), p.relmse)).collect();
        let is_known = |low: f64, high: f64| low > 0.0 && high.is_finite();
        let band: Vec<_> = curve.iter().filter(|(_, e)| is_known(e.low, e.high)).collect();
        if band.len() >= 2 {
            let clamp = |y: f64| y.clamp(ys[0], ys[1]);
            let upper = band.iter().map(|(x, e)| (*x, clamp(e.high)));
            let lower = band.iter().rev().map(|(x, e)| (*x, clamp(e.low)));
            let outline: Vec<_> = upper.chain(lower).collect();
            chart.draw_series(std::iter::once(Polygon::new(outline, color.mix(0.15).filled())))?;
        }
        chart
            .draw_series(LineSeries::new(curve.iter().map(|(x, e)| (*x, e.value)), color.stroke_width(2)))?;
        chart.draw_series(curve.iter().map(|(x, e)| Circle::new((*x, e.value), 3, color.filled())))?;
        if let Some((x, e)) = curve.last() {
            let style = ("sans-serif", 13).into_font().color(&color).pos(Pos::new(HPos::Left, VPos::Center));
            let at = chart.backend_coord(&(*x, e.value));
            root.draw(&Text::new(short(&method.label), (at.0 + 8, at.1), style))?;
        }
    }
    root.present()?;
    Ok(())
}

/// The smallest and largest positive value, with some room.
fn range(values: impl Iterator<Item = f64>, room: f64) -> [f64; 2] {
    let (lo, hi) = values
        .filter(|x| x.is_finite() && *x > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
    if lo <= hi { [lo / room, hi * room] } else { [0.1, 1.0] }
}

/// A label that fits beside the plot.
fn short(label: &str) -> String {
    let mut text: String = label.chars().take(13).collect();
    if text.len() < label.len() {
        text.push('…');
    }
    text
}

/// A number of few digits: 0.5, 20, 3e-4.
fn number(x: f64) -> String {
    match x.abs() {
        a if (1e-2..1e5).contains(&a) => format!("{}", (x * 1e6).round() / 1e6),
        _ => format!("{x:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(["0.5", "20", "3e-4"], [number(0.5), number(20.0), number(3e-4)].map(|s| s));
        assert_eq!(short("path:mis=false:max_depth=3"), "path:mis=fals…");
        assert_eq!(range([0.0, 2.0, f64::NAN].into_iter(), 2.0), [1.0, 4.0]);
    }
}
