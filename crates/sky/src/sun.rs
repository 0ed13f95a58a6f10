//! Where the sun is.

use solar_positioning::time::JulianDate;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t};

/// The angle under which the sun's disc is seen [°], its mean.
pub const SUN_ANGLE: f64 = 0.533;

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// The latitude [°], positive in the north.
    pub latitude: f64,
    /// The longitude [°], positive in the east.
    pub longitude: f64,
    /// By how much clocks of the site are ahead of UTC [h].
    pub time_zone: f64,
    /// The height above the sea [m].
    pub elevation: f64,
}

/// The direction of the sun as it is seen through the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// The angle above the horizon [°].
    pub altitude: f64,
    /// The angle from the north over the east [°].
    pub azimuth: f64,
}

impl SunPosition {
    /// The sun at a time of the clocks of a site, in hours since the midnight before a date (year, month, day): NREL's algorithm (I. Reda &
    /// A. Andreas, *Solar position algorithm for solar radiation applications*, NREL/TP-560-34302). `None` of a date or place that cannot be.
    pub fn at(site: &Site, [year, month, day]: [i32; 3], hour: f64) -> Option<Self> {
        let [month, day] = [month, day].map(|number| u32::try_from(number).ok());
        let lag = delta_t::estimate_from_date(year, month?).ok()?;
        let midnight = JulianDate::from_utc(year, month?, day?, 0, 0, 0.0, lag).ok()?;
        let time = JulianDate::new(midnight.julian_date() + (hour - site.time_zone) / 24.0, lag).ok()?;
        let location = Location { latitude: site.latitude, longitude: site.longitude };
        let refraction = Some(RefractionCorrection::standard());
        let position =
            SolarPositions::new().at_from_julian(time, location, site.elevation, refraction).ok()?;
        Some(SunPosition { altitude: position.elevation_angle(), azimuth: position.azimuth() })
    }

    /// The unit vector to the sun: east, north, up.
    pub fn direction(&self) -> [f64; 3] {
        let [(sine, cosine), (east, north)] =
            [self.altitude, self.azimuth].map(|angle| angle.to_radians().sin_cos());
        [cosine * east, cosine * north, sine]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NREL/TP-560-34302, appendix A.5: zenith angle 50.11162°, azimuth 194.34024°. The report's air is of 820 hPa and 11 °C, where
    /// ours is the standard one, which bends light by 0.004° more, and its ΔT is 67 s.
    #[test]
    fn the_published_case() {
        let site = Site { latitude: 39.742476, longitude: -105.1786, time_zone: -7.0, elevation: 1830.14 };
        let sun = SunPosition::at(&site, [2003, 10, 17], 12.0 + 30.5 / 60.0).unwrap();
        assert!((90.0 - sun.altitude - 50.11162).abs() < 0.005, "{sun:?}");
        assert!((sun.azimuth - 194.34024).abs() < 0.0003, "{sun:?}");
        let [east, north, up] = sun.direction();
        assert!(east < 0.0 && north < 0.0 && (up - sun.altitude.to_radians().sin()).abs() < 1e-15);
        assert_eq!(SunPosition::at(&site, [2003, 13, 17], 12.0), None);
        assert_eq!(SunPosition::at(&Site { latitude: 91.0, ..site }, [2003, 1, 17], 12.0), None);
    }
}
