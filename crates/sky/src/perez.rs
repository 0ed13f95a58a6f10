//! The all-weather sky of Perez, Seals & Michalsky, and the luminous efficacies of Perez, Ineichen, Seals, Michalsky & Stewart.
//!
//! **P90**: *Modeling daylight availability and irradiance components from direct and global irradiance*, Solar Energy 44 (1990)
//! 271–289. **P93**: *All-weather model for sky luminance distribution — preliminary configuration and validation*, Solar Energy 50
//! (1993) 235–245, with the erratum in 51 (1993) 423. Numbers are held in the limits that Radiance's `gendaymtx` sets.

use crate::luminance::{Sky, SkyForm};

/// The solar constant that the models were fitted with [W/m²].
const SOLAR_CONSTANT: f64 = 1367.0;

/// The clearnesses ε at which a class of skies ends (P93 table 1).
const CLASSES: [f64; 7] = [1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200];

/// The most clearness there is.
const MOST_CLEAR: f64 = 11.9;

/// a₁ … a₄, b₁ … e₄ of each class (P93 table 1).
const COEFFICIENTS: [[[f64; 4]; 5]; 8] = [
    [
        [1.3525, -0.2576, -0.2690, -1.4366],
        [-0.7670, 0.0007, 1.2734, -0.1233],
        [2.8000, 0.6004, 1.2375, 1.0000],
        [1.8734, 0.6297, 0.9738, 0.2809],
        [0.0356, -0.1246, -0.5718, 0.9938],
    ],
    [
        [-1.2219, -0.7730, 1.4148, 1.1016],
        [-0.2054, 0.0367, -3.9128, 0.9156],
        [6.9750, 0.1774, 6.4477, -0.1239],
        [-1.5798, -0.5081, -1.7812, 0.1080],
        [0.2624, 0.0672, -0.2190, -0.4285],
    ],
    [
        [-1.1000, -0.2515, 0.8952, 0.0156],
        [0.2782, -0.1812, -4.5000, 1.1766],
        [24.7219, -13.0812, -37.7000, 34.8438],
        [-5.0000, 1.5218, 3.9229, -2.6204],
        [-0.0156, 0.1597, 0.4199, -0.5562],
    ],
    [
        [-0.5484, -0.6654, -0.2672, 0.7117],
        [0.7234, -0.6219, -5.6812, 2.6297],
        [33.3389, -18.3000, -62.2500, 52.0781],
        [-3.5000, 0.0016, 1.1477, 0.1062],
        [0.4659, -0.3296, -0.0876, -0.0329],
    ],
    [
        [-0.6000, -0.3566, -2.5000, 2.3250],
        [0.2937, 0.0496, -5.6812, 1.8415],
        [21.0000, -4.7656, -21.5906, 7.2492],
        [-3.5000, -0.1554, 1.4062, 0.3988],
        [0.0032, 0.0766, -0.0656, -0.1294],
    ],
    [
        [-1.0156, -0.3670, 1.0078, 1.4051],
        [0.2875, -0.5328, -3.8500, 3.3750],
        [14.0000, -0.9999, -7.1406, 7.5469],
        [-3.4000, -0.1078, -1.0750, 1.5702],
        [-0.0672, 0.4016, 0.3017, -0.4844],
    ],
    [
        [-1.0000, 0.0211, 0.5025, -0.5119],
        [-0.3000, 0.1922, 0.7023, -1.6317],
        [19.0000, -5.0000, 1.2438, -1.9094],
        [-4.0000, 0.0250, 0.3844, 0.2656],
        [1.0468, -0.3788, -2.4517, 1.4656],
    ],
    [
        [-1.0500, 0.0289, 0.4260, 0.3590],
        [-0.3250, 0.1156, 0.7781, 0.0025],
        [31.0625, -14.5000, -46.1148, 55.3750],
        [-7.2312, 0.4050, 13.3500, 0.6234],
        [1.5000, -0.6426, 1.8564, 0.5636],
    ],
];

/// a … d of the luminous efficacy of the sky (P90 table 4, eq. 7).
const DIFFUSE_EFFICACY: [[f64; 4]; 8] = [
    [97.24, -0.46, 12.00, -8.91],
    [107.22, 1.15, 0.59, -3.95],
    [104.97, 2.96, -5.53, -8.77],
    [102.39, 5.59, -13.95, -13.90],
    [100.71, 5.94, -22.75, -23.74],
    [106.42, 3.83, -36.15, -28.83],
    [141.88, 1.90, -53.24, -14.03],
    [152.23, 0.35, -45.27, -7.98],
];

