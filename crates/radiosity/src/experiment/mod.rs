//! A method applied to a scene: the walks to shoot, the board that they score on, and the solution from their tally.

pub(crate) mod arrivals;
mod batches;
mod board;
mod chains;
pub(crate) mod daylight;
pub(crate) mod exchange;
mod gathering;
pub(crate) mod glare;
mod groups;
pub(crate) mod influence;
mod lit;
mod lost;
mod meaning;
mod mixture;
pub(crate) mod planes;
pub(crate) mod precision;
pub(crate) mod readings;
pub(crate) mod replay;
mod run;
pub(crate) mod segments;
mod sensing;
pub(crate) mod slopes;
pub(crate) mod solution;
mod sources;
mod unfit;
mod unmet;

pub use board::Board;
pub use gathering::birth_probabilities;
pub use groups::{Groups, PatchGroup, SensitivityMaterial};
pub use lost::Lost;
pub use meaning::Meaning;
pub use sensing::SensorView;
pub use sources::SourceScores;
pub use unfit::Unfit;

use std::sync::{Arc, OnceLock};

use crate::geometry::sensor::{SensorSpec, Sensors};
use crate::jacobi;
use crate::method::{Direction, Method, Score, Unit};
use crate::scene::Scene;
use crate::scene::births::Births;
use crate::tally::{ColouredBoard, Layout, LinearBoard, Scoreboard, Tally};
use crate::walk::estimator::{AbsorptionMode, Estimator};
use crate::walk::marks::{MarkBoard, Marked};
use board::{GroupSums, Scores, Sensing, with_board};
use daylight::{Daylight, DaylightSpec};
use exchange::{Exchange, ExchangeSpec};
use gathering::Gathering;
use groups::Mixture;
use lit::LampsAtCells;
use unfit::{check, check_sensors};

/// A scene and a method that fits it.
///
/// ```
/// use radiosity::{EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec};
///
/// let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
/// let solution = Experiment::new(scene, Method::shooting(EstimatorKind::Collision))?.run(1, 1000)?;
/// assert_eq!(solution.estimates.len(), 54);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Experiment {
    scene: Scene,
    method: Method,
    /// The births and values of gathering walks; `None` for other methods.
    gathering: Option<Gathering>,
    /// What batches and chains score H over [W/m²], per channel.
    largest_radiosity: [f64; 3],
    /// What samples of sensors are scored over [W/m²], per channel.
    largest_at_sensors: [f64; 3],
    /// The area of the smallest face [m²].
    least_area: f64,
    /// Places where light is measured; `None` where there are none.
    sensors: Option<Arc<Sensors>>,
    /// Groups of patches that are distinguished; `None` where there are none.
    groups: Option<Arc<Groups>>,
    /// What is estimated in place of the light of the scene; `None`: that light.
    mixture: Option<Arc<Mixture>>,
    /// Groups of faces that walks are counted by; `None` where faces score.
    exchange: Option<Arc<Exchange>>,
    /// Places whose walks to the sky are counted; `None` where faces score.
    daylight: Option<Arc<Daylight>>,
    /// What lamps without area bring to the points of sensors, once that is asked for.
    lamps_at_cells: OnceLock<Arc<LampsAtCells>>,
    /// The part of the rays of a chain that each face shoots, once a chain has asked.
    aim: OnceLock<Arc<[f64]>>,
    /// Whether shadow rays bring direct light in its chains: rays are also those of lamps, sensors and the final gather.
    shadow_rays: OnceLock<bool>,
}

impl Experiment {
    /// Prepares a method for a scene.
    ///
    /// # Errors
    /// Where its answer would be wrong.
    pub fn new(scene: Scene, method: impl Into<Method>) -> Result<Self, Unfit> {
        let method = method.into();
        check(&scene, &method)?;
        Experiment::unchecked(scene, method)
    }

    /// [`Experiment::new`], whatever [`check`] says of the answer.
    pub(crate) fn unchecked(scene: Scene, method: Method) -> Result<Self, Unfit> {
        let gathering = match &method {
            Method::Walks(walks) => match &walks.direction {
                Direction::Gathering(birth) => Some(Gathering::new(&scene, birth, walks.score)?),
                Direction::Shooting => None,
            },
            Method::Batches(_) | Method::Chains(_) => None,
        };
        if method.is_linear() {
            // Now, and not while walks are under way.
            scene.planes();
        }
        let largest_radiosity = lit::largest_radiosity(&scene);
        let least_area = scene.faces().iter().map(|face| face.area).fold(f64::INFINITY, f64::min);
        Ok(Experiment {
            scene,
            method,
            gathering,
            largest_radiosity,
            largest_at_sensors: largest_radiosity,
            least_area,
            sensors: None,
            groups: None,
            mixture: None,
            exchange: None,
            daylight: None,
            lamps_at_cells: OnceLock::new(),
            aim: OnceLock::new(),
            shadow_rays: OnceLock::new(),
        })
    }

