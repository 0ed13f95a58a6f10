//! `exact.csv`: the deterministic solution, the variance that one walk of each estimator would have, and how far the
//! solution itself may be off. `exact.json`: what holds of the whole scene.

use std::io::{self, Write};

use radiosity::{Side, surfaces::Faces};
use serde::{Serialize, Serializer};

use crate::patches::side_name;
use crate::summary::{Check, Units, hex};
use crate::words::counted;

/// The columns, in the order of faces; all of one length. The variances are of B for one walk, in the order
/// absorption, survival, collision, infinite; `None` leaves a column empty, and so does a variance that is
/// not finite its cell (a face that no walk is born on).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExactColumns {
    /// B: the radiosity of each face [W/m²].
    pub radiosity: Vec<f64>,
    /// b = B − E [W/m²].
    pub reflected: Vec<f64>,
    /// H: the irradiance of each face [W/m²].
    pub irradiance: Vec<f64>,
    /// ξ: received importance (S97 §2).
    pub xi: Vec<f64>,
    /// Variances of shooting [W²/m⁴].
    pub var_shoot: [Option<Vec<f64>>; 4],
    /// Variances of gathering [W²/m⁴].
    pub var_gather: [Option<Vec<f64>>; 4],
    /// ψ: φ in the scene of squared reflectances [W] (SInf §3).
    pub psi: Vec<f64>,
    /// β: b in the scene of squared reflectances [W/m²].
    pub beta: Vec<f64>,
    /// How far B may be off [W/m²].
    pub radiosity_error: Vec<f64>,
}

/// The columns after `patch` and `side`.
const NUMBERS: [&str; 15] = [
    "radiosity",
    "reflected",
    "irradiance",
    "xi",
    "var_shoot_absorption",
    "var_shoot_survival",
    "var_shoot_collision",
    "var_shoot_infinite",
    "var_gather_absorption",
    "var_gather_survival",
    "var_gather_collision",
    "var_gather_infinite",
    "psi",
    "beta",
    "radiosity_error",
];

/// Writes the columns, one row for each face, those of a patch next to each other; the column `side` is there if some
/// patch has two.
///
/// # Errors
/// Those of `writer`, and columns without a value for each face.
pub fn write_exact(writer: impl Write, faces: &Faces, columns: &ExactColumns) -> io::Result<()> {
    check_lengths(faces, columns)?;
    let mut table = csv::Writer::from_writer(writer);
    let place: &[&str] = if faces.two_sided() { &["patch", "side"] } else { &["patch"] };
    table.write_record(place.iter().chain(&NUMBERS))?;
    for i in faces.by_patch() {
        let face = faces.get(i);
        let side = faces.two_sided().then(|| [side_name(face.side)]);
        let values = [&columns.radiosity, &columns.reflected, &columns.irradiance, &columns.xi];
        let values = values.map(|column| column[i]);
        let variance = |column: &Option<Vec<f64>>| {
            column.as_ref().map(|variances| variances[i]).filter(|variance| variance.is_finite())
        };
        table.serialize((
            face.patch,
            side.as_slice(),
            values,
            columns.var_shoot.each_ref().map(variance),
            columns.var_gather.each_ref().map(variance),
            [&columns.psi, &columns.beta, &columns.radiosity_error].map(|column| column[i]),
        ))?;
    }
    table.flush()
}

fn check_lengths(faces: &Faces, columns: &ExactColumns) -> io::Result<()> {
    let always = [
        &columns.radiosity,
        &columns.reflected,
        &columns.irradiance,
        &columns.xi,
        &columns.psi,
        &columns.beta,
        &columns.radiosity_error,
    ];
    let variances = columns.var_shoot.iter().chain(&columns.var_gather).flatten();
    for column in always.into_iter().chain(variances) {
        if column.len() != faces.len() {
            let problem = format!("a column of {} numbers does not fit {} faces", column.len(), faces.len());
            return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
        }
    }
    Ok(())
}

/// All of `exact.json`, in its order. Numbers that are not finite become null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExactSummary {
    /// Version of the program.
    pub version: String,
    /// Digest of the scene.
    #[serde(serialize_with = "hex")]
    pub scene_hash: [u8; 32],
    /// The number of patches.
    pub patches: usize,
    /// The number of faces, the unknowns.
    pub faces: usize,
    /// Φ_T: total self-emitted power [W].
    pub total_power: f64,
    /// What the numbers measure.
    pub units: Units,
    /// How the form factors were found.
    pub form_factors: String,
    /// The least Σ_j F_ij: 1 in a closed scene.
    pub row_sum_min: f64,
    /// The greatest Σ_j F_ij.
    pub row_sum_max: f64,
    /// The greatest estimated error Σ_j |δF_ij| of a row.
    pub row_error: f64,
    /// The greatest |B − E − R Σ F B| over the greatest B.
    pub residual: f64,
    /// The greatest relative error of B, as estimated.
    pub max_relative_error: Option<f64>,
    /// The patch that has it.
    pub worst_patch: Option<u32>,
    /// Which side of it, if some patch has two.
    #[serde(serialize_with = "name_of_side", skip_serializing_if = "Option::is_none")]
    pub worst_side: Option<Side>,
    /// Faces left out there, since B is not above its error.
    pub undetermined: usize,
    /// What the error may at most be, whatever the geometry (S97).
    pub bounds: ExactBounds,
    /// The checks of the solution.
    pub checks: Vec<Check>,
}