/// a … d of the luminous efficacy of the sun (P90 table 4, eq. 8).
const DIRECT_EFFICACY: [[f64; 4]; 8] = [
    [57.20, -4.55, -2.98, 117.12],
    [98.99, -3.46, -1.21, 12.38],
    [109.83, -4.90, -1.71, -8.81],
    [110.34, -5.84, -1.99, -4.56],
    [106.36, -3.97, -1.75, -6.16],
    [107.19, -1.25, -1.51, -26.73],
    [105.75, 0.77, -1.26, -34.44],
    [101.18, 1.58, -1.10, -8.29],
];

/// What light is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyUnit {
    /// Light as the eye sees it [lx, cd/m²].
    Illuminance,
    /// Power [W/m², W/(m² sr)].
    Irradiance,
}

/// The weather of an hour, as far as it bears on light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// The altitude of the sun [°].
    pub altitude: f64,
    /// The azimuth of the sun [°].
    pub azimuth: f64,
    /// What a plane that faces the sun receives from it [W/m²].
    pub direct: f64,
    /// What a horizontal plane receives from the sky without the sun [W/m²].
    pub diffuse: f64,
    /// The dew point [°C].
    pub dew_point: f64,
    /// The day of the year, from 1.
    pub day: u32,
}

impl Conditions {
    /// The zenith angle of the sun [rad], between 3° and 90°: the models were not fitted beyond.
    fn zenith(&self) -> f64 {
        (90.0 - self.altitude).clamp(3.0, 90.0).to_radians()
    }

    /// ε, the clearness of the sky (P90 eq. 1).
    fn clearness(&self) -> f64 {
        let cubed = 1.041 * self.zenith().powi(3);
        (((self.diffuse + self.direct) / self.diffuse + cubed) / (1.0 + cubed)).clamp(1.0, MOST_CLEAR)
    }

    fn class(&self) -> usize {
        CLASSES.partition_point(|&end| end <= self.clearness())
    }

    /// Δ, the brightness of the sky (P90 eq. 2), by the air mass of F. Kasten (1966) and the distance of the sun.
    fn brightness(&self) -> f64 {
        let zenith = self.zenith();
        let air_mass = 1.0 / (zenith.cos() + 0.15 * (93.885 - zenith.to_degrees()).powf(-1.253));
        let day = (f64::from(self.day) - 1.0) * (std::f64::consts::TAU / 365.0);
        let eccentricity = 1.00011
            + 0.034221 * day.cos()
            + 0.00128 * day.sin()
            + 0.000719 * (2.0 * day).cos()
            + 0.000077 * (2.0 * day).sin();
        (self.diffuse * air_mass / (SOLAR_CONSTANT * eccentricity)).clamp(0.01, 0.6)
    }

    /// The efficacies of sky and sun [lm/W] (P90 eqs. 3, 7, 8).
    fn efficacies(&self) -> [f64; 2] {
        let water = (0.07 * self.dew_point - 0.075).exp();
        let (zenith, brightness, class) = (self.zenith(), self.brightness(), self.class());
        let [a, b, c, d] = DIFFUSE_EFFICACY[class];
        let diffuse = a + b * water + c * zenith.cos() + d * brightness.ln();
        let [a, b, c, d] = DIRECT_EFFICACY[class];
        let direct = a + b * water + c * (5.73 * zenith - 5.0).exp() + d * brightness;
        [diffuse, direct.max(0.0)]
    }

    /// Diffuse horizontal and direct normal light in a quantity.
    pub fn light(&self, quantity: SkyUnit) -> [f64; 2] {
        match quantity {
            SkyUnit::Irradiance => [self.diffuse, self.direct],
            SkyUnit::Illuminance if self.diffuse <= 0.0 => [0.0, self.direct * self.efficacies_of_dark()],
            SkyUnit::Illuminance => {
                let [diffuse, direct] = self.efficacies();
                [self.diffuse * diffuse, self.direct * direct]
            }
        }
    }

