//! Charts that are read without colour: lines differ in their dashes, marks in their shapes, and error bars say how far
//! a mark may be off. One drawing serves SVG and PNG; its font is part of the program.

use std::error::Error;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, Ranged};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use stats::Measured;

use crate::picture::Picture;

/// Width of a chart, and height of its plot with the title [pixels].
const SIZE: [u32; 2] = [720, 440];

/// Height of a line of the legend, which stands below [pixels].
const LEGEND_LINE: u32 = 20;

const FONT: &str = "sans-serif";

/// The size of labels in maps [px].
const LABEL: u32 = 18;

/// Colours that the colour-blind tell apart (Okabe & Ito 2008), and black. They only help.
const COLOURS: [RGBColor; 6] = [
    BLACK,
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
];

/// A chart with its data.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// The title above the chart.
    pub title: String,
    /// The horizontal axis of the chart.
    pub x: Axis,
    /// The vertical axis of the chart.
    pub y: Axis,
    /// What is drawn, in the order of the legend.
    pub series: Vec<Series>,
}

/// An axis: what it measures, with its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The label beside the axis, with the unit.
    pub label: String,
    /// Whether it is logarithmic; what is not positive has no place on it then.
    pub log: bool,
}

/// Points of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The name of the series in the legend.
    pub name: String,
    /// How it is drawn.
    pub style: Style,
    /// The points, in the order of the line.
    pub points: Vec<ChartPoint>,
}

impl Series {
    /// What theory says along a sweep: a line.
    pub fn theory(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| ChartPoint { x, y, error: 0.0 }).collect();
        Series { name: name.into(), style: Style::Line, points }
    }

    /// Measurements along a sweep: joined marks with error bars.
    pub fn measured(name: &str, points: impl IntoIterator<Item = (f64, Measured)>) -> Self {
        let points = points.into_iter().map(|(x, y)| ChartPoint { x, y: y.value, error: y.standard_error });
        Series { name: name.into(), style: Style::Joined, points: points.collect() }
    }
}

/// A point of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartPoint {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// The standard error of `y`; 0 where it has none.
    pub error: f64,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line: what theory says.
    Line,
    /// Marks with error bars: what is seen.
    Marks,
    /// Marks with error bars, joined.
    Joined,
}

impl Axis {
    /// An axis with equal steps.
    pub fn linear(label: &str) -> Self {
        Axis { label: label.into(), log: false }
    }

    /// An axis with equal factors.
    pub fn log(label: &str) -> Self {
        Axis { label: label.into(), log: true }
    }

    /// Where a value stands; `None` where it has no place.
    fn place(&self, value: f64) -> Option<f64> {
        let place = if self.log { value.log10() } else { value };
        place.is_finite().then_some(place)
    }

    /// From the least to the largest of some places, with a margin.
    fn span(&self, places: impl Iterator<Item = f64>) -> Span {
        let [low, high] = places
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| [low.min(place), high.max(place)]);
        let [low, high] = if low <= high { [low, high] } else { [0.0, 1.0] };
        let margin = if high > low {
            0.06 * (high - low)
        } else if self.log {
            0.5
        } else {
            0.1 * high.abs().max(1.0)
        };
        Span { low: low - margin, high: high + margin, log: self.log }
    }

    fn tick(&self, place: f64) -> String {
        if !self.log {
            return format!("{}", (place * 1e9).round() / 1e9);
        }
        let decade = (place + 1e-9).floor();
        let digit = 10f64.powf(place - decade).round();
        if (-2.0..=4.0).contains(&decade) {
            return format!("{}", digit * 10f64.powf(decade));
        }
        let factor = if digit > 1.0 { format!("{digit}·") } else { String::new() };
        format!("{factor}10{}", superscript(decade as i32))
    }
}

fn superscript(exponent: i32) -> String {
    let raised = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
    };
    exponent.to_string().chars().map(raised).collect()
}

/// The range of an axis, in places.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: f64,
    high: f64,
    log: bool,
}

