//! The page of the study.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use stats::Measured;

use super::Failure;
use super::measure::{
    CLASSES, Distance, FRACTION, MethodRow, NARROWED, ReportedAndTrue, TARGET_SEEDS, TOTAL_SEEDS,
    TotalReached,
};
use super::scenes::HonestyScene;
use crate::edition::origin;

/// The band of coverages [%] of 95 % intervals: below, chance apart, an interval is not true; above, from this class on, it is wider than it
/// need be.
const COVERAGE: [f64; 2] = [94.0, 98.0];
const MANY_SCORES: usize = 3;

/// The bands of reported over true figures: of half-widths and percentiles, of standard errors, of totals.
const WIDTH: [f64; 2] = [0.7, 2.0];
const STD_ERROR: [f64; 2] = [0.8, 1.25];
const TOTAL: [f64; 2] = [1.0 / 1.5, 1.5];

/// The band of true errors over a total error that is reached.
const REACHED: [f64; 2] = [0.0, 1.1];

/// The standard errors that a figure may be off by chance.
const CHANCE: f64 = 3.0;

/// Checks that a sound run never fails, or as rarely as said.
const SOUND: [&str; 6] = ["energy", "backs", "tail", "reciprocity", "gap", "workers"];
const DRIFT: f64 = 1e-3;

/// Where a figure is: in its band, below it, where the program claims more than it knows, or above it.
#[derive(Clone, Copy, PartialEq)]
enum BandPosition {
    Inside,
    Below,
    Above,
}

impl BandPosition {
    /// The place of a figure by a band; what is not a number is nowhere else than inside.
    fn of(x: f64, [low, high]: [f64; 2]) -> Self {
        match x {
            x if x < low => BandPosition::Below,
            x if x > high => BandPosition::Above,
            _ => BandPosition::Inside,
        }
    }
}

/// Why rows are outside of their bands: scene (or any), method and figure, each from its beginning, the side, and the reason.
const WHY: [(&str, &str, &str, BandPosition, &str); 12] = [
    ("", "infinite, cut off", "standard errors", BandPosition::Below, CUT_OFF_BIAS),
    ("", "infinite, cut off", "", BandPosition::Above, CUT_OFF),
    ("", "chains", "", BandPosition::Above, ONE_MORE),
    ("bright", "", "coverage", BandPosition::Above, LONG_WALKS),
    ("", "", "half-widths, 1 scores", BandPosition::Above, FEW_SCORES),
    ("", "", "half-widths, 4 scores", BandPosition::Above, FEW_SCORES),
    ("", "", "coverage", BandPosition::Above, SAFE),
    ("", "", "median", BandPosition::Above, UNHIT),
    ("CornellBox-Original.obj", "", "check backs", BandPosition::Below, GAPS),
    ("simpleRoom.obj", "", "check backs", BandPosition::Below, GAPS),
    ("office2.mgf", "", "check backs", BandPosition::Below, ONE_SIDED),
    ("", "", "9 tenths", BandPosition::Above, UNHIT),
];
const CUT_OFF: &str = "The bound on what is cut off is added to the upper end, and the truth is nearer than the bound. The tally knows how much was cut off, not where, and nothing smaller follows from that ([derivation](../theory/intervals.md#walks))";
const CUT_OFF_BIAS: &str = "A standard error knows nothing of a bias. What is cut off here is as large as the noise; the interval has the bound on it, and the check `bias` fails";
const ONE_MORE: &str = "Intervals and standard errors of chains allow for one more link, which a run cannot know that it lacks: where links are few, most runs lack none ([few links](../theory/intervals.md#chains-and-batches))";
const LONG_WALKS: &str = "With R = 0.99 one walk may score a hundred times on a patch, and intervals allow for a walk that does so more often than any that was seen: on the safe side";
const GAPS: &str =
    "The check is right: faces of this file do not meet, or are turned round, and light ends on backs";
const ONE_SIDED: &str =
    "The check is right: the lamps of this file have one side, and 0.4 % of the light ends on their backs";
const SAFE: &str = "On the safe side: an interval of few whole hits covers more than it need, and few seeds tell little of how much";
const FEW_SCORES: &str =
    "Most runs have no score or one on such a patch, and tell a bound: the light that could have been there";
const UNHIT: &str = "A tenth of the area and more has hardly a score: the headline counts it by half of its bound over the floor, and the truth is far below the bound. More walks bring both together";

