// The fuzz targets of the readers of weather and of matrices: whatever a file holds, a reader must not panic, run for ever or take memory without end, and
// what it reads has a finite sky.

use radiosity::daylight::SkyPatches;
use sky::{Dome, Encoding, Matrix, SkyUnit, Weather, Year};

/// Hours that a sky is made of, at most: years are long.
const HOURS: usize = 24;

pub fn epw(content: &[u8]) {
    let Ok(mut weather) = Weather::read(content) else { return };
    weather.hours.truncate(HOURS);
    let dome = Dome::new(SkyPatches::new(145).expect("Tregenza's patches"));
    let year = Year::new(&weather, &dome, SkyUnit::Illuminance, 0.2);
    let (sky, sun) = year.mean(&dome);
    let all = sky.iter().copied().chain(sun.iter().map(|&(_, light)| light));
    all.for_each(|light| assert!(light.is_finite() && light >= 0.0, "light of {light}"));
}

pub fn mtx(content: &[u8]) {
    let Ok(matrix) = Matrix::read(content) else { return };
    assert_eq!(matrix.numbers.len(), matrix.rows * matrix.columns);
    let mut written = Vec::new();
    matrix.write(Encoding::Float, &mut written).expect("a vector takes anything");
}
