//! Where the emitted power ends, material by material: a diagram of flows and the rows behind it.
//!
//! A face absorbs a = A (1 − R) H, with A its area [m²], R its reflectance and H its irradiance [W/m²], the mean of the channels. The
//! standard error of a sum is at most the sum of the standard errors, however its parts depend on each other; that bound is shown.

use std::fmt::Write as _;

use job::Finishes;
use radiosity::Estimates;
use serde::Serialize;
use stats::Measured;

use crate::summary::Summary;
use crate::words::{number, share};

/// Materials that are shown by name: those that absorb most.
const NAMED: usize = 8;

/// Colours that are distinguished without colour vision (Okabe and Ito 2008), and greys for the rest.
const COLOURS: [&str; NAMED] =
    ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#7a5195"];
const OTHERS: &str = "#8a8a8a";
const ESCAPED: &str = "#b58900";
const BACKS: &str = "#cc3311";
const CUT: &str = "#555555";

/// The drawing [pixels]: its width, where flows begin and end, the height of all of them, and the least height of a row.
const WIDTH: f64 = 760.0;
const FROM: f64 = 150.0;
const TO: f64 = 430.0;
const HEIGHT: f64 = 240.0;
const ROW: f64 = 22.0;
const BAR: f64 = 14.0;

/// The parts that the emitted power ends in.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Flow {
    /// Φ, the mean of the channels [W]: white light has it in each of them.
    emitted: f64,
    unit: &'static str,
    /// Whether there are several channels.
    coloured: bool,
    parts: Vec<PowerShare>,
    /// Patches of which nothing is known.
    unknown: usize,
}

/// A part of the power, as the page lists it.
#[derive(Clone, Debug, PartialEq)]
struct PowerShare {
    words: String,
    colour: &'static str,
    /// The power of the part [W].
    power: f64,
    /// At least its standard error [W].
    error: f64,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct FlowRow {
    words: String,
    colour: &'static str,
    share: String,
    error: String,
    power: String,
}

impl Flow {
    /// The flows of a result; `None` where it does not tell irradiance, or nothing is emitted.
    pub(crate) fn of(estimates: &Estimates, summary: &Summary, finishes: &Finishes) -> Option<Self> {
        let scene = estimates.scene();
        let channels = scene.channels() as f64;
        let emitted = (0..scene.channels()).map(|c| scene.total_power(c)).sum::<f64>() / channels;
        let finish = finishes.of_surfaces();
        let mut absorbed: Vec<PowerShare> = Vec::new();
        let mut of_name: std::collections::HashMap<String, usize> = std::collections::HashMap::new();
        let (mut unknown, mut any_known) = (0, false);
        for (_, face, known) in estimates.iter() {
            let Some(known) = known else {
                unknown += 1;
                continue;
            };
            // Results from before materials were kept tell them by what they reflect.
            let name = match finish.get(face.surface as usize) {
                Some(&number) => finishes.names()[number as usize].clone(),
                None => format!("reflectance {}", face.reflectance[0]),
            };
            let part = *of_name.entry(name).or_insert_with_key(|name| {
                absorbed.push(PowerShare { words: name.clone(), colour: OTHERS, power: 0.0, error: 0.0 });
                absorbed.len() - 1
            });
            for (c, estimate) in known.iter().enumerate() {
                let taken = face.area * (1.0 - face.reflectance[c]) / channels;
                let Some(irradiance) = estimate.irradiance else { continue };
                any_known = true;
                absorbed[part].power += taken * irradiance;
                absorbed[part].error += taken * estimate.irradiance_error.unwrap_or(f64::INFINITY);
            }
        }
        if !any_known || emitted <= 0.0 || summary.method.estimator == "direct" {
            return None;
        }
        absorbed.sort_by(|a, b| b.power.total_cmp(&a.power));
        let rest = absorbed.split_off(absorbed.len().min(NAMED));
        absorbed.iter_mut().zip(COLOURS).for_each(|(part, colour)| part.colour = colour);
        if !rest.is_empty() {
            absorbed.push(PowerShare {
                words: format!("{} other materials", rest.len()),
                colour: OTHERS,
                power: rest.iter().map(|part| part.power).sum(),
                error: rest.iter().map(|part| part.error).sum(),
            });
        }
        absorbed.extend(lost_parts(estimates, emitted));
        absorbed.retain(|part| part.power > 0.0);
        let coloured = scene.channels() > 1;
        Some(Flow { emitted, unit: summary.units.power, coloured, parts: absorbed, unknown })
    }

