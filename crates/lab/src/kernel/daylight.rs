//! What the intervals of daylight are worth: `radwalk-lab daylight FOLDER [SEEDS [WEATHER]]` writes `daylight.md`.
//!
//! The year of the repository has few hours. WEATHER is a whole year to be measured besides.

use std::fs;
use std::path::Path;

use parallel::on_all_cores;
use radiosity::{
    IndexChoice, Sequence,
    daylight::{Coefficients, SkyPatches, SkyTally},
};
use report::Markdown;
use sky::{BoundedValue, Dome, Metrics, STANDARD_SKIES, Sky, SkyPatchCounts, SkyUnit, TARGETS, Wanted, Year};

use super::Failure;
use crate::edition::origin;

const SCENE: &str = "configs/scenes/daylit.toml";
const WEATHER: &str = "configs/weather/made.epw";

/// Runs, where none are asked for.
const SEEDS: u64 = 500;

/// Walks of a place: of the runs whose intervals are held against the truth, and of the run that tells it.
const RUNS: [u64; 3] = [1 << 12, 1 << 14, 1 << 16];
const TRUTH: u64 = 1 << 25;

/// The places, by their numbers among the 60 of the scene: from the window to the back of the room.
const PLACES: [usize; 6] = [0, 12, 25, 37, 48, 59];

/// The illuminance that is enough [lx]: many hours lie about it at every one of the places.
const ENOUGH: f64 = 1000.0;

/// Single hours, then figures of the year.
const FIGURES: usize = 6 + TARGETS.len();

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let folder = words.first().ok_or("usage: daylight FOLDER [SEEDS [WEATHER]]")?;
    let seeds = words.get(1).map_or(Ok(SEEDS), |word| word.parse())?;
    let mut page = Markdown::default();
    page.heading(1, "Daylight");
    let more = words.get(2).map_or("", |_| " WEATHER");
    page.paragraph(format!("Made by `radwalk-lab daylight FOLDER {seeds}{more}`: {}.", origin()));
    page.heading(2, "Coverage");
    page.paragraph(format!(
        "How many of the 95 % intervals hold the truth, in per cent, at {} places of `{SCENE}`: {seeds} seeds each, against {TRUTH} walks a place. Hours of a \
         seed share walks, so the errors, in brackets, are those of the means of seeds. Autonomy asks for {ENOUGH} lx.",
        PLACES.len()
    ));
    page.paragraph(
        "Parts of hours are counted in whole hours, and half an hour is added to their intervals. Where walks move fewer than two hours or so over a border, most intervals hold \
         the truth by that: the columns rise to 100 % with more walks, earlier in a year of few hours. Where hours lie unevenly about a border, the estimate errs to one side, \
         and an interval may hold the truth less often than in 95 %.",
    );
    for weather in [WEATHER].into_iter().chain(words.get(2).map(String::as_str)) {
        coverage(&mut page, seeds, weather)?;
    }
    fs::create_dir_all(folder)?;
    fs::write(Path::new(folder).join("daylight.md"), page.text())?;
    Ok(())
}

/// Adds the coverage under a weather.
fn coverage(page: &mut Markdown, seeds: u64, weather: &str) -> Result<(), Failure> {
    let study = DaylightStudy::new(weather)?;
    let truths = on_all_cores(PLACES.len(), |place| study.reported(&study.counts(0, place, TRUTH)));
    let rows: Vec<[String; FIGURES + 1]> =
        RUNS.iter().map(|&walks| study.row(seeds, walks, &truths)).collect();
    let (name, hours) = (Path::new(weather).file_name().unwrap_or_default(), study.year.hours.len());
    page.paragraph(format!("Under `{}`, {hours} hours:", name.display()));
    let heads = [
        "walks a place",
        "hours",
        "daylight factor",
        "mean",
        "autonomy",
        "useful",
        "excess",
        "100 lx",
        "300 lx",
        "500 lx",
        "750 lx",
    ];
    page.table(heads, rows);
    Ok(())
}

