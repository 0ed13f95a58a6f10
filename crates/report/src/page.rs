//! `report.html`: one file with the answer in words, the scene in three dimensions, and the table that both are made from.
//!
//! Words, tables and charts are written here and need no script. The scene is shown by `assets/viewer.js.gz`, which
//! `web/build.mjs` bundles from `web/src` and three.js; the page opens without a network.

mod charts;
mod compact;

use std::io::{self, Read, Write};

use flate2::read::GzDecoder;
use job::Finishes;
use minijinja::{AutoEscape, Environment, context};
use radiosity::{
    Estimates,
    sensors::{Reading, Readings},
};
use serde::Serialize;
use stats::Measured;

use self::charts::{convergence, profile};
use self::compact::{CompactLayout, compact, holds_table};
use crate::chart::Chart;
use crate::dials::{Dials, write_scores};
use crate::floor::{FloorMap, floor_map};
use crate::flow::{Flow, losses};
use crate::isolux::isolux_svg;
use crate::outlines::outlines;
use crate::pack::{pack, write_point};
use crate::patches::{Digits, per_channel, write_patches};
use crate::picture::Shot;
use crate::planes::{PerChannel, PlaneSummary};
use crate::precision::HeadlineSummary;
use crate::sensitivities::SensitivitySummary;
use crate::sensors::write_cells;
use crate::smooth::Smooth;
use crate::sources::SourceSummary;
use crate::summary::{Energy, Summary, Verdict};
use crate::words::{self, brief_percent, measured, number, percent, printed};
pub use charts::Milestone;

const TEMPLATE: &str = include_str!("../assets/report.html");
const STYLE: &str = include_str!("../assets/page.css");
const SCRIPT: &[u8] = include_bytes!("../assets/viewer.js.gz");

/// What the page shows.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// The name of the job.
    pub name: &'a str,
    /// The summary of the run.
    pub summary: &'a Summary,
    /// What is known of every face.
    pub estimates: &'a Estimates<'a>,
    /// What sensors read, where there are any.
    pub readings: Option<&'a Readings<'a>>,
    /// The errors at the looks of the run, in the order of walks.
    pub milestones: Vec<Milestone>,
    /// The command that makes the same numbers again.
    pub command: String,
    /// How the scene is seen at first.
    pub shot: Shot,
    /// The level of each interval of a patch.
    pub level: f64,
    /// Radiosity at the corners of faces.
    pub smooth: &'a Smooth,
    /// What surfaces are made of.
    pub materials: &'a Finishes,
}

/// The data that only the report page of a running job has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Live {
    /// Paths of the budget.
    pub paths_total: u64,
}

/// The parts of the page's data that its script reads as JSON.
#[derive(Serialize)]
struct Facts<'a> {
    summary: &'a Summary,
    view: Shot,
    contrast: [f64; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    dials: Option<Dials<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    live: Option<Live>,
    #[serde(skip_serializing_if = "Option::is_none")]
    compact: Option<CompactLayout>,
}

/// A sensor, with what its patches read at most and at least.
#[derive(Serialize)]
struct SensorRow {
    name: String,
    patches: usize,
    least: String,
    most: String,
    error: String,
}

#[derive(Serialize)]
struct PageFigure {
    title: String,
    svg: String,
}

/// Where a part of the power went.
#[derive(Serialize)]
struct Share {
    kind: &'static str,
    words: &'static str,
    share: f64,
    percent: String,
    amount: String,
}

