//! The page of the study.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use stats::Measured;

use super::Failure;
use super::measure::{CLASSES, FRACTION, Pair, Row, TARGET_SEEDS};
use super::scenes::Site;

/// The band of coverages [%] of 95 % intervals: below, chance apart, an interval is not true; above, from this class on, it is wider than it
/// need be.
const COVERAGE: [f64; 2] = [94.0, 98.0];
const MANY_SCORES: usize = 3;

/// The bands of told over true: of half-widths and percentiles, of standard errors, of totals.
const WIDTH: [f64; 2] = [0.7, 2.0];
const STD_ERROR: [f64; 2] = [0.8, 1.25];
const TOTAL: [f64; 2] = [1.0 / 1.5, 1.5];

/// The standard errors that a figure may be off by chance.
const CHANCE: f64 = 3.0;

/// Checks that a sound run never fails, or as rarely as said.
const SOUND: [&str; 6] = ["energy", "backs", "tail", "reciprocity", "gap", "workers"];
const DRIFT: f64 = 1e-3;

/// A page that is being written: its text, and its rows out of their bands.
struct Page {
    text: String,
    outside: Vec<String>,
}

/// Writes `honesty.md`.
pub fn write(sites: &[Site], rows: &[Row], folder: &Path) -> Result<(), Failure> {
    let mut page = Page { text: String::new(), outside: Vec::new() };
    page.coverages(rows)?;
    page.headlines(rows)?;
    page.targets(rows)?;
    page.totals(rows)?;
    page.alarms(rows)?;
    let Page { text, outside } = page;
    let quick = if sites.iter().all(|site| site.slow || !site.made) { " --quick" } else { "" };
    let rooms: String =
        sites.iter().filter(|site| !site.made).map(|site| format!(" {}", site.name)).collect();
    let mut head = format!(
        "# Whether the figures told are true\n\n\
         `radwalk-lab honesty docs/results{quick}{rooms}` writes this page, radwalk {}, in {:.0} s of processor time.\n\n\
         For each figure that the program tells: *told over true*. Told is what `patches.csv` and `summary.json` hold. True is the exact solution of the\n\
         patches' system for discrete walks in made scenes, and otherwise a run of 256 times the walks (64 times in rooms from archives). Seeds are independent\n\
         runs; a patch's class is the number of scores that a run is worth there: (b/σ)², b being the reflected light and σ the root mean squared error, and at most its hits. **Bold** cells are outside of their band; the last section says why.\n\n\
         | scene | what it is |\n|---|---|\n",
        env!("CARGO_PKG_VERSION"),
        super::scenes::processor_seconds(),
    );
    for site in sites {
        writeln!(head, "| {} | {} |", site.name, site.what)?;
    }
    head.push('\n');
    head += &text;
    writeln!(head, "## Outside of their bands\n")?;
    if outside.is_empty() {
        writeln!(head, "None.")?;
    }
    outside.iter().try_for_each(|line| writeln!(head, "- {line}"))?;
    fs::write(folder.join("honesty.md"), head)?;
    Ok(())
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

impl Page {
    /// A cell that is bold where it is outside.
    fn cell(&mut self, row: &Row, what: &str, text: String, inside: bool) -> String {
        if inside {
            return text;
        }
        self.outside.push(format!("{}, {}, {what}: {text}", row.site, row.method));
        format!("**{text}**")
    }

    /// Told over true, in a band.
    fn ratio(&mut self, row: &Row, what: &str, pair: Pair, band: [f64; 2]) -> String {
        self.ratio_but_for(row, what, (pair, 0.0), band)
    }

    /// [`Page::ratio`] of a ratio with this relative standard error.
    fn ratio_but_for(
        &mut self,
        row: &Row,
        what: &str,
        (Pair { told, truth }, chance): (Pair, f64),
        band: [f64; 2],
    ) -> String {
        let (ratio, chance) = (told / truth, CHANCE * chance);
        let inside =
            ratio.is_nan() || (ratio >= band[0] * (1.0 - chance) && ratio <= band[1] * (1.0 + chance));
        self.cell(row, what, number(ratio), inside)
    }

    fn coverages(&mut self, rows: &[Row]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Intervals and standard errors\n\n\
             In each class of scores: the part of the 95 % intervals that hold the truth [%]; half-widths that the median run tells over the errors that 95 % of the runs keep within; standard errors told\n\
             over the root mean squared error. Bands: {:.0} % to {:.0} % (up to 16 scores from below alone: an interval of few whole hits cannot be exact), {} to {}, {} to {}.\n\
             Below one score there is no half-width to speak of: the upper bound is held to its coverage. *H*: coverage of the intervals of irradiance, all classes.\n\n\
             | scene | method | seeds | below 1 | 1 to 4 | 4 to 16 | 16 to 64 | above 64 | H |\n|---|---|---|---|---|---|---|---|---|",
            COVERAGE[0], COVERAGE[1], WIDTH[0], WIDTH[1], STD_ERROR[0], STD_ERROR[1]
        )?;
        for row in rows.iter().filter(|row| row.classes.iter().any(|class| class.coverage.is_some())) {
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
                    let width = Pair { told: class.width, truth: 1.0 };
                    let std_error = Pair { told: class.std_error, truth: 1.0 };
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
        for row in rows {
            if let Some(why) = &row.refused {
                writeln!(self.text, "- {}, {}: not studied ({why})", row.site, row.method)?;
            }
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn coverage(&mut self, row: &Row, what: &str, coverage: Measured, class: usize) -> String {
        let [value, error] = [100.0 * coverage.value, 100.0 * coverage.standard_error];
        let high = if class >= MANY_SCORES { COVERAGE[1] } else { 100.0 };
        let inside = value + CHANCE * error >= COVERAGE[0] && value - CHANCE * error <= high;
        self.cell(row, &format!("coverage, {what}"), format!("{value:.1}"), inside)
    }

    fn headlines(&mut self, rows: &[Row]) -> Result<(), Failure> {
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
                percent(median.told),
                percent(median.truth),
                ratios[0],
                percent(ninth.told),
                percent(ninth.truth),
                ratios[1],
                percent(worst.told),
                percent(worst.truth)
            )?;
        }
        writeln!(self.text)?;
        Ok(())
    }

    fn targets(&mut self, rows: &[Row]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Targets that are reached\n\n\
             `target.relative_error` for {:.0} % of the area, {TARGET_SEEDS} seeds at most: the runs that reach it, and the part of the lit area that is truly within it then, in the mean and\n\
             at least. Band of the mean: {:.0} % and more.\n\n\
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
                    reached.within >= FRACTION,
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

    fn totals(&mut self, rows: &[Row]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Total errors\n\n\
             The relative L2 error of the reflected light, noise and discretisation together: as `accuracy` tells it, as it was predicted before the run, and true, on cells of a\n\
             quarter of the given patches' edges. Band of the ratios: {:.2} to {}.\n\n\
             | scene | method | paths | told | predicted | true | told over true | predicted over true |\n|---|---|---|---|---|---|---|---|",
            TOTAL[0], TOTAL[1]
        )?;
        let percent =
            |pair: Option<Pair>| pair.map_or("–".into(), |pair| format!("{:.2} %", 100.0 * pair.told));
        for row in rows {
            let Some(known) = row.total.or(row.predicted) else { continue };
            let mut of = |what: &str, pair: Option<Pair>| match pair {
                Some(pair) => self.ratio(row, what, pair, TOTAL),
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

    fn alarms(&mut self, rows: &[Row]) -> Result<(), Failure> {
        writeln!(
            self.text,
            "## Checks\n\n\
             All these runs are sound. The part of the runs of a row whose check fails [%]. `drift` may fail in 0.1 % of them; {} never. The others say that a run is short, and\n\
             many of these are.\n\n| scene | method | seeds | failed |\n|---|---|---|---|",
            SOUND.map(|name| format!("`{name}`")).join(", ")
        )?;
        for row in rows.iter().filter(|row| row.refused.is_none()) {
            let rate = |name: &str| row.alarms.get(name).copied().unwrap_or(0.0);
            let never = SOUND.iter().filter(|name| rate(name) > 0.0);
            let mut wrong: Vec<String> =
                never.map(|name| format!("{name} {:.1}", 100.0 * rate(name))).collect();
            // Poisson: more than two of 200 runs at 1 in 1,000 once in 900 rows.
            let drifts = rate("drift") * row.seeds as f64;
            if drifts > 2.0 + DRIFT * row.seeds as f64 {
                wrong.push(format!("drift {:.1}", 100.0 * rate("drift")));
            }
            for text in wrong {
                self.cell(row, "check", text, false);
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