    /// The rows of the table.
    pub(crate) fn rows(&self) -> Vec<FlowRow> {
        let row = |part: &PowerShare| FlowRow {
            words: part.words.clone(),
            colour: part.colour,
            share: share(part.power / self.emitted),
            error: if part.error.is_finite() { share(part.error / self.emitted) } else { "unknown".into() },
            power: number(part.power),
        };
        self.parts.iter().map(row).collect()
    }

    /// The facts that the rows do not show.
    pub(crate) fn notes(&self) -> Vec<String> {
        let sum: f64 = self.parts.iter().map(|part| part.power).sum();
        let mut notes = vec![format!(
            "{} {} are emitted{}. The shares are estimates; their sum is {}, which differs from 100 % by chance.",
            number(self.emitted),
            self.unit,
            if self.coloured { ", the mean of the channels" } else { "" },
            share(sum / self.emitted)
        )];
        if self.unknown > 0 {
            notes.push(format!(
                "{} faces have no estimate; the power that they absorb is missing.",
                self.unknown
            ));
        }
        notes
    }

    /// The diagram. Each flow is as high as its share; the words stand beside it, so that no reader has to tell colours apart.
    pub(crate) fn svg(&self) -> String {
        let sum: f64 = self.parts.iter().map(|part| part.power).sum();
        let scale = HEIGHT / sum.max(self.emitted);
        let rows: Vec<f64> = self.parts.iter().map(|part| (part.power * scale).max(ROW)).collect();
        let total: f64 = rows.iter().sum::<f64>() + 6.0 * rows.len() as f64;
        let height = total.max(HEIGHT) + 8.0;
        let mut y_from = 0.5 * (height - sum * scale);
        let first = y_from;
        let mut y_to = 4.0;
        let mut drawn = String::new();
        let mut shares = Vec::new();
        for (part, row) in self.parts.iter().zip(rows) {
            let thick = part.power * scale;
            let end = y_to + 0.5 * (row - thick);
            let (middle, colour) = (0.5 * (FROM + BAR + TO), part.colour);
            let share = share(part.power / self.emitted);
            // A string takes what it is given.
            let _ = write!(
                drawn,
                "<path d=\"M{x0:.1} {y_from:.1}C{middle:.1} {y_from:.1} {middle:.1} {end:.1} {TO:.1} {end:.1}v{thick:.2}\
                 C{middle:.1} {back:.1} {middle:.1} {below:.1} {x0:.1} {below:.1}z\" fill=\"{colour}\" fill-opacity=\"0.45\"/>\
                 <rect x=\"{TO:.1}\" y=\"{end:.1}\" width=\"{BAR}\" height=\"{thick:.2}\" fill=\"{colour}\"/>\
                 <text x=\"{x_text:.1}\" y=\"{y_text:.1}\" dominant-baseline=\"middle\">{words}, {share}</text>",
                x0 = FROM + BAR,
                back = end + thick,
                below = y_from + thick,
                x_text = TO + BAR + 8.0,
                y_text = y_to + 0.5 * row,
                words = escaped(&part.words),
            );
            shares.push(format!("{} {share}", part.words));
            y_from += thick;
            y_to += row + 6.0;
        }
        format!(
            "<svg class=\"flow\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" aria-labelledby=\"flow-words\">\
             <title id=\"flow-words\">Where the emitted power ends: {}</title>\
             <rect x=\"{FROM}\" y=\"{first:.1}\" width=\"{BAR}\" height=\"{:.2}\" fill=\"currentColor\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" dominant-baseline=\"middle\">emitted</text>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" dominant-baseline=\"middle\">{} {}</text>{drawn}</svg>",
            escaped(&shares.join(", ")),
            sum * scale,
            FROM - 8.0,
            0.5 * height - 10.0,
            FROM - 8.0,
            0.5 * height + 10.0,
            number(self.emitted),
            self.unit
        )
    }
}

/// The parts of the power that left the scene, ended on backs, and were cut off. `None` where walks carry importance, which tells nothing of
/// power, and of a mixture of sources, since walks tell of all sources together.
pub(crate) fn losses(estimates: &Estimates) -> Option<[Measured; 3]> {
    let experiment = estimates.experiment();
    let tells = !experiment.gathers() && experiment.mixture().is_none();
    let lost = tells.then(|| experiment.lost(&estimates.tally().counts))?;
    Some([lost.escaped, lost.on_backs, lost.cut_off])
}

/// [`losses`] as parts of the diagram.
fn lost_parts(estimates: &Estimates, emitted: f64) -> impl Iterator<Item = PowerShare> {
    let kinds =
        [("left the scene", ESCAPED), ("ended on backs of one-sided surfaces", BACKS), ("cut off", CUT)];
    let part = move |((words, colour), part): ((&str, &'static str), Measured)| PowerShare {
        words: words.into(),
        colour,
        power: emitted * part.value,
        error: emitted * part.standard_error,
    };
    losses(estimates).into_iter().flat_map(move |lost| kinds.into_iter().zip(lost)).map(part)
}

/// Text as XML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use radiosity::{IndexChoice, Scene, Spectrum};

    use super::*;
    use crate::scenes::{cornell, cube, experiment, shot, summary};

    fn flow(scene: &Scene, finishes: &Finishes) -> Flow {
        let experiment = experiment(scene);
        let tally = shot(&experiment);
        let summary = summary(&experiment, &tally);
        Flow::of(&Estimates::new(&experiment, &tally, 0.95), &summary, finishes).unwrap()
    }

    fn sum(flow: &Flow) -> f64 {
        flow.parts.iter().map(|part| part.power).sum()
    }

    /// 100,000 walks of one seed: the sum of all shares errs by fewer than 5 of the sums of the bounds, which are at least the
    /// standard error (a false alarm has a probability of 6·10⁻⁷, once and for all).
    #[test]
    fn what_is_emitted_ends_somewhere() {
        let mut coloured = cornell();
        coloured.surfaces[3].reflectance = Spectrum::rgb([0.7, 0.1, 0.05]);
        let [grey, coloured] =
            [cornell(), coloured].map(|spec| Scene::build(&spec, IndexChoice::Auto).unwrap());
        for scene in [cube(), grey, coloured] {
            let flow = flow(&scene, &Finishes::default());
            let error: f64 = flow.parts.iter().map(|part| part.error).sum();
            assert!(error > 0.0 && error < 0.1 * flow.emitted, "{flow:?}");
            assert!((sum(&flow) - flow.emitted).abs() < 5.0 * error, "{} of {}", sum(&flow), flow.emitted);
        }
    }

    #[test]
    fn materials_have_their_names_and_what_escapes_is_shown() {
        let scene = Scene::build(&cornell(), IndexChoice::Auto).unwrap();
        let mut finishes = Finishes::default();
        for surface in 0..scene.surfaces().len() {
            let name = scene.surface_name(surface as u32);
            finishes.push(if ["dark", "light", "lamp"].contains(&name) { name } else { "<white>" });
        }
        let flow = flow(&scene, &finishes);
        let words: Vec<&str> = flow.parts.iter().map(|part| &part.words[..]).collect();
        assert!(words.starts_with(&["<white>"]) || words.starts_with(&["dark"]), "{words:?}");
        for name in ["<white>", "dark", "light", "left the scene"] {
            assert!(words.contains(&name), "{name} is not in {words:?}");
        }
        let svg = flow.svg();
        assert!(svg.contains("&lt;white&gt;, ") && !svg.contains("<white>") && !svg.contains("NaN"));
        assert_eq!(svg.matches("<path").count(), flow.parts.len());
    }

    #[test]
    fn many_materials_are_listed_together() {
        let scene = cube();
        let mut finishes = Finishes::default();
        (0..scene.surfaces().len()).for_each(|surface| finishes.push(&format!("m{surface}")));
        assert_eq!(flow(&scene, &finishes).parts.len(), 6);
        let spec = cornell();
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let mut finishes = Finishes::default();
        (0..scene.surfaces().len()).for_each(|surface| finishes.push(&format!("m{surface}")));
        let flow = flow(&scene, &finishes);
        let others = scene.surfaces().len() - NAMED;
        assert!(flow.parts.iter().any(|part| part.words == format!("{others} other materials")), "{flow:?}");
    }
}