impl Page<'_> {
    /// Writes the page.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, mut writer: impl Write) -> io::Result<()> {
        writer.write_all(self.render()?.as_bytes())
    }

    fn render(&self) -> io::Result<String> {
        fill(&[self.fixed()?, self.parts(None)?])
    }

    /// The page of a run that goes on, which asks for news by itself, and the news: the page without what does not change from
    /// one page of a run to the next.
    ///
    /// # Errors
    /// Where the parts cannot be packed.
    pub fn render_live(&self, live: Live) -> io::Result<[String; 2]> {
        let parts = self.parts(Some(live))?;
        Ok([fill(&[self.fixed()?, parts.clone()])?, fill(&[context! { news => true }, parts])?])
    }

    /// Style, script, and the corners of faces and sensors.
    fn fixed(&self) -> io::Result<minijinja::Value> {
        let sensor_corners = self.readings.map(sensor_corners).transpose()?;
        Ok(context! {
            style => STYLE,
            script => script()?,
            corners => if self.is_compact() { None } else { Some(self.corners()?) },
            sensor_corners => sensor_corners,
        })
    }

    /// The values of the template that come from the summary and the tables.
    fn parts(&self, live: Option<Live>) -> io::Result<minijinja::Value> {
        let summary = self.summary;
        let (energy, energy_unit) = shares(self.estimates, summary);
        let mut checks = summary.checks.clone();
        checks.sort_by_key(|check| check.verdict);
        let of = |verdict: Verdict| checks.iter().filter(move |check| check.verdict == verdict).count();
        let flow = Flow::of(self.estimates, summary, self.materials);
        let (layout, compact) = match self.is_compact() {
            true => {
                compact(self.estimates, self.smooth).map(|(layout, numbers)| (Some(layout), Some(numbers)))?
            }
            false => (None, None),
        };
        let rounded = layout.as_ref().map(CompactLayout::words);
        let sensor_table = self.readings.map(|readings| {
            let cells = 0..readings.sensors().cell_count();
            pack(|zlib| write_cells(zlib, readings, cells))
        });
        let sensor_table = sensor_table.transpose()?;
        let floor = floor_map(self.estimates, self.smooth, summary.units.irradiance);
        Ok(context! {
            name => self.name,
            summary => summary,
            live => live,
            answer => self.answer(floor.as_ref()),
            verdict => self.verdict(),
            headline => self.headline(),
            floor => self.floor(),
            confidence => printed(100.0 * summary.confidence),
            coloured => self.estimates.scene().channels() > 1,
            charts => self.figures(),
            maps => self.maps(floor),
            planes => self.planes(),
            sensors => self.sensors(),
            sources => self.sources(),
            sensitivities => self.sensitivities(),
            passed => of(Verdict::Passed),
            not_examined => of(Verdict::NotExamined),
            checks => checks,
            energy => energy,
            energy_unit => energy_unit,
            flow => flow.as_ref().map(Flow::rows),
            flow_svg => flow.as_ref().map(Flow::svg),
            flow_notes => flow.as_ref().map(Flow::notes),
            model => summary.model.lines(),
            seconds => format!("{:.1}", summary.seconds),
            cpu_seconds => format!("{:.1}", summary.cpu_seconds),
            command => &self.command,
            picture => self.taken(),
            facts => self.facts(live, layout)?,
            compact => compact,
            rounded => rounded,
            table => if self.is_compact() { None } else { Some(self.table()?) },
            smooth => if self.is_compact() { None } else { Some(self.smooth()?) },
            scores => if self.is_compact() { None } else { self.scores()? },
            sensor_table => sensor_table,
        })
    }

    /// How bright white is, and where the picture is taken from.
    fn taken(&self) -> String {
        let Shot { viewpoint, white, .. } = self.shot;
        let channels = self.estimates.scene().channels();
        let white: Vec<String> = white.iter().take(channels).map(|&white| number(white)).collect();
        let point = |point: [f64; 3]| point.map(number).join(", ");
        format!(
            "white is {} {} and above{}; seen from ({}) towards ({}) m, {:.0}° high",
            white.join(", "),
            self.summary.units.radiosity,
            if channels > 1 { " (red, green, blue)" } else { "" },
            point(viewpoint.eye),
            point(viewpoint.look_at),
            viewpoint.fov
        )
    }

    /// The answer in a few sentences: how much light there is, how well it is known, and from how many paths.
    fn answer(&self, floor: Option<&FloorMap>) -> String {
        let Summary { paths, model, units, planes, .. } = self.summary;
        let unit = units.irradiance;
        let mean = "Mean light on";
        let light = match (planes.first(), floor) {
            (Some(plane), _) => format!("{mean} {}: {} {unit}. ", plane.name, plane.mean.words()),
            (None, Some(floor)) => {
                let of = if self.estimates.scene().channels() > 1 { ", mean of the channels" } else { "" };
                format!("{mean} the floor: about {} {unit}{of}. ", number(floor.mean))
            }
            (None, None) => String::new(),
        };
        let median = self.summary.precision.headline.median;
        let known = match median.is_finite() && median > 0.0 {
            true => format!(
                "Half of the area is known within {}{} ({} % intervals)",
                brief_percent(median),
                self.summary.system(),
                printed(100.0 * self.summary.confidence)
            ),
            false => self.headline(),
        };
        format!("{light}{known}. {paths} paths, {} patches.", model.patches)
    }

    fn headline(&self) -> String {
        sentence(&self.summary.headline())
    }

    /// What half-widths are divided by at least, in words.
    fn floor(&self) -> String {
        let HeadlineSummary { floor, .. } = &self.summary.precision.headline;
        let floor: Vec<String> = floor.iter().map(|&floor| number(floor)).collect();
        format!("{} {}", floor.join(", "), self.summary.units.irradiance)
    }

    /// Whether the target, if there is one, is reached.
    fn verdict(&self) -> Option<String> {
        let target = self.summary.target.as_ref()?;
        let reached = if target.reached { "reached" } else { "not reached" };
        Some(format!(
            "The target is {reached}: {}{}; {:.2} % was asked for.",
            target.achieved_words(),
            self.summary.system(),
            100.0 * target.fraction
        ))
    }

    /// A row for each plane of points: its figures, and whether they reach what is demanded.
    fn planes(&self) -> Vec<[String; 7]> {
        let unit = self.summary.units.irradiance;
        let row = |plane: &PlaneSummary| {
            let [mean, minimum, uniformity, diversity] =
                [&plane.mean, &plane.minimum, &plane.uniformity, &plane.diversity].map(PerChannel::words);
            let modelling = plane.modelling.iter().map(|modelling| modelling.words());
            let modelling = modelling.chain(plane.ugr.iter().map(|ugr| ugr.words()));
            let demands: Vec<String> =
                modelling.chain(plane.demands.iter().map(|demand| demand.words(unit))).collect();
            let (name, points) = (plane.name.clone(), plane.points.to_string());
            [name, points, mean, minimum, uniformity, diversity, demands.join("; ")]
        };
        self.summary.planes.iter().map(row).collect()
    }

    /// A row for each sensor, and each channel of it; planes of points have a table of their own.
    fn sensors(&self) -> Vec<SensorRow> {
        let Some(readings) = self.readings else { return Vec::new() };
        let sensors = readings.sensors();
        let specs = sensors.specs().iter().enumerate().filter(|(_, spec)| !spec.shape.is_plane());
        let rows = specs.flat_map(|(number, spec)| {
            let names = per_channel(&spec.name, readings.channels());
            names.into_iter().enumerate().map(move |(channel, name)| {
                let read: Vec<Reading> =
                    sensors.cells_of(number).map(|cell| readings.cell(cell)[channel]).collect();
                let by_light = |a: &&Reading, b: &&Reading| {
                    let [a, b] = [a, b].map(|reading| reading.irradiance.unwrap_or(0.0));
                    a.total_cmp(&b)
                };
                let words = |reading: Option<&Reading>| reading.map_or(String::new(), with_interval);
                let error = read.iter().map(Reading::relative_error).fold(0.0, f64::max);
                SensorRow {
                    name,
                    patches: read.len(),
                    least: words(read.iter().min_by(by_light)),
                    most: words(read.iter().max_by(by_light)),
                    error: percent(error),
                }
            })
        });
        rows.collect()
    }

    /// A row for each source.
    fn sources(&self) -> Vec<[String; 4]> {
        let row = |source: &SourceSummary| {
            let factor = source.factor.map_or(String::new(), printed);
            [source.name.clone(), number(source.power), factor, percent(source.relative_error)]
        };
        self.summary.sources.iter().map(row).collect()
    }

    /// A row for each material whose influence is asked for, the one that matters most first.
    fn sensitivities(&self) -> Vec<[String; 3]> {
        let row = |of: &SensitivitySummary| {
            if !of.is_known() {
                return [of.material.clone(), "unknown".into(), "unknown".into()];
            }
            let known = |error: f64| format!("{} ± {}", percent(of.relative_change), percent(error));
            let change = known(of.relative_change * of.std_error_bound / of.mean_derivative);
            let change = if of.mean_derivative > 0.0 { change } else { "0".into() };
            let derivative =
                measured(Measured { value: of.mean_derivative, standard_error: of.std_error_bound });
            [of.material.clone(), derivative, change]
        };
        self.summary.sensitivities.iter().map(row).collect()
    }

    fn figures(&self) -> Vec<PageFigure> {
        let figure = |chart: Chart| PageFigure { svg: chart.svg(), title: chart.title };
        let charts = [convergence(&self.milestones, self.summary.target.as_ref()), profile(self.estimates)];
        charts.into_iter().flatten().map(figure).collect()
    }

    /// Maps of light: of the floor, and of planes.
    fn maps(&self, floor: Option<FloorMap>) -> Vec<PageFigure> {
        let unit = self.summary.units.irradiance;
        let floor = floor.map(|floor| floor.svg);
        let planes = self.readings.and_then(|readings| isolux_svg(readings, unit));
        let named = [("Light on the floor", floor), ("Light on planes", planes)];
        named
            .into_iter()
            .filter_map(|(title, svg)| Some(PageFigure { title: title.into(), svg: svg? }))
            .collect()
    }

    /// Whether the page rounds the numbers of patches, since there are many.
    fn is_compact(&self) -> bool {
        !holds_table(self.estimates.scene().faces().piece_count())
    }

    fn facts(&self, live: Option<Live>, compact: Option<CompactLayout>) -> io::Result<String> {
        let dials = Dials::of(self.estimates, self.level).filter(|_| compact.is_none());
        let facts = Facts {
            summary: self.summary,
            view: self.shot,
            contrast: self.shot.contrast,
            dials,
            live,
            compact,
        };
        // Nothing in it ends the element that holds it.
        Ok(serde_json::to_string(&facts)?.replace('<', "\\u003c"))
    }

    /// The table; of a scene whose patches are groups, the row of a group once for each of its cells, which are drawn one by one.
    fn table(&self) -> io::Result<String> {
        let faces = self.estimates.scene().faces();
        if !faces.are_grouped() {
            return pack(|zlib| write_patches(zlib, self.estimates, Digits::All));
        }
        let mut table = Vec::new();
        write_patches(&mut table, self.estimates, Digits::All)?;
        let mut rows = table.split_inclusive(|&byte| byte == b'\n');
        pack(|zlib| {
            rows.next().map_or(Ok(()), |header| zlib.write_all(header))?;
            faces
                .by_patch()
                .zip(rows)
                .try_for_each(|(face, row)| faces.pieces(face).try_for_each(|_| zlib.write_all(row)))
        })
    }

    /// Four corners a row of this table, three numbers a corner [m], little-endian. A triangle's third is there twice.
    fn corners(&self) -> io::Result<String> {
        let faces = self.estimates.scene().faces();
        pack(|zlib| {
            for (_, piece) in faces.pieces_by_patch() {
                let corners = faces.piece_corners(piece);
                (0..4).try_for_each(|i| write_point(zlib, corners[i.min(corners.len() - 1)]))?;
            }
            Ok(())
        })
    }

    /// What mixtures of sources are made from, where sources are distinguished.
    fn scores(&self) -> io::Result<Option<String>> {
        let groups = self.estimates.experiment().groups();
        let apart = groups.is_some_and(|groups| !groups.sources().is_empty());
        apart.then(|| pack(|zlib| write_scores(zlib, self.estimates))).transpose()
    }

    /// B at these corners [W/m²], the channels of a corner side by side.
    fn smooth(&self) -> io::Result<String> {
        let faces = self.estimates.scene().faces();
        pack(|zlib| {
            let mut values =
                faces.pieces_by_patch().flat_map(|(_, piece)| self.smooth.corners(piece as usize));
            values.try_for_each(|&b| zlib.write_all(&(b as f32).to_le_bytes()))
        })
    }
}