impl Ranged for Span {
    type FormatOption = plotters::coord::ranged1d::NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (begin, end): (i32, i32)) -> i32 {
        begin + ((value - self.low) / (self.high - self.low) * f64::from(end - begin)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let most = hint.max_num_points().min(12);
        let ticks = if self.log { self.decades(most) } else { self.steps(most) };
        ticks.into_iter().filter(|tick| (self.low..=self.high).contains(tick)).collect()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.low..self.high
    }
}

impl plotters::coord::ranged1d::ValueFormatter<f64> for Span {
    fn format(value: &f64) -> String {
        value.to_string()
    }
}

impl Span {
    /// Powers of 10, evenly spaced, about `most` in number; with 2 and 5 times these between them where they are few.
    fn decades(&self, most: usize) -> Vec<f64> {
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let step = (last - first + 1).max(1) as usize / most.max(1) + 1;
        let between: &[f64] = if self.high - self.low < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let decades = (first..=last).filter(|decade| decade.rem_euclid(step as i32) == 0);
        decades.flat_map(|decade| between.iter().map(move |b| f64::from(decade) + b.log10())).collect()
    }

    /// Multiples of 1, 2 or 5 times a power of 10.
    fn steps(&self, most: usize) -> Vec<f64> {
        let rough = (self.high - self.low) / most.clamp(1, 8) as f64;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|step| *step >= rough);
        let step = step.unwrap_or(rough);
        let (first, last) = ((self.low / step).ceil() as i64, (self.high / step).floor() as i64);
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

type DrawingError = Box<dyn Error + Send + Sync>;

impl Chart {
    /// The chart as SVG.
    pub fn svg(&self) -> String {
        let mut svg = String::new();
        let backend = SVGBackend::with_string(&mut svg, self.size());
        self.draw(&backend.into_drawing_area()).expect("strings take all");
        svg
    }

    /// The chart as PNG.
    pub fn png(&self) -> Vec<u8> {
        let (width, height) = self.size();
        let mut pixels = vec![255; 3 * (width * height) as usize];
        let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
        self.draw(&backend.into_drawing_area()).expect("memory takes all");
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().expect("memory takes all");
        writer.write_image_data(&pixels).expect("as many pixels as were announced");
        writer.finish().expect("memory takes all");
        bytes
    }

    fn size(&self) -> (u32, u32) {
        (SIZE[0], SIZE[1] + LEGEND_LINE * self.series.len() as u32 + LEGEND_LINE / 2)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), DrawingError>
    where
        B::ErrorType: 'static,
    {
        load_font();
        area.fill(&WHITE)?;
        let (above, below) = area.split_vertically(SIZE[1]);
        self.draw_plot(&above)?;
        for (number, series) in self.series.iter().enumerate() {
            let middle = (number as i32) * LEGEND_LINE as i32 + LEGEND_LINE as i32 / 2;
            let look = SeriesLook::new(number, series.style);
            let line = [(76, middle), (116, middle)];
            look.draw_line(&below, &line)?;
            look.draw_mark(&below, (96, middle))?;
            let anchored = text_style(14).pos(Pos::new(HPos::Left, VPos::Center));
            below.draw(&Text::new(series.name.clone(), (126, middle), anchored))?;
        }
        area.present()?;
        Ok(())
    }

    fn draw_plot<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), DrawingError>
    where
        B::ErrorType: 'static,
    {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let x = self.x.span(points().filter_map(|point| self.x.place(point.x)));
        let ends = |point: &ChartPoint| [point.y, point.y - point.error, point.y + point.error];
        let y = self.y.span(points().flat_map(ends).filter_map(|y| self.y.place(y)));
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, (FONT, 17))
            .margin(12)
            .margin_right(24)
            .x_label_area_size(46)
            .y_label_area_size(72)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .x_label_formatter(&|place| self.x.tick(*place))
            .y_label_formatter(&|place| self.y.tick(*place))
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .bold_line_style(RGBColor(225, 225, 225))
            .light_line_style(TRANSPARENT)
            .draw()?;
        let plot = chart.plotting_area();
        let at = |x: f64, y: f64| Some(plot.map_coordinate(&(self.x.place(x)?, self.y.place(y)?)));
        for (number, series) in self.series.iter().enumerate() {
            let look = SeriesLook::new(number, series.style);
            let middles: Vec<_> = series.points.iter().filter_map(|p| at(p.x, p.y)).collect();
            look.draw_line(area, &middles)?;
        }
        // Marks stand above all lines.
        for (number, series) in self.series.iter().enumerate() {
            let look = SeriesLook::new(number, series.style);
            for point in &series.points {
                let Some(middle) = at(point.x, point.y) else { continue };
                if point.error > 0.0 && series.style != Style::Line {
                    let floor = plot.map_coordinate(&(x.low, y.low));
                    let top = at(point.x, point.y + point.error).unwrap_or(middle);
                    let bottom = at(point.x, point.y - point.error).unwrap_or((middle.0, floor.1));
                    look.draw_bar(area, top, bottom)?;
                }
                look.draw_mark(area, middle)?;
            }
        }
        Ok(())
    }
}