/// A page that is being written: its text, and its rows out of their bands.
#[derive(Default)]
struct HonestyPage {
    text: String,
    outside: Vec<Outside>,
}

/// A figure out of its band.
struct Outside {
    site: String,
    method: &'static str,
    what: String,
    text: String,
    place: BandPosition,
}

impl Outside {
    /// Why it is outside, if that is known.
    fn why(&self) -> Option<&'static str> {
        let Outside { site, method, what, place, .. } = self;
        let is_of = |(scene, of, figure, side, _): &&(&str, &str, &str, BandPosition, &str)| {
            (scene.is_empty() || scene == site)
                && method.starts_with(of)
                && what.starts_with(figure)
                && side == place
        };
        WHY.iter().find(is_of).map(|(.., why)| *why)
    }
}

/// Whether anything that a row tells is outside of its band.
pub fn is_refused(row: &MethodRow) -> bool {
    let mut page = HonestyPage::default();
    page.intervals(std::slice::from_ref(row)).is_ok() && !page.outside.is_empty()
}

/// Writes `honesty.md`.
pub fn write(sites: &[HonestyScene], rows: &[MethodRow], folder: &Path) -> Result<(), Failure> {
    let (controls, rows): (Vec<&MethodRow>, Vec<&MethodRow>) = rows.iter().partition(|row| row.is_control);
    let mut page = HonestyPage::default();
    page.coverages(&rows)?;
    page.controls(&controls)?;
    page.headlines(&rows)?;
    page.targets(&rows)?;
    page.totals_reached(&rows)?;
    page.totals(&rows)?;
    page.distances(&rows)?;
    page.alarms(&rows)?;
    let HonestyPage { text, outside } = page;
    let mut head = head(sites)?;
    head += &text;
    let cells = rows.iter().filter(|row| row.refused.is_none()).count();
    writeln!(
        head,
        "## Outside of their bands\n\n{} figures of {cells} rows, and why. A figure without a reason may be a fault of the program.\n",
        outside.len()
    )?;
    for figure @ Outside { site, method, what, text, .. } in &outside {
        writeln!(
            head,
            "- {site}, {method}, {what}: {text}. {}",
            figure.why().unwrap_or("**No reason is known.**")
        )?;
    }
    fs::write(folder.join("honesty.md"), head)?;
    Ok(())
}

/// The beginning of the page: how it is made, how it is read, and the scenes.
fn head(sites: &[HonestyScene]) -> Result<String, Failure> {
    let quick = if sites.iter().all(|site| site.slow || !site.made) { " --quick" } else { "" };
    let rooms: String =
        sites.iter().filter(|site| !site.made).map(|site| format!(" {}", site.file)).collect();
    let mut head = format!(
        "# Whether the figures told are true\n\n\
         `radwalk-lab honesty docs/results{quick}{rooms}` writes this page: {}, in {:.0} s of processor time.\n\n\
         A run tells many figures about its own accuracy: an interval and a standard error for each patch, a headline, whether a target is reached, the error of the whole answer before the\n\
         run and after it, the distance of the discretised system from the light, and checks. This page runs each method in each scene with many seeds, and holds each figure against what is\n\
         true: *told over true*. A ratio of 1 is right, below 1 the program claims more than it knows, above 1 it knows more than it claims.\n\n\
         - *Told* is what `patches.csv` and `summary.json` hold, read back by column and field.\n\
         - *True* is, for discrete walks and chains in made scenes, the exact solution of the patches' system; otherwise a run of 256 times the walks (64 times in rooms from archives).\n\
         - Seeds are independent runs. The scenes are no scenes of the test suite's tolerances: nothing in the program was tuned by this page.\n\
         - A patch's class is the number of scores that a run is worth there: (b/σ)², b being the reflected light and σ the root mean squared error of a run, and at most its hits.\n\
         - **Bold** cells are outside of their band by more than three standard errors of the study itself. The last section lists each with its reason.\n\n\
         Rooms from archives are not part of the repository: `CornellBox-Original.obj` stands in many public collections, `corridor.mgf` and `office2.mgf` among the MGF scenes, `simpleRoom.obj` beside a program that draws shadows.\n\n\
         | scene | what it is |\n|---|---|\n",
        origin(),
        crate::clock::process_seconds(),
    );
    for site in sites {
        writeln!(head, "| {} | {} |", site.name, site.what)?;
    }
    head.push('\n');
    Ok(head)
}