/// A room, a year, and what is asked of them.
struct DaylightStudy {
    coefficients: Coefficients,
    dome: Dome,
    year: Year,
    mean: (Vec<f64>, Vec<(usize, f64)>),
    overcast: Vec<f64>,
    wanted: Wanted,
}

/// What a run says of a place.
struct PlaceReport {
    hours: Vec<BoundedValue>,
    figures: Vec<BoundedValue>,
}

impl DaylightStudy {
    fn new(weather: &str) -> Result<Self, Failure> {
        let file = job::load_scene(SCENE.as_ref())?.for_daylight(0);
        let patches = SkyPatches::new(145).ok_or("Tregenza's sky")?;
        let coefficients =
            Coefficients::new(file.build(IndexChoice::Auto)?, file.sensors(), patches.clone())?;
        let dome = Dome::new(patches);
        let year = Year::new(&job::load_weather(weather.as_ref())?, &dome, SkyUnit::Illuminance, 0.2);
        let overcast = Sky::standard(STANDARD_SKIES, [0.0, 0.0, 1.0], 100.0).ok_or("the overcast sky")?;
        Ok(DaylightStudy {
            mean: year.mean(&dome),
            overcast: dome.vector(&overcast),
            wanted: Wanted { enough: ENOUGH, ..Wanted::default() },
            coefficients,
            dome,
            year,
        })
    }

    fn counts(&self, seed: u64, place: usize, walks: u64) -> SkyPatchCounts {
        let mut tally = SkyTally::new(self.dome.patches().count());
        self.coefficients.walk(&Sequence::new(seed), PLACES[place], 0..walks, &mut tally);
        SkyPatchCounts { walks, straight: tally.straight, reflected: tally.reflected }
    }

    /// What counts say of single hours and of the year. The direct sun, which is exact, is left out.
    fn reported(&self, row: &SkyPatchCounts) -> PlaceReport {
        let level = self.wanted.confidence;
        let lit = self.year.hours.iter().filter(|hour| !hour.is_dark());
        let hours = lit.map(|hour| row.light(&hour.sky, &hour.sun, level)).collect();
        let beam = vec![0.0; self.year.hours.len()];
        let Metrics { mean, enough, useful, excess, daylight } =
            self.year.at(row, &beam).metrics((&self.mean.0, &self.mean.1), &self.wanted);
        let factor = row.light(&self.overcast, &[], level);
        let figures = [factor, mean, enough, useful, excess].into_iter().chain(daylight).collect();
        PlaceReport { hours, figures }
    }

    /// The coverage of runs of some walks.
    fn row(&self, seeds: u64, walks: u64, truths: &[PlaceReport]) -> [String; FIGURES + 1] {
        let of_seed = |seed: usize| -> [f64; FIGURES] {
            let mut covered = [0.0; FIGURES];
            for (place, truth) in truths.iter().enumerate() {
                let reported = self.reported(&self.counts(1 + seed as u64, place, walks));
                let part = |reported: &[BoundedValue], truth: &[BoundedValue]| {
                    let held =
                        reported.iter().zip(truth).filter(|(it, truth)| holds(it, truth.value)).count();
                    held as f64 / reported.len() as f64
                };
                covered[0] += part(&reported.hours, &truth.hours) / truths.len() as f64;
                for (figure, covered) in covered[1..].iter_mut().enumerate() {
                    let range = figure..=figure;
                    *covered +=
                        part(&reported.figures[range.clone()], &truth.figures[range]) / truths.len() as f64;
                }
            }
            covered
        };
        let all = on_all_cores(seeds as usize, of_seed);
        std::array::from_fn(|column| match column {
            0 => walks.to_string(),
            column => {
                let rates = all.iter().map(|covered| covered[column - 1]);
                let n = all.len() as f64;
                let mean = rates.clone().sum::<f64>() / n;
                let variance = rates.map(|rate| (rate - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
                format!("{:.1} ({:.1})", 100.0 * mean, 100.0 * variance.sqrt())
            }
        })
    }
}

fn holds(interval: &BoundedValue, truth: f64) -> bool {
    interval.low <= truth && truth <= interval.high
}