/// Writes words in the middle of a place of a picture in colour [px], black on white.
pub(crate) fn write_label(picture: &mut Picture, at: [f64; 2], text: &str) {
    load_font();
    let backend = BitMapBackend::with_buffer(&mut picture.pixels, (picture.width, picture.height));
    let area = backend.into_drawing_area();
    let style = text_style(LABEL).pos(Pos::new(HPos::Center, VPos::Center));
    let (width, height) = area.estimate_text_size(text, &style).expect("the font is built in");
    let [x, y] = at.map(|at| at as i32);
    let half = [width, height].map(|side| side as i32 / 2 + 2);
    let around = [(x - half[0], y - half[1]), (x + half[0], y + half[1])];
    area.draw(&Rectangle::new(around, WHITE.filled())).expect("memory takes all");
    area.draw(&Text::new(text, (x, y), style)).expect("memory takes all");
    area.present().expect("memory takes all");
}

fn text_style(size: u32) -> TextStyle<'static> {
    (FONT, size).into_text_style(&(SIZE[0], SIZE[1]))
}

/// Charts draw the same text on every machine.
fn load_font() {
    static LOADED: Once = Once::new();
    LOADED.call_once(|| {
        let loaded = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        assert!(loaded.is_ok(), "the font that is built in is a font");
    });
}

/// How a series looks: the shape of its marks, the dashes of its line.
struct SeriesLook {
    number: usize,
    style: Style,
    colour: RGBColor,
}

type ChartPixel = (i32, i32);

impl SeriesLook {
    fn new(number: usize, style: Style) -> Self {
        SeriesLook { number, style, colour: COLOURS[number % COLOURS.len()] }
    }

    /// Lengths of a dash and of the gap after it [pixels]; no gap in the first line.
    fn dashes(&self) -> [f64; 2] {
        [[1.0, 0.0], [9.0, 5.0], [2.0, 4.0], [14.0, 4.0], [5.0, 9.0]][self.number % 5]
    }

    fn draw_line<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        points: &[ChartPixel],
    ) -> Result<(), DrawingError>
    where
        B::ErrorType: 'static,
    {
        let width = match self.style {
            Style::Marks => return Ok(()),
            Style::Line => 2,
            Style::Joined => 1,
        };
        for part in dashed(points, self.dashes()) {
            area.draw(&PathElement::new(part, self.colour.stroke_width(width)))?;
        }
        Ok(())
    }

    fn draw_bar<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        top: ChartPixel,
        bottom: ChartPixel,
    ) -> Result<(), DrawingError>
    where
        B::ErrorType: 'static,
    {
        let across = |(x, y): ChartPixel| vec![(x - 3, y), (x + 3, y)];
        for line in [vec![top, bottom], across(top), across(bottom)] {
            area.draw(&PathElement::new(line, self.colour.stroke_width(1)))?;
        }
        Ok(())
    }

    /// Filled and hollow shapes in turn.
    fn draw_mark<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        (x, y): ChartPixel,
    ) -> Result<(), DrawingError>
    where
        B::ErrorType: 'static,
    {
        const DISC: &[ChartPixel] = &[(4, 0), (3, 3), (0, 4), (-3, 3), (-4, 0), (-3, -3), (0, -4), (3, -3)];
        const TRIANGLE: &[ChartPixel] = &[(0, -5), (5, 4), (-5, 4)];
        const SQUARE: &[ChartPixel] = &[(-4, -4), (4, -4), (4, 4), (-4, 4)];
        const DIAMOND: &[ChartPixel] = &[(0, -6), (5, 0), (0, 6), (-5, 0)];
        const DOWN: &[ChartPixel] = &[(0, 5), (5, -4), (-5, -4)];
        if self.style == Style::Line {
            return Ok(());
        }
        let shape = [DISC, TRIANGLE, SQUARE, DIAMOND, DOWN][self.number % 5];
        let mut outline: Vec<ChartPixel> = shape.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
        let hollow = self.number % 2 == 1;
        let filling = if hollow { WHITE } else { self.colour };
        area.draw(&Polygon::new(outline.clone(), filling.filled()))?;
        outline.push(outline[0]);
        area.draw(&PathElement::new(outline, self.colour.stroke_width(2)))?;
        Ok(())
    }
}

