//! `radwalk daylight`: daylight coefficients of sensors, and what a year of weather makes of them.

use radiosity::daylight::SkyPatches;
use report::OutputFolder;
use results::daylight::{DAYLIGHT_FILES, DaylightAnswer, DaylightFile, DaylightQuestion, Wished, count};
use results::{Round, all_threads};
use sky::Wanted;
use tracing::{info, warn};
use voice::Phase;

use crate::args::DaylightArgs;
use crate::build::BUILD;
use crate::choose::load_given;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};
use crate::rounds::{dismiss, open_executor, walk_round};
use crate::signals;

/// Counts daylight coefficients and writes the figures of a year.
pub(crate) fn daylight(args: &DaylightArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene and the weather");
    let job = load_given(&args.job.job, &args.job.overrides()?, "daylight")?;
    let wished = Wished {
        weather: &args.weather,
        patches: SkyPatches::new(args.sky_patches).expect("the number was checked when it was read"),
        ground: args.ground,
        channel: args.channel.map(|channel| channel as usize),
        tolerance: args.tolerance,
        wanted: Wanted { enough: args.enough, ..Wanted::default() },
    };
    let question = DaylightQuestion::of(job, &wished)?;
    question.job.scene.notes().iter().for_each(|note| info!("note: {note}"));
    if !question.ignored.is_empty() {
        info!("note: what follows has no part in daylight: {}", question.ignored.join(", "));
    }
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&question.job));
    let folder = OutputFolder::claim(&path, &DAYLIGHT_FILES, args.out.force || args.rounds.resume)?;
    signals::catch();
    let executor = open_executor(&args.rounds, &question.scene, &folder)?;
    phase.now("counting walks from the sensors to the sky");
    let mut walk = |round: Round<'_>| walk_round(&executor, round);
    let resume = args.rounds.resume;
    let counted = count(&question, BUILD, (&folder, resume), &mut walk, &|part| phase.done(part));
    dismiss(executor, &question.job, || question.experiment(Vec::new()))?;
    let counted = counted?;
    if counted.interrupted {
        drop(phase);
        warn!("interrupted; what was counted is kept, go on with --resume");
        return Ok(Outcome::Interrupted);
    }
    phase.now("working out the hours of the year");
    let answer = DaylightAnswer::of(&question, counted, all_threads());
    let exports: Vec<DaylightFile> = args.export.iter().map(|&word| word.into()).collect();
    answer.write(&folder, &exports)?;
    drop(phase);
    answer.warnings().iter().for_each(|warning| warn!("{warning}"));
    args.out.tell(folder.path(), answer.lines());
    Ok(if answer.reached() { Outcome::Done } else { Outcome::TargetMissed })
}