/// A number with three digits.
fn number(x: f64) -> String {
    match x {
        x if x.is_nan() => "–".into(),
        x if x.is_infinite() => "unknown".into(),
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}

impl HonestyPage {
    /// A cell that is bold where it is outside.
    fn cell(&mut self, row: &MethodRow, what: &str, text: String, place: BandPosition) -> String {
        if place == BandPosition::Inside {
            return text;
        }
        self.outside.push(Outside {
            site: row.site.clone(),
            method: row.method,
            what: what.into(),
            text: text.clone(),
            place,
        });
        format!("**{text}**")
    }

    /// Told over true, in a band.
    fn ratio(&mut self, row: &MethodRow, what: &str, pair: ReportedAndTrue, band: [f64; 2]) -> String {
        self.ratio_but_for(row, what, (pair, 0.0), band)
    }

    /// [`HonestyPage::ratio`] of a ratio with this relative standard error.
    fn ratio_but_for(
        &mut self,
        row: &MethodRow,
        what: &str,
        (ReportedAndTrue { reported, truth }, chance): (ReportedAndTrue, f64),
        band: [f64; 2],
    ) -> String {
        let (ratio, chance) = (reported / truth, CHANCE * chance);
        let place = BandPosition::of(ratio, [band[0] * (1.0 - chance), band[1] * (1.0 + chance)]);
        self.cell(row, what, number(ratio), place)
    }

    fn coverages(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Intervals and standard errors\n\n\
             In each class of scores: the part of the 95 % intervals that hold the truth [%]; half-widths that the median run tells over the errors that 95 % of the runs keep within; standard errors told\n\
             over the root mean squared error. Bands: {:.0} % to {:.0} % (up to 16 scores from below alone: an interval of few whole hits cannot be exact), {} to {}, {} to {}.\n\
             Below one score there is no half-width to speak of: the upper bound is held to its coverage. *H*: coverage of the intervals of irradiance, all classes.\n",
            COVERAGE[0], COVERAGE[1], WIDTH[0], WIDTH[1], STD_ERROR[0], STD_ERROR[1]
        )?;
        self.intervals(rows.iter().copied())?;
        for row in rows {
            if let Some(why) = &row.refused {
                writeln!(self.text, "- {}, {}: not studied ({why})", row.site, row.method)?;
            }
        }
        writeln!(self.text)?;
        Ok(())
    }

    /// A row of coverages, half-widths and standard errors for each row of the study.
    fn intervals<'a>(&mut self, rows: impl IntoIterator<Item = &'a MethodRow>) -> Result<(), Failure> {
        writeln!(
            self.text,
            "| scene | method | seeds | below 1 | 1 to 4 | 4 to 16 | 16 to 64 | above 64 | H |\n|---|---|---|---|---|---|---|---|---|"
        )?;
        for row in rows.into_iter().filter(|row| row.classes.iter().any(|class| class.coverage.is_some())) {
            let mut cells = Vec::new();
            for (number_of_class, class) in row.classes.iter().enumerate() {
                let Some(coverage) = class.coverage else {
                    cells.push("–".into());
                    continue;
                };
                let name = match number_of_class {
                    0 => "below 1 score".into(),
                    k => format!("{} scores and more", CLASSES[k - 1]),
                };
                let mut cell = self.coverage(row, &name, coverage, number_of_class);
                if number_of_class > 0 {
                    let width = ReportedAndTrue { reported: class.width, truth: 1.0 };
                    let std_error = ReportedAndTrue { reported: class.std_error, truth: 1.0 };
                    let widths = self.ratio_but_for(
                        row,
                        &format!("half-widths, {name}"),
                        (width, class.chance),
                        WIDTH,
                    );
                    let band = if number_of_class >= MANY_SCORES { STD_ERROR } else { [0.0, f64::INFINITY] };
                    let errors = self.ratio_but_for(
                        row,
                        &format!("standard errors, {name}"),
                        (std_error, class.chance),
                        band,
                    );
                    cell += &format!("; {widths}; {errors}");
                }
                cells.push(cell);
            }
            let irradiance = match row.irradiance {
                Some(coverage) => self.coverage(row, "irradiance", coverage, 0),
                None => "–".into(),
            };
            writeln!(
                self.text,
                "| {} | {} | {} | {} | {irradiance} |",
                row.site,
                row.method,
                row.seeds,
                cells.join(" | ")
            )?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    /// Figures that are false on purpose. What is outside of its band here is no fault, and is not listed.
    fn controls(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        if rows.is_empty() {
            return Ok(());
        }
        writeln!(
            self.text,
            "## Whether this page can say no\n\n\
             The same runs with every interval and standard error narrowed on purpose to {NARROWED} of its width. The study fails unless cells are bold here.\n"
        )?;
        let listed = self.outside.len();
        self.intervals(rows.iter().copied())?;
        self.outside.truncate(listed);
        Ok(())
    }

    fn distances(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Distance of the discretised system\n\n\
             Discrete walks and chains solve the system of the patches, and the headline says how far that is from the integral equation's answer (`discretised`), where a run has more than\n\
             65,536 rays. Told by the median run and true, the relative L2 distance over the area, and the part of the 95 % intervals that hold the truth. Band: {:.0} % and more.\n\n\
             | scene | method | told | true | covered |\n|---|---|---|---|---|",
            COVERAGE[0]
        )?;
        for row in rows {
            let Some(Distance { pair, coverage }) = row.distance else { continue };
            let covered = self.coverage(row, "coverage, distance", coverage, 0);
            let [reported, truth] = [pair.reported, pair.truth].map(|part| format!("{:.2} %", 100.0 * part));
            writeln!(self.text, "| {} | {} | {reported} | {truth} | {covered} |", row.site, row.method)?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn coverage(&mut self, row: &MethodRow, what: &str, coverage: Measured, class: usize) -> String {
        let [value, error] = [100.0 * coverage.value, 100.0 * coverage.standard_error];
        let high = if class >= MANY_SCORES { COVERAGE[1] } else { 100.0 };
        let place = BandPosition::of(value, [COVERAGE[0] - CHANCE * error, high + CHANCE * error]);
        self.cell(row, &format!("coverage, {what}"), format!("{value:.1}"), place)
    }

    fn headlines(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## The headline\n\n\
             Relative half-widths by area: told by the median run, and true, the relative error that 95 % of the runs keep within, patch by patch. Band of the ratio: {} to {};\n\
             of the worst patch it is shown alone, since the worst told is the largest of many that scatter.\n\n\
             | scene | method | median told | true | ratio | 9 tenths told | true | ratio | worst told | true |\n|---|---|---|---|---|---|---|---|---|---|",
            WIDTH[0], WIDTH[1]
        )?;
        let percent =
            |x: f64| if x.is_finite() { format!("{} %", number(100.0 * x)) } else { "unknown".into() };
        for row in rows {
            let Some([median, ninth, worst]) = row.headline else { continue };
            let ratios = [("median", median), ("9 tenths", ninth)]
                .map(|(what, pair)| self.ratio(row, what, pair, WIDTH));
            writeln!(
                self.text,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                row.site,
                row.method,
                percent(median.reported),
                percent(median.truth),
                ratios[0],
                percent(ninth.reported),
                percent(ninth.truth),
                ratios[1],
                percent(worst.reported),
                percent(worst.truth)
            )?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn targets(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Targets that are reached\n\n\
             `target.relative_error` for {:.0} % of the area, {TARGET_SEEDS} seeds at most: the runs that reach it, and the part of the lit area that is truly within it then, in the mean and\n\
             at least. Band of the mean: {:.0} % and more. What is sealed counts neither for nor against a target.\n\n\
             | scene | method | target | reached | truly within | at least |\n|---|---|---|---|---|---|",
            100.0 * FRACTION,
            100.0 * FRACTION
        )?;
        for row in rows {
            let Some(reached) = row.reached else { continue };
            let within = match reached.within.is_nan() {
                true => "–".into(),
                false => self.cell(
                    row,
                    "target",
                    format!("{:.1} %", 100.0 * reached.within),
                    BandPosition::of(reached.within, [FRACTION, 1.0]),
                ),
            };
            let least = if reached.least.is_finite() {
                format!("{:.1} %", 100.0 * reached.least)
            } else {
                "–".into()
            };
            writeln!(
                self.text,
                "| {} | {} | {:.2} % | {:.0} % | {within} | {least} |",
                row.site,
                row.method,
                100.0 * reached.error,
                100.0 * reached.part
            )?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn totals_reached(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Total errors that are reached\n\n\
             `target.total_error`, noise and discretisation together, on patches that a pilot chooses for it, {TOTAL_SEEDS} seeds: the runs that reach it, and their true errors, by root mean\n\
             square and at most. Band of the first over the target: {} at most. Where the light is even, the noise of all patches goes together, and few seeds tell little of it.\n\n\
             | scene | method | target | reached | true | at most | true over target |\n|---|---|---|---|---|---|---|",
            REACHED[1]
        )?;
        for row in rows {
            let Some(TotalReached { target, part, truth, std_error, most }) = row.total_reached else {
                continue;
            };
            let percent = |x: f64| if x.is_finite() { format!("{:.2} %", 100.0 * x) } else { "–".into() };
            let ratio = truth / target;
            // An error above the target is reported to be below it: the program claims more than it knows.
            let is_more = (truth - 3.0 * std_error) / target > REACHED[1];
            let place = if is_more { BandPosition::Below } else { BandPosition::Inside };
            let cell = self.cell(row, "total reached", number(ratio), place);
            writeln!(
                self.text,
                "| {} | {} | {:.2} % | {:.0} % | {} ± {} | {} | {cell} |",
                row.site,
                row.method,
                100.0 * target,
                100.0 * part,
                percent(truth),
                percent(std_error),
                percent(most)
            )?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn totals(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Total errors\n\n\
             The relative L2 error of the reflected light, noise and discretisation together: as `accuracy` tells it, as it was predicted before the run, and true, by a\n\
             run of 2·10⁶ walks, 64 times the run at least, on patches that a pilot chose for these. Band of the ratios: {:.2} to {}. Each has its relative standard error: where the light is even, the noise of all patches goes together,\n\
             and many seeds tell little.\n\n\
             | scene | method | paths | told | predicted | true | told over true | predicted over true |\n|---|---|---|---|---|---|---|---|",
            TOTAL[0], TOTAL[1]
        )?;
        let percent = |pair: Option<(ReportedAndTrue, f64)>| {
            pair.map_or("–".into(), |(pair, _)| format!("{:.2} %", 100.0 * pair.reported))
        };
        for row in rows {
            let Some((known, _)) = row.total.or(row.predicted) else { continue };
            let mut of = |what: &str, known: Option<(ReportedAndTrue, f64)>| match known {
                Some((pair, chance)) => {
                    let ratio = self.ratio_but_for(row, what, (pair, chance), TOTAL);
                    format!("{ratio} ± {:.0} %", 100.0 * chance)
                }
                None => "–".into(),
            };
            let ratios = [of("total told", row.total), of("total predicted", row.predicted)];
            writeln!(
                self.text,
                "| {} | {} | {} | {} | {} | {:.2} % | {} | {} |",
                row.site,
                row.method,
                row.paths,
                percent(row.total),
                percent(row.predicted),
                100.0 * known.truth,
                ratios[0],
                ratios[1]
            )?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn alarms(&mut self, rows: &[&MethodRow]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Checks\n\n\
             All made scenes are sound. The part of the runs of a row whose check fails [%]. `drift` may fail in 0.1 % of them; {} never. The others say that a run is short, and\n\
             many of these are.\n\n| scene | method | seeds | failed |\n|---|---|---|---|",
            SOUND.map(|name| format!("`{name}`")).join(", ")
        )?;
        for row in rows.iter().filter(|row| row.refused.is_none()) {
            let rate = |name: &str| row.alarms.get(name).copied().unwrap_or(0.0);
            let never = SOUND.iter().filter(|name| rate(name) > 0.0);
            let mut wrong: Vec<(&str, String)> =
                never.map(|name| (*name, format!("{:.1} %", 100.0 * rate(name)))).collect();
            // Poisson: more than two of 200 runs at 1 in 1,000 once in 900 rows.
            let drifts = rate("drift") * row.seeds as f64;
            if drifts > 2.0 + DRIFT * row.seeds as f64 {
                wrong.push(("drift", format!("{:.1} %", 100.0 * rate("drift"))));
            }
            for (name, text) in wrong {
                self.cell(row, &format!("check {name}"), text, BandPosition::Below);
            }
            let failed = row.alarms.iter().filter(|(_, part)| **part > 0.0);
            let failed: Vec<String> =
                failed.map(|(name, part)| format!("{name} {:.0}", 100.0 * part)).collect();
            let failed = if failed.is_empty() { "–".into() } else { failed.join(", ") };
            writeln!(self.text, "| {} | {} | {} | {failed} |", row.site, row.method, row.seeds)?;
        }
        writeln!(self.text)?;
        Ok(())
    }
}