    /// The experiment with sensors, whose light rays of their own gather from what its walks have found. What is found of
    /// faces stays as it is.
    ///
    /// # Errors
    /// An impossible sensor, or walks that do not estimate every face.
    pub fn with_sensors(mut self, specs: &[SensorSpec]) -> Result<Self, Unfit> {
        self.sensors = Sensors::new(&self.scene, specs)?.map(Arc::new);
        if self.sensors.is_some() {
            check_sensors(&self.method)?;
        }
        if let Some(sensors) = &self.sensors {
            lit::check_points(&self.scene, sensors)?;
            self.largest_at_sensors = lit::largest_at_sensors(&self.scene, sensors, self.largest_radiosity);
        }
        self.check_groups()
    }

    /// The experiment with sources that are distinguished, and materials whose influence is measured. What is found of faces stays
    /// as it is.
    ///
    /// # Errors
    /// Groups that cannot be distinguished, or a method whose samples belong to several of them.
    pub fn with_groups(mut self, sources: &[PatchGroup], materials: &[PatchGroup]) -> Result<Self, Unfit> {
        self.groups = Groups::new(&self.scene, &self.method, (sources, materials))?.map(Arc::new);
        self.check_groups()
    }

    fn check_groups(self) -> Result<Self, Unfit> {
        let materials = self.groups().is_some_and(|groups| !groups.materials().is_empty());
        match self.sensors.is_some() && materials {
            true => Err(Unfit::SensitiveSensors),
            false => Ok(self),
        }
    }

    /// Sources that are distinguished.
    fn source_count(&self) -> usize {
        self.groups().map_or(0, |groups| groups.sources().len())
    }

    /// Rows of a tally that hold scores of faces: all classes together, and every class but the first.
    fn face_rows(&self) -> usize {
        self.scene.faces().len() + self.groups().map_or(0, Groups::class_rows)
    }

    /// Rows that hold what sensors read: all sources together, and each.
    fn sensor_rows(&self) -> usize {
        self.sensors().map_or(0, |sensors| sensors.row_count() * (1 + self.source_count()))
    }

    /// The number of the first row of sensors in a tally, which counts their samples.
    pub fn first_row_of_sensors(&self) -> usize {
        self.face_rows()
    }

    /// The groups of patches that are distinguished, where there are any.
    pub fn groups(&self) -> Option<&Groups> {
        self.groups.as_deref()
    }

    /// The experiment whose walks count exchange factors, in place of those of its method: of this, only the space that walks go
    /// on in is used. Light plays no part.
    ///
    /// # Errors
    /// A scene in colour, or groups and walks that cannot be.
    pub fn with_exchange(mut self, spec: ExchangeSpec) -> Result<Self, Unfit> {
        self.exchange = Some(Exchange::new(&self.scene, spec)?.into());
        Ok(self)
    }

    /// Walks that count daylight coefficients. Light plays no part.
    ///
    /// # Errors
    /// A scene in colour, or sensors, a sky and walks that cannot be.
    pub fn of_daylight(scene: Scene, spec: DaylightSpec) -> Result<Self, Unfit> {
        let daylight = Daylight::new(&scene, spec)?;
        let method = Method::shooting(Estimator::Collision);
        Ok(Experiment { daylight: Some(daylight.into()), ..Experiment::unchecked(scene, method)? })
    }

    /// Rows of what is counted in place of light; `None` where light is.
    fn counted_rows(&self) -> Option<usize> {
        let exchange = self.exchange.as_ref().map(|exchange| exchange.rows());
        exchange.or_else(|| self.daylight.as_ref().map(|daylight| daylight.rows()))
    }

    /// The sensors, where there are any.
    pub fn sensors(&self) -> Option<&Sensors> {
        self.sensors.as_deref()
    }

    /// What the scores of sensors are parts of [W/m²]: no radiosity exceeds it, nor does what a sample of a sensor finds of lamps without
    /// area.
    pub fn largest_at_sensors(&self, channel: usize) -> f64 {
        self.largest_at_sensors[channel]
    }

    /// The scene of the experiment.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The method of the experiment.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// What is one sample.
    pub fn unit(&self) -> Unit {
        self.method.unit()
    }