    /// The efficacy of the sun [lm/W] where there is no sky: that of the clearest class.
    fn efficacies_of_dark(&self) -> f64 {
        Conditions { diffuse: 1e-3 * self.direct.max(1e-9), ..*self }.efficacies()[1]
    }

    /// The sky of these conditions in a quantity; `None` where it is dark.
    pub fn sky(&self, quantity: SkyUnit) -> Option<Sky> {
        let [horizontal, _] = self.light(quantity);
        if horizontal <= 0.0 {
            return None;
        }
        let form = self.form();
        let sun =
            crate::sun::SunPosition { altitude: 90.0 - self.zenith().to_degrees(), azimuth: self.azimuth };
        Some(Sky::new(form, sun.direction(), horizontal))
    }

    /// a … e of this sky (P93 eqs. 6–8).
    fn form(&self) -> SkyForm {
        let (zenith, clearness, class) = (self.zenith(), self.clearness(), self.class());
        let brightness = match clearness > 1.065 && clearness < 2.8 {
            true => self.brightness().max(0.2),
            false => self.brightness(),
        };
        let rows = &COEFFICIENTS[class];
        let linear = |[x1, x2, x3, x4]: [f64; 4]| x1 + x2 * zenith + brightness * (x3 + x4 * zenith);
        let [a, b, mut c, mut d, e] = rows.map(linear);
        if class == 0 {
            let [[c1, c2, c3, c4], [d1, d2, d3, d4]] = [rows[2], rows[3]];
            c = (brightness * (c1 + c2 * zenith)).powf(c3).exp() - c4;
            d = -(brightness * (d1 + d2 * zenith)).exp() + d3 + brightness * d4;
        }
        SkyForm::Graded { gradation: [a, b], indicatrix: [c, d, e], offset: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOON: Conditions =
        Conditions { altitude: 40.0, azimuth: 180.0, direct: 0.0, diffuse: 120.0, dew_point: 11.0, day: 80 };

    /// Classes end where P93 says: ε of conditions whose ε is worked out by hand.
    #[test]
    fn clear_and_overcast_skies_are_told_apart() {
        assert_eq!((NOON.clearness(), NOON.class()), (1.0, 0));
        let clear = Conditions { direct: 800.0, diffuse: 80.0, ..NOON };
        let cubed = 1.041 * 50.0_f64.to_radians().powi(3);
        assert!((clear.clearness() - (11.0 + cubed) / (1.0 + cubed)).abs() < 1e-12);
        assert_eq!((clear.class(), Conditions { direct: 200.0, ..NOON }.class()), (7, 4));
        assert!(Conditions { diffuse: 0.0, ..NOON }.sky(SkyUnit::Irradiance).is_none());
    }

    /// Efficacies of skies lie between 90 and 160 lm/W, those of the sun below: P90 figures 7 and 8.
    #[test]
    fn efficacies_are_those_of_daylight() {
        for (direct, diffuse) in [(0.0, 50.0), (100.0, 200.0), (500.0, 150.0), (900.0, 80.0)] {
            let conditions = Conditions { direct, diffuse, ..NOON };
            let [sky, sun] = conditions.efficacies();
            assert!((90.0..160.0).contains(&sky) && (40.0..115.0).contains(&sun), "{direct}: {sky}, {sun}");
            let [horizontal, normal] = conditions.light(SkyUnit::Illuminance);
            assert!((horizontal - diffuse * sky).abs() + (normal - direct * sun).abs() < 1e-9);
        }
    }

    /// A clear sky is brightest about the sun, an overcast one at the zenith.
    #[test]
    fn the_brightest_place_is_where_it_should_be() {
        let clear = Conditions { direct: 850.0, diffuse: 90.0, ..NOON }.sky(SkyUnit::Irradiance).unwrap();
        let overcast = NOON.sky(SkyUnit::Irradiance).unwrap();
        let [up, sun, away] = [[0.0, 0.0, 1.0], [0.0, -0.766, 0.643], [0.0, 0.766, 0.643]];
        assert!(
            clear.relative(sun) > 4.0 * clear.relative(up)
                && clear.relative(sun) > 4.0 * clear.relative(away)
        );
        assert!(
            overcast.relative(up) > overcast.relative(away)
                && overcast.relative(up) > 1.3 * overcast.relative([0.0, 0.995, 0.0998])
        );
    }
}