/// Bounds of S97 for one walk: §§2.2–2.5, 3.3–3.8 and table 4. Estimators in the order absorption, survival,
/// collision, infinite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExactBounds {
    /// The greatest variance of B that shooting by absorption may have [W²/m⁴].
    pub shooting_variance: f64,
    /// The greatest variance of B that gathering by absorption with births by area may have [W²/m⁴].
    pub gathering_variance: f64,
    /// The greatest expected area-weighted mean square error of shooting [W²/m⁴].
    pub shooting_mse: [f64; 4],
    /// The greatest expected area-weighted mean square error of gathering with births by area [W²/m⁴].
    pub gathering_mse: [f64; 4],
}

fn name_of_side<S: Serializer>(side: &Option<Side>, serializer: S) -> Result<S::Ok, S::Error> {
    side.map(side_name).serialize(serializer)
}

impl ExactSummary {
    /// The summary, a fact or two a line.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!(
                "{} solved to a residual of {:.1e}",
                counted(self.patches as u64, "patch"),
                self.residual
            ),
            format!("form factors found {}", self.form_factors),
            format!(
                "their rows sum to {:.6} … {:.6} (1: no light is lost), with an error of at most {:.1e}",
                self.row_sum_min, self.row_sum_max, self.row_error
            ),
        ];
        if let (Some(error), Some(face)) = (self.max_relative_error, self.worst_face()) {
            lines.push(format!("so the relative error of radiosities is at most {error:.1e} ({face})"));
        }
        if self.undetermined > 0 {
            lines.push(format!(
                "{} faces are too dark: their errors exceed their radiosities",
                self.undetermined
            ));
        }
        lines
    }

    /// The face whose error is the greatest, in words: `patch 3` or, where patches have two sides, `patch 3, back`.
    pub fn worst_face(&self) -> Option<String> {
        let patch = self.worst_patch?;
        Some(match self.worst_side {
            None => format!("patch {patch}"),
            Some(side) => format!("patch {patch}, {}", side_name(side)),
        })
    }

    /// Writes it as JSON.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, mut writer: impl Write) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut writer, self)?;
        writeln!(writer)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use radiosity::{IndexChoice, Scene, SceneSpec, Shape, Sides, SurfaceSpec};

    use super::*;

    /// The faces of this many triangles, with one side or with two.
    fn faces(triangles: u32, sides: Sides) -> Faces {
        let triangle = |z: f64| SurfaceSpec {
            name: None,
            shape: Shape::Triangle { a: DVec3::Z * z, b: DVec3::X, c: DVec3::Y, rows: 1 },
            sides,
            reflectance: 0.5.into(),
            emittance: 1.0.into(),
            cell_emittance: vec![],
            transmittance: Default::default(),
        };
        let spec = SceneSpec::new((0..triangles).map(|i| triangle(f64::from(i))).collect());
        Scene::build(&spec, IndexChoice::Flat).unwrap().faces().clone()
    }

    fn text(faces: &Faces, columns: &ExactColumns) -> io::Result<String> {
        let mut bytes = Vec::new();
        write_exact(&mut bytes, faces, columns)?;
        Ok(String::from_utf8(bytes).unwrap())
    }

    fn columns() -> ExactColumns {
        ExactColumns {
            radiosity: vec![1.5, 1e-20],
            reflected: vec![0.5, 1e300],
            irradiance: vec![1.0, 2.0],
            xi: vec![0.1, 1.0 / 3.0],
            var_shoot: [None, None, Some(vec![4.0, 5e-9]), None],
            var_gather: [Some(vec![f64::INFINITY, 6.0]), None, None, Some(vec![f64::NAN, 7.0])],
            psi: vec![0.25, 0.75],
            beta: vec![0.1, 0.2],
            radiosity_error: vec![1e-9, 0.0],
        }
    }

    #[test]
    fn columns_are_as_the_format_says() {
        assert_eq!(
            text(&faces(2, Sides::Front), &columns()).unwrap(),
            "patch,radiosity,reflected,irradiance,xi,\
             var_shoot_absorption,var_shoot_survival,var_shoot_collision,var_shoot_infinite,\
             var_gather_absorption,var_gather_survival,var_gather_collision,var_gather_infinite,\
             psi,beta,radiosity_error\n\
             0,1.5,0.5,1.0,0.1,,,4.0,,,,,,0.25,0.1,1e-9\n\
             1,1e-20,1e300,2.0,0.3333333333333333,,,5e-9,,6.0,,,7.0,0.75,0.2,0.0\n"
        );
    }

    #[test]
    fn the_faces_of_a_patch_stand_together() {
        let radiosity = vec![1.0, 2.0, 3.0, 4.0];
        let columns = ExactColumns {
            reflected: radiosity.clone(),
            irradiance: radiosity.clone(),
            xi: radiosity.clone(),
            psi: radiosity.clone(),
            beta: radiosity.clone(),
            radiosity_error: radiosity.clone(),
            radiosity,
            ..ExactColumns::default()
        };
        let table = text(&faces(2, Sides::Both), &columns).unwrap();
        let starts = ["patch,side,radiosity,", "0,front,1.0,", "0,back,3.0,", "1,front,2.0,", "1,back,4.0,"];
        assert_eq!(table.lines().count(), starts.len());
        for (line, start) in table.lines().zip(starts) {
            assert!(line.starts_with(start), "{line} instead of {start}…");
        }
    }

    #[test]
    fn unequal_columns_are_refused() {
        let mut short = columns();
        short.xi.pop();
        assert!(text(&faces(2, Sides::Front), &short).is_err());
        let mut short = columns();
        short.var_shoot[2] = Some(vec![1.0]);
        assert!(text(&faces(2, Sides::Front), &short).is_err());
    }
}