    /// Whether walks carry importance from the patches, not power from the emitters.
    pub fn gathers(&self) -> bool {
        self.gathering.is_some()
    }

    /// Where walks are born.
    fn births(&self) -> &Births {
        self.gathering.as_ref().map_or(self.scene.emitters(), |gathering| &gathering.births)
    }

    /// Whether walks are cut off while they still carry weight.
    pub fn is_biased(&self) -> bool {
        self.method.is_biased()
    }

    /// What a tally keeps of each patch.
    pub fn layout(&self) -> Layout {
        with_board!(&self.scores(0), board => board.layout())
    }

    /// Rows of a tally: the faces; where groups are distinguished those of every class but the first, and of materials; where there are sensors
    /// one that counts their samples, and their cells, for all sources together and for each. Of exchange factors: those of [`ExchangeSpec`]; of daylight
    /// coefficients: [`daylight::sky_rows`] for each segment.
    pub fn rows(&self) -> usize {
        if let Some(rows) = self.counted_rows() {
            return rows;
        }
        let of_sensors = self.sensors().map_or(0, |_| 1 + self.sensor_rows());
        self.face_rows() + self.groups().map_or(0, Groups::material_rows) + of_sensors
    }

    /// An empty tally.
    pub fn tally(&self) -> Tally {
        Tally::new(self.rows(), self.layout())
    }

    /// An empty board for one thread to score on.
    pub fn board(&self) -> Board {
        let sensing = self.sensors().map(|_| {
            let faces = [self.scene.faces().len(), self.face_rows()];
            Sensing::new(faces, self.sensor_rows(), self.layout())
        });
        let counted = self.counted_rows();
        let faces = counted.unwrap_or(self.scene.faces().len());
        // Light is not distinguished where it is not counted.
        let groups = self.groups().filter(|_| counted.is_none());
        let slots = faces + groups.map_or(0, Groups::class_rows);
        Board {
            scores: self.scores(slots),
            sensing,
            group_sums: groups.map(|groups| self.group_sums(groups)),
        }
    }

    fn group_sums(&self, groups: &Groups) -> GroupSums {
        let (faces, layout) = (self.scene.faces().len(), self.layout());
        let materials = groups.materials().len();
        let (size, columns) = ([faces, materials], layout.columns());
        let marks = (materials > 0).then(|| match (layout.events, layout.scores) {
            (false, _) => MarkBoard::Hits(Marked::new(size, columns)),
            (true, 1) => MarkBoard::Fixed(Marked::new(size, columns)),
            (true, _) => MarkBoard::Coloured(Marked::new(size, columns)),
        });
        GroupSums { faces, marks }
    }

    fn scores(&self, faces: usize) -> Scores {
        match &self.method {
            Method::Walks(walks) => self.scores_of_walks(walks.score, faces),
            Method::Batches(_) | Method::Chains(_) => {
                let slopes = if self.method.is_linear() { 2 } else { 0 };
                Scores::Chains(jacobi::ChainBoard::new(faces, self.scene.channels(), slopes))
            }
        }
    }

    /// Where single walks score.
    fn scores_of_walks(&self, score: Score, faces: usize) -> Scores {
        let hits = !self.gathers();
        match (self.scene.channels(), score) {
            (1, Score::Mix) if hits => Scores::RelatedHits(Scoreboard::new(faces)),
            (1, Score::Mix) => Scores::RelatedFixed(Scoreboard::new(faces)),
            (1, Score::Of(estimator)) => match estimator.kind().absorption() {
                AbsorptionMode::Analog | AbsorptionMode::DirectOnly if hits => {
                    Scores::Hits(Scoreboard::new(faces))
                }
                AbsorptionMode::Analog | AbsorptionMode::DirectOnly | AbsorptionMode::Implicit => {
                    Scores::Fixed(Scoreboard::new(faces))
                }
            },
            (1, Score::Linear(estimator)) => match estimator.kind().absorption() {
                AbsorptionMode::Analog | AbsorptionMode::DirectOnly if hits => {
                    Scores::LinearHits(LinearBoard::new(faces))
                }
                AbsorptionMode::Analog | AbsorptionMode::DirectOnly | AbsorptionMode::Implicit => {
                    Scores::LinearFixed(LinearBoard::new(faces))
                }
            },
            (_, Score::Linear(_)) => Scores::LinearColoured(LinearBoard::new(faces)),
            _ => Scores::Coloured(ColouredBoard::new(faces)),
        }
    }
}