/// The pieces of a line of dashes.
fn dashed(points: &[ChartPixel], [dash, gap]: [f64; 2]) -> Vec<Vec<ChartPixel>> {
    if gap == 0.0 {
        return vec![points.to_vec()];
    }
    let mut pieces = Vec::new();
    // How far the pattern has come.
    let mut phase = 0.0;
    for ends in points.windows(2) {
        let [a, b] = [ends[0], ends[1]].map(|(x, y)| [f64::from(x), f64::from(y)]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let at = |s: f64| {
            let along = |k: usize| (a[k] + (b[k] - a[k]) * s / length).round() as i32;
            (along(0), along(1))
        };
        let mut from = -phase;
        while from < length {
            let (begin, end) = (from.max(0.0), (from + dash).min(length));
            if end > begin {
                pieces.push(vec![at(begin), at(end)]);
            }
            from += dash + gap;
        }
        phase = (phase + length).rem_euclid(dash + gap);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        let point = |x: f64| ChartPoint { x, y: 1.0 / x.sqrt(), error: 0.1 / x.sqrt() };
        let points: Vec<ChartPoint> = [1e-8, 1e-5, 1e-2].map(point).into();
        let series = |name: &str, style| Series { name: name.into(), style, points: points.clone() };
        Chart {
            title: "Errors & areas".into(),
            x: Axis::log("area [m²]"),
            y: Axis::log("relative error"),
            series: vec![series("theory", Style::Line), series("seen", Style::Marks)],
        }
    }

    #[test]
    fn a_chart_says_what_it_shows_as_svg_and_as_png() {
        let svg = chart().svg();
        for text in ["Errors &amp; areas", "area [m²]", "relative error", "theory", "seen", "10⁻⁸"] {
            assert!(svg.contains(text), "{text} in {svg}");
        }
        let decoder = png::Decoder::new(std::io::Cursor::new(chart().png()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (720, 490));
        let ink = pixels.chunks_exact(3).filter(|pixel| pixel.iter().any(|&c| c < 128)).count();
        assert!(ink > 1000, "{ink} dark pixels");
    }

    #[test]
    fn what_has_no_place_is_left_out() {
        let mut chart = chart();
        chart.series[1].points.push(ChartPoint { x: 1e-3, y: f64::INFINITY, error: 0.0 });
        chart.series[1].points.push(ChartPoint { x: 0.0, y: 1.0, error: f64::NAN });
        assert!(chart.svg().contains("seen"));
        chart.series.clear();
        assert!(chart.svg().contains("area [m²]"));
    }

    #[test]
    fn ticks_are_round_numbers() {
        let log = Axis::log("");
        assert_eq!(log.tick(-8.0), "10⁻⁸");
        assert_eq!(log.tick(2f64.log10() - 6.0), "2·10⁻⁶");
        assert_eq!(log.tick(5f64.log10() - 2.0), "0.05");
        assert_eq!(Span { low: 0.04, high: 0.97, log: false }.steps(5), [0.2, 0.4, 0.6000000000000001, 0.8]);
    }

    #[test]
    fn dashes_go_round_corners() {
        let pieces = dashed(&[(0, 0), (10, 0), (10, 10)], [6.0, 2.0]);
        assert_eq!(pieces, [[(0, 0), (6, 0)], [(8, 0), (10, 0)], [(10, 0), (10, 4)], [(10, 6), (10, 10)]]);
    }
}