/// The corners of the cells of all sensors, as those of faces.
fn sensor_corners(readings: &Readings) -> io::Result<String> {
    pack(|zlib| outlines(readings).into_iter().flatten().try_for_each(|corner| write_point(zlib, corner)))
}

/// An estimate with its interval.
fn with_interval(reading: &Reading) -> String {
    let [low, high] = [reading.ci_low, reading.ci_high].map(number);
    match reading.irradiance {
        Some(irradiance) => format!("{} ({low} … {high})", number(irradiance)),
        None => format!("between {low} and {high}"),
    }
}

/// A line of words as a sentence.
fn sentence(line: &str) -> String {
    let mut letters = line.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The template with these values. Text is escaped as HTML.
fn fill(values: &[minijinja::Value; 2]) -> io::Result<String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let [first, second] = values.clone();
    let page = environment.render_named_str("report.html", TEMPLATE, context! { ..first, ..second });
    page.map_err(io::Error::other)
}

fn script() -> io::Result<String> {
    let mut script = String::new();
    GzDecoder::new(SCRIPT).read_to_string(&mut script)?;
    Ok(script)
}

/// Where the power went, and what the amounts are: the figures of the check `escape`. Where walks tell nothing of power, where they ended.
fn shares(estimates: &Estimates, summary: &Summary) -> (Vec<Share>, String) {
    let power = |channels: &str| {
        let channels = if estimates.scene().channels() > 1 { channels } else { "" };
        format!("Power{channels} [{}]", summary.units.power)
    };
    let (amounts, unit) = match (losses(estimates), &summary.energy) {
        (Some([escaped, on_backs, cut_off]), _) => {
            let scene = estimates.scene();
            // As in the flow of light beside it, the mean of the channels.
            let emitted = (0..scene.channels()).map(|c| scene.total_power(c)).sum::<f64>();
            let emitted = emitted / scene.channels() as f64;
            let lost = [escaped, on_backs, cut_off].map(|part| emitted * part.value);
            ([emitted - lost.iter().sum::<f64>(), lost[0], lost[1], lost[2]], power(", mean of the channels"))
        }
        (None, &Energy::Walks { emitted, absorbed, escaped }) => {
            let (backs, cut) = (summary.absorbed_back, summary.truncated);
            let on_fronts = absorbed.saturating_sub(backs);
            let cut_off = emitted.saturating_sub(absorbed + escaped).max(cut);
            ([on_fronts, escaped, backs, cut_off].map(|walks| walks as f64), "Walks".into())
        }
        (None, &Energy::Power { absorbed, escaped, .. }) => {
            ([absorbed, escaped, 0.0, 0.0], power(", all channels together"))
        }
    };
    let total: f64 = amounts.iter().sum();
    let written = |amount: f64| if unit == "Walks" { amount.to_string() } else { number(amount) };
    let kinds = [
        ("absorbed", "absorbed by surfaces"),
        ("escaped", "left the scene"),
        ("backs", "ended on the back of a one-sided surface"),
        ("cut", "was cut off"),
    ];
    let share = |((kind, words), amount): ((&'static str, &'static str), f64)| {
        let part = amount / total;
        Share { kind, words, share: 100.0 * part, percent: words::share(part), amount: written(amount) }
    };
    let shown = kinds.into_iter().zip(amounts).filter(|&(_, amount)| amount > 0.0);
    (shown.map(share).collect(), unit)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use job::View;
    use radiosity::{
        Experiment, IndexChoice, Scene, Spectrum, Tally,
        sensors::{SensorShape, SensorSpec},
    };

    use super::*;
    use crate::planes::plane_summaries;
    use crate::scenes::{cube_spec, experiment, shot};
    use crate::summary::Check;

    fn page(experiment: &Experiment, tally: &Tally, sources: Vec<SourceSummary>) -> String {
        let estimates = Estimates::new(experiment, tally, 0.95);
        let readings = Readings::new(experiment, tally, 0.95);
        let mut summary = crate::scenes::summary(experiment, tally);
        summary.planes =
            readings.iter().flat_map(|of| plane_summaries(of, &[], |_| None, |_| [].into_iter())).collect();
        summary.sources = sources;
        let failed =
            |name: &str| Check { name: name.into(), verdict: Verdict::Failed, message: String::new() };
        summary.checks = vec![failed("rare"), failed("energy")];
        let page = Page {
            name: "cube",
            summary: &summary,
            estimates: &estimates,
            readings: readings.as_ref(),
            milestones: Vec::new(),
            command: String::new(),
            shot: Shot::aim(&estimates, &View::default()),
            level: 0.95,
            smooth: &Smooth::new(&estimates),
            materials: &Finishes::default(),
        };
        page.render().unwrap()
    }

    /// Planes are no sensors, figures of three channels say which is which, powers say which channels they are of, and the first words are
    /// those of the light.
    #[test]
    fn a_coloured_page_says_which_channels_it_tells_of() {
        let mut spec = cube_spec();
        spec.surfaces[1].cell_emittance = vec![(4, Spectrum::rgb([3.0, 2.0, 1.0]))];
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let at = |n: u32| DVec3::new(0.25 + 0.5 * f64::from(n / 2), 0.25 + 0.5 * f64::from(n % 2), 0.4);
        let points = (0..4).map(|n| [at(n), DVec3::Z]).collect();
        let plane = SensorSpec { name: "desk".into(), shape: SensorShape::Points { points, grid: [2, 2] } };
        let shape = SensorShape::Point { point: DVec3::splat(0.5), normal: DVec3::Z };
        let eye = SensorSpec { name: "eye".into(), shape };
        let experiment = experiment(&scene).with_sensors(&[plane, eye]).unwrap();
        let source = SourceSummary {
            name: "lamp".into(),
            emitters: 1,
            power: 2.0 / 3.0,
            factor: None,
            relative_error: 0.1,
        };
        let text = page(&experiment, &shot(&experiment), vec![source]);
        let sensors = text.split_once("id=\"sensors\"").unwrap().1.split_once("</section>").unwrap().0;
        assert!(sensors.contains("eye_r") && !sensors.contains("desk"), "{sensors}");
        assert!(text.contains("<p class=\"answer\">Mean light on desk: red "));
        assert!(text.contains("desk, mean of the channels: ") && text.contains(", green "));
        assert!(text.contains("Power, all channels together [W]</th><th scope=\"col\">Factor"));
        assert_eq!(text.matches("Power, mean of the channels [W]").count(), 2);
        assert!(text.contains("<th scope=\"row\">lamp</th><td>0.6667</td>"));
    }

    /// A dim scene has digits, the page draws with the picture's contrast, and what more walks mend is no fault.
    #[test]
    fn a_page_tells_of_little_light() {
        let mut spec = cube_spec();
        spec.surfaces[1].cell_emittance = vec![(4, 1e-6.into())];
        let experiment = experiment(&Scene::build(&spec, IndexChoice::Auto).unwrap());
        let text = page(&experiment, &shot(&experiment), Vec::new());
        assert!(text.contains("Power [W]</th>") && !text.contains("channels together"));
        let white = text.split_once("white is ").unwrap().1.split_once(' ').unwrap().0;
        assert!(white.parse::<f64>().unwrap() > 0.0, "{white}");
        assert!(text.contains("<p class=\"answer\">Mean light on the floor: about "), "the floor's mean");
        let words = "<th scope=\"row\">rare</th><td>needs more walks</td>";
        assert!(text.contains(words) && text.contains("<span class=\"bad\">failed</span>"));
        let facts = text.split_once("id=\"facts\">").unwrap().1.split_once("</script>").unwrap().0;
        let facts: serde_json::Value = serde_json::from_str(facts).unwrap();
        let [bright, power] = [0, 1].map(|i| facts["contrast"][i].as_f64().unwrap());
        assert!(bright > 0.0 && (1.0..=3.0).contains(&power), "{bright} {power}");
        assert!(facts["view"].get("contrast").is_none());
    }
}
