//! Examples and tables under the help of commands.

/// Under the help of `radwalk` itself.
pub(super) const AFTER: &str = "\
Examples:
  radwalk new box && radwalk run box.toml      a first scene, on all cores: out/box/
  radwalk check room.glb --fix-report          what is wrong with a mesh
  radwalk plan box.toml                        what its target will take
  radwalk coordinate box.toml --listen node1:7600 --access box.json
  radwalk work --access box.json --threads 8   on every other machine
  radwalk status box.json                      the state of the job
  radwalk help target                          what a word means: walk, interval, target, chain, access file …

Exit codes:
  0    done, and the target, if any, is reached; comparisons and audits agree
  1    the budget or the wall clock ended the job before its target was reached; a check names faults
  2    bad input or usage, or results that cannot be written
  3    the cluster failed, or an audit, a difference or a page of results did not hold
  130  interrupted; what was walked is written, and `--resume` goes on from it

Environment:
  RADWALK_LOG     the least level of messages on stderr: error, warn, info, debug, trace or off [default: info; with
                  --quiet: error]

Jobs, scenes, output files and checks: docs/reference/.";

/// Under the help of `radwalk run`.
pub(super) const RUN: &str = "\
Examples:
  radwalk run box.toml                                       all cores, to the budget or the target of the job
  radwalk run box.toml --paths 1e9 --set target.relative_error=0.01
  radwalk run box.toml --resume --paths 2e9                  goes on from the checkpoint, or from the end, to more walks
  radwalk run room.glb                                       a mesh as it is
  radwalk run room.glb --light Lamp.001=1000lm               a material or a part of it as a lamp
  radwalk run house.obj --sky=10000                          under a uniform sky";

/// Under the help of `radwalk coordinate`.
pub(super) const COORDINATE: &str = "\
Examples:
  radwalk coordinate box.toml --listen node1:7600 --access shared/box.json
  radwalk coordinate box.toml --listen 0.0.0.0:7600 --advertise gate.example.org:443 --metrics 9600";

/// Under the help of `radwalk work`.
pub(super) const WORK: &str = "\
Examples:
  radwalk work --access shared/box.json --threads 8
  ssh node1 cat shared/box.json | radwalk work --access -";

/// Under the help of `radwalk relay`.
pub(super) const RELAY: &str = "\
Examples:
  radwalk relay --access shared/box.json --out-access rack7.json --listen node7:0
  radwalk work --access rack7.json                           on the machines of the rack; a node at once: scripts/node.sh";

/// Under the help of `radwalk check`.
pub(super) const CHECK: &str = "\
Examples:
  radwalk check box.toml
  radwalk check room.glb                                     what was assumed, a table of materials, faults by number
  radwalk check room.glb --fix-report                        flipped, doubled, buried and leaking surfaces, dark lamps
  radwalk check room.glb --repair                            writes room.repaired.toml";

/// Under the help of `radwalk status`.
pub(super) const STATUS: &str = "\
Examples:
  radwalk status out/box                                     a run on this machine, by its output folder
  radwalk status shared/box.json --json                      a job of `radwalk coordinate`, by its access file";

/// Under the help of `radwalk exact`.
pub(super) const EXACT: &str = "\
Examples:
  radwalk exact box.toml --out out/exact                     exact.csv: radiosities without noise, and variances of walks";

/// Under the help of `radwalk factors`.
pub(super) const FACTORS: &str = "\
Examples:
  radwalk factors box.toml                                   form factors of every pair of patches: factors.csv
  radwalk factors box.toml --groups by-surface --reflections --smooth
  radwalk factors box.toml --groups by-surface --tolerance 0.01 --pairs floor:ceiling
  radwalk factors configs/oven.toml --groups by-surface --temperatures configs/heat/oven.toml
  radwalk factors box.toml --listen node1:7600               for workers elsewhere: radwalk work --access out/box/access.json";

/// Under the help of `radwalk audit`.
pub(super) const AUDIT: &str = "\
Examples:
  radwalk audit out/box                                      traces one walk in a thousand again
  radwalk audit out/box --share 1                            traces all of them; names who delivered a wrong one";

/// Under the help of `radwalk report`.
pub(super) const REPORT: &str = "\
Examples:
  radwalk report out/box                                     makes report.html and the rest again
  radwalk report out/box --export vtu,glb                    for ParaView, and for glTF viewers";

/// Under the help of `radwalk replay`.
pub(super) const REPLAY: &str = "\
Examples:
  radwalk replay box.toml --walk 7                           where walk 7 is born, what it meets, where it ends";

/// Under the help of `radwalk plan`.
pub(super) const PLAN: &str = "\
Examples:
  radwalk plan box.toml                                      what the target of the job will take
  radwalk plan box.toml --set target.relative_error=0.01 --json";

/// Under the help of `radwalk new`.
pub(super) const NEW: &str = "\
Examples:
  radwalk new box                                            box.toml, which `radwalk run box.toml` takes";

/// Under the help of `radwalk lamp`.
pub(super) const LAMP: &str = "\
Examples:
  radwalk lamp downlight.ies                                 flux, efficacy, beam angles; out/downlight.ies/polar.svg
  radwalk lamp street.ldt --svg street.svg --json            the same as JSON on stdout";

/// Under the help of `radwalk daylight`.
pub(super) const DAYLIGHT: &str = "\
Examples:
  radwalk daylight room.toml --weather city.epw              a year of daylight at every sensor: out/room/annual.csv
  radwalk daylight room.toml --weather city.epw --sky-patches 577 --enough 500

Files: annual.csv (figures of every place), annual.ill and annual-error.ill (hour by hour), coefficients.mtx (for dctimestep), daylight.json.";

/// Under the help of `radwalk sky`.
pub(super) const SKY: &str = "\
Examples:
  radwalk sky --cie 16 --horizontal 10000 --out overcast.mtx  the overcast sky of the CIE, 10,000 lx on the ground
  radwalk sky --cie 12 --altitude 40 --azimuth 180 --out clear.mtx
  radwalk sky --weather city.epw --out year.mtx               a column for each hour: Perez's all-weather sky, and the sun";

/// Under the help of `radwalk compare`.
pub(super) const COMPARE: &str = "\
Examples:
  radwalk compare box.toml --out out/compare                 charts of time and rays against error, with a verdict";

/// Under the help of `radwalk merge`.
pub(super) const MERGE: &str = "\
Examples:
  radwalk merge out/seed1 out/seed2 --out out/both           runs of other seeds, or of other ranges of walks
  radwalk merge out/factors1 out/factors2 --out out/factors  exchange factors of two seeds";

/// Under the help of `radwalk combine`.
pub(super) const COMBINE: &str = "\
Examples:
  radwalk run configs/lamps.toml                             a room with two lamps: out/lamps/
  radwalk combine out/lamps --set left=0.3 --set rest=1.2    one lamp dimmed: out/lamps-mix/";

/// Under the help of `radwalk diff`.
pub(super) const DIFF: &str = "\
Examples:
  radwalk diff out/seed1 out/seed2                           two runs with other seeds agree, but for chance
  radwalk diff out/box out/exact                             a run and the output folder of `radwalk exact`";

/// Under the help of `radwalk help`.
pub(super) const HELP: &str = "\
Examples:
  radwalk help interval                                      what an interval says
  radwalk help access file                                   how workers join a job
  radwalk help run                                           as radwalk run --help";
